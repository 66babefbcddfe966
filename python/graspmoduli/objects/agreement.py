"""How far an object is from a fitted surface, how much of it that explains, and how much of the
surface has no object near it.

All are by area, of the whole object and the whole surface, not only of where rays from the axis
hit or of what the fit explains.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .._arrays import Floats
from .._core import arctan2
from ..surfaces import Surface
from .likeness import cells
from .reading import Object
from .touching import TriangleMesh
from .walls import CLOSE, Booleans

#: What a ray along a visible sample's normal meets first is this close to it, over the size.
VISIBLE = 3e-3
#: Points of the surface at which it is asked whether the object is near: rows, columns.
GRID = (40, 60)
#: Points of the surface that tell how far from it what is not near is.
FINE_GRID = (90, 150)


@dataclass(frozen=True)
class Residual:
    """Distance of the object from the fitted surface, closed by a lid at either end.

    Of the whole object, also of what the surface does not explain: of a mesh, all that is visible
    from outside, by area; of a cloud, its points; of a part, the points that belong to it.
    """

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


class Agreement(NamedTuple):
    """What a fit says of itself; see :class:`graspmoduli.Fit`."""

    residual: Residual
    coverage: float
    unexplained: float
    phantom: float


def of_mesh(thing: Object, mesh: TriangleMesh, surface: Surface, pose: Floats) -> Agreement:
    """Of an object whose mesh is known: by area of what is visible from outside."""
    seen = visible(thing, mesh)
    # What hides all of itself is looked at all the same.
    points = thing.samples[seen] if seen.any() else thing.samples
    away = distances(points, surface, pose)
    phantom = phantom_area(mesh, surface, pose)
    return Agreement(
        residual_of(points, surface, pose, thing.size),
        1.0 - phantom,
        float((away > CLOSE * thing.size).mean()),
        phantom,
    )


def of_cloud(
    thing: Object,
    surface: Surface,
    pose: Floats,
    seen: Booleans,
    explained: Booleans,
    unexplained: Booleans,
    empty: Booleans,
) -> Agreement:
    """Of a cloud, with the cells over u and θ that were seen, that are explained, that are not, and
    that were seen to be empty."""
    area = cells(surface, pose, np.ones_like(seen))[1].reshape(seen.shape)
    # Small holes between the points aside.
    covered = ~dilated(~dilated(explained, 1), 1)
    return Agreement(
        residual_of(thing.samples, surface, pose, thing.size),
        float(area[covered].sum() / area.sum()),
        float(area[unexplained].sum() / area[seen].sum()) if seen.any() else 1.0,
        float(area[empty].sum() / area.sum()),
    )


def dilated(cells: Booleans, reach: int) -> Booleans:
    """Cells and their neighbours; columns wrap around."""
    out = cells.copy()
    for _ in range(reach):
        grown = out | np.roll(out, 1, axis=1) | np.roll(out, -1, axis=1)
        grown[1:] |= out[:-1]
        grown[:-1] |= out[1:]
        out = grown
    return out


def visible(thing: Object, mesh: TriangleMesh) -> Booleans:
    """Which of the object's samples a straight ray along their normals sees from outside."""
    points = mesh.local(thing.samples)
    seen = np.zeros(len(points), dtype=bool)
    for normals in (thing.sample_normals, -thing.sample_normals):
        ways = np.ascontiguousarray(normals)
        distance = mesh.core.rays(np.ascontiguousarray(points - 2.0 * ways), ways)[:, 0]
        seen |= np.abs(distance - 2.0) < VISIBLE
    return seen


def residual_of(points: Floats, surface: Surface, pose: Floats, size: float) -> Residual:
    """Of points spread over what is to be explained. Shape (n, 3), n at least 1."""
    away = distances(points, surface, pose)
    # Where the surface is steep, or far, its own distance is not that along its normal here.
    doubtful = away > 0.25 * CLOSE * size
    if doubtful.any():
        first, nearest = away[doubtful], _to_nearest(points[doubtful], surface, pose)
        away[doubtful] = np.where(first > 2.0 * CLOSE * size, nearest, np.minimum(first, nearest))
    return Residual(rms=float(np.sqrt((away * away).mean())), max=float(away.max()), size=size)


def _to_nearest(points: Floats, surface: Surface, pose: Floats) -> Floats:
    """From points to the nearest of many of a surface closed by lids."""
    from scipy.spatial import KDTree

    rows, columns = FINE_GRID
    u, theta = np.meshgrid(
        np.linspace(0.0, 1.0, rows), 2 * np.pi * np.arange(columns) / columns, indexing="ij"
    )
    wall = surface.points(u, theta)
    shares = ((np.arange(rows // 3) + 0.5) / (rows // 3))[:, None, None]
    lids = [wall[end] * [1.0, 1.0, 0.0] * shares + wall[end] * [0.0, 0.0, 1.0] for end in (0, -1)]
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    away: Any = KDTree(np.concatenate([one.reshape(-1, 3) for one in (wall, *lids)])).query(local)
    return away[0]


def distances(points: Floats, surface: Surface, pose: Floats) -> Floats:
    """From points, in the object's coordinates, to a surface closed by a lid at either end.

    To first order, quickly, for what is near it. Shape (n,).
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
    places, area = cells(surface, pose, np.ones(GRID, dtype=np.bool_))
    points = mesh.local(places)
    away = mesh.core.nearest(points) - points
    far = (away * away).sum(axis=1) > CLOSE**2
    return float(area[far].sum() / area.sum())
