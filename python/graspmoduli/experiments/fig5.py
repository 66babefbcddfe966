"""Sec. IV.A: how good uniform grasps in D(1) are (Fig. 5)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .._arrays import Floats
from .random_grasps import (
    WIDTH,
)
from .report import Outcome, Row
from .settings import Scale


def share(number: int, count: int) -> tuple[float, float]:
    """A share and its standard error."""
    p = number / count
    return p, float(np.sqrt(p * (1.0 - p) / count))


def fig5(pieces: dict[str, list[Any]], seconds: dict[str, list[float]], scale: Scale) -> Outcome:
    """Shares of uniform grasps and the histogram of their quality."""
    found = pieces["survey"]
    count = scale.survey_pieces * scale.survey_grasps
    total = {
        key: np.sum([piece[key] for piece in found], axis=0)
        for key in ("unstable", "outside", "at_least", "histogram")
    }
    largest = max(piece["largest"] for piece in found)

    def row(what: str, number: int, paper: float, rounding: float, why: str) -> Row:
        p, error = share(number, count)
        agrees = abs(p - paper) <= rounding + 4.0 * error
        digits = 4 if paper < 0.01 else 3
        return Row(
            what, "IV.A", f"{100 * paper:.3g} %",
            f"({100 * p:.{digits}f} ± {100 * error:.{digits}f}) %",
            f"within the paper's rounding, {100 * rounding:g} %, and four standard errors",
            bool(agrees), why,
        )  # fmt: skip

    outcome = Outcome()
    outcome.rows = [
        row(
            "grasps with Q₈ = 0, by the definition (origin not in the interior)",
            int(total["unstable"]), 0.839, 0.0005,
            "3.4 % of grasps have the origin on the boundary of the hull: two contacts carry the "
            "load; a hull code calls them stable or not by rounding",
        ),
        row(
            "grasps with the origin strictly outside of the hull",
            int(total["outside"]), 0.839, 0.0005,
            "the paper's figure lies between this one and the one by definition, near this one: as "
            "if its hull code gave tiny positive numbers for most grasps on the boundary",
        ),
        row("grasps with Q₈ ≥ 0.05", int(total["at_least"][0]), 0.041, 0.0005, ""),
        row("grasps with Q₈ ≥ 0.2", int(total["at_least"][1]), 0.00064, 5e-6, ""),
        Row(
            "largest Q₈ found", "IV.A", "0.4013", f"{largest:.4f}",
            "within 0.02 of the paper's, of as many grasps",
            bool(abs(largest - 0.4013) <= 0.02) if count >= 10**8 else None,
            f"of {count:,} grasps; an extreme varies from sample to sample"
            + ("" if count >= 10**8 else ", and the paper took 100,000,000"),
        ),
    ]  # fmt: skip
    outcome.series = {
        "grasps": count,
        "histogram of Q > 0": [int(n) for n in total["histogram"]],
        "bin width": WIDTH,
        "largest": largest,
        "unstable": int(total["unstable"]),
        "strictly outside": int(total["outside"]),
        "at least 0.05 and 0.2": [int(n) for n in total["at_least"]],
    }
    spent = sum(seconds["survey"])
    outcome.times = [(f"{count:,} grasps", "–", f"{spent:.1f} s of one core")]
    outcome.pictures = {"": partial(_histogram, total["histogram"], count)}
    outcome.captions = {
        "": f"Q₈ > 0 of {count:,} uniform grasps in D(1), a logarithmic axis. Seed {scale.seed}."
    }
    return outcome


def _histogram(numbers: Floats, count: int) -> Figure:
    figure = Figure(figsize=(7.2, 3.6), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    edges = WIDTH * np.arange(len(numbers) + 1)
    axes.stairs(numbers, edges, fill=True, color="#0072B2")
    axes.set_xlim(0.0, 0.42)
    axes.set_yscale("log")
    axes.set_xlabel("grasp quality $Q_8 > 0$")
    axes.set_ylabel(f"grasps of {count:,}")
    axes.spines[["top", "right"]].set_visible(False)
    return figure
