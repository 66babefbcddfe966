"""Speed, side by side in one run: each row is a ratio, because machines are noisy.

python benchmarks/bench.py [--markdown FILE]
"""

import argparse
import itertools
import math
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
from scipy.spatial import ConvexHull, QhullError

import graspmoduli as gm

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import reference  # noqa: E402
from conftest import uniform_grasps  # noqa: E402
from degenerate import CASES  # noqa: E402

REPEATS = 5

DEGENERATE = """\
# Degenerate grasps

Q_8 with the unit of length as it is. Zeros are theorems (two contacts, collinear contacts, no
friction, a one-sided push); the others are from a hull with lengths of the order of 1, mapped back.
Qhull's joggle (`QJ`) makes small numbers, positive or not, out of zeros, so "Q > 0" is decided by
chance; its `Qt` stops with an error. Written by `make bench` and held by `tests/test_quality.py`.

"""


def seconds(work, amount, repeats=REPEATS):
    """Median over repeats of the time per unit of work."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append((time.perf_counter() - start) / amount)
    return float(np.median(times))


def qhull(grasps, options, edges=8):
    """SciPy's time per grasp: the hull and the smallest offset, wrenches made beforehand."""
    points = [reference.wrenches(*grasp, edges=edges) for grasp in zip(*grasps, strict=True)]

    def work():
        for p in points:
            max(0.0, -ConvexHull(p, qhull_options=options).equations[:, -1].max())

    return seconds(work, len(points), repeats=3)


def operations(l):
    """Floating-point operations of the closed form on a force-closure grasp, multiply-add as two;
    comparisons, minima and signs not counted. See docs/mathematics.md."""
    apex_ray_face = 6 * l * (75 + 3 * l + 2 * 4)
    ray_ray_ray = l**3 * (3 * 3 + 12) + l**2 * 60
    return apex_ray_face + ray_ray_ray


def multiplication_rate():
    """Floating-point operations per second of BLAS on one core, multiplying matrices."""
    n = 512
    a = np.random.default_rng(0).random((n, n))
    np.matmul(a, a)
    return 2 * n**3 / min(seconds(lambda: a @ a, 1, repeats=1) for _ in range(20))


def kernel_rows():
    """In a process of its own, on one core."""
    rows = []

    def compare(name, grasps, few, all_options=("QJ", "Qt"), edges=8):
        ours = seconds(lambda: gm.quality(*grasps, edges=edges), len(grasps[0]))
        sample = [array[:few] for array in grasps]
        for options in all_options:
            theirs = qhull(sample, options, edges)
            rows.append((f"Q_{edges}, {name}", ours, f"SciPy ConvexHull {options}", theirs))
        return ours

    def draw(count, m):
        grasps = uniform_grasps(count, np.random.default_rng(0), m)
        q = gm.quality(*grasps)
        return grasps, [array[q > 0] for array in grasps]

    mix, stable = draw(100_000, 3)
    compare("3 contacts, uniform D(1)", mix, 300)
    value = compare("3 contacts, force closure", stable, 200)
    for edges in (16, 32):
        part = [array[:2000] for array in stable]
        compare("3 contacts, force closure", part, 20, ("QJ",), edges)
    for m in (4, 5, 8):
        grasps, _ = draw(3000, m)
        compare(f"{m} contacts, uniform D(1)", grasps, 60)
    for m, name in ((3, "3"), (4, "4")):
        _, some = (mix, stable) if m == 3 else draw(3000, m)
        count = len(some[0])
        one = seconds(lambda some=some: gm.quality(*some), count)
        what = f"{name} contacts, force closure"
        slope = seconds(lambda some=some: gm.quality_gradient(*some), count)
        rows.append((f"Q_8, {what}", one, "value and exact gradient", slope))
        for threshold in (0.05, 0.2):
            bar = seconds(
                lambda some=some, t=threshold: gm.quality_at_least(*some, threshold=t), count
            )
            rows.append((f"is Q_8 ≥ {threshold}? {what}", bar, "the value", one))
        best = seconds(lambda some=some: gm.largest_quality(*some), count)
        worst = seconds(lambda some=some: gm.smallest_quality(*some), count)
        rows.append((f"the best of {count:,}, {what}", best, "all values", one))
        rows.append((f"the worst of {count:,}, {what}", worst, "all values", one))
    few = [array[:300] for array in stable]
    circular = seconds(lambda: gm.circular_quality(*few), 300)
    rows.append(("circular cones to 1e-3, 3 contacts, force closure", circular, "Q_8", value))
    each = seconds(lambda: gm.quality(*few, norm="each"), 300)
    rows.append(("Q'_8, 3 contacts, force closure", each, "Q_8", value))
    return rows, (value, multiplication_rate())


def uniform_rate():
    """Time per grasp of the uniform mix, in a process with as many threads as it is given."""
    mix = uniform_grasps(400_000, np.random.default_rng(0))
    return seconds(lambda: gm.quality(*mix), len(mix[0]))


def alone(work, threads):
    """``work`` in a process with so many threads."""
    names = ("RAYON_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
    os.environ.update(dict.fromkeys(names, str(threads)))
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        result = pool.submit(work).result()
    for name in names:
        del os.environ[name]
    return result


def search_rows():
    surface = gm.shapes.MODELS["g"]
    rng = np.random.default_rng(0)
    rows = []
    for n, m, sampled in ((200, 3, 200), (60, 4, 60)):
        u, theta = gm.sample_points(surface, n, seed=0)
        ours = seconds(lambda u=u, t=theta, m=m: gm.best_grasps(surface, u, t, contacts=m), 1)
        index = np.array([rng.choice(n, m, replace=False) for _ in range(sampled)])
        points, normals = surface.points(u, theta)[index], surface.normals(u, theta)[index]
        center = np.broadcast_to(surface.center_of_mass, (sampled, 3))
        count = math.comb(n, m)
        theirs = qhull((points, normals, center), "QJ") * count
        label = f"a loop over SciPy ConvexHull QJ (extrapolated from {sampled} subsets)"
        rows.append((f"best of C({n},{m}) = {count:,} subsets, all cores", ours, label, theirs))
    return rows


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


def transfer_rows():
    """All 144 transfers between the models, from the best of 200 sampled contacts (Sec. IV.D)."""
    models = gm.shapes.MODELS
    best = {}
    for name, surface in models.items():
        u, theta = gm.sample_points(surface, 200, seed=0)
        best[name] = gm.best_grasps(surface, u, theta)[0].grasp
    ends, rows = {}, []
    for method in ("naive", "gradient", "ascent"):
        start = time.perf_counter()
        found = [gm.transfer(models[s], best[s], models[t], method) for s in models for t in models]
        taken = time.perf_counter() - start
        ends[method] = np.array([transfer.quality for transfer in found])
        most = max(transfer.evaluations for transfer in found)
        rows.append(
            (
                method,
                str((ends[method] > 0).sum()),
                str((ends[method] > ends["naive"]).sum()),
                str((ends[method] >= ends["gradient"]).sum()) if method == "ascent" else "",
                f"{ends[method].mean():.4f}",
                f"{most:,}",
                duration(taken / len(found)),
            )
        )
    return rows


def distance_sentence():
    """Times of d(S, S') between all pairs of models."""
    surfaces = list(gm.shapes.MODELS.values())
    times = []
    for first, second in itertools.combinations(surfaces, 2):
        runs = []
        for _ in range(3):
            start = time.perf_counter()
            gm.surface_distance(first, second)
            runs.append(time.perf_counter() - start)
        times.append(min(runs))
    return (
        f"d(S, S') of two models to a proven relative error of 1e-6: median "
        f"{duration(np.median(times))}, slowest of the {len(times)} pairs {duration(max(times))}."
    )


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
    cores = os.cpu_count() or 1
    rows, (stable, rate) = alone(kernel_rows, 1)
    one, many = alone(uniform_rate, 1), alone(uniform_rate, cores)
    rows = [(f"{what}, one core", ours, against, theirs) for what, ours, against, theirs in rows]
    rows.append((f"Q_8, 3 contacts, uniform D(1), {cores} cores", many, "one core", one))
    for what, ours, against, theirs in [*rows, *search_rows()]:
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
    count = operations(8)
    bound = (
        f"A force-closure grasp of three contacts takes {count:,} floating-point operations "
        f"(docs/mathematics.md counts them). At the {rate / 1e9:.0f} GFlop/s at which BLAS "
        f"multiplies matrices on one core of this machine that is {duration(count / rate)}; it "
        f"takes {duration(stable)}, {count / rate / stable:.0%} of that rate."
    )
    lines += ["", bound]
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
    transfers = Table(title="Transfers between the twelve models", title_justify="left")
    titles = (
        "method", "force closure, of 144", "better than naive", "at least the gradient method",
        "mean Q_8", "most evaluations", "time each",
    )  # fmt: skip
    for title in titles:
        transfers.add_column(title, justify="right")
    lines += ["", "| " + " | ".join(titles) + " |", "|" + "---|" * len(titles)]
    for row in transfer_rows():
        transfers.add_row(*row)
        lines.append("| " + " | ".join(row) + " |")
    distances = distance_sentence()
    lines += ["", distances]
    console = Console()
    console.print(speed)
    console.print(bound)
    console.print(figure)
    console.print(transfers)
    console.print(distances)
    if target:
        machine = f"{platform.machine()}, {os.cpu_count()} cores"
        head = f"# Benchmarks\n\nWritten by `make bench` on {machine}. Ratios count, not seconds."
        target.write_text(head + "\n\n" + "\n".join(lines) + "\n")
        write_degenerate(target.with_name("degenerate.md"))


def write_degenerate(target):
    """Degenerate grasps: the true quality, ours, and what Qhull says."""

    def number(value):
        return "0" if value == 0 else f"{value:.9g}"

    def hull(case, options):
        points = reference.wrenches(
            case.contacts, np.asarray(case.normals, float), case.center, case.friction
        )
        try:
            offset = -ConvexHull(points, qhull_options=options).equations[:, -1].max()
        except QhullError as error:
            return f"error {str(error).split()[0]}"
        return number(offset)

    lines = [
        *DEGENERATE.splitlines(),
        "| grasp | true | ours | Qhull QJ | Qhull Qt |",
        "|" + "---|" * 5,
    ]
    for case in CASES:
        ours = gm.quality(case.contacts, case.normals, case.center, friction=case.friction)
        cells = (case.name, number(case.truth()), number(ours), hull(case, "QJ"), hull(case, "Qt"))
        lines.append("| " + " | ".join(cells) + " |")
    target.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
