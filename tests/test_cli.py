"""The command line as users meet it."""

import dataclasses
import json
import os
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import graspmoduli as gm
from conftest import ROOT
from graspmoduli import cli
from graspmoduli.cli import table

BOTTLE = ROOT / "examples" / "objects" / "baby_bottle.ply"


def run(*arguments, cwd=None):
    environment = {**os.environ, "COLUMNS": "120"}
    return subprocess.run(
        [sys.executable, "-m", "graspmoduli", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=environment,
        check=False,
    )


def test_grasp_writes_table_json_and_picture(tmp_path):
    json_file, picture = tmp_path / "grasps.json", tmp_path / "grasps.png"
    result = run("grasp", BOTTLE, "--json", json_file, "--picture", picture, "--top", 3)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    assert "finger 3" in result.stdout
    assert sorted(p.name for p in tmp_path.iterdir()) == ["grasps.json", "grasps.png"]
    assert picture.read_bytes().startswith(b"\x89PNG")
    report = json.loads(json_file.read_text())
    assert set(report) >= {"object", "fit", "friction", "edges", "length_scale", "grasps"}
    assert set(report["fit"]) >= {"residual_rms", "residual_max", "coverage", "phantom", "pose"}
    assert report["schema"] == 1
    qualities = [grasp["round_quality"][0] for grasp in report["grasps"]]
    assert qualities == sorted(qualities, reverse=True)
    assert len(qualities) == 3
    mesh = trimesh.load_mesh(BOTTLE)
    scale = report["length_scale"]
    for grasp in report["grasps"]:
        value = gm.quality(
            np.array(grasp["contacts"]) / scale,
            grasp["normals"],
            np.array(grasp["center_of_mass"]) / scale,
        )
        assert value == pytest.approx(grasp["quality"], rel=1e-12)
        _, distance, _ = trimesh.proximity.closest_point(mesh, grasp["contacts"])
        assert distance.max() < 1e-9 * mesh.extents.max()
        assert all(check["seen"] and check["bearing"] > 0.3 for check in grasp["checks"])
        assert grasp["held"] > 0.99
        assert len(grasp["u"]) == len(grasp["theta"]) == 3


def test_the_same_command_writes_the_same_bytes(tmp_path):
    for name in ("a.json", "b.json"):
        assert run("grasp", BOTTLE, "--json", tmp_path / name, "--seed", 7).returncode == 0
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_help_and_version():
    assert "grasp" in run("--help").stdout
    assert "--friction" in run("grasp", "--help").stdout
    assert run("--version").stdout.strip() == "0.1.0"


@pytest.fixture
def bad_files(tmp_path):
    whole = BOTTLE.read_bytes()
    ascii_mesh = trimesh.creation.icosphere(2).export(file_type="ply", encoding="ascii")
    two = trimesh.util.concatenate(
        [trimesh.creation.box(), trimesh.creation.box().apply_translation([5, 0, 0])]
    )
    two.export(tmp_path / "two.obj")
    np.save(tmp_path / "few.npy", np.random.default_rng(0).random((9, 3)))
    np.save(tmp_path / "flat.npy", np.random.default_rng(0).random((99, 3)) * [1, 1, 0])
    np.save(tmp_path / "nan.npy", np.full((99, 3), np.nan))
    np.save(tmp_path / "wide.npy", np.ones((99, 5)))
    (tmp_path / "empty.ply").write_bytes(b"")
    (tmp_path / "cut.ply").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "cut2.ply").write_bytes(ascii_mesh[: len(ascii_mesh) // 2])
    (tmp_path / "head.ply").write_bytes(whole[:60])
    (tmp_path / "noise.stl").write_bytes(b"not a mesh at all")
    (tmp_path / "noise.glb").write_bytes(b"not a mesh at all")
    (tmp_path / "noise.pcd").write_bytes(b"not a cloud at all")
    (tmp_path / "words.xyz").write_text("one two three\n")
    (tmp_path / "what.docx").write_text("hello")
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["missing.ply"], "a file that exists, got missing.ply"),
        (["what.docx"], "a file of a known format"),
        (["empty.ply"], "must not be empty"),
        (["cut.ply"], "a whole PLY file, got cut.ply"),
        (["cut2.ply"], "a whole PLY file, got cut2.ply"),
        (["head.ply"], "a whole PLY file, got head.ply"),
        (["noise.stl"], "noise.stl"),
        (["noise.glb"], "a whole GLB file"),
        (["noise.pcd"], "a whole PCD file"),
        (["words.xyz"], "a whole XYZ file"),
        (["nan.npy"], "at least 50 points"),
        (["few.npy"], "at least 50 points"),
        (["flat.npy"], "on a plane"),
        (["wide.npy"], "points of shape (n, 3)"),
        (["two.obj"], "a single one, got 2 with space"),
        (["."], "got the folder"),
        ([BOTTLE, "--friction", "0"], "friction must be a positive finite number, got 0.0"),
        ([BOTTLE, "--friction", "-1"], "friction must be"),
        ([BOTTLE, "--friction", "nan"], "friction must be"),
        ([BOTTLE, "--friction", "rough"], "friction must be a number, got 'rough'"),
        ([BOTTLE, "--edges", "2"], "edges must be at least 3, got 2"),
        ([BOTTLE, "--top", "0"], "top must be at least 1"),
        ([BOTTLE, "--seed", "-1"], "seed must be at least 0"),
        ([BOTTLE, "--json", "no/such/folder/x.json"], "output must be a file that can be written"),
        ([BOTTLE, "--picture", "no/such/folder/x.png"], "output must be a file that can be"),
        ([BOTTLE, "--picture", "x.docx"], "picture must be a file of a known format"),
        ([], "OBJECT"),
        ([BOTTLE, "--colour", "red"], "colour"),
    ],
    ids=str,
)
def test_wrong_input_gives_one_line_and_exit_code_2(
    bad_files, arguments, sentence, monkeypatch, capsys
):
    before = sorted(p.name for p in bad_files.iterdir())
    monkeypatch.chdir(bad_files)
    assert cli._run(["grasp", *map(str, arguments)]) == 2
    output = capsys.readouterr()
    assert sentence in output.err
    assert len(output.err.strip().splitlines()) == 1, output.err
    assert output.out == ""
    assert sorted(p.name for p in bad_files.iterdir()) == before


@pytest.mark.parametrize("name", ["a\nb.ply", "a\rb\n\n.docx", "\n"])
def test_a_name_of_several_lines_gives_one(tmp_path, capsys, name):
    (tmp_path / "there\n.docx").write_text("hello")
    for path in (tmp_path / name, tmp_path / "there\n.docx"):
        assert cli._run(["grasp", str(path)]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


def test_no_zero_is_negative(capsys):
    t, h = np.random.default_rng(0).random((2, 900))
    fit = gm.fit(np.stack([np.cos(7 * t), np.sin(7 * t), 2 * h], axis=1))
    grasp = fit.synthesize(top=1)[0]
    tiny = dataclasses.replace(grasp, contacts=np.full((3, 3), -1e-9))
    pose = fit.pose.copy()
    pose[:3, 2] = [-1e-9, -1e-9, -1.0]
    table.show("can.npy", dataclasses.replace(fit, pose=pose), [tiny], 8)
    output = capsys.readouterr().out
    assert "axis (+0.00, +0.00, -1.00)" in output
    assert output.count("  0.000, 0.000, 0.000") == 3
    assert "-0.0" not in output


#: What people and programs write where a number is wanted.
VALUES = st.one_of(
    st.integers().map(str),
    st.floats().map(str),
    st.text(max_size=8).filter(lambda text: "\0" not in text),
    st.sampled_from(["", "nan", "-inf", "1e400", "0x10", "1_000", "٣", "9" * 5000, "-0", "1e-320"]),
)


@settings(max_examples=150, derandomize=True, deadline=None, database=None,
          suppress_health_check=[HealthCheck.function_scoped_fixture])  # fmt: skip
@given(
    option=st.sampled_from(["--friction", "--edges", "--top", "--seed", "--colour"]), value=VALUES
)
def test_any_value_of_an_option_is_taken_or_refused_in_one_line(tmp_path, capsys, option, value):
    # The object is not there: what passes the options is told so.
    code = cli._run(["grasp", str(tmp_path / "none.ply"), f"{option}={value}"])
    output = capsys.readouterr()
    assert code == 2
    assert output.err.startswith("graspmoduli: ")
    assert len(output.err) < 400 + 2 * len(str(tmp_path))
    assert output.err.count("\n") == 1


def test_a_failure_after_the_start_leaves_old_output_alone(bad_files):
    old = bad_files / "out.json"
    old.write_text("precious")
    assert run("grasp", "two.obj", "--json", old, cwd=bad_files).returncode == 2
    assert old.read_text() == "precious"
    assert not [p for p in bad_files.iterdir() if p.name.startswith(".")]
