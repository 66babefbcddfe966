"""Rays, regression and axes, against slow and obvious twins."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from graspmoduli import _core
from graspmoduli.objects.axes import (
    _axis_of_revolution,
    _frame,
    candidate_axes,
    principal,
    refined,
    same_axis,
    score,
)
from graspmoduli.objects.reading import read
from graspmoduli.objects.walls import (
    FOR_SCANS,
    Axis,
    Grid,
    Hits,
    Shape,
    _cloud_hits,
    _design,
    _mesh_hits,
    _penalty,
    outer_wall,
    outermost,
    regress,
)


def turned(mesh, seed):
    """In a pose in which no ray meets an edge."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([1.0 + seed, 0.7, -0.4]).as_matrix()
    pose[:3, 3] = np.random.default_rng(seed).uniform(-0.1, 0.1, 3)
    return mesh.copy().apply_transform(pose)


def crossings(points, faces, grid):
    """Each ray with each triangle, by solving three equations: sorted (cell, radius)."""
    found = []
    for row in range(grid.rows):
        height = grid.low + (row + 0.5) * (grid.high - grid.low) / grid.rows
        for column in range(grid.columns):
            angle = (column + 0.5) * 2 * np.pi / grid.columns
            ray = np.array([np.cos(angle), np.sin(angle), 0.0])
            for a, b, c in points[faces]:
                # (0, 0, height) + r · ray = a + s (b − a) + t (c − a).
                system = np.stack([ray, a - b, a - c], axis=1)
                if abs(np.linalg.det(system)) < 1e-14:
                    continue
                r, s, t = np.linalg.solve(system, a - [0.0, 0.0, height])
                if r > 0.0 and s >= 0.0 and t >= 0.0 and s + t <= 1.0:
                    normal = np.cross(b - a, c - a)
                    tilt = abs(normal[2]) / np.linalg.norm(normal)
                    found.append((row * grid.columns + column, r, height, angle, tilt))
    return np.array(sorted(found))


MESHES = {
    "sphere": trimesh.creation.icosphere(subdivisions=1),
    "box": trimesh.creation.box((1.0, 0.6, 1.7)),
    "mug": trimesh.creation.annulus(0.8, 1.0, 1.5, sections=12),
    "torus": trimesh.creation.torus(1.0, 0.3, major_sections=12, minor_sections=6),
}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_rays_meet_a_mesh_where_each_ray_meets_each_triangle(name, seed):
    mesh = turned(MESHES[name], seed)
    points, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    grid = Grid(float(points[:, 2].min()), float(points[:, 2].max()), 7, 9)
    hits = _mesh_hits(points, faces, grid)
    wanted = crossings(points, faces, grid)
    assert len(wanted) > 30
    order = np.lexsort((hits.radius, hits.cell))
    np.testing.assert_array_equal(hits.cell[order], wanted[:, 0])
    for k, column in enumerate((hits.radius, hits.height, hits.angle, hits.tilt), start=1):
        np.testing.assert_allclose(column[order], wanted[:, k], atol=1e-12)


def test_rays_miss_what_is_degenerate():
    points = np.array([[1.0, 0, 0], [1, 0, 1], [1, 0, 0.5], [2, 0, 0], [2, 1, 0], [2, 0, 0.0]])
    faces = np.array([[0, 1, 2], [3, 4, 5], [0, 0, 0]])
    assert len(_mesh_hits(points, faces, Grid(0.0, 1.0, 5, 8)).cell) == 0


def test_points_of_a_cloud_are_their_own_hits():
    points = np.random.default_rng(0).normal(size=(500, 3))
    grid = Grid(-1.0, 1.5, 6, 10)
    hits = _cloud_hits(points, grid)
    wanted = []
    for x, y, z in points:
        if -1.0 <= z <= 1.5:
            angle = np.arctan2(y, x) % (2 * np.pi)
            row = min(int((z + 1.0) / 2.5 * 6), 5)
            wanted.append((z, angle, np.hypot(x, y), row * 10 + int(angle / (2 * np.pi) * 10)))
    assert 300 < len(wanted) < 500
    for got, column in zip(hits, np.array(wanted).T, strict=False):
        np.testing.assert_allclose(got, column, atol=1e-14)


def random_hits(rng, count, grid):
    cell = rng.integers(0, grid.rows * grid.columns, count)
    radius = rng.uniform(0.5, 1.5, count)
    height = (cell // grid.columns + 0.5) / grid.rows
    angle = (cell % grid.columns + 0.5) * 2 * np.pi / grid.columns
    return Hits(height, angle, radius, cell, np.zeros(count))


def test_the_outer_wall_is_chosen_cell_by_cell():
    rng, grid = np.random.default_rng(1), Grid(0.0, 1.0, 5, 6)
    hits = random_hits(rng, 200, grid)
    error = rng.normal(size=200)
    close = 0.4
    wanted, outer = np.zeros(200, bool), np.zeros(200, bool)
    for cell in range(30):
        own = np.flatnonzero(hits.cell == cell)
        if not len(own):
            continue
        near = [i for i in own if abs(error[i]) <= close]
        near = near or [min(own, key=lambda i: abs(error[i]))]
        wall = max(hits.radius[i] for i in near)
        wanted[own] = [abs(hits.radius[i] - wall) <= 0.5 * close for i in own]
        most = max(hits.radius[own])
        outer[own] = [hits.radius[i] >= most - 0.03 * hits.radius.max() for i in own]
    np.testing.assert_array_equal(outer_wall(hits, grid, error, close), wanted)
    np.testing.assert_array_equal(outermost(hits, grid), outer)


def dense(band, columns):
    """The symmetric matrix of a lower band."""
    count, stride = band.shape
    full = np.zeros((count, count))
    for i in range(count):
        for k in range(max(0, stride - 1 - i), stride):
            full[i, i - stride + 1 + k] = full[i - stride + 1 + k, i] = band[i, k]
    return full


@pytest.mark.parametrize(("intervals", "columns"), [(1, 4), (3, 5), (10, 8)])
def test_the_penalty_is_that_of_its_differences(intervals, columns):
    full = dense(_penalty(intervals, columns, FOR_SCANS), columns)
    c = np.random.default_rng(2).normal(size=(intervals + 3, columns))
    ring = np.hstack([c, c[:, :2]])
    wanted = (
        FOR_SCANS.bending * (np.diff(c, 2, axis=0) ** 2).sum()
        + FOR_SCANS.bending * (np.diff(ring, 2, axis=1) ** 2).sum()
        + FOR_SCANS.symmetry * (np.diff(ring[:, :-1], axis=1) ** 2).sum()
        + 1e-9 * (c**2).sum()
    )
    assert c.ravel() @ full @ c.ravel() == pytest.approx(wanted, rel=1e-12)


def test_the_regression_is_least_squares():
    intervals, columns, rng = 6, 7, np.random.default_rng(3)
    u, theta = rng.random(400), rng.uniform(0, 2 * np.pi, 400)
    radius = 1.0 + 0.2 * np.sin(theta) * u
    design = _design(u, theta, intervals, columns)
    full = np.zeros((400, (intervals + 3) * columns))
    full[np.arange(400)[:, None], design.cells] = design.values
    weights = np.maximum(rng.random(400) - 0.2, 0.0)
    band, right = _core.normal_equations(full.shape[1], 4 * columns, *design, weights, radius)
    np.testing.assert_allclose(dense(band, columns), full.T @ (weights[:, None] * full), atol=1e-13)
    np.testing.assert_allclose(right, full.T @ (weights * radius), atol=1e-13)
    band += _penalty(intervals, columns, FOR_SCANS)
    found = _core.solve_banded(band, right)
    np.testing.assert_allclose(found, np.linalg.solve(dense(band, columns), right), rtol=1e-9)
    # And the design is the surface: the values of the spline with these coefficients.
    shape = Shape(found.reshape(intervals + 3, columns))
    hits = Hits(u, theta, radius, np.zeros(400, np.int64), np.zeros(400))
    np.testing.assert_allclose(full @ found, shape.at(hits, Grid(0.0, 1.0, 1, 1)), atol=1e-13)


def test_a_handle_leaves_the_wall_where_it_is():
    rng, grid = np.random.default_rng(4), Grid(0.0, 1.0, 24, 32)
    hits = random_hits(rng, 6000, grid)
    handle = (np.abs(hits.height - 0.5) < 0.2) & (np.abs(hits.angle - 3.0) < 0.3)
    hits = hits._replace(radius=np.where(handle & (hits.radius > 1.0), 1.5, 1.0))
    thing = read(trimesh.creation.cylinder(1.0, 2.0))
    shape, wall = regress(thing, hits, grid, 10, 8)
    np.testing.assert_allclose(shape.ring_radii(), 1.0, atol=0.01)
    assert (hits.radius[wall] < 1.2).mean() > 0.99


@pytest.mark.parametrize("seed", range(20))
def test_principal_axes_are_lapacks(seed):
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-3, 3)
    matrix = half @ half.T
    values, vectors = principal(matrix)
    np.testing.assert_allclose(values, np.linalg.eigvalsh(matrix), atol=1e-14 * np.trace(matrix))
    np.testing.assert_allclose(vectors @ np.diag(values) @ vectors.T, matrix, rtol=1e-9)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(3), atol=1e-14)


def test_principal_axes_of_a_cube_are_the_coordinates():
    noise = np.random.default_rng(0).normal(size=(3, 3)) * 1e-13
    for matrix in (np.eye(3), np.eye(3) + noise + noise.T, np.zeros((3, 3))):
        np.testing.assert_array_equal(principal(matrix)[1], np.eye(3))


def test_a_last_bit_does_not_turn_a_frame():
    for direction in ([1.0, 1, 0], [0, -1, 1], [1, -1, 1], [-1, -1, -1], [1, 0, 0], [3, 4, 4]):
        exact = _frame(np.array(direction))
        assert np.linalg.det(exact) == pytest.approx(1.0)
        for seed in range(20):
            noise = 1e-14 * np.random.default_rng(seed).normal(size=3)
            np.testing.assert_allclose(_frame(direction + noise), exact, atol=1e-12)
            np.testing.assert_allclose(_frame(-(direction + noise)), exact, atol=1e-12)


def angle_between(axis, direction):
    return np.degrees(np.arccos(min(1.0, abs(axis.rotation[:, 2] @ direction))))


@pytest.mark.parametrize("seed", range(4))
def test_the_axis_of_revolution_is_found(seed):
    cone = trimesh.creation.cone(1.0, 2.0, sections=64)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([1.0 + seed, 0.7, -0.4]).as_matrix()
    pose[:3, 3] = [3.0, -2.0, 1.0]
    thing = read(cone.apply_transform(pose))
    axis = _axis_of_revolution(thing)
    assert axis is not None
    assert angle_between(axis, pose[:3, 2]) < 0.5
    off = axis.local(pose[None, :3, 3])[0, :2]
    assert np.linalg.norm(off) < 0.01 * thing.size
    assert any(same_axis(thing, axis, other) for other in candidate_axes(thing))
    # About it the wall is nearer to one of revolution than about any coordinate axis.
    others = [Axis(_frame(d), thing.samples.mean(axis=0)) for d in np.eye(3)]
    assert score(thing, axis) < min(score(thing, other) for other in others)


def test_a_wrong_axis_is_brought_to_the_right_one():
    thing = read(trimesh.creation.cylinder(1.0, 3.0, sections=64))
    tilt = Rotation.from_euler("xy", [6.0, -4.0], degrees=True).as_matrix()
    start = Axis(_frame(tilt[:, 2]), np.array([0.1, -0.15, 0.0]))
    right = Axis(np.eye(3), np.zeros(3))
    assert not same_axis(thing, start, right)
    found = refined(thing, start)
    assert angle_between(found, np.array([0.0, 0, 1])) < 0.3
    assert np.linalg.norm(found.local(np.zeros((1, 3)))[0, :2]) < 0.01
    # A parameter along the axis is no difference, 1 % across it is.
    assert same_axis(thing, right, Axis(right.rotation, np.array([0.0, 0.0, 2.0])))
    assert not same_axis(thing, right, Axis(right.rotation, np.array([0.03, 0.0, 0.0])))
