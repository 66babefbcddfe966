"""Sec. IV.A: the worst grasps near good ones (Fig. 7)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .._arrays import Floats
from ..viewing.plotting import LINES
from .random_grasps import (
    EPSILONS,
    PAPER,
    REPETITIONS,
    SAMPLES,
)
from .report import BEYOND, Outcome, Row
from .settings import Scale
from .worst import proven_radius


def fig7(pieces: dict[str, list[Any]], seconds: dict[str, list[float]], scale: Scale) -> Outcome:
    """The smallest quality near good grasps: sampled, searched for, and proven."""
    outcome = Outcome()
    for delta, key, asked in ((0.05, "05", 410_000), (0.2, "20", 64_000)):
        epsilons = EPSILONS[delta]
        found = pieces[f"near{key}"]
        number = sum(piece["number"] for piece in found)
        smallest = np.min([piece["smallest"] for piece in found], axis=0)
        sampled = smallest.reshape(REPETITIONS, len(epsilons))
        searched = [piece.get("smallest") for piece in pieces[f"worst{key}"]]
        n = len(epsilons)
        away, pole = searched[:n], searched[n + 1 : 2 * n + 1]
        limits = [pieces[f"worst{key}"][k]["refuted"] for k in (n, 2 * n + 1)]
        refuted = min((x for x in limits if x is not None), default=None)
        proven = proven_radius(delta, scale.friction, scale.edges)
        paper = PAPER[delta]
        at = epsilons.index(paper)
        outcome.rows += [
            Row(
                f"grasps with Q₈ ≥ {delta:g} whose neighbourhoods are sampled", "IV.A",
                f"about {asked:,}", f"{number:,}",
                "within 5 % of the paper's, at its scale",
                abs(number - asked) < 0.05 * asked if scale.name == "paper" else None,
            ),
            Row(
                f"smallest Q₈ of {SAMPLES[delta]} samples in each N_ε, ε = {paper:g}, four times",
                "IV.A", "> 0", ", ".join(f"{q:.4f}" for q in sampled[:, at]), "all four > 0",
                bool((sampled[:, at] > 0.0).all()), "sampling, as in the paper",
            ),
            Row(
                f"smallest Q₈ found by search in N_ε, ε = {paper:g}", "IV.A", "–",
                f"{min(away[at], pole[at]):.4f}", BEYOND, None,
                "gradient descent over the good grasp and its neighbour together",
            ),
            Row(
                f"ε₈(0, {delta:g}, 1)", "IV.A", f"≥ {paper:g} (estimate)",
                f"in [{proven:.4f}, {refuted:.4f}]" if refuted else f"at least {proven:.4f}",
                f"no pair is found that refutes {paper:g}", refuted is None,
                "" if refuted is None else
                f"the paper's {paper:g} does not stand: the search finds a grasp with Q₈ ≥ "
                f"{delta:g} and one within {refuted:.4f} of it that is lost; with all normals of "
                "the good grasp away from −e₃, where R(n) is not continuous, within "
                f"{'none' if limits[0] is None else f'{limits[0]:.4f}'}. "
                + ("The lower end is proven (docs/mathematics.md)" if proven > 0.0 else
                   "Nothing is proven from below: the bound is 0 here"),
            ),
        ]  # fmt: skip
        outcome.series[f"near Q ≥ {delta:g}"] = {
            "epsilon": list(epsilons),
            "grasps": number,
            "sampled, four times": sampled.tolist(),
            "searched": away,
            "searched with a normal at -e3": pole,
            "refuted": limits,
            "proven": proven,
        }
        spent = sum(seconds[f"near{key}"])
        evaluations = number * SAMPLES[delta] * REPETITIONS * n
        outcome.times.append(
            (
                f"panel of Q₈ ≥ {delta:g}: {evaluations:,} neighbours",
                "–",
                f"{spent:.0f} s of one core",
            )
        )
        outcome.captions[f"-{key}"] = (
            f"Sampled: {SAMPLES[delta]} neighbours of each of {number:,} grasps with Q₈ ≥ "
            f"{delta:g}, four times. Found: by gradients from {scale.search_starts:,} of such "
            f"grasps. Seed {scale.seed}."
        )
        outcome.pictures[f"-{key}"] = partial(
            _panel, delta, np.array(epsilons), sampled, np.array(away), np.array(pole)
        )
    return outcome


def _panel(delta: float, epsilons: Floats, sampled: Floats, away: Floats, pole: Floats) -> Figure:
    figure = Figure(figsize=(7.2, 4.0), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    for index, line in enumerate(sampled):
        axes.plot(epsilons, line, "o-", color="#0072B2", linewidth=1.2, markersize=4,
                  label=None if index else "sampled, four times (the paper's way)")  # fmt: skip
    for values, label, (color, dashes) in (
        (away, "found by search", LINES[1]),
        (pole, "found by search, a normal at −e₃", LINES[2]),
    ):
        axes.plot(
            epsilons, values, marker="s", markersize=4, color=color, linestyle=dashes, label=label
        )
    axes.axvline(PAPER[delta], color="0.6", linewidth=1.0)
    axes.annotate(
        "the paper's\nestimate", (PAPER[delta], 0.72 * axes.get_ylim()[1]), fontsize=8,
        color="0.4", ha="left", va="top", xytext=(3, 0), textcoords="offset points",
    )  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("ε")
    axes.set_ylabel(f"smallest $Q_8$ within ε of a grasp with $Q_8$ ≥ {delta:g}")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9)
    return figure
