"""The outer wall of an object about an axis: rays from it, and regression in its coordinates.

The regression is that of penalised splines (P. Eilers, B. Marx, Flexible smoothing with B-splines
and penalties, 1996) with robust weights.

Nothing here calls BLAS or LAPACK: their threads starve on a busy machine, and their last bits
differ between processors, as do NumPy's sines; those of the core do neither.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, locked
from .._core import GraspModuliError, arctan2, cos, normal_equations, sin, solve_banded
from ..splines import clamped_knots
from ..surfaces import Surface
from .reading import Object, some_faces

#: A point this close to the fitted surface, relative to the object's size, is explained by it.
CLOSE = 0.02
#: Meshes with more triangles are represented by their samples while the axis is searched.
COARSE_FACES = 20_000

Booleans = NDArray[np.bool_]


class Smoothing(NamedTuple):
    """Weights of roughness, to that of a cell of the outer wall; see :func:`_penalty`."""

    bending: float
    symmetry: float


#: While it is not yet clear what the wall is.
STIFF = Smoothing(0.3, 0.02)
#: A mesh has no noise.
FOR_MESHES = Smoothing(5e-4, 0.02)
#: A scan has.
FOR_SCANS = Smoothing(3e-3, 0.1)


class Axis(NamedTuple):
    """A frame whose third column is the axis, and its origin."""

    rotation: Floats
    origin: Floats

    def local(self, points: Floats) -> Floats:
        """Points in this frame. Shape (n, 3)."""
        moved = points - self.origin
        x, y, z = (moved[:, k, None] * self.rotation[k] for k in range(3))
        return x + y + z


class Hits(NamedTuple):
    """Points where horizontal rays from the axis meet the object: height, angle, radius, cell.

    Cells are numbered row by row, rows over the height. ``tilt`` is the normal's component along
    the axis, in [0, 1].
    """

    height: Floats
    angle: Floats
    radius: Floats
    cell: NDArray[np.int64]
    tilt: Floats


class Grid(NamedTuple):
    """Cells over height and angle."""

    low: float
    high: float
    rows: int
    columns: int

    def row(self, height: Floats) -> NDArray[np.int64]:
        """Row of cells at each height."""
        share = (height - self.low) / (self.high - self.low)
        return np.clip((share * self.rows).astype(np.int64), 0, self.rows - 1)

    def column(self, angle: Floats) -> NDArray[np.int64]:
        """Column of cells at each angle in [0, 2π)."""
        return (angle / (2 * np.pi) * self.columns).astype(np.int64) % self.columns


# Rays ---------------------------------------------------------------------------------------


def coarse_hits(thing: Object, axis: Axis) -> tuple[Hits, Grid]:
    """Few rays; through the samples where following the mesh would take long."""
    exact = thing.faces is not None and len(thing.faces) <= COARSE_FACES
    return _hits(thing, axis, 24, 32, exact=exact)


def fine_hits(thing: Object, axis: Axis) -> tuple[Hits, Grid]:
    """As many rays as the final surface can use."""
    if thing.faces is None:
        return _hits(thing, axis, 40, 48, exact=False)
    return _hits(thing, axis, 96, 128, exact=True)


def _hits(thing: Object, axis: Axis, rows: int, columns: int, *, exact: bool) -> tuple[Hits, Grid]:
    if exact and thing.faces is not None:
        local = axis.local(thing.points)
        low, high = local[:, 2].min(), local[:, 2].max()
        grid = Grid(float(low), float(high), rows, columns)
        return _mesh_hits(local, thing.faces, grid), grid
    local = axis.local(thing.samples if rows < 40 else thing.points)
    # Outliers of a scan must not stretch the object.
    low, high = np.percentile(local[:, 2], [0.3, 99.7])
    grid = Grid(float(low), float(high), rows, columns)
    return _cloud_hits(local, grid), grid


def _mesh_hits(local: Floats, faces: NDArray[np.int64], grid: Grid) -> Hits:
    """All crossings of the mesh with rays through the middles of the cells."""
    step = (grid.high - grid.low) / grid.rows
    height = np.ascontiguousarray(local[:, 2])
    crossing, first, last = [], [], []
    for some in some_faces(faces):
        z = height[some]
        # Reductions over an axis of three are slow.
        lowest = np.minimum(np.minimum(z[:, 0], z[:, 1]), z[:, 2])
        highest = np.maximum(np.maximum(z[:, 0], z[:, 1]), z[:, 2])
        begin = np.maximum(np.ceil((lowest - grid.low) / step - 0.5).astype(np.int64), 0)
        end = np.floor((highest - grid.low) / step - 0.5).astype(np.int64)
        end = np.minimum(end, grid.rows - 1)
        # Of many small triangles few lie across the plane of a row.
        across = begin <= end
        crossing.append(some[across])
        first.append(begin[across])
        last.append(end[across])
    corners = local[np.concatenate(crossing)]
    first, last = np.concatenate(first), np.concatenate(last)
    triangle, offset = _ranges(last - first + 1)
    row = first[triangle] + offset
    height = grid.low + (row.astype(np.float64) + 0.5) * step
    # Where the plane at this height cuts the triangle's sides.
    tri = corners[triangle]
    above = tri[:, :, 2] >= height[:, None]
    one, two, three = above.T
    # The corner alone on its side of the plane.
    lone = np.where(one == two, 2, np.where(one == three, 1, 0))
    mixed: Booleans = (one != two) | (one != three)
    triangle, row, height = triangle[mixed], row[mixed], height[mixed]
    tri, lone = tri[mixed], lone[mixed]
    index = np.arange(len(tri))
    apex = tri[index, lone]
    ends = []
    for other in (1, 2):
        corner = tri[index, (lone + other) % 3]
        share = (height - apex[:, 2]) / (corner[:, 2] - apex[:, 2])
        ends.append(apex[:, :2] + share[:, None] * (corner[:, :2] - apex[:, :2]))
    start, end = ends
    # Rays between the segment's ends, the short way round.
    turn = 2 * np.pi / grid.columns
    from_angle = arctan2(start[:, 1], start[:, 0])
    cross = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    sweep = arctan2(cross, (start * end).sum(axis=1))
    low = np.minimum(from_angle, from_angle + sweep) / turn - 0.5
    high = np.maximum(from_angle, from_angle + sweep) / turn - 0.5
    first = np.ceil(low).astype(np.int64)
    segment, offset = _ranges(np.floor(high).astype(np.int64) - first + 1)
    column = first[segment] + offset
    angle = (column.astype(np.float64) + 0.5) * turn
    ray = np.stack([cos(angle), sin(angle)], axis=1)
    side = (end - start)[segment]
    below = ray[:, 0] * side[:, 1] - ray[:, 1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = cross[segment] / below
    good = np.isfinite(radius) & (radius > 0.0)
    segment, column = segment[good], column[good]
    angle, radius = angle[good], radius[good]
    triangle = triangle[segment]
    hit, which = np.unique(triangle, return_inverse=True)
    crossed = corners[hit]
    normal = np.cross(crossed[:, 1] - crossed[:, 0], crossed[:, 2] - crossed[:, 0])
    tilt = np.abs(normal[:, 2]) / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    return Hits(
        height[segment],
        angle % (2 * np.pi),
        radius,
        row[segment] * grid.columns + column % grid.columns,
        tilt[which],
    )


def _ranges(counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For counts (2, 0, 3): owners (0, 0, 2, 2, 2) and offsets (0, 1, 0, 1, 2)."""
    counts = np.maximum(counts, 0)
    owner = np.repeat(np.arange(len(counts)), counts)
    starts = np.cumsum(counts) - counts
    return owner, np.arange(counts.sum()) - starts[owner]


def _cloud_hits(local: Floats, grid: Grid) -> Hits:
    """The points themselves."""
    inside = (local[:, 2] >= grid.low) & (local[:, 2] <= grid.high)
    local = local[inside]
    angle = arctan2(local[:, 1], local[:, 0]) % (2 * np.pi)
    return Hits(
        local[:, 2],
        angle,
        np.sqrt(local[:, 0] ** 2 + local[:, 1] ** 2),
        grid.row(local[:, 2]) * grid.columns + grid.column(angle),
        np.zeros(len(local)),
    )


def outermost(hits: Hits, grid: Grid) -> Booleans:
    """The hits on the outer wall of their cell: within 3 % of the largest radius in it.

    Of a cloud that is the wall's thickness of noise; of a mesh usually one hit.
    """
    outer = np.zeros(grid.rows * grid.columns)
    np.maximum.at(outer, hits.cell, hits.radius)
    return hits.radius >= outer[hits.cell] - 0.03 * outer.max()


# Regression ---------------------------------------------------------------------------------


class Shape(NamedTuple):
    """Spline coefficients of the radius over a grid's heights."""

    coefficients: Floats

    def at(self, hits: Hits, grid: Grid) -> Floats:
        """Radius at the height and angle of each hit."""
        u = np.clip((hits.height - grid.low) / (grid.high - grid.low), 0.0, 1.0)
        return self._values(u, hits.angle)

    def at_points(self, local: Floats, grid: Grid) -> Floats:
        """Radius at the height and angle of points in the frame of the axis."""
        u = np.clip((local[:, 2] - grid.low) / (grid.high - grid.low), 0.0, 1.0)
        return self._values(u, arctan2(local[:, 1], local[:, 0]))

    def ring_radii(self) -> Floats:
        """Radii on a grid of 24 heights and 24 angles."""
        u, theta = np.meshgrid(
            (np.arange(24) + 0.5) / 24, np.arange(24) * np.pi / 12, indexing="ij"
        )
        return self._values(u.ravel(), theta.ravel()).reshape(24, 24)

    def _values(self, u: Floats, theta: Floats) -> Floats:
        return Surface.from_coefficients(self.coefficients, 0.0, 1.0).radius(u, theta)


def regress(
    thing: Object,
    hits: Hits,
    grid: Grid,
    intervals: int,
    columns: int,
    smoothing: Smoothing = FOR_MESHES,
    start: Shape | None = None,
) -> tuple[Shape, Booleans]:
    """Robust penalised regression of the outer wall, and the hits that it explains.

    Without a ``start`` the spline should be too coarse to follow what sticks out.

    In each round a cell's wall is the outermost of its hits close to the present surface, or the
    nearest if none is close: so the body wins over a handle in front of it, and the outer wall
    over the inner one.
    """
    u = np.clip((hits.height - grid.low) / (grid.high - grid.low), 0.0, 1.0)
    design = _design(u, hits.angle, intervals, columns)
    close = CLOSE * thing.size
    if start is None:
        chosen = outermost(hits, grid)
        widths = (16.0, 8.0, 4.0, 2.0, 1.5, 1.5)
    else:
        chosen = outer_wall(hits, grid, hits.radius - start.at(hits, grid), close)
        widths = (8.0, 4.0, 2.0, 1.5)
    weights = chosen.astype(np.float64)
    coefficients = np.empty(0)
    stiff, soft = (_penalty(intervals, columns, kind) for kind in (STIFF, smoothing))
    # From a wide to a narrow idea of what fits, in units of the tolerance.
    for round_, width in enumerate(widths):
        per_cell = np.bincount(hits.cell, weights, grid.rows * grid.columns)
        # Every cell counts the same, however many points it holds.
        balanced = weights / np.maximum(per_cell[hits.cell], 1.0)
        normal, right = normal_equations(
            (intervals + 3) * columns, 4 * columns, *design, balanced, hits.radius
        )
        normal += stiff if start is None and round_ < 2 else soft
        coefficients = solve_banded(normal, right)
        error = hits.radius - (design.values * coefficients[design.cells]).sum(axis=1)
        chosen = outer_wall(hits, grid, error, close)
        if round_ == 0 and start is None:
            # The first surface is a compromise with whatever sticks out: only shrink from it.
            width = max(width, float(np.percentile(np.abs(error[chosen]), 80)) / close)
        weights = np.where(chosen, np.maximum(1.0 - (error / (width * close)) ** 2, 0.0) ** 2, 0.0)
        if not weights.any():
            raise GraspModuliError(
                "object must have an outer wall about an axis, got none that is smooth"
            )
    least = 0.01 * float(np.abs(hits.radius).max())
    shape = Shape(np.maximum(coefficients, least).reshape(intervals + 3, columns))
    error = hits.radius - shape.at(hits, grid)
    return shape, outer_wall(hits, grid, error, close)


def outer_wall(hits: Hits, grid: Grid, error: Floats, close: float) -> Booleans:
    """Per cell, the outermost hits that are close to the surface, or else the nearest."""
    cells = grid.rows * grid.columns
    distance = np.abs(error)
    nearest = np.full(cells, np.inf)
    np.minimum.at(nearest, hits.cell, distance)
    near = distance <= np.maximum(nearest[hits.cell], close)
    wall = np.zeros(cells)
    np.maximum.at(wall, hits.cell[near], hits.radius[near])
    # Points of a cloud scatter about their wall.
    return np.abs(hits.radius - wall[hits.cell]) <= 0.5 * close


class _Design(NamedTuple):
    """The functions that do not vanish at each point, and their values there. Shapes (n, 16)."""

    cells: NDArray[np.uint32]
    values: Floats


def _design(u: Floats, theta: Floats, intervals: int, columns: int) -> _Design:
    """The basis functions of a spline surface at points."""
    from scipy.interpolate import BSpline

    in_u: Any = BSpline.design_matrix(u, clamped_knots(intervals), 3)
    uniform = np.arange(-3, columns + 4, dtype=np.float64)
    turns = np.clip(theta / (2 * np.pi) * columns, 0.0, np.nextafter(columns, 0.0))
    in_theta: Any = BSpline.design_matrix(turns, uniform, 3)
    count = len(u)
    rows = in_u.indices.reshape(count, 4)
    cells = rows[:, :, None] * columns + (in_theta.indices.reshape(count, 4) % columns)[:, None, :]
    values = in_u.data.reshape(count, 4)[:, :, None] * in_theta.data.reshape(count, 4)[:, None, :]
    return _Design(cells.reshape(count, 16).astype(np.uint32), values.reshape(count, 16))


def _lower_band(matrix: Any, columns: int) -> Floats:
    """A symmetric matrix as :func:`solve_banded` wants it. Shape (n, 4 · columns).

    Functions overlap with those of three rows on either side, and any column of them.
    """
    entries = matrix.tocoo()
    band = np.zeros((matrix.shape[0], 4 * columns))
    lower = entries.row >= entries.col
    row, col = entries.row[lower], entries.col[lower]
    band[row, col - row + 4 * columns - 1] = entries.data[lower]
    return band


@cache
def _penalty(intervals: int, columns: int, smoothing: Smoothing) -> Floats:
    """Roughness of the coefficients: second differences both ways, and first ones around.

    The lower band of its matrix.

    Small beside the data. Where there are none, the first differences around the axis outweigh the
    others and draw the unseen side to the seen one at the same height.
    """
    from scipy.sparse import csr_array, kron

    rows = intervals + 3
    second = csr_array(np.diff(np.eye(rows), 2, axis=0))
    ring = np.eye(columns)
    around = csr_array(np.roll(ring, -1, axis=0) - ring)
    bend = csr_array(np.roll(ring, -1, axis=0) - 2 * ring + np.roll(ring, 1, axis=0))
    along = kron(smoothing.bending * (second.T @ second), csr_array(ring))
    rings = smoothing.bending * (bend.T @ bend) + smoothing.symmetry * (around.T @ around)
    across = kron(csr_array(np.eye(rows)), rings)
    band = _lower_band(csr_array(along + across), columns)
    band[:, -1] += 1e-9
    return locked(band)
