"""Objects in parts that lie in M^cyl (Sec. III of the paper): walls are peeled off a mesh."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, a_callback, finite, locked, vectors
from .._core import GraspModuliError
from .._values import Value
from .agreement import distances, phantom_area, residual_of, visible
from .axes import candidate_axes, refined, same_axis, score
from .fits import Fit
from .fitting import fit_about, fit_object
from .likeness import cells
from .reading import Object, mesh_samples, read, size_of
from .scans import parts_of
from .touching import TriangleMesh
from .walls import CLOSE, Axis, Booleans

#: Samples of the mesh of which parts are made, and of a piece by which its axis is sought.
SAMPLES, OF_A_PIECE = 12_000, 1_500
#: No more parts are sought once this share of the visible area is explained, or with so many parts.
ENOUGH, MOST_PARTS = 0.95, 12
#: A part explains at least this share of the visible area that no other does.
LEAST = 0.005
#: Smaller pieces than this share of the visible area are taken together with all others.
SMALL = 0.05
#: A surface for all that is left must explain so many times what one for the largest piece does.
TOGETHER = 1.8
#: Places of a cell, each way, that all are to be near a part's points.
IN_A_CELL = 3
#: Fewest points of a piece, and its least height along an axis, over its size.
FEWEST, FLAT = 50, 1e-3


@dataclass(frozen=True, eq=False)
class Parts(Value):
    """An object as parts, each of which is a surface with cylindrical coordinates."""

    #: One fit for each, that of the whole first. Its grasps are of the whole object's mesh, about
    #: its centre of mass, with contacts on the part.
    parts: tuple[Fit, ...]
    #: Share of the object's visible area that is farther than 2 % of its size from every part.
    unexplained: float
    #: Points of the visible surface, spread evenly over its area. Shape (n, 3).
    points: Floats = field(repr=False)
    #: Unit normals there, of either sign. Shape (n, 3).
    normals: Floats = field(repr=False)
    #: The part that each point belongs to, -1 if it is unexplained. Shape (n,).
    part: NDArray[np.int64] = field(repr=False)

    def __len__(self) -> int:
        return len(self.parts)

    @property
    def shares(self) -> Floats:
        """Shares of the visible area that belong to each part. Shape (len(parts),)."""
        known = self.part[self.part >= 0]
        return np.bincount(known, minlength=len(self.parts)) / len(self.part)

    def part_of(self, points: Any) -> NDArray[np.int64]:
        """The part of the surface that is within 2 % of the size of each point, -1 of none.

        Parameters
        ----------
        points
            In the object's coordinates. Shape (..., 3); the result has shape (...).
        """
        from scipy.spatial import KDTree

        given = vectors("points", points, "(..., 3)")
        away, nearest = KDTree(self.points).query(finite("points", given))
        near: Any = away <= CLOSE * self.parts[0].residual.size
        return np.where(near, self.part[nearest], -1)


def fit_parts(
    mesh_or_path: Any,
    *,
    object_number: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Parts:
    """A mesh as parts, until 95 % of what is visible of it is explained.

    The first part is the outer wall of the whole (:func:`graspmoduli.fit`). What it does not
    explain is left: of its largest connected piece, or of all pieces together if that explains
    much more, the axis is sought about which a surface explains most of it; and so on.

    Parameters
    ----------
    mesh_or_path
        As for :func:`graspmoduli.fit`, with faces.
    object_number
        Which of several objects, counted from 1 by size.
    progress
        Called as ``progress(done, total)`` after each part, in percent of what is to be explained.

    Returns
    -------
    Parts
        ``fit.transfer_to`` carries the grasp of a part to a part of another object.

    Raises
    ------
    GraspModuliError
        If the object cannot be read, has no faces, or no outer wall.
    """
    a_callback("progress", progress)
    thing = read(mesh_or_path, None, object_number)
    body = TriangleMesh.of(thing)
    if body is None or thing.faces is None:
        raise GraspModuliError("mesh_or_path must have faces, got points only")
    points, normals = mesh_samples(thing.points, thing.faces, SAMPLES)
    seen = visible(dataclasses.replace(thing, samples=points, sample_normals=normals), body)
    points, normals = np.ascontiguousarray(points[seen]), np.ascontiguousarray(normals[seen])
    if len(points) < FEWEST:
        raise GraspModuliError("mesh_or_path must have a surface that is visible from outside")
    with warnings.catch_warnings():
        # That one wall does not explain all is why there are parts.
        warnings.simplefilter("ignore", UserWarning)
        first = fit_object(thing)
        left = distances(points, first.surface, first.pose) > CLOSE * thing.size
        if left.mean() > 1.0 - LEAST:
            raise GraspModuliError(
                "mesh_or_path must have an outer wall that is close to a surface in cylindrical "
                "coordinates, got one that explains nothing"
            )
        parts = [_as_part(first, body, points, ~left)]
        owner = np.where(left, -1, 0)
        given_up = np.zeros(len(points), dtype=np.bool_)
        near = _spacing(points)
        while left.mean() > 1.0 - ENOUGH and len(parts) < MOST_PARTS:
            if progress is not None:
                progress(min(99, int(100.0 * (1.0 - left.mean()) / ENOUGH)), 100)
            rest = np.flatnonzero(left & ~given_up)
            if len(rest) < FEWEST:
                break
            pieces = np.full(len(points), -1, dtype=np.int64)
            pieces[rest] = _connected(points[rest], near)
            largest = int(np.bincount(pieces[rest]).argmax())
            found = _best(points, normals, pieces, largest, thing.size)
            if found is None:
                given_up[pieces == largest] = True
                continue
            one, own = found
            owner[own] = len(parts)
            parts.append(_as_part(one, body, points, own))
            left &= ~own
    if progress is not None:
        progress(100, 100)
    # What a part explains beside its own pieces, if no other has it.
    for number, one in enumerate(parts):
        away = distances(points, one.surface, one.pose)
        owner[(owner < 0) & (away <= CLOSE * thing.size)] = number
    return Parts(
        parts=tuple(parts),
        unexplained=float((owner < 0).mean()),
        points=locked(points),
        normals=locked(normals),
        part=owner,
    )


def _spacing(points: Floats) -> float:
    """A distance within which points have neighbours on the same surface."""
    from scipy.spatial import KDTree

    distances: Any = KDTree(points).query(points, k=7)[0]
    return 2.0 * float(np.median(distances[:, -1]))


def _connected(points: Floats, near: float) -> NDArray[np.int64]:
    """The number of the connected piece that each point belongs to."""
    from scipy.spatial import KDTree

    return parts_of(KDTree(points), near)


def _best(
    points: Floats, normals: Floats, pieces: NDArray[np.int64], largest: int, size: float
) -> tuple[Fit, Booleans] | None:
    """The surface that explains most of what is left, and which points are then its own.

    Of pieces of which it explains less than half it crosses a part that is another's.
    """
    left = pieces >= 0
    total = np.bincount(pieces[left])
    best: tuple[Fit, Booleans] | None = None
    most = LEAST
    for together in (False, True):
        chosen = np.flatnonzero(left if together else pieces == largest)
        if together and len(chosen) < 1.05 * total[largest]:
            break
        # Pieces that lie apart make sense together only if they are one surface.
        apart = together and best is not None and total[largest] > SMALL * len(points)
        bar = most * TOGETHER if apart else most
        for fit in _surfaces(points[chosen], normals[chosen]):
            explained = distances(points, fit.surface, fit.pose) <= CLOSE * size
            share = np.bincount(pieces[left], explained[left]) / total
            meant = share >= 0.5
            meant[largest] |= not together
            own = left & explained
            own[left] &= meant[pieces[left]]
            gain = float(own.mean())
            if gain > bar + 1e-3:
                best, most, bar = (fit, own), gain, gain
    return best


def _surfaces(points: Floats, normals: Floats) -> list[Fit]:
    """Surfaces about all axes that may be those of a piece."""
    if len(points) < FEWEST:
        return []
    some = np.linspace(0, len(points) - 1, min(len(points), OF_A_PIECE)).astype(np.int64)
    more = np.linspace(0, len(points) - 1, min(len(points), 2 * OF_A_PIECE)).astype(np.int64)
    size = size_of(points, points)
    if not size > 0.0:
        return []
    thing = Object(points[more], None, points[some], normals[some], size)
    axes, fits = [], []
    for candidate in candidate_axes(thing):
        if _is_flat(thing, candidate):
            continue
        for axis in (candidate, refined(thing, candidate)):
            if any(same_axis(thing, axis, other) for other in axes):
                continue
            axes.append(axis)
            if not np.isfinite(score(thing, axis)):
                continue
            try:
                fits.append(fit_about(thing, axis, 2))
            except GraspModuliError:
                # About this axis it is no surface.
                continue
    return fits


def _is_flat(thing: Object, axis: Axis) -> bool:
    """Has a piece no height along an axis?"""
    height = axis.local(thing.points)[:, 2]
    return bool(height.max() - height.min() < FLAT * thing.size)


def _as_part(fit: Fit, body: TriangleMesh, points: Floats, own: Booleans) -> Fit:
    """A fit of a piece as a part of the whole object, to which some of the points belong."""
    from scipy.spatial import KDTree

    phantom = phantom_area(body, fit.surface, fit.pose)
    # All over each cell: where the surface is steep one is longer than a part of it is near.
    rows, columns = fit.allowed.shape
    fine = np.ones((IN_A_CELL * rows, IN_A_CELL * columns), dtype=np.bool_)
    places, _ = cells(fit.surface, fit.pose, fine)
    away: Any = KDTree(points[own]).query(places)[0]
    near = away.reshape(rows, IN_A_CELL, columns, IN_A_CELL) <= 1.5 * CLOSE * body.size
    there = near.all(axis=(1, 3))
    return Fit(
        surface=fit.surface,
        pose=fit.pose,
        residual=residual_of(points[own], fit.surface, fit.pose, body.size),
        coverage=1.0 - phantom,
        unexplained=1.0 - float(own.mean()),
        phantom=phantom,
        allowed=there,
        part=True,
        mesh=body,
    )
