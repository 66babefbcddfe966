"""Fitting a surface with cylindrical coordinates to a real object (Sec. III of the paper).

The paper proposes regression in cylindrical coordinates about the most dominant axis. Here the
axis is chosen among candidates by how well the outer wall about it is such a surface, and the
regression is that of penalised splines (Eilers & Marx 1996) with robust weights.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import (
    Floats,
    a_callback,
    locked,
)
from .._core import GraspModuliError
from ..surfaces import Surface
from .agreement import Residual as Residual
from .agreement import dilated, of_cloud, of_mesh
from .axes import FARTHEST, candidate_axes, refined, same_axis, score
from .fits import Fit as Fit
from .object_grasps import ObjectGrasp as ObjectGrasp
from .reading import Object, read
from .scanned import Scanned
from .touching import TIP, TriangleMesh
from .views import is_free, meet
from .walls import CLOSE, FOR_MESHES, FOR_SCANS, Axis, Booleans, fine_hits, regress

#: More unexplained than this is refused, of a cloud of points.
MOST_UNEXPLAINED = 0.4
#: Axes whose scores, numbers of order 1, are this close are equally good.
TIE = 1e-6
#: Of what lies on a table, contacts are at least so much of its height above it.
LOW = 0.3
#: More unexplained than this is worth a warning.
WORTH_A_WARNING = 0.005
#: So is more of a mesh's visible area, and less of the surface with the mesh near it.
WORTH_A_WARNING_OF_MESH, LEAST_COVERAGE = 0.05, 0.9


def fit(
    points_or_mesh_or_path: Any,
    *,
    camera: ArrayLike | None = None,
    object_number: int | None = None,
    keep_table: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> Fit:
    """The surface with cylindrical coordinates that is closest to a real object.

    Parameters
    ----------
    points_or_mesh_or_path
        Points of shape (n, 3), or an image of points (rows, columns, 3), NaN where nothing came
        back; a trimesh mesh; a pair (vertices, faces); the path of a PLY, OBJ, STL, GLB, OFF, PCD,
        XYZ or NPY file, or of a TOML file that lists depth images with their intrinsics; or a list
        of clouds in the same coordinates. Any unit, any pose; a scan may be noisy and see the
        object from one side only.
    camera
        Where the camera was that saw a cloud, shape (3,), in its coordinates; one per cloud, shape
        (k, 3), of several. Of images of points it is found, and of depth images known. What it saw
        to be empty is no place for the surface, nor for contacts.
    object_number
        Which of several objects, counted from 1 by size.
    keep_table
        A plane around which nothing stands and on which something stands, is a table: it is left
        out of scans and closed to fingers, unless this is true.
    progress
        Called as ``progress(done, total)`` after each axis tried.

    Returns
    -------
    Fit
        Where a ray from the axis crosses several walls, the surface is the outer one; parts that
        stick out of it, such as a handle, are left unexplained, and a warning says how much.

    Raises
    ------
    GraspModuliError
        If the file cannot be read, holds several objects (parts farther apart than 3 % of the size
        in a mesh, 8 % in a cloud of points where the space between was seen) and no number of one
        is given, or the object is no such surface.
    """
    thing = read(points_or_mesh_or_path, camera, object_number, keep_table=keep_table)
    return _fitted(thing, progress, stacklevel=3)


def fit_object(thing: Object, progress: Callable[[int, int], object] | None = None) -> Fit:
    """As :func:`fit`, of an object that has been read."""
    return _fitted(thing, progress, stacklevel=3)


def _fitted(thing: Object, progress: Callable[[int, int], object] | None, stacklevel: int) -> Fit:
    """The fit; ``stacklevel``, from here, is that of whom warnings are for."""
    a_callback("progress", progress)
    candidates = candidate_axes(thing)
    scored: list[tuple[float, Axis]] = []
    for done, candidate in enumerate(candidates):
        for axis in (candidate, refined(thing, candidate)):
            # Several candidates often refine to the same axis.
            if not any(same_axis(thing, axis, other) for _, other in scored):
                scored.append((score(thing, axis), axis))
        if progress is not None:
            progress(done + 1, len(candidates))
    lowest = min(value for value, _ in scored)
    # The first among equals: a symmetric object must not get another axis by a last bit.
    axis = next(axis for value, axis in scored if value <= lowest + TIE)
    if not np.isfinite(lowest):
        raise GraspModuliError(
            "object must have an outer wall around some axis, got too little of one"
        )
    return fit_about(thing, axis, stacklevel + 1)


def fit_about(thing: Object, axis: Axis, stacklevel: int) -> Fit:
    """The fit about a given axis; ``stacklevel``, from here, is that of whom warnings are for."""
    mesh = thing.faces is not None
    hits, grid = fine_hits(thing, axis)
    coarse, _ = regress(thing, hits, grid, intervals=10, columns=8)
    intervals, columns, smoothing = (40, 32, FOR_MESHES) if mesh else (20, 24, FOR_SCANS)
    shape, wall = regress(thing, hits, grid, intervals, columns, smoothing, coarse)
    # Rows at the very ends cut lids and rims, not the wall.
    middle = (grid.low + grid.high) / 2
    surface = Surface.from_coefficients(shape.coefficients, grid.low - middle, grid.high - middle)
    u = (hits.height - grid.low) / (grid.high - grid.low)
    normals = surface.normals(np.clip(u, 0.0, 1.0), hits.angle)
    slant = np.hypot(normals[:, 0], normals[:, 1])
    distance = (hits.radius - shape.at(hits, grid)) * slant
    close = CLOSE * thing.size
    explained = wall & (np.abs(distance) <= close)
    outside = distance > close

    shape_of_cells = (grid.rows, grid.columns)
    seen = _hit(hits.cell[wall], shape_of_cells) > 0
    good = _hit(hits.cell[explained], shape_of_cells) > 0
    sticking = _hit(hits.cell[outside], shape_of_cells) > (0 if mesh else 2)
    pose, body = _pose(axis, middle), TriangleMesh.of(thing)
    if body is not None:
        found = of_mesh(thing, body, surface, pose)
        if found.unexplained > WORTH_A_WARNING_OF_MESH or found.coverage < LEAST_COVERAGE:
            warnings.warn(
                f"{found.unexplained:.0%} of the object's visible area is not explained by the "
                f"fitted surface, and {found.phantom:.0%} of the surface has no object near it; "
                "grasps are true all the same, but have no contact coordinates off the surface",
                stacklevel=stacklevel,
            )
    else:
        empty = _is_empty(thing, _cells(surface, pose, shape_of_cells)[0])
        found = of_cloud(thing, surface, pose, seen, good, seen & (~good | sticking), empty)
        if found.unexplained > MOST_UNEXPLAINED:
            raise GraspModuliError(
                "object must be close to a surface in cylindrical coordinates about some axis, "
                f"got one whose outer wall is not for {found.unexplained:.0%}; a mesh of it could "
                "be grasped all the same"
            )
        if found.unexplained > WORTH_A_WARNING:
            warnings.warn(
                f"{found.unexplained:.1%} of the object's outer wall is not explained by the "
                "fitted surface; no grasp is offered there",
                stacklevel=stacklevel,
            )
    # A wall that leans more than the surface, such as a lid's rim, is not what a finger meets.
    crooked = np.abs(np.abs(normals[:, 2]) - hits.tilt) > 0.5
    bad = sticking | (seen & ~good)
    if mesh:
        bad |= _hit(hits.cell[explained & crooked], shape_of_cells) > 0
    # A fingertip's width away from it.
    allowed = ~dilated(bad, 4 if mesh else 2)
    sure = None
    if mesh:
        # Where no ray hits a mesh there is nothing to touch.
        allowed &= seen
    else:
        points, ways = _cells(surface, pose, shape_of_cells)
        allowed &= ~_closed(thing, points, ways)
        if thing.views:
            sure = meet(thing.views, points, ways, thing.size)
    rim = max(1, round(0.03 * grid.rows))
    allowed[:rim] = allowed[-rim:] = False
    return Fit(
        surface=surface,
        pose=pose,
        residual=found.residual,
        coverage=found.coverage,
        unexplained=found.unexplained,
        phantom=found.phantom,
        allowed=allowed,
        mesh=body,
        scanned=None if mesh else Scanned(thing.points, thing.size, sure),
    )


def _hit(cell: NDArray[np.int64], shape: tuple[int, int]) -> NDArray[np.int64]:
    """How many of the hits are in each cell."""
    return np.bincount(cell, minlength=shape[0] * shape[1]).reshape(shape)


def _cells(surface: Surface, pose: Floats, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    """Points and normals of the surface, in the object's coordinates, in the middles of cells."""
    rows, columns = shape
    u, theta = np.meshgrid(
        (np.arange(rows) + 0.5) / rows,
        (np.arange(columns) + 0.5) * 2 * np.pi / columns,
        indexing="ij",
    )
    turn = pose[:3, :3].T
    return surface.points(u, theta) @ turn + pose[:3, 3], surface.normals(u, theta) @ turn


def _is_empty(thing: Object, points: Floats) -> Booleans:
    """Where a camera saw nothing, or the object cannot reach."""
    away = points - thing.points.mean(axis=0)
    beyond = np.sqrt((away * away).sum(axis=-1)) > FARTHEST * thing.size
    return is_free(thing.views, points, thing.size) | beyond


def _closed(thing: Object, points: Floats, ways: Floats) -> Booleans:
    """Where there is nothing, or the table is in the way."""
    closed = _is_empty(thing, points)
    if thing.table is not None:
        # Neither the tip nor a finger as long as the object may reach into it; what lies flat is
        # held by less of a tip.
        finger = thing.table.height(points - thing.size * ways)
        margin = min(TIP * thing.size, LOW * float(thing.table.height(thing.points).max()))
        closed |= np.minimum(thing.table.height(points), finger) < margin
    return closed


def _pose(axis: Axis, middle: float) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = axis.rotation
    pose[:3, 3] = axis.origin + axis.rotation[:, 2] * middle
    return locked(pose)
