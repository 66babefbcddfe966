"""The axis about which an object is closest to a surface with cylindrical coordinates.

The paper's "most dominant axis", made robust: candidates are refined and judged by how well the
outer wall about each is such a surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats
from .reading import Object
from .walls import CLOSE, Axis, coarse_hits, outermost, regress


def same_axis(thing: Object, one: Axis, other: Axis) -> bool:
    """Do two axes differ by less than 0.3 degrees and 0.3 % of the object's size?"""
    between = one.local(other.origin)
    turned = abs(one.rotation[:, 2] @ other.rotation[:, 2])
    apart = float(np.hypot(between[0], between[1]))
    return bool(turned > 1.0 - 1.4e-5) and apart < 3e-3 * thing.size


def candidate_axes(thing: Object) -> list[Axis]:
    """The coordinate axes, the principal axes, and the axis of revolution."""
    centered = thing.samples - thing.samples.mean(axis=0)
    directions = [*np.eye(3), *np.linalg.svd(centered, full_matrices=False)[2]]
    axes: list[Axis] = []
    for direction in directions:
        if any(abs(direction @ axis.rotation[:, 2]) > 0.9998 for axis in axes):
            continue
        rotation = _frame(direction)
        planar = thing.samples @ rotation[:, :2]
        low, high = np.percentile(planar, [1.0, 99.0], axis=0)
        axes.append(Axis(rotation, rotation[:, :2] @ ((low + high) / 2)))
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
        nn, nm = weighted.T @ thing.sample_normals, weighted.T @ moments
        mm = (moments * weights[:, None]).T @ moments
        # Eliminating the moment leaves a 3 × 3 problem for the direction.
        inverse = np.linalg.pinv(nn, rcond=1e-6)
        values, vectors = np.linalg.eigh(mm - nm.T @ inverse @ nm)
        if not np.isfinite(values).all():
            return None
        direction = vectors[:, 0]
        moment = -inverse @ nm @ direction
        error = np.abs(thing.sample_normals @ moment + moments @ direction)
        scale = max(1.5 * float(np.median(error)), 1e-6)
        weights = 1.0 / (1.0 + (error / scale) ** 2)
    foot = np.cross(direction, moment)
    if np.linalg.norm(foot) > 1.0:
        # The axis misses the object.
        return None
    return Axis(_frame(direction), middle + thing.size * foot)


def _frame(direction: Floats) -> Floats:
    """A rotation whose third column is the direction, in the sense that points up or forward."""
    axis = direction / np.linalg.norm(direction)
    largest = int(np.argmax(np.abs(axis)))
    axis = axis * np.sign(axis[largest])
    side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    side /= np.linalg.norm(side)
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
        directions = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        lever = (height - (grid.low + grid.high) / 2) / thing.size
        columns = np.concatenate([directions, directions * lever[:, None]], axis=1)
        step = np.zeros(4)
        weights = np.ones(len(radius))
        for _ in range(5):
            design = np.stack([_centred(column, row, weights) for column in columns.T], axis=1)
            target = _centred(radius, row, weights)
            root = np.sqrt(weights)[:, None]
            # A little damping: a short arc says little about the shift across it.
            stacked = np.concatenate([design * root, 1e-3 * len(radius) ** 0.5 * np.eye(4)])
            right = np.concatenate([target * root[:, 0], np.zeros(4)])
            step = np.linalg.lstsq(stacked, right, rcond=None)[0]
            error = np.abs(target - design @ step)
            scale = max(3.0 * float(np.median(error)), 1e-4 * thing.size)
            weights = 1.0 / (1.0 + (error / scale) ** 2)
        limit = 0.2 * thing.size
        shift = np.clip(step[:2], -limit, limit)
        tilt = np.clip(step[2:] / thing.size, -0.3, 0.3)
        middle = axis.origin + axis.rotation[:, 2] * (grid.low + grid.high) / 2
        direction = axis.rotation @ np.array([*tilt, 1.0])
        axis = Axis(_frame(direction), middle + axis.rotation[:, :2] @ shift)
        if np.abs(shift).max() < 1e-4 * thing.size and np.abs(tilt).max() < 1e-4:
            break
    return axis


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
    depth = shape.at_points(local, grid) - np.hypot(local[:, 0], local[:, 1])
    missed = float((depth < -CLOSE * thing.size).mean())
    # A scan from one side sees half of the cells about the true axis, fewer about many others.
    unseen = max(0.0, 0.6 - seen)
    return misfit + oval + 0.1 * pinched + 2.0 * missed + 0.4 * unseen
