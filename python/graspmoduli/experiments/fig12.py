"""Sec. IV.E: synthesis by deformation from a surface of revolution (Fig. 12)."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..grasps import Grasp
from ..shapes import MODELS, NAMES
from ..surfaces import project
from ..synthesis import plane_grasp, synthesize
from ..transfers import transfer
from .common import (
    Pieces,
    Seconds,
    by_seed,
    counts,
    over_seeds,
    own_grasp,
    repetition,
    seeds_of,
)
from .fig11 import TRIPLES
from .report import BEYOND, Outcome, Row
from .settings import Scale

#: Fig. 12: angles by which the heuristic's grasp is turned, and the starts of our own method.
ANGLES = 24
STARTS = 40
#: The models that are none of revolution.
UNEVEN = "efghijkl"


def fig12_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Synthesis by deformation on one model, from each of 24 angles; and ours.

    The heuristic's grasp on π(S) may be turned by any angle: Q on a surface of revolution does not
    tell one from another (but for the polygons of the cones), while S does.
    """
    surface = MODELS[UNEVEN[index]]
    options = {"friction": scale.friction, "edges": scale.edges}
    _ = surface.center_of_mass
    clock = time.perf_counter()
    flat = project(surface)
    start = plane_grasp(flat, **options)
    prepared = time.perf_counter() - clock
    carried, evaluations = [0.0] * ANGLES, TRIPLES[10]
    clock = time.perf_counter()
    if start is not None:
        # N₁ = N₂ = 10, δ = 0.01, h = 1e-5 and 450 triples, as in the paper.
        ways = [
            transfer(flat, Grasp(start.grasp.u, start.grasp.theta + 2 * np.pi * k / ANGLES),
                     surface, "gradient", surfaces=10, steps=10, step_length=0.01,
                     difference=1e-5, **options)
            for k in range(ANGLES)
        ]  # fmt: skip
        carried = [way.quality for way in ways]
        evaluations += max(way.evaluations for way in ways)
    deformed = prepared + (time.perf_counter() - clock) / ANGLES
    return {
        "deformation": carried,
        "evaluations": evaluations,
        "seconds": {"deformation": deformed, "all angles": prepared + ANGLES * deformed},
    }


def search_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Exhaustive search and our synthesis on one model of Fig. 12."""
    seed, number = repetition(index, len(UNEVEN), scale)
    surface = MODELS[UNEVEN[number]]
    _ = surface.center_of_mass
    clock = time.perf_counter()
    _, brute = own_grasp(surface, scale, seed)
    searched = time.perf_counter() - clock
    clock = time.perf_counter()
    ours = synthesize(
        surface, top=5, starts=STARTS, seed=seed, friction=scale.friction, edges=scale.edges
    )
    synthesised = time.perf_counter() - clock
    return {
        "brute": brute,
        "ours": ours[0].quality if ours else 0.0,
        "seconds": {"brute": searched, "ours": synthesised},
    }


def fig12(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """Synthesis by deformation from a surface of revolution."""
    found, searches = pieces["fig12"], pieces["search12"]
    # Of shape (8, angles) and (seeds, 8).
    carried = np.array([piece["deformation"] for piece in found])
    brute, ours = (
        by_seed([piece[kind] for piece in searches], scale) for kind in ("brute", "ours")
    )
    n = len(UNEVEN)
    angles = carried.mean(axis=0)
    best = carried.max(axis=1)
    outcome = Outcome(
        series={
            "models": UNEVEN,
            "brute": brute.tolist(),
            "deformation, by angle": carried.tolist(),
            "ours": ours.tolist(),
        }
    )
    evaluations = max(piece["evaluations"] for piece in found)
    everywhere = int((carried > 0.0).sum())
    outcome.rows = [
        Row("models e–l and angles with which deformation from π(S) ends force closure", "IV.E",
            f"all {n} models, one angle each", f"{everywhere} of {n} × {ANGLES}",
            f"all {n * ANGLES}", everywhere == n * ANGLES,
            f"the paper's parameters, {evaluations:,} evaluations. The heuristic's grasp on π(S) "
            "may be turned by any angle; the paper does not say by which"),
        Row("mean Q₈ of the best of C(200, 3)", "IV.E", "–", over_seeds(brute.mean(axis=1)),
            BEYOND),
        Row("mean Q₈ of deformation from π(S)", "IV.E", "“on average not as high as using brute "
            "force search”",
            f"{angles.mean():.4f}; the {ANGLES} angles have {angles.min():.4f} to "
            f"{angles.max():.4f}, standard deviation {angles.std(ddof=1):.4f}",
            "the mean over the angles is lower than that of C(200, 3) in every seed",
            bool((angles.mean() < brute.mean(axis=1)).all()),
            f"{int((angles > brute.mean()).sum())} of {ANGLES} angles are above the mean of "
            "C(200, 3)" + (f"; θ₀ = 0, along which the models are drawn, has {angles[0]:.4f}")),
        Row(f"mean Q₈ of the best of the {ANGLES} angles", "IV.E", "–", f"{best.mean():.4f}",
            BEYOND, None, f"ours, at {ANGLES} times the cost; at least C(200, 3) on "
            f"{int((best >= brute.mean(axis=0)).sum())} of {n} models"),
        Row("models on which our synthesis is at least the best of C(200, 3)", "IV.E", "–",
            counts((ours >= brute).sum(axis=1), n), BEYOND, None,
            f"mean Q₈ {over_seeds(ours.mean(axis=1))}, {STARTS} starts"),
    ]  # fmt: skip
    spent = {
        kind: float(np.mean([piece["seconds"][kind] for piece in some]))
        for some in (found, searches)
        for kind in some[0]["seconds"]
    }
    outcome.times = [
        ("best of C(200, 3), a surface", "31 minutes", f"{1e3 * spent['brute']:.1f} ms"),
        ("deformation from π(S), a surface", "4 s", f"{1e3 * spent['deformation']:.2f} ms"),
        (f"the best of {ANGLES} angles, a surface", "–", f"{1e3 * spent['all angles']:.1f} ms"),
        (f"our synthesis with {STARTS} starts, a surface", "–", f"{1e3 * spent['ours']:.2f} ms"),
    ]
    outcome.pictures = {"": partial(_fig12_picture, brute, carried, ours)}
    outcome.captions = {
        "": f"Means over {seeds_of(scale)} (best of C(200, 3), our synthesis) and over {ANGLES} "
        "angles (deformation); whiskers from the least to the greatest."
    }
    return outcome


def _fig12_picture(brute: Any, carried: Any, ours: Any) -> Figure:
    figure = Figure(figsize=(8.0, 3.8), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    for k, (rows, label, color) in enumerate(
        (
            (brute, "best of C(200, 3)", "#0072B2"),
            (carried.T, f"deformation from π(S), mean of {ANGLES} angles", "#D55E00"),
            (ours, "our synthesis", "#009E73"),
        )
    ):
        mean = rows.mean(axis=0)
        whiskers = np.abs(np.stack([rows.min(axis=0), rows.max(axis=0)]) - mean)
        axes.bar(
            np.arange(len(UNEVEN)) + 0.27 * (k - 1), mean, 0.25, color=color, label=label,
            yerr=whiskers, error_kw={"elinewidth": 1.0, "capsize": 2.0, "ecolor": "0.25"},
        )  # fmt: skip
    axes.set_xticks(range(len(UNEVEN)), [f"{n}\n{NAMES[n]}" for n in UNEVEN], fontsize=8)
    axes.set_ylabel("$Q_8$")
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    return figure
