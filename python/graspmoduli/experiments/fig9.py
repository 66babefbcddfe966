"""Sec. IV.C: quality along transfers (Fig. 9), and how fast it changes."""

from __future__ import annotations

import itertools
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .._arrays import Floats
from ..grasps import Grasp, place
from ..moduli import (
    Point,
    interpolate,
    placed_distance,
)
from ..quality import circular_quality
from ..shapes import MODELS, NAMES
from ..transfers import quality_along
from ..viewing.plotting import LINES
from .common import (
    Pieces,
    Seconds,
    counts,
    own_grasp,
    repetition,
)
from .report import BEYOND, Outcome, Row
from .settings import Scale

#: Fig. 9: intervals along each path.
STEPS = 50
#: Where the interpolation transfer goes.
LEVEL = Grasp([0.5, 0.5, 0.5], [0.0, 2 * np.pi / 3, 4 * np.pi / 3])
TRANSFERS = ("naive", "interpolation")
#: Slopes are measured between every so many samples of a path; bounds of round cones, so closely.
EVERY, TOLERANCE = 5, 1e-3


def lipschitz_constant(friction: float, lever: float) -> float:
    """|Q(g) − Q(g′)| ≤ L d(g, g′) for round cones, if ‖c_i − z‖ ≤ lever in one of the two.

    The rotation that takes n to n′ the shortest way takes the round cone of n to that of n′ and
    moves each of its forces f by at most ‖f‖ ‖n − n′‖, so its torque (c − z) × f by at most
    ‖f‖ (2d + lever · d); ‖f‖ ≤ √(1 + μ²). So every wrench of g is within
    L d = √(1 + μ²) √(1 + (2 + lever)²) d of one of g′ and the reverse, the convex hulls are within
    that of each other by Hausdorff's distance, and Q, the least value of a support function on the
    unit sphere (or 0), differs by no more. Polygonal cones are not taken to each other by that
    rotation but by R(n′) R(n)ᵀ, whose angle is not bounded by ‖n − n′‖ near −e₃.
    """
    return float(np.hypot(1.0, friction) * np.hypot(1.0, 2.0 + lever))


def fig9_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Q along the paths from one model to all others, by both transfers."""
    seed, number = repetition(index, len(scale.fig9_sources), scale)
    source = scale.fig9_sources[number]
    grasp, _ = own_grasp(MODELS[source], scale, seed)
    paths: dict[str, Any] = {}
    for target, surface in MODELS.items():
        if target == source:
            continue
        for kind, end in zip(TRANSFERS, (grasp, LEVEL), strict=True):
            ends = (MODELS[source], grasp), (surface, end)
            along = quality_along(*ends, samples=STEPS, friction=scale.friction, edges=scale.edges)
            path = {
                "quality": along.quality.tolist(),
                "worst": [along.worst_t, along.worst_quality],
            }
            if seed == scale.seed:
                path |= _slopes(*ends, along.quality, scale)
            paths[f"{kind} {source}{target}"] = path
    return paths


def _slopes(start: Point, end: Point, values: Floats, scale: Scale) -> dict[str, float]:
    """The steepest |ΔQ| / d(g, g′) along a path: of Q_l, and what is proven of round cones."""
    t = np.linspace(0.0, 1.0, STEPS + 1)[::EVERY]
    placed = [place(*point) for point in interpolate(start, end, t)]
    apart = np.array([placed_distance(p, q) for p, q in itertools.pairwise(placed)])
    bounds = circular_quality(placed, friction=scale.friction, tolerance=TOLERANCE)
    low, high = np.asarray(bounds.lower), np.asarray(bounds.upper)
    # At least so much is between neighbours, whatever the bounds leave open.
    change = np.maximum(low[1:] - high[:-1], low[:-1] - high[1:])
    lever = max(np.linalg.norm(p.contacts - p.center_of_mass, axis=1).max() for p in placed)
    return {
        "slope": float((np.abs(np.diff(values[::EVERY])) / apart).max()),
        "round slope": float(np.maximum(change / apart, 0.0).max()),
        "round constant": lipschitz_constant(scale.friction, float(lever)),
    }


def fig9(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """Quality along naïve and interpolation transfers."""
    per = len(scale.fig9_sources)
    runs: list[dict[str, Any]] = [
        {key: path for piece in pieces["fig9"][k * per : (k + 1) * per] for key, path in
         piece.items()}
        for k in range(scale.seeds)
    ]  # fmt: skip
    total = per * (len(MODELS) - 1)
    outcome = Outcome(series={str(scale.seed + k): paths for k, paths in enumerate(runs)})
    for kind, paper, lost in (
        ("naive", "“rather tamely”; some unstable", True),
        ("interpolation", "“a large amount” stable", False),
    ):
        chosen = [[path for key, path in paths.items() if key.startswith(kind)] for paths in runs]
        stable = np.array([sum(p["quality"][-1] > 0.0 for p in paths) for paths in chosen])
        held = np.array([sum(p["worst"][1] > 0.0 for p in paths) for paths in chosen])
        most = bool((stable > 0.5 * total).all())
        outcome.rows += [
            Row(f"{kind} transfers that end force closure", "IV.C", paper, counts(stable, total),
                "more than half, but not all, in every seed" if lost else
                "more than half in every seed",
                most and not (lost and bool((stable == total).any())),
                "" if lost else "they end in the same grasp on S_j from wherever they come"),
            Row(f"{kind} transfers that are force closure all the way", "IV.C", "–",
                counts(held, total), BEYOND, None, "the worst point between samples counts"),
        ]  # fmt: skip
        outcome.pictures[f"-{kind}"] = partial(_fig9_picture, kind, runs[0])
        outcome.captions[f"-{kind}"] = (
            f"Q₈ along each {kind} transfer of the models' own grasps, {STEPS + 1} samples each. "
            f"Seed {scale.seed}."
        )
    first = list(runs[0].values())
    pole = pieces["poles"][0]
    tightest = max(path["round slope"] / path["round constant"] for path in first)
    outcome.rows += [
        Row("Q with round cones: is it Lipschitz continuous?", "IV.C",
            "Q₈ “seems to be Lipschitz continuous”",
            f"yes, by proof: |ΔQ| ≤ L d(g, g′), here with L up to "
            f"{max(p['round constant'] for p in first):.2f}; steepest measured "
            f"{max(p['round slope'] for p in first):.2f}",
            "no measured slope exceeds the proven constant of its path", bool(tightest <= 1.0),
            "L = √(1 + μ²) √(1 + (2 + ‖c − z‖)²): a rotation takes the cone at n to that at n′ and "
            f"moves no force by more than ‖f‖ ‖n − n′‖. Between every {EVERY}th sample"),
        Row("Q₈, whose cones R(n) lays out: is it Lipschitz continuous?", "IV.C",
            "“seems to be Lipschitz continuous”",
            f"not uniformly: Q₈ changes by {pole['drop']:.4f} within d(g, g′) = "
            f"{pole['distance']:.0e}; steepest |ΔQ₈| / d(g, g′) along the paths "
            f"{max(p['slope'] for p in first):.2f}",
            "no pair found has |ΔQ₈| > 1000 d(g, g′)",
            bool(pole["drop"] <= 1e3 * pole["distance"]),
            "R(n) turns a polygon by any angle near n = −e₃. Normals of a surface of M^cyl never "
            "reach −e₃, so along one curve Q₈ is Lipschitz, but no constant serves all curves"),
    ]  # fmt: skip
    return outcome


def _fig9_picture(kind: str, paths: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(8.8, 4.0), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    # As in the paper: from a, i and j; the others faint.
    colors = {"a": LINES[1], "i": LINES[5], "j": LINES[0]}
    seen = set()
    for key, path in paths.items():
        name, pair = key.split()
        if name != kind:
            continue
        color, dashes = colors.get(pair[0], ("0.85", "-"))
        label = f"from {pair[0]} ({NAMES[pair[0]]})" if pair[0] in colors else "from the others"
        axes.plot(
            np.linspace(0.0, 1.0, len(path["quality"])), path["quality"], color=color,
            linestyle=dashes, linewidth=1.1, zorder=2 if pair[0] in colors else 1,
            label=None if label in seen else label,
        )  # fmt: skip
        seen.add(label)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("t")
    axes.set_ylabel("$Q_8$")
    axes.set_title(f"{kind} transfer", fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    # Beside the lines, not over them.
    figure.legend(loc="outside right upper", frameon=False, fontsize=9)
    return figure
