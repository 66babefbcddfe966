"""Pictures of surfaces and grasps on them, without numbers to compare (Figs. 1 to 4)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from .._arrays import Floats
from ..grasps import Grasp
from ..moduli import Point, sample_combinations, sample_weights
from ..shapes import MODELS, NAMES
from ..surfaces import Surface, combine
from ..viewing.drawing import Camera, Scene, add_body, finish
from ..viewing.plotting import ELEVATION, plot_path, plot_rows, plot_simplex
from .common import CORNERS, WEIGHTS, Pieces, Seconds, own_grasp
from .report import Outcome
from .settings import Scale

#: Fig. 1: uniform samples that are drawn, of how many candidates.
SHOWN, CANDIDATES = 8, 400
#: Two surfaces of Fig. 1 do not cover each other if their weights differ so much; a corner takes
#: more room, and so does the surface with the grasp.
APART, FROM_CORNER, FROM_GRASP = 0.16, 0.30, 0.22
#: Fig. 4: from which model to which.
ENDS = "aj"
#: Fig. 3: what surfaces are combined of, a row each.
ROWS = ("abcd", "efghijkl", "abcdefghijkl")


def fig1(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """A simplex of shapes, with the surface of Sec. IV.B and its grasp."""
    corners = [MODELS[name] for name in CORNERS]
    labels = [f"{name} ({NAMES[name]})" for name in CORNERS]
    grasp, value = own_grasp(combine(corners, WEIGHTS), scale, scale.seed)
    weights = _apart(np.array(WEIGHTS), sample_weights(3, CANDIDATES, scale.seed))
    grasps: list[Grasp | None] = [grasp, *[None] * (len(weights) - 1)]
    return Outcome(
        pictures={"": partial(plot_simplex, corners, labels, weights=weights, grasps=grasps)},
        captions={
            "": f"Conv(X) of the models {', '.join(CORNERS)}: {len(weights) - 1} uniform samples, "
            "left out where they would cover one another or a corner, and the surface "
            f"(0.3, 0.3, 0.4) of Sec. IV.B with the best grasp of C(200, 3), Q = {value:.3f}. Seed "
            f"{scale.seed}."
        },
    )


def _apart(first: Floats, candidates: Floats) -> Floats:
    """The first weights, then those of the candidates that cover no corner and no other."""
    chosen = [first]
    for weights in candidates:
        # In the triangle of side 1: half the sum of squares of differences of weights that sum to
        # 1 is the square of their distance.
        to_corners = np.linalg.norm(weights - np.eye(3), axis=1) / np.sqrt(2.0)
        to_others = np.linalg.norm(weights - np.array(chosen), axis=1) / np.sqrt(2.0)
        if to_corners.min() > FROM_CORNER and to_others.min() > APART and to_others[0] > FROM_GRASP:
            chosen.append(weights)
        if len(chosen) > SHOWN:
            break
    return np.array(chosen)


def fig2(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """The twelve models."""
    labels = [f"{name}  {NAMES[name]}" for name in MODELS]
    return Outcome(
        pictures={"": partial(_gallery, list(MODELS.values()), labels)},
        captions={
            "": "The models, after the paper's Fig. 2: a–d are surfaces of revolution, e–l are not."
        },
    )


def fig3(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """Random surfaces between the models, with grasps."""
    points: list[Point] = []
    labels = []
    for row, names in enumerate(ROWS):
        models = [MODELS[name] for name in names]
        for surface in sample_combinations(models, 4, seed=scale.seed + row, concentration=0.5):
            points.append((surface, own_grasp(surface, scale, scale.seed)[0]))
            labels.append(f"{'abcdefghijkl'[len(labels)]})")
    return Outcome(
        pictures={"": partial(plot_rows, points, labels, columns=4)},
        captions={
            "": "Samples of the Grasp Moduli Space: combinations of the models of revolution "
            "(a–d), of the others (e–h) and of all (i–l), Dirichlet with α = 0.5, each with the "
            f"best grasp of C(200, 3). Seed {scale.seed}."
        },
    )


def fig4(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """A curve in the Grasp Moduli Space."""
    start, end = ((MODELS[name], own_grasp(MODELS[name], scale, scale.seed)[0]) for name in ENDS)
    return Outcome(
        pictures={"": partial(plot_path, start, end)},
        captions={
            "": f"The curve of Eq. (III.1) between the best grasps of C(200, 3) on {ENDS[0]} and "
            f"{ENDS[1]}. Seed {scale.seed}."
        },
    )


def _gallery(surfaces: Sequence[Surface], labels: Sequence[str]) -> Figure:
    figure = Figure(figsize=(9.0, 4.4), dpi=110)
    camera = Camera(0.6, ELEVATION)
    for index, (surface, label) in enumerate(zip(surfaces, labels, strict=True)):
        row, column = divmod(index, 6)
        axes = figure.add_axes((column / 6, 0.52 - 0.5 * row, 1 / 6, 0.44))
        scene = Scene()
        add_body(scene, camera, surface)
        scene.draw(axes)
        finish(axes)
        axes.set_title(label, fontsize=9, y=-0.08)
    return figure
