"""From where a grasp is seen best, and how near the eye comes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats

#: Elevations that are tried [rad]: a little from above, unless that hides what matters.
ELEVATIONS = (0.3, 0.1, 0.6, 0.95, 1.25, -0.25)
AZIMUTHS = 24
#: How far the eye of a hidden contact is looked from, over the object's radius.
BESIDE = 0.03

#: Of rays from points along directions (n, 3): is something in the way?
Blocked = Callable[[Floats, Floats], NDArray[np.bool_]]


def best_direction(
    contacts: Floats, normals: Floats, outline: Floats, blocked: Blocked | None = None
) -> tuple[Floats, NDArray[np.bool_]]:
    """Towards the eye from which most contacts are seen, and which of them are seen from there.

    Among these views the one that shows contacts apart from each other and flat objects from their
    flat side. ``outline`` are points of the object; its third axis is up. Shapes (3,), (m,).
    """
    turns = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    azimuth, elevation = (grid.ravel() for grid in np.meshgrid(turns, ELEVATIONS, indexing="ij"))
    level = np.cos(elevation)
    ways = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)
    facing = -ways @ normals.T
    seen = facing > -0.15
    if blocked is not None:
        starts = np.repeat((contacts - BESIDE * normals)[None], len(ways), axis=0)
        along = np.repeat(ways[:, None], len(contacts), axis=1)
        hidden = blocked(starts.reshape(-1, 3), np.ascontiguousarray(along.reshape(-1, 3)))
        seen = ~hidden.reshape(len(ways), len(contacts))
    score = np.array([
        _score(way, contacts, normals, seen[k], outline) - 0.25 * abs(elevation[k] - 0.3)
        for k, way in enumerate(ways)
    ])  # fmt: skip
    best = int(score.argmax())
    return ways[best], seen[best]


def _score(
    way: Floats, contacts: Floats, normals: Floats, seen: NDArray[np.bool_], outline: Floats
) -> float:
    right, up = axes_of(way)
    flat = np.stack([outline @ right, outline @ up], axis=1)
    area = float(np.sqrt(max(np.linalg.det(np.cov(flat.T)), 0.0)))
    spread = np.linalg.eigvalsh(np.cov(outline.T))
    places = np.stack([contacts @ right, contacts @ up], axis=1)
    apart = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(len(places), 1)]
    nearest = float(apart.min()) if len(apart) else 1.0
    # A finger that comes at the eye hides what it touches.
    headlong = float((np.maximum(-normals @ way, 0.0) ** 4).max())
    return (
        float(seen.mean() * 3.0)
        + 0.5 * min(nearest / 0.4, 1.0)
        - 0.4 * headlong
        + 0.8 * area / max(float(np.sqrt(spread[1] * spread[2])), 1e-9)
    )


def axes_of(way: Floats) -> tuple[Floats, Floats]:
    """To the right and up in a picture seen from a direction, the third axis being up."""
    right = np.cross([0.0, 0.0, 1.0], way)
    right /= np.linalg.norm(right)
    return right, np.cross(way, right)


def framed(
    points: Floats,
    way: Floats,
    fov: float,
    aspect: float,
    *,
    margin: float = 0.88,
    top: float = 0.0,
    bottom: float = 0.0,
) -> tuple[Floats, Floats]:
    """Eye and what it looks at, such that all points lie in the picture.

    ``fov`` is the height's [rad]; ``margin`` is what they may take of the picture, ``top`` and
    ``bottom`` how much of its height is covered by something else.
    """  # fmt: skip
    right, up = axes_of(way)
    x, y, z = points @ right, points @ up, points @ way
    half = np.tan(0.5 * fov) * margin
    # Slopes to the picture's sides: a point on the eye's right by d is inside if d is at most that
    # times its depth, and so on, which is linear in the eye's place.
    sides = (half * aspect, half * aspect), (half * (1.0 - 2.0 * top), half * (1.0 - 2.0 * bottom))
    ends = [
        (float((v + more * z).max()), float((-v + less * z).max()), more, less)
        for v, (more, less) in zip((x, y), sides, strict=True)
    ]
    far = max((one + other) / (more + less) for one, other, more, less in ends)
    across, high = (
        0.5 * (one - far * more + far * less - other) for one, other, more, less in ends
    )
    target = across * right + high * up
    return target + far * way, target
