"""The axis about which an object is closest to a surface with cylindrical coordinates.

The paper's "most dominant axis", made robust: candidates are refined and judged by how well the
outer wall about each is such a surface.

As in :mod:`.walls`, nothing here calls BLAS or LAPACK, and where numbers tie a fixed order decides,
not their last bits.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._core import cos, sin, solve_banded
from ..surfaces import Surface
from .reading import Object
from .views import hidden, is_free
from .walls import CLOSE, Axis, Grid, Shape, coarse_hits, outermost, regress

#: Weights of the share of a surface that is where a camera saw nothing to be, and of the share of
#: what faces a camera that lies behind what it saw.
INTO_VOID, HIDDEN = 4.0, 1.0
#: Farther than this from the middle of what was seen, over the size, there is nothing either.
FARTHEST = 0.75
#: Numbers of order 1 this close are equal but for rounding.
TIE = 1e-9


def same_axis(thing: Object, one: Axis, other: Axis) -> bool:
    """Do two axes differ by less than 0.3 degrees and 0.3 % of the object's size?"""
    between = one.local(other.origin[None])[0]
    turned = abs((one.rotation[:, 2] * other.rotation[:, 2]).sum())
    apart = sqrt(between[0] ** 2 + between[1] ** 2)
    return bool(turned > 1.0 - 1.4e-5) and apart < 3e-3 * thing.size


def candidate_axes(thing: Object) -> list[Axis]:
    """The coordinate axes, the principal axes, and the axis of revolution."""
    centered = thing.samples - thing.samples.mean(axis=0)
    directions = [*np.eye(3), *principal(_products(centered, centered))[1].T[::-1]]
    axes: list[Axis] = []
    for direction in directions:
        if any(abs((direction * axis.rotation[:, 2]).sum()) > 0.9998 for axis in axes):
            continue
        rotation = _frame(direction)
        planar = Axis(rotation, np.zeros(3)).local(thing.samples)[:, :2]
        low, high = np.percentile(planar, [1.0, 99.0], axis=0)
        axes.append(Axis(rotation, _along(rotation[:, :2], (low + high) / 2)))
    revolution = _axis_of_revolution(thing)
    if revolution is not None:
        axes.append(revolution)
    return axes


def _axis_of_revolution(thing: Object) -> Axis | None:
    """The line that the surface's normals come closest to meeting.

    A line with direction n through p has moment p × n; it meets the line (d, m) exactly when
    n·m + (p × n)·d = 0 (H. Pottmann, J. Wallner, Computational Line Geometry, 2001). Least
    squares with weights that leave aside what is not of revolution.
    """
    middle = thing.samples.mean(axis=0)
    points = (thing.samples - middle) / thing.size
    moments = np.cross(points, thing.sample_normals)
    weights = np.ones(len(points))
    direction = moment = np.zeros(3)
    for _ in range(15):
        weighted = thing.sample_normals * weights[:, None]
        nn, nm = _products(weighted, thing.sample_normals), _products(weighted, moments)
        mm = _products(moments * weights[:, None], moments)
        if not (np.isfinite(nn).all() and np.isfinite(nm).all() and np.isfinite(mm).all()):
            return None
        # Eliminating the moment leaves a 3 × 3 problem for the direction.
        values, vectors = principal(nn)
        kept = values > 1e-6 * values[2]
        inverse = _products(
            (vectors * np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)).T, vectors.T
        )
        solved = _products(inverse, nm)
        direction = principal(mm - _products(nm, solved))[1][:, 0]
        moment = -_along(solved, direction)
        error = np.abs(_along(thing.sample_normals, moment) + _along(moments, direction))
        scale = max(1.5 * float(np.median(error)), 1e-6)
        weights = 1.0 / (1.0 + (error / scale) ** 2)
    foot = np.cross(direction, moment)
    if (foot * foot).sum() > 1.0:
        # The axis misses the object.
        return None
    return Axis(_frame(direction), middle + thing.size * foot)


def _frame(direction: Floats) -> Floats:
    """A rotation whose third column is the direction, in the sense that points up or forward."""
    axis = direction / np.sqrt((direction * direction).sum())
    # The first among equals, rounding aside.
    sizes = np.abs(axis)
    axis = axis * np.sign(axis[int(np.argmax(sizes > sizes.max() - TIE))])
    side = np.cross(axis, np.eye(3)[int(np.argmax(sizes < sizes.min() + TIE))])
    side /= np.sqrt((side * side).sum())
    return np.stack([side, np.cross(axis, side), axis], axis=1)


def refined(thing: Object, axis: Axis) -> Axis:
    """Shifted and tilted so that the first harmonic of the radius vanishes at all heights.

    A shift s and tilt t of the axis change the radius by ⟨s + t h, e(θ)⟩ to first order.
    """
    for _ in range(6):
        hits, grid = coarse_hits(thing, axis)
        wall = outermost(hits, grid)
        height, angle, radius = hits.height[wall], hits.angle[wall], hits.radius[wall]
        row = grid.row(height)
        directions = np.stack([cos(angle), sin(angle)], axis=1)
        lever = (height - (grid.low + grid.high) / 2) / thing.size
        columns = np.concatenate([directions, directions * lever[:, None]], axis=1)
        step = np.zeros(4)
        weights = np.ones(len(radius))
        for _ in range(5):
            design = np.stack([_centred(column, row, weights) for column in columns.T], axis=1)
            target = _centred(radius, row, weights)
            weighted = design * weights[:, None]
            # A little damping: a short arc says little about the shift across it.
            normal = _products(weighted, design) + 1e-6 * len(radius) * np.eye(4)
            band = np.stack([np.roll(row, 3 - i) for i, row in enumerate(normal)])
            step = solve_banded(band, _products(weighted, target[:, None])[:, 0])
            error = np.abs(target - _along(design, step))
            scale = max(3.0 * float(np.median(error)), 1e-4 * thing.size)
            weights = 1.0 / (1.0 + (error / scale) ** 2)
        limit = 0.2 * thing.size
        shift = np.clip(step[:2], -limit, limit)
        tilt = np.clip(step[2:] / thing.size, -0.3, 0.3)
        middle = axis.origin + axis.rotation[:, 2] * (grid.low + grid.high) / 2
        direction = _along(axis.rotation, np.array([*tilt, 1.0]))
        axis = Axis(_frame(direction), middle + _along(axis.rotation[:, :2], shift))
        if np.abs(shift).max() < 1e-4 * thing.size and np.abs(tilt).max() < 1e-4:
            break
    return axis


def _along(rows: Floats, vector: Floats) -> Floats:
    """Σ_k rows[:, k] · vector[k]."""
    total = rows[:, 0] * vector[0]
    for k in range(1, len(vector)):
        total = total + rows[:, k] * vector[k]
    return total


def _products(one: Floats, other: Floats) -> Floats:
    """Σ_i one[i, :] ⊗ other[i, :]."""
    return (one[:, :, None] * other[:, None, :]).sum(axis=0)


def principal(matrix: Floats) -> tuple[Floats, Floats]:
    """Ascending eigenvalues and, as columns, eigenvectors of a symmetric 3 × 3 matrix.

    By Jacobi's rotations from the coordinate axes: where eigenvalues are equal but for rounding,
    as those of a cube are, the vectors stay at these axes.
    """
    a, vectors = matrix.tolist(), np.eye(3)
    scale = float(np.abs(matrix).max())
    for _ in range(12):
        for i, k in ((0, 1), (0, 2), (1, 2)):
            if abs(a[i][k]) <= 1e-15 * scale:
                continue
            if abs(a[i][k]) <= TIE * scale and abs(a[i][i] - a[k][k]) <= TIE * scale:
                continue
            slope = (a[k][k] - a[i][i]) / (2.0 * a[i][k])
            tangent = (1.0 if slope >= 0.0 else -1.0) / (abs(slope) + sqrt(1.0 + slope * slope))
            cosine = 1.0 / sqrt(1.0 + tangent * tangent)
            sine = tangent * cosine
            for row in a:
                row[i], row[k] = cosine * row[i] - sine * row[k], sine * row[i] + cosine * row[k]
            a[i], a[k] = (
                [cosine * x - sine * y for x, y in zip(a[i], a[k], strict=True)],
                [sine * x + cosine * y for x, y in zip(a[i], a[k], strict=True)],
            )
            vectors[:, [i, k]] = np.stack(
                [
                    cosine * vectors[:, i] - sine * vectors[:, k],
                    sine * vectors[:, i] + cosine * vectors[:, k],
                ],
                axis=1,
            )
    values = np.array([a[j][j] for j in range(3)])
    # In the order of the axes among equals.
    order = sorted(range(3), key=lambda j: (round(values[j] / (TIE * scale or 1.0)), j))
    return values[order], vectors[:, order]


def _centred(values: Floats, row: NDArray[np.int64], weights: Floats) -> Floats:
    """Values less the weighted mean of their row: each height has a mean radius of its own."""
    total = np.maximum(np.bincount(row, weights), 1e-12)
    return values - (np.bincount(row, weights * values) / total)[row]


def score(thing: Object, axis: Axis) -> float:
    """How far the outer wall about an axis is from a surface close to one of revolution."""
    hits, grid = coarse_hits(thing, axis)
    seen = len(np.unique(hits.cell)) / (grid.rows * grid.columns)
    if len(hits.cell) < 30 or seen < 0.05:
        return np.inf
    shape, chosen = regress(thing, hits, grid, intervals=10, columns=12)
    error = np.abs(hits.radius[chosen] - shape.at(hits, grid)[chosen])
    misfit = float(np.minimum(error / (CLOSE * thing.size), 1.0).mean())
    rings = shape.ring_radii()
    mean = rings.mean(axis=1, keepdims=True)
    oval = float(np.abs(rings - mean).mean() / mean.mean())
    # Rings that shrink to points belong to an object that lies on its side.
    pinched = float((mean < 0.25 * mean.max()).mean())
    # What lies within the wall is hidden unless it closes the ends.
    local = axis.local(thing.samples)
    depth = shape.at_points(local, grid) - np.sqrt(local[:, 0] ** 2 + local[:, 1] ** 2)
    missed = float((depth < -CLOSE * thing.size).mean())
    # Where no ray hits a mesh there is nothing. A scan from one side sees half of the cells about
    # the true axis, fewer about many others.
    mesh = thing.faces is not None
    unseen = 2.5 * (1.0 - seen) if mesh else 0.4 * max(0.0, 0.6 - seen)
    doubt = _doubt(thing, axis, shape, grid)
    return misfit + oval + 0.1 * pinched + 2.0 * missed + unseen + doubt


def _doubt(thing: Object, axis: Axis, shape: Shape, grid: Grid) -> float:
    """How much of a surface is where cameras saw that there is nothing, or hides from them."""
    if thing.faces is not None:
        return 0.0
    u, theta = np.meshgrid((np.arange(24) + 0.5) / 24, np.arange(24) * np.pi / 12, indexing="ij")
    surface = Surface.from_coefficients(shape.coefficients, grid.low, grid.high)
    points = axis.origin + surface.points(u, theta) @ axis.rotation.T
    inward = surface.normals(u, theta) @ axis.rotation.T
    middle = (thing.samples.min(axis=0) + thing.samples.max(axis=0)) / 2
    away = np.sqrt(((points - middle) ** 2).sum(axis=-1))
    void = is_free(thing.views, points, thing.size) | (away > FARTHEST * thing.size)
    return INTO_VOID * float(void.mean()) + HIDDEN * hidden(thing.views, points, inward, thing.size)
