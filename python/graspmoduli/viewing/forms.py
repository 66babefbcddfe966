"""Triangles and lines of what is drawn: surfaces, friction cones, arrows, discs.

The scene's coordinates are those of the fitted surface, over the length scale.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._arrays import Floats
from ..objects.fitting import Fit
from ..surfaces import Surface
from .drawing import FINGERS

#: Friction cones are drawn this long.
CONE = 0.3
#: The weakest push and twist.
DARK = (25, 25, 25)
#: Triangles of a mesh that is drawn as it is; larger ones are drawn with fewer.
MOST_FACES = 60_000


def rgb(color: str) -> tuple[int, int, int]:
    """Of ``"#rrggbb"``."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def finger_color(index: int) -> tuple[int, int, int]:
    """Of a finger, counted from 0."""
    return rgb(FINGERS[index % len(FINGERS)])


def surface_mesh(surface: Surface, rows: int = 48, columns: int = 72) -> tuple[Floats, Any]:
    """Vertices (n, 3) and faces (k, 3) of a grid on a surface."""
    u, theta = np.meshgrid(
        np.linspace(0.0, 1.0, rows + 1), 2 * np.pi * np.arange(columns) / columns, indexing="ij"
    )
    vertices = surface.points(u, theta).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    here, right = i * columns + j, i * columns + (j + 1) % columns
    above, corner = here + columns, right + columns
    faces = np.concatenate(
        [np.stack([here, right, corner], -1), np.stack([here, corner, above], -1)]
    )
    return vertices, faces.reshape(-1, 3)


def net_segments(surface: Surface) -> Floats:
    """Lines of constant u and θ, a hair outside. Shape (n, 2, 3)."""
    lines = []
    around, upward = np.linspace(0.0, 2 * np.pi, 73), np.linspace(0.0, 1.0, 49)
    for u in np.linspace(0.0, 1.0, 9):
        lines.append((np.full_like(around, u), around))
    for theta in np.linspace(0.0, 2 * np.pi, 17)[:-1]:
        lines.append((upward, np.full_like(upward, theta)))
    segments = []
    for u, theta in lines:
        points = surface.points(u, theta) - 0.003 * surface.normals(u, theta)
        segments.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate(segments)


def beside(axis: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors across an axis and across each other."""
    side = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    return side, np.cross(axis, side)


def cone_mesh(point: Floats, normal: Floats, friction: float, edges: int) -> tuple[Floats, Any]:
    """The friction cone on the finger's side, apex first."""
    axis = -normal
    side, other = beside(axis)
    angles = 2 * np.pi * np.arange(edges) / edges
    # Wide cones are cut shorter, so that all are of a size.
    height = CONE / np.hypot(1.0, friction)
    rim = point + height * (
        axis + friction * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other)
    )
    k = np.arange(edges)
    faces = np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % edges], axis=1)
    return np.concatenate([point[None], rim]), faces


def disc_mesh(radius: float, sides: int = 12) -> tuple[Floats, Any]:
    """A disc across the third axis."""
    angles = 2 * np.pi * np.arange(sides) / sides
    rim = radius * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    k = np.arange(sides)
    faces = np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % sides], axis=1)
    return np.concatenate([np.zeros((1, 3)), rim]), faces


def twist_mesh(center: Floats, axis: Floats, radius: float) -> tuple[Floats, Any, Floats]:
    """A curved arrow about an axis, three quarters around, and where it ends."""
    side, other = beside(axis)
    turns = np.linspace(0.0, 1.6 * np.pi, 49)
    out = np.cos(turns)[:, None] * side + np.sin(turns)[:, None] * other
    # A shaft of constant width and a head that comes to a point.
    width = np.full(49, 0.014)
    width[-9:] = np.linspace(0.045, 0.0, 9)
    around = 2 * np.pi * np.arange(8) / 8
    ring = (
        np.cos(around)[None, :, None] * out[:, None]
        + np.sin(around)[None, :, None] * axis[None, None]
    )
    vertices = center + radius * out[:, None] + width[:, None, None] * ring
    i, j = np.meshgrid(np.arange(48), np.arange(8), indexing="ij")
    here, right = i * 8 + j, i * 8 + (j + 1) % 8
    faces = np.concatenate(
        [np.stack([here, right, right + 8], -1), np.stack([here, right + 8, here + 8], -1)]
    ).reshape(-1, 3)
    return vertices.reshape(-1, 3), faces, center + radius * out[-1]


def exits(center: Floats, way: Floats, outline: Floats) -> float:
    """How far from the centre a ray leaves an object of which some points are given."""
    away = outline - center
    along = away @ way
    beside = np.linalg.norm(away - along[:, None] * way, axis=1)
    near = along[(beside < 0.25) & (along > 0.0)]
    return float(near.max()) if len(near) else 0.3


def twist_end(center: Floats, axis: Floats, outline: Floats, towards: Floats) -> Floats:
    """Where a twist is drawn on its axis: outside of the object, at the end nearer to the eye."""
    way = axis if axis @ towards >= 0.0 else -axis
    return center + (exits(center, way, outline) + 0.12) * way


def turned_to(normals: Floats) -> Floats:
    """Quaternions (n, 4) that turn the third axis to directions."""
    z = -normals
    half = np.stack([1.0 + z[:, 2], -z[:, 1], z[:, 0], np.zeros(len(z))], axis=1)
    half[half[:, 0] < 1e-9] = [0.0, 1.0, 0.0, 0.0]
    return half / np.linalg.norm(half, axis=1, keepdims=True)


def local(fit: Fit, points: Floats) -> Floats:
    """Points of the object in the scene: those of its surface, over the length scale."""
    return (points - fit.pose[:3, 3]) @ fit.pose[:3, :3] / fit.length_scale


def fewer(vertices: Floats, faces: Any, most: int = MOST_FACES) -> tuple[Floats, Any]:
    """A mesh with at most about so many triangles: vertices in the same cell become one."""
    cells = 220
    while len(faces) > most and cells > 8:
        low, extent = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
        cell = np.floor((vertices - low) / extent * cells).astype(np.int64)
        key = (cell[:, 0] * 4096 + cell[:, 1]) * 4096 + cell[:, 2]
        owner = np.unique(key, return_inverse=True)[1]
        owner = owner.ravel()
        count = np.bincount(owner)
        middle = np.stack(
            [np.bincount(owner, weights=vertices[:, k]) / count for k in range(3)], axis=1
        )
        left = owner[faces]
        kept = (left[:, 0] != left[:, 1]) & (left[:, 1] != left[:, 2]) & (left[:, 0] != left[:, 2])
        vertices, faces = middle, left[kept]
        cells = int(cells / 1.4)
    return vertices, faces


def in_the_way(fit: Fit) -> Callable[[Floats, Floats], Any] | None:
    """Of rays from points along directions (n, 3): is the object in the way? None of a cloud."""
    mesh = fit.mesh
    if mesh is None:
        return None

    def blocked(starts: Floats, ways: Floats) -> Any:
        along = np.ascontiguousarray(ways @ fit.pose[:3, :3].T)
        from_there = mesh.local(fit.to_object(fit.length_scale * starts))
        return ~np.isnan(mesh.core.rays(from_there, along)[:, 0])

    return blocked
