"""Objects in parts that are surfaces with cylindrical coordinates, and grasps carried between."""

import copy
import dataclasses
import pickle
import warnings
from functools import cache

import numpy as np
import pytest
from scipy.spatial import KDTree

import graspmoduli as gm
import graspmoduli.objects.parts
import objects_made
import true_grasps
from conftest import ROOT, some_long
from graspmoduli import plotting

#: Of how many bodies the objects are made.
MADE_OF = {
    "mug": 2, "hammer": 2, "pan": 2, "banana": 1, "spoon": 2, "fork": 2, "scissors": 4, "tray": 1,
    "torus": 1, "cube": 1, "carton": 1, "bracket": 2, "cage": 8, "hook": 2, "chair_leg": 4,
    "drill": 4, "screwdriver": 3, "wrench": 3, "bottle": 1, "wine_glass": 3, "egg": 1, "bowl": 1,
    "toy_car": 5, "bracelet": 1,
}  # fmt: skip


@cache
def parts_of(name):
    return gm.fit_parts(objects_made.OBJECTS[name]())


def near(parts, points):
    """Distances of points from the parts, by dense samples of the surfaces and of their lids."""
    u, theta = np.meshgrid(np.linspace(0, 1, 160), np.linspace(0, 2 * np.pi, 240))
    best = np.full(len(points), np.inf)
    for part in parts.parts:
        wall = part.surface.points(u.ravel(), theta.ravel())
        lids = []
        for end in (0.0, 1.0):
            rim = part.surface.points(np.full(240, end), np.linspace(0, 2 * np.pi, 240))
            shares = np.linspace(0, 1, 40)[:, None, None]
            lids.append((rim * [1, 1, 0] * shares + rim * [0, 0, 1]).reshape(-1, 3))
        tree = KDTree(part.to_object(np.concatenate([wall, *lids])))
        best = np.minimum(best, tree.query(points)[0])
    return best


@pytest.mark.parametrize(
    "name", some_long([*MADE_OF], lambda name: name not in ("mug", "torus", "bracket", "drill"))
)
def test_few_parts_explain_nearly_all(name):
    parts = parts_of(name)
    assert parts.unexplained <= 0.05
    assert len(parts) <= MADE_OF[name] + 1
    assert parts.shares.sum() == pytest.approx(1.0 - parts.unexplained)
    # That is so: samples of the surfaces are that near.
    size = parts.parts[0].residual.size
    some = np.random.default_rng(0).choice(len(parts.points), 600, replace=False)
    away = near(parts, parts.points[some])
    assert (away > 0.025 * size).mean() <= parts.unexplained + 0.02
    explained = parts.part[some] >= 0
    assert (away[explained] < 0.025 * size).mean() > 0.98
    np.testing.assert_array_equal(parts.part_of(parts.points), parts.part)


@pytest.mark.parametrize("seed", some_long([1, 2, 3], lambda seed: seed > 1))
def test_pose_and_unit_do_not_matter_much(seed):
    mesh = objects_made.moved(objects_made.mug(), seed)
    parts = gm.fit_parts(mesh)
    assert parts.unexplained <= 0.05
    assert len(parts) <= 3


def test_the_first_part_is_the_fit_of_the_whole():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = gm.fit(objects_made.mug())
    first = parts_of("mug").parts[0]
    assert first.surface == fit.surface
    np.testing.assert_array_equal(first.pose, fit.pose)
    assert first.mesh == fit.mesh
    np.testing.assert_array_equal(first.center_of_mass, fit.center_of_mass)
    assert first.length_scale == fit.length_scale


def handle(parts):
    """The part that is farthest from the middle of the object."""
    middle = parts.points.mean(axis=0)
    away = [
        np.linalg.norm(parts.points[parts.part == k].mean(axis=0) - middle)
        for k in range(1, len(parts))
    ]
    return parts.parts[1 + int(np.argmax(away))]


def other_mug():
    body = objects_made.lathe(objects_made.cup_profile(0.05, 0.004, 0.08))
    ring = objects_made.tube(objects_made.arc(0.022, -85, 85), 0.006)
    return objects_made._all(body, objects_made._at(ring, x=0.047, z=0.045))


def test_grasps_of_a_part_lie_on_it():
    parts = parts_of("mug")
    # The handle of this mug begins where x is that of its wall.
    grasps = handle(parts).synthesize(top=3)
    assert grasps
    for grasp in grasps:
        assert (np.hypot(grasp.contacts[:, 0], grasp.contacts[:, 1]) > 0.038).all()
        assert (grasp.contacts[:, 0] > 0.03).all()
        assert grasp.quality > 0.0
    for grasp in parts.parts[0].synthesize(top=3):
        assert (np.hypot(grasp.contacts[:, 0], grasp.contacts[:, 1]) < 0.043).all()


def test_the_grasp_of_a_handle_holds_on_the_handle_of_another_mug():
    meshes = {"mug": objects_made.mug(), "other": other_mug()}
    handles = {"mug": handle(parts_of("mug")), "other": handle(gm.fit_parts(meshes["other"]))}
    for one, another in (("mug", "other"), ("other", "mug")):
        true = true_grasps.Mesh(meshes[another].vertices, meshes[another].faces)
        for grasp in handles[one].synthesize(top=3):
            carried = handles[one].transfer_to(handles[another], grasp)
            assert true.verdict(carried.contacts, carried.normals, carried.center_of_mass).is_true()
            # On the handle, not on the mug.
            wall = 0.04 if another == "mug" else 0.05
            assert (np.hypot(*carried.contacts[:, :2].T) > wall - 0.001).all()
            assert (carried.contacts[:, 0] > 0.8 * wall).all()


def test_parts_are_values(tmp_path):
    parts = parts_of("mug")
    assert pickle.loads(pickle.dumps(parts)) == parts
    assert copy.deepcopy(parts) == parts
    assert hash(parts) == hash(copy.deepcopy(parts))
    assert gm.fit_parts(objects_made.mug()) == parts
    part = handle(parts)
    part.save(tmp_path / "handle.npz")
    assert gm.Fit.load(tmp_path / "handle.npz") == part


def test_progress_is_told():
    calls = []
    gm.fit_parts(objects_made.torus(), progress=lambda *at: calls.append(at))
    assert calls[-1] == (100, 100)
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)


def test_what_has_no_parts_is_refused_in_one_sentence():
    cloud = objects_made.mug().vertices
    for wrong, sentence in (
        (np.asarray(cloud), "mesh_or_path must have faces, got points only"),
        ("nowhere.ply", "a file that exists"),
        (3, "object must have points of shape"),
    ):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.fit_parts(wrong)
    with pytest.raises(gm.GraspModuliError, match="points must have shape"):
        parts_of("mug").part_of([[1.0, 2.0]])


def test_a_wall_that_explains_nothing_is_refused(monkeypatch):
    first = parts_of("mug").parts[0]
    pose = first.pose.copy()
    pose[:3, 3] += 10.0
    away = dataclasses.replace(first, pose=pose)
    monkeypatch.setattr(graspmoduli.objects.parts, "fit_object", lambda thing: away)
    with pytest.raises(gm.GraspModuliError, match="got one that explains nothing"):
        gm.fit_parts(objects_made.mug())


def test_pictures_show_parts_and_shares():
    parts = parts_of("mug")
    figure = plotting.plot_parts(parts, title="mug")
    (legend,) = figure.legends
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels[0] == f"part 0  {parts.shares[0]:.0%}"
    assert labels[-1] == f"unexplained  {parts.unexplained:.1%}"
    assert len(labels) == len(parts) + 1
    mesh = ROOT / "examples" / "objects" / "yogurt_bottle.ply"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = gm.fit(mesh)
    figure = plotting.plot_contact_map(fit, gm.contact_map(mesh), title="bottle")
    assert "places for a fingertip" in figure.get_suptitle()
