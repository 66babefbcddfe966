"""Readers: every format, what is missing in it, and what is broken."""

import contextlib
import warnings
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from trimesh.exchange.stl import export_stl_ascii

import graspmoduli as gm
import mutations
from conftest import quick
from graspmoduli.objects.reading import read

FILES = mutations.files()


def path_of(folder, name):
    return folder / f"object.{name.split()[-1]}"


def write(folder, name, data):
    path = path_of(folder, name)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("name", FILES)
def test_every_format_holds_the_same_object(tmp_path, name):
    thing = read(write(tmp_path, name, FILES[name]))
    assert (thing.faces is None) == (name in mutations.CLOUDS)
    assert thing.size == pytest.approx(3.4, rel=1e-2)
    np.testing.assert_allclose(np.ptp(thing.points, axis=0), [2.0, 2.0, 3.4], rtol=1e-2)
    np.testing.assert_allclose(np.linalg.norm(thing.sample_normals, axis=1), 1.0, atol=1e-12)
    if thing.faces is not None:
        assert len(thing.faces) == 320


@pytest.mark.parametrize("name", FILES)
@settings(
    max_examples=40, derandomize=True, deadline=None, database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
@given(what=mutations.changes)
def test_a_damaged_file_is_read_or_refused_in_one_sentence(tmp_path, name, what):
    path = write(tmp_path, name, mutations.changed(FILES[name], what))
    thing, sentence = None, ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", UserWarning)
        try:
            thing = read(path)
        except gm.GraspModuliError as error:
            sentence = str(error)
    if thing is None:
        assert 0 < len(sentence) < 500
        assert "\n" not in sentence
        return
    for array in (thing.points, thing.samples, thing.sample_normals):
        assert np.isfinite(array).all()
    assert 0.0 < thing.size < np.inf


@pytest.mark.parametrize("name", ["off", "ascii ply", "ascii stl", "pcd", "binary pcd", "npy"])
@pytest.mark.parametrize("share", [0.13, 0.5, 0.9])
def test_a_truncated_file_is_refused(tmp_path, name, share):
    data = FILES[name]
    with pytest.raises(gm.GraspModuliError, match="object must be a whole"):
        read(write(tmp_path, name, data[: int(share * len(data))]))


@pytest.mark.parametrize("name", ["pcd", "off"])
def test_more_announced_than_there_is_is_refused(tmp_path, name):
    data = FILES[name].replace(b"162", b"199")
    with pytest.raises(gm.GraspModuliError, match="announced"):
        read(write(tmp_path, name, data))


@pytest.mark.parametrize("name", ["obj", "off", "ascii stl", "ascii ply"])
def test_a_vertex_that_is_no_number_is_refused(tmp_path, name):
    mesh = trimesh.creation.icosphere(2)
    vertices = mesh.vertices.copy()
    vertices[7, 1] = np.nan
    if name == "obj":
        rows = [f"v {x} {y} {z}" for x, y, z in vertices]
        rows += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
        data = "\n".join(rows).encode()
    else:
        broken = trimesh.Trimesh(vertices, mesh.faces, process=False)
        if name == "ascii stl":
            text: Any = export_stl_ascii(broken)
        elif name == "ascii ply":
            text = broken.export(file_type="ply", encoding="ascii")
        else:
            text = broken.export(file_type="off")
        data = text.encode() if isinstance(text, str) else text
    assert b"nan" in data
    with pytest.raises(gm.GraspModuliError, match="object must be"):
        read(write(tmp_path, name, data))


@pytest.mark.parametrize("name", ["obj", "off", "ascii stl"])
def test_zeroed_bytes_in_a_text_are_refused(tmp_path, name):
    data = FILES[name]
    half = len(data) // 2
    with pytest.raises(gm.GraspModuliError, match="zeroed bytes"):
        read(write(tmp_path, name, data[:half] + bytes(64) + data[half + 64 :]))


def image():
    """What an organised cloud is: a point for each pixel, NaN where nothing was seen."""
    x, y = np.meshgrid(np.linspace(-1.5, 1.5, 60), np.linspace(-1.5, 1.5, 40))
    with np.errstate(invalid="ignore"):
        z = np.sqrt(1.0 - x**2)
    points = np.stack([x, y, z], axis=-1)
    points[np.isnan(z)] = np.nan
    return points


def test_missing_pixels_are_left_out_and_counted(tmp_path):
    points = image()
    missing = int(np.isnan(points[..., 0]).sum())
    assert 0 < missing < 2400
    header = (
        b"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 60\nHEIGHT 40\n"
        b"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2400\nDATA binary\n"
    )
    (tmp_path / "p.pcd").write_bytes(header + points.astype(np.float32).tobytes())
    np.save(tmp_path / "p.npy", points)
    for source in (points, points.reshape(-1, 3), tmp_path / "p.pcd", tmp_path / "p.npy"):
        with pytest.warns(UserWarning, match=f"{missing:,} of 2,400 points are NaN"):
            thing = read(source)
        assert len(thing.points) == 2400 - missing
        assert np.isfinite(thing.points).all()


def can(n=4000, seed=0):
    t, h = np.random.default_rng(seed).random((2, n))
    return np.stack([np.cos(7 * t), np.sin(7 * t), 2 * h], axis=1)


def test_warnings_are_for_who_calls_fit():
    few = can()
    few[:3] = np.nan
    handle = 0.3 * can(150) + np.array([8, 0, 0])
    two = np.vstack([can(20_000), can(20_000) + np.array([2.3, 0, 0])])
    for points, words in (
        (few, "3 of 4,000 points are NaN"),
        (np.vstack([can(), handle]), "lies apart"),
        (two, "in 2 parts"),
    ):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            # Two beside each other are no surface: the warning comes first.
            with contextlib.suppress(gm.GraspModuliError):
                gm.fit(points)
        found = [w for w in caught if words in str(w.message)]
        assert [w.filename for w in found] == [__file__]


@pytest.mark.parametrize("scale", quick([1e-44, 1e-12, 1e12, 1e44], 1e-44))
def test_any_unit_gives_the_same_grasps(scale):
    mesh = trimesh.creation.cylinder(1.0, 2.5)
    for one, other in (
        ((mesh.vertices, mesh.faces), (scale * mesh.vertices, mesh.faces)),
        (can(800), scale * can(800)),
    ):
        first, second = gm.fit(one), gm.fit(other)
        assert second.length_scale == pytest.approx(scale * first.length_scale)
        best = second.synthesize(top=1)[0]
        assert best.quality == pytest.approx(first.synthesize(top=1)[0].quality, rel=1e-2)


@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e-60, 1e60, 1e154, 1e300])
def test_an_extent_beyond_all_units_is_refused(scale):
    with pytest.raises(gm.GraspModuliError, match="object must have an extent between"):
        read(scale * can())


@pytest.mark.parametrize("ending", ["obj", "ply", "stl"])
def test_a_tiny_mesh_keeps_its_vertices(tmp_path, ending):
    mesh = trimesh.creation.icosphere(2)
    mesh.vertices *= [1e-9, 1e-9, 2e-9]
    path = tmp_path / f"tiny.{ending}"
    if ending == "obj":
        rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
        rows += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
        path.write_text("\n".join(rows))
    else:
        mesh.export(path)
    thing = read(path)
    assert thing.size == pytest.approx(4e-9, rel=1e-2)
    assert thing.faces is not None
    assert len(thing.faces) == 320


@pytest.mark.parametrize("count", [1000, 100_000])
def test_a_heap_of_triangles_is_refused(count):
    corners = np.random.default_rng(0).random((3 * count, 3))
    with pytest.raises(gm.GraspModuliError, match="object must be a surface"):
        read((corners, np.arange(3 * count).reshape(-1, 3)))


def test_a_heap_of_few_triangles_is_refused():
    # What would take many seconds, with about 6 times the area of the box.
    rng = np.random.default_rng(0)
    with pytest.raises(gm.GraspModuliError, match="object must be a surface, got 900 triangles"):
        read((rng.normal(size=(900, 3)), rng.integers(0, 900, (900, 3))))


@pytest.mark.parametrize("shells", [1, 3])
def test_walls_within_walls_are_no_heap(shells):
    # Each has the area of the box around it.
    box = trimesh.creation.box()
    boxes = [box.copy().apply_scale(1.0 - 0.01 * shell) for shell in range(shells)]
    assert read(trimesh.util.concatenate(boxes)).size > 1.0


@pytest.mark.parametrize("noise", [1e-4, 0.003, 0.01])
@pytest.mark.parametrize("flat", [(1, 0, 0), (1, 1, 0)])
def test_a_line_or_a_plane_with_noise_is_refused(noise, flat):
    rng = np.random.default_rng(1)
    points = rng.random((3000, 3)) * flat + noise * rng.normal(size=(3000, 3))
    with pytest.raises(gm.GraspModuliError, match="a plane or a line, with noise"):
        read(points)


class TestSeveralObjects:
    def test_in_a_mesh_a_narrow_gap_is_enough(self):
        one = trimesh.creation.cylinder(1.0, 2.0)
        other = one.copy().apply_translation([2.2, 0.0, 0.0])
        with pytest.raises(gm.GraspModuliError, match="a single one, got 2 with space"):
            read(trimesh.util.concatenate([one, other]))

    def test_of_points_a_narrow_gap_is_told(self):
        with pytest.warns(UserWarning, match="in 2 parts with a narrow or an unseen"):
            read(np.vstack([can(20_000), can(20_000) + np.array([2.3, 0, 0])]))
        with pytest.raises(gm.GraspModuliError, match="a single one, got 2 with space"):
            read(np.vstack([can(), can() + np.array([3.5, 0, 0])]))

    def test_a_small_part_is_told(self):
        with pytest.warns(UserWarning, match="3.[0-9]% of the object lies apart"):
            read(np.vstack([can(), 0.3 * can(150) + np.array([8, 0, 0])]))

    def test_few_points_are_not_taken_for_parts(self):
        assert read(can(200)).size > 2.0


@pytest.mark.parametrize("corner", ["{}", "{}/1", "{}//1", "{}/10/20"])
def test_faces_of_obj_files_count_from_1(tmp_path, corner):
    mesh = trimesh.creation.icosphere(2)
    vertices = [f"v {x} {y} {z}" for x, y, z in mesh.vertices]
    for first in (1, 0):
        faces = [
            "f " + " ".join(corner.format(i + first) for i in face) for face in mesh.faces.tolist()
        ]
        row = 163 + min(i for i, face in enumerate(mesh.faces) if 0 in face)
        path = write(tmp_path, "obj", "\n".join(vertices + faces).encode())
        if first == 1:
            assert read(path).size == pytest.approx(2.0, rel=1e-2)
        else:
            with pytest.raises(gm.GraspModuliError, match=f"from 1.*vertex 0 in row {row}$"):
                read(path)


@pytest.mark.parametrize("name", FILES)
def test_a_name_need_not_be_utf_8(tmp_path, name):
    path = tmp_path / f"\udcff\udcfe.{name.split()[-1]}"
    try:
        path.write_bytes(FILES[name])
    except (OSError, UnicodeError):
        pytest.skip("a file system of UTF-8 names")
    assert read(path).size == pytest.approx(3.4, rel=1e-2)


def test_a_name_that_cannot_be_is_one_sentence():
    for name in ("x" * 300 + ".ply", "a\0b.ply", "y" * 300 + "/z.ply"):
        with pytest.raises(gm.GraspModuliError, match="object must be a file that exists"):
            read(name)
