"""Fitting real objects: meshes, one-sided noisy scans, what cannot be fitted."""

import itertools
import warnings

import numpy as np
import pytest
import trimesh

import graspmoduli as gm
import reference
from conftest import ROOT, objects, quick
from graspmoduli.objects import fitting
from graspmoduli.objects.axes import candidate_axes
from graspmoduli.objects.reading import read

BOTTLE = ROOT / "examples" / "objects" / "yogurt_bottle.ply"


def quiet_fit(source):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return gm.fit(source)


def scan(mesh, view, rng, noise):
    """What a depth camera far away in direction ``view`` sees: the nearest hit of each ray."""
    view = np.asarray(view, float) / np.linalg.norm(view)
    size = mesh.extents.max()
    right = np.cross(view, [0.3, 0.5, 0.8])
    right /= np.linalg.norm(right)
    up = np.cross(view, right)
    step = size / 70
    steps = np.arange(-80, 81) * step
    a, b = (grid.ravel() for grid in np.meshgrid(steps, steps))
    center = mesh.bounds.mean(axis=0)
    triangles = mesh.triangles - center
    flat = np.stack([triangles @ right, triangles @ up], axis=-1)
    best = np.full(len(a), -np.inf)
    # Rays are parallel: a triangle is hit where its projection covers the ray's.
    low, high = flat.min(axis=1), flat.max(axis=1)
    depth = triangles @ view
    for k in range(len(flat)):
        i0, i1 = np.searchsorted(steps, [low[k, 0], high[k, 0]])
        j0, j1 = np.searchsorted(steps, [low[k, 1], high[k, 1]])
        if i0 == i1 or j0 == j1:
            continue
        index = (np.arange(j0, j1)[:, None] * len(steps) + np.arange(i0, i1)).ravel()
        system = np.vstack([flat[k].T, np.ones(3)])
        if abs(np.linalg.det(system)) < 1e-14:
            continue
        weights = np.linalg.solve(system, np.vstack([a[index], b[index], np.ones(len(index))]))
        inside = (weights >= -1e-12).all(axis=0)
        hit = index[inside]
        best[hit] = np.maximum(best[hit], depth[k] @ weights[:, inside])
    seen = np.isfinite(best)
    points = center + a[seen, None] * right + b[seen, None] * up + best[seen, None] * view
    return points, points + noise * size * rng.normal(size=points.shape)


def distance_in_surface(fit, points):
    """Radial distance of points from the fitted surface."""
    local = (points - fit.pose[:3, 3]) @ fit.pose[:3, :3]
    surface = fit.surface
    u = (local[:, 2] - surface.bottom) / (surface.top - surface.bottom)
    inside = (u >= 0) & (u <= 1)
    local, u = local[inside], u[inside]
    angle = np.arctan2(local[:, 1], local[:, 0])
    normals = surface.normals(u, angle)
    slant = np.hypot(normals[:, 0], normals[:, 1])
    return np.abs(np.hypot(local[:, 0], local[:, 1]) - surface.radius(u, angle)) * slant


@pytest.mark.parametrize("path", quick(objects(), "coffee_mug", "vase"), ids=lambda path: path.stem)
def test_grasps_of_real_meshes_touch_the_mesh(path):
    mesh = trimesh.load_mesh(path)
    fit = quiet_fit(path)
    grasps = fit.synthesize()
    assert len(grasps) >= 3
    angles = []
    for grasp in grasps:
        _, distance, triangle = trimesh.proximity.closest_point(mesh, grasp.contacts)
        assert distance.max() < 1e-9 * fit.residual.size
        cosine = np.abs((mesh.face_normals[triangle] * grasp.normals).sum(axis=1))
        angles.extend(np.degrees(np.arccos(np.clip(cosine, 0, 1))))
        scale = grasp.length_scale
        scaled = grasp.contacts / scale, grasp.normals, grasp.center_of_mass / scale
        assert grasp.quality > 0.05
        assert grasp.quality == pytest.approx(reference.quality(*scaled), abs=1e-9)
    assert np.median(angles) < 15
    for one, other in itertools.combinations(grasps, 2):
        apart = min(
            np.linalg.norm(one.contacts - other.contacts[list(order)], axis=1).max()
            for order in itertools.permutations(range(3))
        )
        assert apart > 0.1 * fit.length_scale


@pytest.mark.parametrize("view", [(0, 0, 1), (1, 0.4, 0.3), (0.3, 0.5, -0.8)])
def test_a_noisy_scan_from_one_side(view):
    rng = np.random.default_rng(0)
    mesh = trimesh.load_mesh(BOTTLE)
    exact, points = scan(mesh, view, rng, noise=0.005)
    fit = quiet_fit(points)
    # Lids and undercuts at the ends are not part of the wall.
    error = distance_in_surface(fit, exact) / mesh.extents.max()
    assert np.percentile(error, 95) < 0.03
    assert np.median(error) < 0.01
    assert 0.35 < fit.coverage < 0.75
    grasps = fit.synthesize()
    assert grasps
    for grasp in grasps:
        scale = grasp.length_scale
        twin = reference.quality(
            grasp.contacts / scale, grasp.normals, grasp.center_of_mass / scale
        )
        assert grasp.quality > 0
        assert grasp.quality == pytest.approx(twin, abs=1e-9)


@pytest.mark.parametrize("scale", quick([1e-3, 1.0, 1e3], 1e-3))
def test_unit_and_pose_do_not_matter(scale):
    mesh = trimesh.load_mesh(BOTTLE)
    pose = trimesh.transformations.rotation_matrix(2.0, [1, 2, 3])
    pose[:3, 3] = [10, -20, 5]
    plain = gm.fit(mesh)
    mesh.apply_transform(pose)
    mesh.apply_scale(scale)
    moved = gm.fit(mesh)
    axis = np.asarray(pose)[:3, :3] @ plain.pose[:3, 2]
    assert abs(axis @ moved.pose[:3, 2]) > np.cos(np.radians(0.5))
    assert moved.residual.rms == pytest.approx(scale * plain.residual.rms, rel=0.5)
    best = moved.synthesize()[0]
    _, distance, _ = trimesh.proximity.closest_point(mesh, best.contacts)
    assert distance.max() < 0.01 * scale * plain.residual.size


def test_the_handle_of_a_mug_is_not_explained():
    body = trimesh.creation.annulus(0.9, 1.0, 2.2, sections=64)
    handle = trimesh.creation.torus(0.6, 0.12)
    handle.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    handle.apply_translation([1.05, 0, 0])
    mug = trimesh.util.concatenate([body, handle])
    with pytest.warns(UserWarning, match="not explained"):
        fit = gm.fit(mug)
    assert abs(fit.pose[2, 2]) > 0.999
    assert 0.01 < fit.unexplained < 0.2
    radius = fit.surface.radius(*np.meshgrid(np.linspace(0.1, 0.9, 9), np.linspace(0, 6, 20)))
    np.testing.assert_allclose(radius, 1.0, atol=0.03)
    # Grasps that touch the handle have no coordinates there.
    for grasp in fit.synthesize(top=10):
        _, distance, _ = trimesh.proximity.closest_point(handle, grasp.contacts)
        assert grasp.coordinates is not None
        assert np.isnan(grasp.coordinates[distance < 1e-6]).all()


def test_the_outer_wall_is_taken_where_there_are_two():
    cup = trimesh.creation.annulus(0.95, 1.0, 3.0, sections=96)
    fit = gm.fit(cup)
    assert abs(fit.surface.radius(0.5, 1.0) - 1.0) < 0.005


@pytest.mark.long
def test_all_kinds_of_sources_agree(tmp_path):
    mesh = trimesh.load_mesh(BOTTLE)
    wanted = gm.fit(BOTTLE)
    for ending in ("obj", "stl", "glb", "off"):
        path = tmp_path / f"bottle.{ending}"
        mesh.export(path)
        got = gm.fit(path)
        assert got.residual.rms == pytest.approx(wanted.residual.rms, rel=0.2)
    for source in (mesh, (mesh.vertices, mesh.faces), str(BOTTLE)):
        np.testing.assert_allclose(gm.fit(source).pose, wanted.pose, atol=1e-9)


@pytest.mark.long
def test_all_kinds_of_point_files_agree(tmp_path):
    points = trimesh.sample.sample_surface(trimesh.load_mesh(BOTTLE), 8000, seed=1)[0]
    points = np.asarray(points)
    wanted = gm.fit(points)
    np.save(tmp_path / "p.npy", points)
    np.savetxt(tmp_path / "p.xyz", points, fmt="%.12g")
    header = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\n"
    )
    body = "\n".join(" ".join(f"{x:.9g}" for x in p) for p in points)
    (tmp_path / "p.pcd").write_text(header + "DATA ascii\n" + body + "\n")
    binary = header.encode() + b"DATA binary\n" + points.astype(np.float32).tobytes()
    (tmp_path / "q.pcd").write_bytes(binary)
    trimesh.PointCloud(points).export(tmp_path / "p.ply")
    for name in ("p.npy", "p.xyz", "p.pcd", "q.pcd", "p.ply"):
        np.testing.assert_allclose(gm.fit(tmp_path / name).pose, wanted.pose, atol=1e-3)


def test_the_same_points_give_the_same_bits():
    points = trimesh.sample.sample_surface(trimesh.load_mesh(BOTTLE), 3000, seed=1)[0]
    one, two = gm.fit(np.asarray(points)), gm.fit(np.asarray(points))
    np.testing.assert_array_equal(one.surface.coefficients, two.surface.coefficients)
    np.testing.assert_array_equal(one.pose, two.pose)


@pytest.mark.parametrize("seed", range(3))
def test_the_first_of_equally_good_axes_is_taken_whatever_their_last_bits(monkeypatch, seed):
    thing = read(trimesh.creation.box((1.0, 1.0, 1.0)))
    noise = np.random.default_rng(seed)
    monkeypatch.setattr(fitting, "refined", lambda thing, axis: axis)
    monkeypatch.setattr(fitting, "score", lambda thing, axis: 0.1 + 1e-12 * noise.random())
    first = candidate_axes(thing)[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        found = fitting.fit_object(thing)
    np.testing.assert_array_equal(found.pose[:3, :3], first.rotation)


def cloud(n=500):
    return np.random.default_rng(0).normal(size=(n, 3))


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        (cloud(20), "at least 50 points for a fit, got 20"),
        (cloud() * [1, 1, 0], "solid, got all points on a plane"),
        (cloud() * [1, 0, 0], "solid, got all points on a line"),
        (cloud() * 0, "solid, got all points in one place"),
        (np.vstack([cloud(), [[np.nan, 0, 0]]]), "object must be finite, got nan at index"),
        (np.vstack([cloud(), [[np.inf, 0, 0]]]), "object must be finite, got inf at index"),
        (cloud()[:, :2], "points of shape \\(n, 3\\), got \\(500, 2\\)"),
        (np.vstack([cloud() / 9, cloud() / 9 + [5, 0, 0]]), "a single one, got 2 with space"),
        ((cloud(), np.zeros((0, 3), int)), "at least 4 points, got 0"),
        ((cloud(), [[0, 1, 700]]), "triangles among its 500 vertices, got vertex 700"),
        ("nowhere.ply", "a file that exists, got nowhere.ply"),
        (object(), "object must be an array of numbers"),
    ],
)
def test_what_cannot_be_fitted_is_refused_in_one_sentence(source, sentence):
    with pytest.raises(gm.GraspModuliError, match=sentence) as caught:
        gm.fit(source)
    assert "\n" not in str(caught.value)
