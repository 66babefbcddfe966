"""Speed, side by side in one run: each row is a ratio, because machines are noisy.

python benchmarks/bench.py [--markdown FILE]
"""

import argparse
import itertools
import multiprocessing
import os
import platform
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial import ConvexHull

import graspmoduli as gm

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import reference  # noqa: E402
from conftest import uniform_grasps  # noqa: E402

REPEATS = 5


def seconds(work, amount):
    """Median over repeats of the time per unit of work."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append((time.perf_counter() - start) / amount)
    return float(np.median(times))


def qhull(grasps, options):
    """SciPy's time per grasp: the hull and the smallest offset, wrenches made beforehand."""
    points = [reference.wrenches(*grasp) for grasp in zip(*grasps, strict=True)]

    def work():
        for p in points:
            max(0.0, -ConvexHull(p, qhull_options=options).equations[:, -1].max())

    return seconds(work, len(points))


def kernel_rows():
    """In a process of its own, on one core."""
    os.environ["RAYON_NUM_THREADS"] = "1"
    mix = uniform_grasps(100_000, np.random.default_rng(0))
    q = gm.quality(*mix)
    stable = [array[q > 0] for array in mix]
    few_mix, few_stable = ([a[:200] for a in g] for g in (mix, stable))
    rows = []
    for name, many, few in (("uniform D(1)", mix, few_mix), ("stable", stable, few_stable)):
        ours = seconds(lambda many=many: gm.quality(*many), len(many[0]))
        for options in ("QJ", "Qt"):
            theirs = qhull(few, options)
            rows.append((f"Q_8, {name}, one core", f"SciPy ConvexHull {options}", theirs, ours))
    value = seconds(lambda: gm.quality(*stable), len(stable[0]))
    gradient = seconds(lambda: gm.quality_gradient(*stable), len(stable[0]))
    rows.append(("Q_8, stable, one core", "its exact gradient", gradient, value))
    return rows


def search_rows():
    surface = gm.shapes.MODELS["g"]
    u, theta = gm.sample_points(surface, 200, seed=0)
    ours = seconds(lambda: gm.best_grasps(surface, u, theta), 1)
    rng = np.random.default_rng(0)
    index = np.array([rng.choice(200, 3, replace=False) for _ in range(200)])
    points, normals = surface.points(u, theta)[index], surface.normals(u, theta)[index]
    center = np.broadcast_to(surface.center_of_mass, (200, 3))
    theirs = qhull((points, normals, center), "QJ") * 1_313_400
    label = "a loop over SciPy ConvexHull QJ (extrapolated from 200 subsets)"
    return [("best of C(200,3) = 1,313,400 subsets, all cores", label, theirs, ours)]


def synthesis_rows():
    """As in Fig. 12: synthesis against exhaustive search on the surfaces e–l, all cores each."""
    rows = []
    index = {n: np.array(list(itertools.combinations(range(n), 3))) for n in (50, 200)}
    for name in "efghijkl":
        surface = gm.shapes.MODELS[name]
        # Integrals are computed once per surface: not part of either.
        center = surface.center_of_mass
        best = {}
        for n in (50, 200):
            u, theta = gm.sample_points(surface, n, seed=1)
            best[n] = gm.best_grasps(surface, u, theta)[0].quality
        found = gm.synthesize(surface, top=1)

        def exhaustive(surface=surface, center=center):
            u, theta = gm.sample_points(surface, 50, seed=1)
            points, normals = surface.points(u, theta), surface.normals(u, theta)
            gm.quality(points[index[50]], normals[index[50]], center).argmax()

        slow = seconds(exhaustive, 1)
        fast = seconds(lambda surface=surface: gm.synthesize(surface, top=1), 1)
        five = seconds(lambda surface=surface: gm.synthesize(surface), 1)
        rows.append((name, best[50], best[200], found[0].quality, slow / fast, slow / five, fast))
    return rows


def duration(s):
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if s >= size:
            return f"{s / size:.3g} {unit}"
    return f"{s * 1e9:.3g} ns"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--markdown", type=Path, help="write the tables here")
    target = parser.parse_args().markdown
    speed = Table(title="Times and their ratio", title_justify="left")
    for column in ("what", "ours", "against", "its time", "ratio"):
        speed.add_column(column, justify="left" if column in ("what", "against") else "right")
    lines = ["| what | ours | against | its time | ratio |", "|---|---|---|---|---|"]
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as alone:
        rows = [*alone.submit(kernel_rows).result(), *search_rows()]
    for what, against, theirs, ours in rows:
        ratio = theirs / ours
        row = (
            what,
            duration(ours),
            against,
            duration(theirs),
            f"{ratio:,.3g}" if ratio < 100 else f"{ratio:,.0f}",
        )
        speed.add_row(*row)
        lines.append("| " + " | ".join(row) + " |")
    titles = (
        "surface", "best of 50", "best of 200", "synthesis, top 1",
        "time, all subsets of 50 / top 1", "the same / top 5", "time, top 1",
    )  # fmt: skip
    figure = Table(title="Synthesis against exhaustive search (Fig. 12)", title_justify="left")
    for title in titles:
        figure.add_column(title, justify="right")
    lines += ["", "| " + " | ".join(titles) + " |", "|" + "---|" * len(titles)]
    for name, q50, q200, ours, one, five, fast in synthesis_rows():
        row = (
            f"{name} {gm.shapes.NAMES[name]}", f"{q50:.4f}", f"{q200:.4f}", f"{ours:.4f}",
            f"{one:.1f}", f"{five:.1f}", duration(fast),
        )  # fmt: skip
        figure.add_row(*row)
        lines.append("| " + " | ".join(row) + " |")
    console = Console()
    console.print(speed)
    console.print(figure)
    if target:
        machine = f"{platform.machine()}, {os.cpu_count()} cores"
        head = f"# Benchmarks\n\nWritten by `make bench` on {machine}. Ratios count, not seconds."
        target.write_text(head + "\n\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
