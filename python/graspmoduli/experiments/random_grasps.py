"""Sec. IV.A: uniform grasps in D(1), and how bad the grasps near good ones are (Figs. 5 to 7)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .. import _core
from .._arrays import Floats
from ..quality import quality
from ..viewing.drawing import FINGERS, Camera
from ..viewing.plotting import LINES
from .report import BEYOND, Outcome, Row
from .settings import Scale
from .worst import proven_radius, split, steepest_at_the_pole, worst_neighbour

THRESHOLDS = (0.05, 0.2)
#: Of the histogram: Fig. 5 goes to 0.4.
BINS, WIDTH = 100, 0.005
REPETITIONS = 4
#: ε of Fig. 7; the paper's list for 0.05 ends in "0.03, 0.03", read as 0.03, 0.035.
EPSILONS = {
    0.05: (0.005, 0.01, 0.015, 0.02, 0.025, 0.03, 0.035),
    0.2: (0.02, 0.04, 0.06, 0.08, 0.1, 0.12),
}
SAMPLES = {0.05: 25, 0.2: 150}
#: The paper's estimates of ε₈(0, δ, 1).
PAPER = {0.05: 0.02, 0.2: 0.1}
#: Numbers of random streams: pieces of uniform grasps from 0, neighbourhoods from here on.
NEIGHBOURHOODS = 1 << 32
#: Fig. 6: neighbours that are drawn, and within what distance.
SHOWN, SHOWN_EPSILON = 150, 0.1
#: Halvings of the interval in which the search still finds a lost neighbour.
HALVINGS = 7


def survey(index: int, scale: Scale) -> dict[str, Any]:
    """A piece of the uniform grasps."""
    unstable, outside, at_least, histogram, largest = _core.survey(
        scale.seed, index, scale.survey_grasps, scale.friction, scale.edges,
        list(THRESHOLDS), BINS, WIDTH,
    )  # fmt: skip
    return {
        "unstable": unstable,
        "outside": outside,
        "at_least": at_least,
        "histogram": histogram,
        "largest": largest,
    }


def near(delta: float, index: int, scale: Scale) -> dict[str, Any]:
    """The smallest Q near the good grasps of a piece: for all repetitions and ε."""
    grasps = scale.near05_grasps if delta == 0.05 else scale.near20_grasps
    epsilons = EPSILONS[delta]
    kind = THRESHOLDS.index(delta)
    neighbourhoods = [
        (epsilon, NEIGHBOURHOODS * (1 + kind + 2 * (len(epsilons) * repetition + k)) + index)
        for repetition in range(REPETITIONS)
        for k, epsilon in enumerate(epsilons)
    ]
    number, smallest = _core.smallest_nearby(
        scale.seed, index, grasps, scale.friction, scale.edges, delta, SAMPLES[delta],
        neighbourhoods,
    )  # fmt: skip
    # JSON has no infinity: no good grasp, no neighbour.
    return {"number": number, "smallest": smallest if number else [1e300] * len(smallest)}


def worst(delta: float, index: int, scale: Scale) -> dict[str, Any]:
    """What the search finds: at each ε, then the smallest ε with a lost neighbour; then both again
    with a normal at −e₃."""
    epsilons = EPSILONS[delta]
    pole, k = divmod(index, len(epsilons) + 1)
    good = _good(delta, scale)

    def smallest(epsilon: float) -> float:
        found = worst_neighbour(
            good, delta, epsilon, scale.search_rounds, pole=bool(pole), cone=scale.cone
        )
        return found.smallest

    if k < len(epsilons):
        return {"smallest": smallest(epsilons[k])}
    held, lost = 0.0, PAPER[delta]
    if smallest(lost) > 0.0:
        return {"refuted": None}
    for _ in range(HALVINGS):
        middle = 0.5 * (held + lost)
        if smallest(middle) > 0.0:
            held = middle
        else:
            lost = middle
    return {"refuted": lost}


def poles(index: int, scale: Scale) -> dict[str, Any]:
    """How much Q_l changes within next to nothing of −e₃, where R(n) is not continuous."""
    drop, grasp, near = steepest_at_the_pole(_good(0.2, scale), scale.cone)
    apart = np.linalg.norm(grasp[9:18] - near[9:18])
    return {
        "drop": drop,
        "distance": float(apart),
        "grasp": grasp.tolist(),
        "neighbour": near.tolist(),
    }


def worst_pieces(delta: float) -> int:
    """How many pieces :func:`worst` has."""
    return 2 * (len(EPSILONS[delta]) + 1)


def _good(delta: float, scale: Scale) -> Floats:
    """The first uniform grasps with Q ≥ δ."""
    found: list[Floats] = []
    number = 0
    while sum(map(len, found)) < scale.search_starts:
        rows = _core.random_grasps(scale.seed, number, 200_000)
        value = quality(*split(rows), friction=scale.friction, edges=scale.edges)
        found.append(rows[value >= delta])
        number += 1
    return np.concatenate(found)[: scale.search_starts]


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


def fig6(pieces: dict[str, list[Any]], seconds: dict[str, list[float]], scale: Scale) -> Outcome:
    """A picture of N_ε(g), ε = 0.1."""
    good = _good(0.2, scale)[:1]
    around = _core.grasps_near(good, SHOWN_EPSILON, SHOWN, scale.seed, NEIGHBOURHOODS - 1)
    options = {"friction": scale.friction, "edges": scale.edges}
    value = float(quality(*split(good), **options)[0])
    near = np.asarray(quality(*split(around), **options))
    outcome = Outcome()
    title = f"ε = {SHOWN_EPSILON:g}, n = {SHOWN}, Q = {value:.3f}, its neighbours' {near.min():.3f}"
    title += f" to {near.max():.3f}"
    outcome.pictures = {"": partial(_neighbourhood, good, around, title)}
    outcome.captions = {
        "": f"The first uniform grasp with Q₈ ≥ 0.2 and {SHOWN} uniform neighbours within "
        f"ε = {SHOWN_EPSILON:g} of it by d(g, g′); {title}. Seed {scale.seed}."
    }
    return outcome


def _neighbourhood(good: Floats, around: Floats, title: str) -> Figure:
    figure = Figure(figsize=(9.0, 4.3), dpi=110)
    figure.suptitle(title, fontsize=11, y=0.985)
    camera = Camera(0.7, 0.35)
    contacts, normals, centers = split(around)
    base, axes_of, middle = split(good)
    left = figure.add_axes((0.0, 0.0, 0.5, 0.86))
    right = figure.add_axes((0.5, 0.0, 0.5, 0.86))
    for i in range(3):
        color = FINGERS[i]
        tails = contacts[:, i]
        for axes, tail, length in ((left, tails, 0.12), (right, 0.0 * tails, 1.0)):
            flat, _ = camera.project(np.stack([tail, tail + length * normals[:, i]], axis=1))
            axes.plot(flat[:, :, 0].T, flat[:, :, 1].T, color=color, alpha=0.35, linewidth=0.7)
        for axes, tail, length in ((left, base[0, i], 0.2), (right, np.zeros(3), 1.2)):
            flat, _ = camera.project(np.stack([tail, tail + length * axes_of[0, i]]))
            # The picture's limits do not see arrows.
            axes.plot(*flat.T, color="none")
            axes.annotate(
                "", flat[1], flat[0], arrowprops={"arrowstyle": "-|>", "color": color, "lw": 2}
            )
        flat, _ = camera.project(tails)
        left.plot(*flat.T, ".", color=color, markersize=3)
    flat, _ = camera.project(np.concatenate([centers, middle]))
    left.plot(*flat.T, ".", color="0.35", markersize=3)
    for axes, text in ((left, "contacts, normals and centre of mass (grey)"), (right, "normals")):
        axes.set_aspect("equal")
        axes.axis("off")
        axes.set_anchor("N")
        axes.set_title(text, fontsize=10)
    return figure


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
