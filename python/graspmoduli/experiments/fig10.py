"""Sec. IV.D: all 144 transfers between the models, by every method (Fig. 10)."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..shapes import MODELS
from ..transfers import transfer
from ..viewing.plotting import LINES
from .common import Pieces, Seconds, by_seed, counts, over_seeds, own_grasp, repetition, seeds_of
from .report import BEYOND, Outcome, Row
from .settings import Scale

#: By name: the method and the h of its finite differences, exact derivatives if None.
METHODS: dict[str, tuple[str, float | None]] = {
    "naïve": ("naive", None),
    "the paper's gradient method": ("gradient", 1e-5),
    "the same with exact derivatives": ("gradient", None),
    "our ascent": ("ascent", None),
}
NAIVE, PAPERS, EXACT, ASCENT = METHODS
PAIRS = len(MODELS) ** 2
#: “In all but one case”: so many of the 144 at least, in ours.
NEARLY_ALL = 140


def fig10_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Transfers from one model to all twelve, by every method."""
    seed, number = repetition(index, len(MODELS), scale)
    source = list(MODELS)[number]
    grasp, _ = own_grasp(MODELS[source], scale, seed)
    found: dict[str, Any] = {}
    for name, (method, difference) in METHODS.items():
        start = time.perf_counter()
        ends = [
            transfer(MODELS[source], grasp, target, method,
                     friction=scale.friction, edges=scale.edges, difference=difference)
            for target in MODELS.values()
        ]  # fmt: skip
        found[name] = {
            "quality": [end.quality for end in ends],
            "evaluations": max(end.evaluations for end in ends),
            "seconds": (time.perf_counter() - start) / len(ends),
        }
    return found


def fig10(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """The gradient method against the naïve transfer, all 144 pairs."""
    found = pieces["fig10"]
    # Each of shape (seeds, 144).
    ends = {m: by_seed([piece[m]["quality"] for piece in found], scale) for m in METHODS}
    most = {m: max(piece[m]["evaluations"] for piece in found) for m in METHODS}
    outcome = Outcome(series={m: v.tolist() for m, v in ends.items()})
    for method in (PAPERS, EXACT):
        stable = (ends[method] > 0.0).sum(axis=1)
        beats = (ends[method] > ends[NAIVE]).sum(axis=1)
        names = list(MODELS)
        short = [
            f"{names[i // 12]} to {names[i % 12]}"
            for i in np.flatnonzero(ends[method][0] <= ends[NAIVE][0])
        ]
        outcome.rows += [
            Row(f"transfers by {_short(method)} that end force closure", "IV.D", "144 of 144",
                counts(stable, PAIRS), "144 in every seed", bool((stable == PAIRS).all())),
            Row(f"pairs in which {_short(method)} ends higher than the naïve transfer", "IV.D",
                "143 of 144", counts(beats, PAIRS), f"at least {NEARLY_ALL} in every seed",
                bool((beats >= NEARLY_ALL).all()),
                f"seed {scale.seed}: not from {', '.join(short)}" if short else ""),
        ]  # fmt: skip
    naive = (ends[NAIVE] > 0.0).sum(axis=1)
    climbs = (ends[ASCENT] >= ends[PAPERS]).sum(axis=1)
    outcome.rows += [
        Row("naïve transfers that end force closure", "IV.D", "fewer than 144",
            counts(naive, PAIRS), "fewer than 144 in every seed", bool((naive < PAIRS).all())),
        Row("transfers by our ascent that end force closure", "IV.D", "–",
            counts((ends[ASCENT] > 0.0).sum(axis=1), PAIRS), BEYOND),
        Row("pairs in which our ascent ends at least as high as the paper's method", "IV.D", "–",
            counts(climbs, PAIRS), BEYOND, None,
            f"with at most {most[ASCENT]:,} evaluations against {most[PAPERS]:,}"),
        *(
            Row(f"mean final Q₈ of the 144: {_short(m)}", "IV.D", "–",
                over_seeds(v.mean(axis=1)), BEYOND)
            for m, v in ends.items()
        ),
    ]  # fmt: skip
    outcome.times = [
        (
            f"one transfer: {_short(m)}",
            "–",
            f"{1e3 * np.mean([p[m]['seconds'] for p in found]):.2f} ms",
        )
        for m in METHODS
    ]
    outcome.pictures = {"": partial(_picture, ends)}
    outcome.captions = {
        "": "Final Q₈ less that of the naïve transfer, of the 144 transfers in the order of this "
        f"difference; {seeds_of(scale)}, the first one strong. N₁ = 100, N₂ = 20, δ = 0.001, "
        "h = 1e-5 as in the paper."
    }
    return outcome


def _short(method: str) -> str:
    """As it reads in the middle of a sentence."""
    return (
        "the gradient method with exact derivatives"
        if method == EXACT
        else (f"{method}, h = 1e-5" if method == PAPERS else method)
    )


def _picture(ends: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(7.2, 3.8), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    for method, (color, dashes) in zip(
        (PAPERS, EXACT, ASCENT), (LINES[0], LINES[2], LINES[1]), strict=True
    ):
        for k, row in enumerate(np.sort(ends[method] - ends[NAIVE], axis=1)):
            axes.plot(
                np.arange(1, PAIRS + 1), row, color=color, linestyle=dashes if k == 0 else "-",
                linewidth=1.5 if k == 0 else 0.5, alpha=1.0 if k == 0 else 0.35,
                zorder=3 if k == 0 else 2, label=method if k == 0 else None,
            )  # fmt: skip
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.set_xlim(1, PAIRS)
    axes.set_xlabel("transfers, sorted")
    axes.set_ylabel("difference of final $Q_8$")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="upper left")
    return figure
