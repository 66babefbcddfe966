"""Fingertips on meshes: the map of contacts, grasps that are true, what the mesh says of them."""

import json
import pickle
import subprocess
import sys
import warnings
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

import graspmoduli as gm
import objects_made
import true_grasps
from conftest import ROOT, objects, quick
from graspmoduli.objects.touching import TriangleMesh

CUP = ROOT / "examples" / "objects" / "plastic_cup.ply"
#: Too thin for a tip of 5 % of their size: where every aim lands there are only grasps of less than
#: half of the quality, so that theirs are true, but bad aim may lose them.
THIN = ("fork", "scissors", "wrench")


def quiet_fit(source):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return gm.fit(source)


def read(path) -> tuple[np.ndarray, np.ndarray]:
    mesh = trimesh.load_mesh(path, process=False)
    return mesh.vertices, mesh.faces


def check(vertices, faces, name, **options: Any) -> list[Any]:
    """Grasps of a mesh, every one of them judged by code that is not the package's."""
    mesh = true_grasps.Mesh(vertices, faces)
    grasps: list[Any] = quiet_fit((vertices, faces)).synthesize(**options)
    assert grasps
    for grasp in grasps:
        friction = options.get("friction", 1.0)
        found = mesh.verdict(grasp.contacts, grasp.normals, grasp.center_of_mass, friction)
        assert found.is_true(tolerance=1e-6), found
        assert found.ball_holds, found
        assert gm.quality(grasp) == grasp.quality > 0.0
        assert grasp.round_quality[0] >= 0.9 * grasp.quality
        assert grasp.exact_quality > 0.0
        assert max(one.distance for one in grasp.checks) < 1e-9 * mesh.size
    if name not in THIN:
        assert grasps[0].held >= 0.99
    bounds = [grasp.round_quality[0] for grasp in grasps]
    assert bounds == sorted(bounds, reverse=True)
    return grasps


@pytest.mark.parametrize(
    "path", quick(objects(), "coffee_mug", "spray_bottle"), ids=lambda path: path.stem
)
def test_every_grasp_of_a_real_mesh_is_true(path):
    assert len(check(*read(path), path.stem)) == 5


@pytest.mark.parametrize("name", quick(objects_made.OBJECTS, "mug", "fork", "drill", "torus"))
def test_every_grasp_of_a_made_object_is_true(name):
    made = objects_made.OBJECTS[name]()
    check(made.vertices, made.faces, name)


@pytest.mark.parametrize("seed", quick([1, 2], 1))
@pytest.mark.parametrize(
    "name", quick(["mug", "drill", "banana", "scissors", "tray", "hook"], "mug", "scissors")
)
def test_pose_unit_winding_and_seed_do_not_matter(name, seed):
    moved = objects_made.moved(objects_made.OBJECTS[name](), seed)
    check(moved.vertices, moved.faces, name, seed=seed)


@pytest.mark.parametrize("name", quick(["mug", "toy_car", "carton"], "mug"))
def test_slippery_fingers(name):
    made = objects_made.OBJECTS[name]()
    check(made.vertices, made.faces, name, friction=0.5)


@pytest.mark.parametrize("fingers", quick([4, 5]))
def test_more_fingers_hold_better(fingers):
    made = objects_made.bottle()
    best = check(made.vertices, made.faces, "bottle", contacts=fingers, top=2)[0]
    three = quiet_fit(made).synthesize(top=1)[0]
    assert best.contacts.shape == (fingers, 3)
    assert best.quality > three.quality


def test_two_soft_fingers_hold():
    fit = quiet_fit(objects_made.bottle())
    best = fit.synthesize(contacts=2, torsion=0.01, top=1)[0]
    assert best.contacts.shape == (2, 3)
    assert gm.quality(best) == best.quality > 0.0
    with pytest.raises(gm.GraspModuliError, match="torsion must be positive for two contacts"):
        fit.synthesize(contacts=2, top=1)


def test_fingers_with_a_limit_each_hold_more():
    fit = quiet_fit(objects_made.bottle())
    best = fit.synthesize(norm="each", top=1)[0]
    assert best.norm == "each"
    assert gm.quality(best) == best.quality
    assert best.quality > fit.synthesize(top=1)[0].quality
    assert best.round_quality is not None
    assert best.round_quality[0] <= 1.2 * best.quality


def test_fingers_that_differ_go_where_they_are_best():
    fit = quiet_fit(objects_made.bottle())
    mu = [0.4, 1.0, 0.8]
    best = fit.synthesize(friction=mu, top=1)[0]
    assert best.friction == tuple(mu)
    for order in ([1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]):
        other = gm.quality(
            best.contacts[order], best.normals[order], best.center_of_mass,
            friction=mu, length_scale=best.length_scale,
        )  # fmt: skip
        assert other <= best.quality + 1e-9


def test_the_command_takes_a_limit_for_each_finger(tmp_path):
    path, out = tmp_path / "bottle.ply", tmp_path / "out.json"
    objects_made.bottle().export(path)
    done = command("grasp", path, "--norm", "each", "--top", "1", "--json", out)
    assert done.returncode == 0
    assert "at most 1 each" in done.stdout
    assert "Q'_8" in done.stdout
    report = json.loads(out.read_text())
    best = report["grasps"][0]
    arrays = (np.array(best[name]) for name in ("contacts", "normals", "center_of_mass"))
    q = gm.quality(*arrays, norm=report["norm"], length_scale=report["length_scale"])
    assert report["norm"] == "each"
    assert best["quality"] == pytest.approx(q, rel=1e-9)
    done = command("grasp", path, "--norm", "both")
    assert done.returncode == 2
    assert 'norm must be "sum" or "each"' in done.stderr


@pytest.mark.parametrize("name", ["cube", "carton"])
def test_boxes_are_held_at_their_faces(name):
    made = objects_made.OBJECTS[name]()
    half, size = made.extents / 2, made.extents.max()
    for grasp in quiet_fit(made).synthesize():
        near = np.abs(np.abs(grasp.contacts - made.bounds.mean(axis=0)) - half) < 0.02 * size
        assert (near.sum(axis=1) == 1).all()


class TestContactMap:
    def test_places_lie_on_the_mesh_and_are_reached_from_outside(self):
        vertices, faces = read(CUP)
        mesh = true_grasps.Mesh(vertices, faces)
        found = gm.contact_map(CUP)
        assert len(found) > 300
        assert found.contacts.shape == found.normals.shape == (len(found), 3)
        assert (found.flatness >= 0.0).all()
        assert (found.flatness <= 1.0).all()
        np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0, atol=1e-12)
        points = mesh.local(found.contacts)
        for point, normal in zip(points[::7], found.normals[::7], strict=True):
            assert mesh.nearest(point)[0] < 1e-9
            assert abs(mesh.ray(point - 3 * normal, normal)[0] - 3) < 1e-9

    def test_a_tip_feels_what_its_rays_meet(self):
        """The recipe in NumPy, all triangles for each ray."""
        vertices, faces = read(ROOT / "examples" / "objects" / "baby_bottle.ply")
        mesh = true_grasps.Mesh(vertices, faces)
        found = gm.contact_map((vertices, faces), samples=40)
        radius = found.tip_radius / mesh.size
        for point, way, flatness in zip(
            mesh.local(found.contacts), found.normals, found.flatness, strict=True
        ):
            side = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
            side /= np.linalg.norm(side)
            depths, normals = [], []
            for ring, count in ((0.0, 1), (0.3, 6), (0.6, 12), (0.9, 18)):
                for angle in 2 * np.pi * np.arange(count) / count:
                    away = np.cos(angle) * side + np.sin(angle) * np.cross(way, side)
                    t, face = mesh.ray(point + ring * radius * away - 3 * way, way)
                    if face >= 0:
                        depths.append(t + radius - radius * np.sqrt(1 - ring**2))
                        normals.append(mesh.normals[face] * np.sign(mesh.normals[face] @ way))
            gap = np.array(depths) - min(depths)
            felt = np.maximum(0, 1 - gap / (0.25 * radius)) @ np.array(normals)
            felt /= np.linalg.norm(felt)
            assert felt @ way > np.cos(np.radians(20.5))
            assert gap[0] < 0.4 * radius
            off = (np.array(normals) @ felt < np.cos(np.radians(30)))[gap < 0.6 * radius].mean()
            # Rays of another frame meet other triangles.
            assert abs((1.0 - off) - flatness) < 0.3

    def test_the_same_seed_gives_the_same_bits_and_another_one_does_not(self):
        one, two = gm.contact_map(CUP, seed=3), gm.contact_map(str(CUP), seed=3)
        assert one == two
        assert pickle.loads(pickle.dumps(one)) == one
        assert one != gm.contact_map(CUP, seed=4)

    def test_units_do_not_matter(self):
        vertices, faces = read(CUP)
        one = gm.contact_map((vertices, faces))
        # Powers of two round alike.
        two = gm.contact_map((1024.0 * vertices, faces))
        assert two.tip_radius == pytest.approx(1024.0 * one.tip_radius, rel=1e-12)
        np.testing.assert_allclose(two.contacts, 1024.0 * one.contacts, rtol=1e-9)

    def test_large_tips_reach_less(self):
        size = quiet_fit(CUP).residual.size
        small, large = (gm.contact_map(CUP, tip_radius=share * size) for share in (0.01, 0.15))
        assert large.steady.sum() < small.steady.sum()

    @pytest.mark.parametrize(
        ("arguments", "sentence"),
        [
            ({"mesh_or_path": np.random.default_rng(0).normal(size=(99, 3))}, "must have faces"),
            ({"tip_radius": 0.0}, "tip_radius must be a positive finite number, got 0"),
            ({"tip_radius": "a"}, "tip_radius must be a positive finite number, got 'a'"),
            ({"tip_radius": 1e9}, r"tip_radius must be from .* to .*, got 1e\+09"),
            ({"seed": -1}, "seed must be at least 0, got -1"),
            ({"samples": 0}, "samples must be at least 1, got 0"),
            ({"mesh_or_path": "nowhere.ply"}, "a file that exists"),
        ],
    )
    def test_wrong_arguments(self, arguments, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.contact_map(**{"mesh_or_path": CUP, **arguments})


class TestMesh:
    def test_the_centre_of_mass_is_the_solids_if_the_mesh_is_closed(self):
        made = trimesh.creation.cone(1.0, 4.0)
        fit = quiet_fit(made)
        np.testing.assert_allclose(fit.center_of_mass, made.center_mass, atol=1e-9)
        assert fit.mesh is not None
        assert fit.mesh.shape.closed
        # As an STL file holds it: every triangle with corners of its own.
        loose = TriangleMesh(
            made.triangles.reshape(-1, 3), np.arange(made.faces.size).reshape(-1, 3), 4.0
        )
        assert loose.shape.closed
        np.testing.assert_allclose(loose.shape.center_of_mass, made.center_mass, atol=1e-9)
        away = np.linalg.norm(made.vertices - made.center_mass, axis=1).max()
        assert fit.length_scale == pytest.approx(away)

    def test_and_the_triangles_if_it_is_open_or_wound_wrongly(self):
        made = trimesh.creation.cone(1.0, 4.0)
        faces = made.faces.copy()
        faces[::3] = faces[::3, ::-1]
        for mesh in (
            TriangleMesh(made.vertices, made.faces[1:], 4.0),
            TriangleMesh(made.vertices, faces, 4.0),
        ):
            assert not mesh.shape.closed
        wrong = TriangleMesh(made.vertices, faces, 4.0).shape
        np.testing.assert_allclose(wrong.center_of_mass, made.centroid, atol=1e-9)

    def test_another_centre_is_taken(self):
        fit = quiet_fit(objects_made.bottle())
        low = fit.synthesize(center_of_mass=[0, 0, 0.03], top=1)[0]
        high = fit.synthesize(center_of_mass=[0, 0, 0.17], top=1)[0]
        np.testing.assert_array_equal(low.center_of_mass, [0, 0, 0.03])
        assert low.contacts[:, 2].mean() < high.contacts[:, 2].mean()

    def test_places_on_the_surface_are_points_of_the_moduli_space(self):
        fit = quiet_fit(objects_made.bottle())
        for grasp in fit.synthesize(top=10):
            assert grasp.coordinates is not None
            on = ~np.isnan(grasp.coordinates[:, 0])
            assert (grasp.grasp is not None) == on.all()
            points = fit.to_object(fit.surface.points(*grasp.coordinates[on].T))
            away = np.linalg.norm(points - grasp.contacts[on], axis=1)
            assert (away <= 0.02 * fit.residual.size).all()
            assert len(fit.on_surface(grasp)) == 3

    def test_errors_rank_by_what_they_leave(self):
        fit = quiet_fit(objects_made.drill())
        grasps: list[Any] = fit.synthesize(errors=0.01)
        low = [grasp.low_quality for grasp in grasps]
        assert low == sorted(low, reverse=True)
        assert low[0] > 0.0
        # Larger errors leave less of it.
        more: list[Any] = fit.synthesize(errors=0.03)
        assert more[0].low_quality < low[0]

    @pytest.mark.parametrize(
        ("options", "sentence"),
        [
            ({"center_of_mass": [0, 0]}, r"center_of_mass must have shape \(3,\), got \(2,\)"),
            ({"center_of_mass": [0, 0, np.nan]}, "center_of_mass must be finite"),
            ({"errors": -1.0}, "errors must be a positive finite number, got -1"),
            ({"errors": 1e9}, "errors must be at most a quarter of the object's size"),
            ({"contacts": 0}, "contacts must be at least 1, got 0"),
            ({"torsion": -1}, "torsion must be a finite number, 0 or positive, got -1"),
            ({"tip_radius": np.inf}, "tip_radius must be a positive finite number, got inf"),
        ],
    )
    def test_wrong_arguments(self, options, sentence):
        fit = quiet_fit(objects_made.cube())
        with pytest.raises(gm.GraspModuliError, match=sentence):
            fit.synthesize(**options)

    def test_a_cloud_of_points_takes_any_fingers(self):
        fit = quiet_fit(
            np.asarray(trimesh.sample.sample_surface(objects_made.bottle(), 3000, seed=0)[0])
        )
        assert fit.mesh is None
        several: list[dict[str, Any]] = [
            {},
            {"contacts": 4},
            {"contacts": 2, "torsion": 0.01},
            {"norm": "each"},
            {"constraints": gm.Constraints(opening=(0.0, 0.15))},
        ]
        for options in several:
            found = fit.synthesize(top=2, **options)
            assert found
            for grasp in found:
                assert len(grasp.contacts) == options.get("contacts", 3)
                assert gm.quality(grasp) == grasp.quality > 0.0
        with pytest.raises(gm.GraspModuliError, match="errors must be left out"):
            fit.synthesize(errors=0.01)

    def test_transfers_end_on_the_mesh(self):
        source, target = quiet_fit(objects_made.bottle()), quiet_fit(CUP)
        mesh = true_grasps.Mesh(*read(CUP))
        for grasp in source.synthesize(top=3):
            carried = source.transfer_to(target, grasp)
            found = mesh.verdict(carried.contacts, carried.normals, carried.center_of_mass)
            assert found.is_true(tolerance=1e-6), found
            assert carried.checks is not None


def command(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "graspmoduli", *map(str, arguments)],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def test_the_command_takes_tips_centres_and_errors(tmp_path):
    path, out = tmp_path / "drill.ply", tmp_path / "grasps.json"
    objects_made.drill().export(path)
    done = command(
        "grasp", path, "--json", out, "--tip-radius", 0.008, "--center-of-mass", 0, 0, -0.05,
        "--errors", 0.004, "--fingers", 4, "--top", 2,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(out.read_text())
    assert report["schema"] == 1
    for grasp in report["grasps"]:
        assert len(grasp["contacts"]) == len(grasp["checks"]) == 4
        assert grasp["center_of_mass"] == [0, 0, -0.05]
        for check, u in zip(grasp["checks"], grasp["u"], strict=True):
            assert set(check) >= {"distance", "angle", "seen", "clearance", "bearing"}
            assert check["part"] == (None if u is None else 0)


def test_a_plate_is_too_thin(tmp_path):
    path, out = tmp_path / "plate.ply", tmp_path / "grasps.json"
    trimesh.creation.box((1.0, 1.0, 1e-4)).export(path)
    done = command("grasp", path, "--json", out)
    assert done.returncode == 1
    assert "too thin for these tips" in done.stderr
    assert json.loads(out.read_text())["grasps"] == []


class TestAgreement:
    def test_what_is_a_cylinder_is_explained(self):
        fit = gm.fit(objects_made.bottle())
        assert fit.unexplained < 0.01
        assert fit.coverage > 0.99
        assert fit.phantom < 0.01
        assert fit.residual.relative_max < 0.02

    @pytest.mark.parametrize("name", ["mug", "bracket", "hammer", "wine_glass"])
    def test_the_residual_is_of_the_whole_object(self, name):
        made = objects_made.OBJECTS[name]()
        fit = quiet_fit(made)
        size = fit.residual.size
        # From outside, by rays of other code, and from the surface by a fine grid of its points.
        mesh = true_grasps.Mesh(made.vertices, made.faces)
        points, faces = trimesh.sample.sample_surface(made, 500, seed=1)[:2]
        normals = made.face_normals[faces]
        seen = np.zeros(len(points), dtype=bool)
        for k, (point, way) in enumerate(zip(mesh.local(points), normals, strict=True)):
            seen[k] = any(
                abs(mesh.ray(point - 3 * side, side)[0] - 3) < 3e-3 for side in (way, -way)
            )
        u, theta = np.meshgrid(np.linspace(0, 1, 200), np.linspace(0, 2 * np.pi, 300))
        wall = fit.surface.points(u.ravel(), theta.ravel())
        shares = np.linspace(0, 1, 60)[:, None, None]
        ends = [wall.reshape(300, 200, 3)[:, end] for end in (0, -1)]
        lids = [(end * [1, 1, 0] * shares + end * [0, 0, 1]).reshape(-1, 3) for end in ends]
        tree = KDTree(fit.to_object(np.concatenate([wall, *lids])))
        away = tree.query(points[seen])[0]
        rms = np.sqrt((away**2).mean())
        # 500 points tell it to some 10 %, and the grid is as fine as a hundredth of the size.
        assert fit.residual.rms == pytest.approx(rms, rel=0.15, abs=0.002 * size)
        assert fit.residual.max >= away.max() - 0.02 * size
        assert fit.residual.max <= away.max() + 0.05 * size
        assert fit.unexplained == pytest.approx((away > 0.02 * size).mean(), abs=0.06)

    def test_a_handle_is_not_explained_in_proportion_to_its_area(self):
        made = objects_made.mug()
        with pytest.warns(UserWarning, match="of the object's visible area is not explained"):
            fit = gm.fit(made)
        # Handle, and what is seen of the inside.
        body = np.hypot(made.triangles_center[:, 0], made.triangles_center[:, 1]) < 0.042
        handle = made.area_faces[~body].sum()
        outside = made.area_faces[body].sum() / 2
        assert fit.unexplained == pytest.approx(handle / (handle + outside), abs=0.1)
        assert fit.coverage > 0.99

    def test_a_surface_in_the_air_is_not_covered(self):
        with pytest.warns(UserWarning, match="of the surface has no object near it"):
            fit = gm.fit(objects_made.bracket())
        assert fit.coverage < 0.5
        made = objects_made.bracket()
        mesh = true_grasps.Mesh(made.vertices, made.faces)
        points = fit.to_object(fit.surface.points(*gm.sample_points(fit.surface, 400)))
        far = np.mean([mesh.nearest(point)[0] > 0.02 for point in mesh.local(points)])
        assert fit.phantom == pytest.approx(far, abs=0.06)
        assert fit.phantom == 1.0 - fit.coverage
