"""Sec. IV.E: grasps on surfaces of revolution (Fig. 11), and in a plane with the axis."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..grasps import Grasp
from ..moduli import sample_combinations
from ..sampling import sample_points
from ..shapes import MODELS, NAMES
from ..synthesis import best_grasps, plane_grasp, synthesize
from ..viewing.plotting import LINES
from .common import (
    Pieces,
    Seconds,
    by_seed,
    counts,
    listed,
    over_seeds,
    own_grasp,
    repetition,
)
from .report import BEYOND, Outcome, Row
from .settings import Scale

#: The models of revolution.
ROUND_MODELS = "abcd"
#: Fig. 11: surfaces, sampled contacts on each, surfaces per piece.
ROUND, ROUND_CONTACTS, ROUND_PIECE = 100, 100, 10
#: U as the paper writes it has m + 1 = 11 heights and 605 triples; its 450 triples need 10.
HEIGHTS = {"heuristic": 11, "heuristic with 10": 10}
TRIPLES = {11: 605, 10: 450}
KINDS = ("brute", *HEIGHTS, "ours")
#: A grasp lies in a plane with the axis if its contacts are within this of one [rad]; at random
#: angles, 15 % of grasps do.
IN_PLANE = np.radians(20.0)


def off_plane(grasp: Grasp) -> float:
    """How far contacts are from the nearest plane with the axis: the largest angle [rad].

    0 if all lie in it; for three contacts π/3 at most, with fingers evenly around.
    """
    # A plane is an angle modulo π: what the smallest arc that holds all contacts leaves out is the
    # largest gap between them.
    at = np.sort(np.mod(grasp.theta, np.pi))
    gaps = np.diff(at, append=at[0] + np.pi)
    return float(0.5 * (np.pi - gaps.max()))


def axis_piece(index: int, scale: Scale) -> dict[str, Any]:
    """The best sampled grasp of a model of revolution, and how far it is from a plane."""
    seed, number = repetition(index, len(ROUND_MODELS), scale)
    grasp, value = own_grasp(MODELS[ROUND_MODELS[number]], scale, seed)
    return {"quality": value, "grasp": listed(grasp), "off": off_plane(grasp)}


def fig11_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Exhaustive search and the heuristic on ten random surfaces of revolution."""
    seed, part = repetition(index, ROUND // ROUND_PIECE, scale)
    surfaces = sample_combinations([MODELS[name] for name in ROUND_MODELS], ROUND, seed=seed)
    options = {"friction": scale.friction, "edges": scale.edges}
    found: dict[str, Any] = {kind: [] for kind in KINDS} | {"off": []}
    spent = dict.fromkeys(KINDS, 0.0)
    for number in range(part * ROUND_PIECE, (part + 1) * ROUND_PIECE):
        surface = surfaces[number]
        # Every surface of every seed has contacts of its own.
        u, theta = sample_points(surface, ROUND_CONTACTS, seed=(seed + 1) * ROUND + number)
        # The centre of mass is computed once, whoever asks first.
        _ = surface.center_of_mass
        clock = time.perf_counter()
        brute = best_grasps(surface, u, theta, threads=1, **options)
        spent["brute"] += time.perf_counter() - clock
        found["brute"].append(brute[0].quality if brute else 0.0)
        if brute:
            found["off"].append(off_plane(brute[0].grasp))
        for kind, heights in HEIGHTS.items():
            clock = time.perf_counter()
            heuristic = plane_grasp(surface, heights=heights, **options)
            spent[kind] += time.perf_counter() - clock
            found[kind].append(heuristic.quality if heuristic else 0.0)
        clock = time.perf_counter()
        ours = synthesize(surface, top=1, seed=seed, **options)
        spent["ours"] += time.perf_counter() - clock
        found["ours"].append(ours[0].quality if ours else 0.0)
    found["seconds"] = {key: value / ROUND_PIECE for key, value in spent.items()}
    return found


def fig11(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """Surfaces of revolution: the heuristic against exhaustive search."""
    found = pieces["fig11"]
    values = {kind: by_seed([piece[kind] for piece in found], scale) for kind in KINDS}
    mean = {kind: v.mean(axis=1) for kind, v in values.items()}
    stable = {kind: (v > 0.0).sum(axis=1) for kind, v in values.items()}
    outcome = Outcome(series={kind: v.tolist() for kind, v in values.items()})
    outcome.rows = [
        *_plane_rows(pieces, scale, outcome),
        Row(f"mean of the best Q₈ of C(100, 3) on {ROUND} random surfaces", "IV.E", "0.2435",
            over_seeds(mean["brute"]), f"force closure on all {ROUND} in every seed",
            bool((stable["brute"] == ROUND).all()), "other surfaces than the paper's"),
    ]  # fmt: skip
    for kind, heights in HEIGHTS.items():
        said = "U as it is written" if heights == 11 else "as many as the paper counts"
        outcome.rows += [
            Row(f"mean Q₈ of the heuristic, {heights} heights, {TRIPLES[heights]} triples", "IV.E",
                "0.2521", over_seeds(mean[kind]),
                "higher than that of C(100, 3) in every seed",
                bool((mean[kind] > mean["brute"]).all()), said),
            Row(f"surfaces on which it is force closure, {heights} heights", "IV.E",
                f"{ROUND} of {ROUND}", counts(stable[kind], ROUND), f"{ROUND} in every seed",
                bool((stable[kind] == ROUND).all())),
        ]  # fmt: skip
    outcome.rows.append(
        Row("mean Q₈ of our synthesis", "IV.E", "–", over_seeds(mean["ours"]), BEYOND)
    )
    spent = {kind: float(np.mean([piece["seconds"][kind] for piece in found])) for kind in KINDS}
    outcome.times = [
        ("C(100, 3) = 161,700 evaluations, a surface", "250 s", f"{1e3 * spent['brute']:.2f} ms"),
        *(
            (
                f"the heuristic, {TRIPLES[heights]} evaluations, a surface",
                "0.89 s" if heights == 10 else "–",
                f"{1e3 * spent[kind]:.2f} ms",
            )
            for kind, heights in HEIGHTS.items()
        ),
        ("our synthesis, a surface", "–", f"{1e3 * spent['ours']:.2f} ms"),
    ]
    labels = ("exhaustive, 100 contacts", "the heuristic, 11 heights", "our synthesis")
    chosen = [values[kind][0] for kind in ("brute", "heuristic", "ours")]
    outcome.pictures = {"": partial(_fig11_picture, chosen, labels)}
    outcome.captions = {
        "": f"Q₈ of the grasps found on {ROUND} random combinations of a–d. Seed {scale.seed}."
    }
    return outcome


def _plane_rows(pieces: Pieces, scale: Scale, outcome: Outcome) -> list[Row]:
    """“The best grasps seemed to occur along a single plane containing the axis.”"""
    models = np.degrees(by_seed([piece["off"] for piece in pieces["axis"]], scale))
    random = [np.degrees(off) for off in _seeds([p["off"] for p in pieces["fig11"]], scale)]
    limit = np.degrees(IN_PLANE)
    near = [int((off <= limit).sum()) for off in random]
    wide = np.concatenate(random)
    outcome.series["off the nearest plane with the axis [degrees]"] = {
        "models": dict(zip(ROUND_MODELS, models.T.tolist(), strict=True)),
        "random surfaces": [off.tolist() for off in random],
    }
    observation = "“seemed to occur along a single plane containing the axis”"
    return [
        Row("largest angle of a contact of the best of C(200, 3) from the nearest plane with the "
            f"axis, {name} ({NAMES[name]})", "IV.E", observation,
            over_seeds(models[:, k], 1) + " degrees",
            f"at most {limit:.0f} degrees in every seed", bool((models[:, k] <= limit).all()),
            "fingers evenly around are off by 60" if k == 0 else "")
        for k, name in enumerate(ROUND_MODELS)
    ] + [
        Row(f"best grasps of C(100, 3) within {limit:.0f} degrees of a plane with the axis, on the "
            "random surfaces", "IV.E", observation, counts(near, ROUND),
            f"at least 90 of {ROUND} in every seed", min(near) >= 90,
            f"{(wide > 40.0).mean():.0%} of all are more than 40 degrees off; for fingers at "
            "random angles 15 % would be within 20"),
    ]  # fmt: skip


def _seeds(parts: Sequence[Any], scale: Scale) -> list[Any]:
    """Lists of pieces joined, one for each seed."""
    per = len(parts) // scale.seeds
    return [np.concatenate(parts[k * per : (k + 1) * per]) for k in range(scale.seeds)]


def _fig11_picture(values: Sequence[Any], labels: Sequence[str]) -> Figure:
    figure = Figure(figsize=(7.2, 3.6), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    low, high = min(map(np.min, values)), max(map(np.max, values))
    bins = np.linspace(low, high + 1e-9, 31)
    for found, label, (color, dashes) in zip(
        values, labels, (LINES[1], LINES[0], LINES[2]), strict=True
    ):
        numbers, _ = np.histogram(found, bins)
        axes.stairs(numbers, bins, color=color, linestyle=dashes, linewidth=1.8, label=label)
    axes.set_xlim(low, high)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("$Q_8$ of the grasp found")
    axes.set_ylabel(f"surfaces of {ROUND}")
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    return figure
