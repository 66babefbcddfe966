"""Sec. IV.A: uniform grasps in D(1), and how bad the grasps near good ones are: what Figs. 5 to 7
show."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from .._arrays import Floats
from ..quality import quality
from .settings import Scale
from .worst import split, steepest_at_the_pole, worst_neighbour

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
    good = good_grasps(delta, scale)

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
    drop, grasp, near = steepest_at_the_pole(good_grasps(0.2, scale), scale.cone)
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


def good_grasps(delta: float, scale: Scale) -> Floats:
    """The first uniform grasps with Q ≥ δ."""
    found: list[Floats] = []
    number = 0
    while sum(map(len, found)) < scale.search_starts:
        rows = _core.random_grasps(scale.seed, number, 200_000)
        value = quality(*split(rows), friction=scale.friction, edges=scale.edges)
        found.append(rows[value >= delta])
        number += 1
    return np.concatenate(found)[: scale.search_starts]
