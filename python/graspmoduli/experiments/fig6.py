"""Sec. IV.A: a neighbourhood of a grasp (Fig. 6)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .. import _core
from .._arrays import Floats
from ..quality import quality
from ..viewing.drawing import FINGERS, Camera
from .random_grasps import (
    NEIGHBOURHOODS,
    good_grasps,
)
from .report import Outcome
from .settings import Scale
from .worst import split

#: Fig. 6: neighbours that are drawn, and within what distance.
SHOWN, SHOWN_EPSILON = 150, 0.1


def fig6(pieces: dict[str, list[Any]], seconds: dict[str, list[float]], scale: Scale) -> Outcome:
    """A picture of N_ε(g), ε = 0.1."""
    good = good_grasps(0.2, scale)[:1]
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
