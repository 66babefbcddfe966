"""How much of a mesh a fitted surface explains, and how much of the surface has no mesh near it.

Both are by area, of the whole object and the whole surface, not only of where rays from the axis
hit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Floats
from .._core import arctan2
from ..surfaces import Surface
from .reading import Object
from .touching import TriangleMesh
from .walls import CLOSE, Booleans

#: What a ray along a visible sample's normal meets first is this close to it, over the size.
VISIBLE = 3e-3
#: Points of the surface at which it is asked whether the object is near: rows, columns.
GRID = (40, 60)


@dataclass(frozen=True)
class Residual:
    """Distance of the object's outer wall from the fitted surface, where it explains the wall."""

    #: Root mean square, in the unit of the object.
    rms: float
    #: Largest, in the unit of the object.
    max: float
    #: The object's largest extent, in its unit.
    size: float

    @property
    def relative_rms(self) -> float:
        """rms / size."""
        return self.rms / self.size

    @property
    def relative_max(self) -> float:
        """max / size."""
        return self.max / self.size


def visible(thing: Object, mesh: TriangleMesh) -> Booleans:
    """Which of the object's samples a straight ray along their normals sees from outside."""
    points = mesh.local(thing.samples)
    seen = np.zeros(len(points), dtype=bool)
    for normals in (thing.sample_normals, -thing.sample_normals):
        ways = np.ascontiguousarray(normals)
        distance = mesh.core.rays(np.ascontiguousarray(points - 2.0 * ways), ways)[:, 0]
        seen |= np.abs(distance - 2.0) < VISIBLE
    return seen


def unexplained_area(thing: Object, mesh: TriangleMesh, surface: Surface, pose: Floats) -> float:
    """Share of the object's visible area farther than 2 % of its size from the surface."""
    seen = visible(thing, mesh)
    if not seen.any():
        return 1.0
    away = distances(thing.samples[seen], surface, pose)
    return float((away > CLOSE * thing.size).mean())


def distances(points: Floats, surface: Surface, pose: Floats) -> Floats:
    """From points, in the object's coordinates, to a surface closed by a lid at either end.

    To first order, and not less than it is. Shape (n,).
    """
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    radius = np.sqrt(local[:, 0] ** 2 + local[:, 1] ** 2)
    theta = arctan2(np.ascontiguousarray(local[:, 1]), np.ascontiguousarray(local[:, 0]))
    height = local[:, 2]
    u = np.clip((height - surface.bottom) / (surface.top - surface.bottom), 0.0, 1.0)
    beyond = np.maximum(np.maximum(surface.bottom - height, height - surface.top), 0.0)
    normals = surface.normals(u, theta)
    slant = np.sqrt(normals[:, 0] ** 2 + normals[:, 1] ** 2)
    off = radius - surface.radius(u, theta)
    to_wall = np.sqrt((off * slant) ** 2 + beyond**2)
    to_end = np.minimum(np.abs(height - surface.bottom), np.abs(height - surface.top))
    return np.minimum(to_wall, np.sqrt(to_end**2 + np.maximum(off, 0.0) ** 2))


def phantom_area(mesh: TriangleMesh, surface: Surface, pose: Floats) -> float:
    """Share of the surface's area that has no object within 2 % of the object's size."""
    rows, columns = GRID
    u, theta = (
        grid.ravel()
        for grid in np.meshgrid(
            (np.arange(rows) + 0.5) / rows,
            (np.arange(columns) + 0.5) * 2 * np.pi / columns,
            indexing="ij",
        )
    )
    first, second = surface.tangents(u, theta)
    across = np.cross(first, second)
    area = np.sqrt((across * across).sum(axis=1))
    points = mesh.local(surface.points(u, theta) @ pose[:3, :3].T + pose[:3, 3])
    away = mesh.core.nearest(points) - points
    far = (away * away).sum(axis=1) > CLOSE**2
    return float(area[far].sum() / area.sum())
