"""Which way round two parts are alike: their principal axes on each other."""

from __future__ import annotations

from itertools import product

import numpy as np

from .._arrays import Floats
from ..surfaces import Surface
from .axes import principal
from .walls import Booleans

#: No axis of a part is shorter than this share of its longest.
THINNEST = 0.05


def ways(one: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> list[tuple[Floats, Floats]]:
    """Linear maps (3, 3) and offsets (3,) that take one part onto another.

    Each part is given by its points and their areas, (n, 3) and (n,). Principal axes go to
    principal axes, in the order of their lengths and stretched to these, in the four ways that
    do not mirror.
    """
    middle, axes, lengths = _frame(*one)
    to_middle, to_axes, to_lengths = _frame(*other)
    stretch = to_lengths / lengths
    found = []
    for a, b in product((1.0, -1.0), repeat=2):
        signs = np.array([a, b, a * b])
        matrix = (to_axes * (signs * stretch)) @ axes.T
        found.append((matrix, to_middle - matrix @ middle))
    return found


def _frame(points: Floats, areas: Floats) -> tuple[Floats, Floats, Floats]:
    """Middle, principal axes as columns of a rotation, and standard deviations along them."""
    weights = areas / areas.sum()
    middle = (weights[:, None] * points).sum(axis=0)
    away = points - middle
    squares, axes = principal((weights[:, None, None] * away[:, :, None] * away[:, None]).sum(0))
    # A rotation: the last axis follows from the others.
    axes = np.stack([axes[:, 0], axes[:, 1], np.cross(axes[:, 0], axes[:, 1])], axis=1)
    lengths = np.sqrt(np.maximum(squares, 0.0))
    return middle, axes, np.maximum(lengths, THINNEST * lengths.max())


def cells(surface: Surface, pose: Floats, chosen: Booleans) -> tuple[Floats, Floats]:
    """Middles, in the object's coordinates, and areas of cells over u and θ."""
    rows, columns = chosen.shape
    row, column = np.nonzero(chosen)
    u, theta = (row + 0.5) / rows, (column + 0.5) * 2 * np.pi / columns
    first, second = surface.tangents(u, theta)
    across = np.cross(first, second)
    points = surface.points(u, theta) @ pose[:3, :3].T + pose[:3, 3]
    return points, np.sqrt((across * across).sum(axis=1))
