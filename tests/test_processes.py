"""Commands and processes: what they may write to, how they end, and forks."""

import contextlib
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import graspmoduli as gm
from conftest import ROOT
from graspmoduli._files import check_output, replacing
from graspmoduli.cli import table

BOTTLE = ROOT / "examples" / "objects" / "baby_bottle.ply"
COMMAND = [sys.executable, "-m", "graspmoduli"]
FORK = multiprocessing.get_context("fork")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="devices and signals of POSIX")


def run(*arguments, **options: Any) -> Any:
    options = {"capture_output": True, "text": True} | options
    return subprocess.run([*COMMAND, *map(str, arguments)], check=False, **options)


def put(path, data):
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def can():
    angle, height = np.meshgrid(np.arange(40) * np.pi / 20, np.linspace(0.0, 3.0, 25))
    return np.stack([np.cos(angle), np.sin(angle), height], axis=-1).reshape(-1, 3)


@pytest.fixture
def small(tmp_path):
    """The file of an object that takes next to no time."""
    np.save(tmp_path / "can.npy", can())
    return tmp_path / "can.npy"


class TestOutputs:
    def test_the_object_is_never_overwritten(self, tmp_path):
        file = tmp_path / "bottle.ply"
        file.write_bytes(BOTTLE.read_bytes())
        (tmp_path / "link.ply").symlink_to(file)
        (tmp_path / "hard.ply").hardlink_to(file)
        (tmp_path / "sub").mkdir()
        for name in ("bottle.ply", "./bottle.ply", "sub/../bottle.ply", "link.ply", "hard.ply"):
            result = run("grasp", "bottle.ply", "--json", name, cwd=tmp_path)
            assert result.returncode == 2
            assert "json must be a file of its own" in result.stderr
            assert result.stderr.count("\n") == 1
        assert file.read_bytes() == BOTTLE.read_bytes()

    def test_two_outputs_do_not_share_a_file(self, tmp_path, small):
        (tmp_path / "link.png").symlink_to(tmp_path / "x.png")
        for other in ("x.png", "./x.png", "link.png"):
            result = run("grasp", small, "--json", "x.png", "--picture", other, cwd=tmp_path)
            assert result.returncode == 2
            assert "picture must be a file of its own" in result.stderr
        assert sorted(p.name for p in tmp_path.iterdir()) == ["can.npy", "link.png"]

    @pytest.mark.parametrize("kind", ["folder", "file below a file", "name too long", "link"])
    def test_what_cannot_be_written_is_found_out_before_the_work(self, tmp_path, kind):
        (tmp_path / "folder").mkdir()
        (tmp_path / "file").write_text("")
        (tmp_path / "link").symlink_to(tmp_path / "nowhere" / "file")
        path = {
            "folder": tmp_path / "folder",
            "file below a file": tmp_path / "file" / "x.json",
            "name too long": tmp_path / ("x" * 300),
            "link": tmp_path / "link",
        }[kind]
        with pytest.raises(gm.GraspModuliError, match="output must be a file that can be written"):
            check_output("json", path)
        with pytest.raises(gm.GraspModuliError, match="output must be a file that can be written"):
            put(path, b"")
        assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder", "link"]

    def test_a_folder_is_found_out_before_the_object_is_read(self, tmp_path):
        result = run("grasp", "nowhere.ply", "--json", tmp_path)
        assert result.returncode == 2
        assert "it is a folder" in result.stderr

    def test_devices_and_pipes_are_written_through(self, tmp_path):
        before = Path(os.devnull).stat()
        check_output("json", Path(os.devnull))
        put(Path(os.devnull), b"{}")
        assert os.path.samestat(Path(os.devnull).stat(), before)
        fifo = tmp_path / "fifo"
        os.mkfifo(fifo)
        got = []
        reader = threading.Thread(target=lambda: got.append(fifo.read_bytes()))
        reader.start()
        check_output("json", fifo)
        put(fifo, b"through")
        reader.join(10)
        assert got == [b"through"]
        assert fifo.is_fifo()

    @pytest.mark.parametrize("kind", ["pipe", "file"])
    def test_standard_output_takes_the_report_and_the_table(self, tmp_path, small, kind):
        if kind == "pipe":
            text = run("grasp", small, "--json", "/dev/stdout").stdout
        else:
            with (tmp_path / "out.txt").open("w") as file:
                run("grasp", small, "--json", "/dev/stdout", stdout=file, capture_output=False)
            text = (tmp_path / "out.txt").read_text()
        report, end = json.JSONDecoder().raw_decode(text)
        assert report["edges"] == 8
        assert "finger 1" in text[end:]
        assert "wrote /dev/stdout" in text[end:]

    def test_a_link_leads_to_the_file_and_permissions_stay(self, tmp_path):
        file, link = tmp_path / "real.json", tmp_path / "link.json"
        file.write_text("old")
        file.chmod(0o640)
        link.symlink_to(file)
        put(link, b"new")
        assert link.is_symlink()
        assert file.read_text() == "new"
        assert file.stat().st_mode & 0o777 == 0o640

    def test_a_failure_leaves_the_old_file_and_nothing_else(self, tmp_path):
        file = tmp_path / "x"
        file.write_text("old")

        def fails():
            with replacing(file) as temporary:
                temporary.write_text("half")
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            fails()
        assert file.read_text() == "old"
        assert list(tmp_path.iterdir()) == [file]


@pytest.fixture(scope="module")
def found():
    fit = gm.fit(can())
    return fit, fit.synthesize(top=2)


class TestStreams:
    def test_a_closed_or_full_standard_output_is_one_sentence(self, small):
        reader, writer = os.pipe()
        os.close(reader)
        closed = run("grasp", small, stdout=writer, stderr=subprocess.PIPE, capture_output=False)
        os.close(writer)
        with Path("/dev/full").open("w") as full:
            results = [closed]
            for arguments in (("grasp", small), ("--help",), ("--version",)):
                results.append(
                    run(*arguments, stdout=full, stderr=subprocess.PIPE, capture_output=False)
                )
        for result in results:
            assert result.returncode == 2
            assert result.stderr.startswith("graspmoduli: standard output must take")
            assert result.stderr.count("\n") == 1

    def test_a_full_standard_error_changes_no_exit_code(self, small):
        with Path("/dev/full").open("w") as full:
            result = run("grasp", small, "--top", "0", stderr=full, capture_output=False)
        assert result.returncode == 2

    def test_any_name_in_any_encoding(self, tmp_path, small):
        # Not ASCII, in no font, the start of a formula, not even UTF-8.
        name = "ö 瓶 a$b$_{ \udcff.npy"
        (tmp_path / name).write_bytes(small.read_bytes())
        environment = {**os.environ, "PYTHONIOENCODING": "ascii", "MPLBACKEND": "no such backend"}
        result = run("grasp", tmp_path / name, "--picture", "p.png", "--json", "j.json",
                     cwd=tmp_path, env=environment)  # fmt: skip
        assert result.returncode == 0, result.stderr
        assert result.stderr == ""
        assert json.loads((tmp_path / "j.json").read_text())["object"].endswith(".npy")

    @pytest.mark.parametrize("width", [20, 40, 80, 200])
    @pytest.mark.parametrize("terminal", ["dumb", "xterm-256color"])
    def test_a_terminal_of_any_width_tears_no_row(self, found, monkeypatch, width, terminal):
        for name, value in {"COLUMNS": str(width), "TERM": terminal, "NO_COLOR": "1"}.items():
            monkeypatch.setenv(name, value)
        ours, theirs = os.openpty()
        with os.fdopen(theirs, "w") as screen:
            monkeypatch.setattr(sys, "stdout", screen)
            table.show("can.npy", found[0], found[1], 8)
            monkeypatch.undo()
        text = b""
        # The other end is closed: what it left, then an error.
        with contextlib.suppress(OSError):
            while chunk := os.read(ours, 4096):
                text += chunk
        os.close(ours)
        assert b"\x1b[3" not in text
        rows = [line.split() for line in text.decode().splitlines() if line.strip()]
        # Rank, two qualities and three fingers in a row; or a row for each finger.
        wide = [row for row in rows if row[0] in ("1", "2") and len(row) == 12]
        first = [row for row in rows if row[0] in ("1", "2") and len(row) == 7]
        further = [row for row in rows if row[0] in ("2", "3") and len(row) == 4]
        counts = len(wide), len(first), len(further)
        assert counts == ((2, 0, 0) if width == 200 else (0, 2, 4))


def ended(process, number, within=10.0):
    """What a command says when it is sent a signal, and how long it takes to end."""
    begin = time.monotonic()
    process.send_signal(number)
    try:
        _, errors = process.communicate(timeout=within)
    except subprocess.TimeoutExpired:
        process.kill()
        raise
    return errors, time.monotonic() - begin


#: The command as it is installed.
SCRIPT = [str(Path(sys.executable).with_name("graspmoduli"))]


@pytest.mark.parametrize(
    ("number", "code", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
class TestSignals:
    def start(self, *command, **options: Any) -> Any:
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
        return subprocess.Popen(command, **options)

    def test_a_long_run_ends_and_leaves_what_is_done(self, tmp_path, number, code, word):
        process = self.start(*COMMAND, "reproduce", "fig7", "--out", str(tmp_path))
        while not (tmp_path / "pieces.sqlite").exists():
            assert process.poll() is None
            time.sleep(0.05)
        time.sleep(1.0)
        errors, seconds = ended(process, number)
        assert process.returncode == code
        assert errors == f"graspmoduli: {word}\n"
        assert seconds < 5.0
        assert {p.name for p in tmp_path.iterdir()} <= {"pieces.sqlite", "pieces.sqlite-journal"}

    @pytest.mark.parametrize(
        ("command", "imported"),
        [(SCRIPT, "numpy"), (SCRIPT, "typer"), (COMMAND, "typer")],
        ids=["script numpy", "script typer", "module typer"],
    )
    def test_a_start_ends_in_one_line(self, tmp_path, number, code, word, command, imported):
        # An import that takes long.
        (tmp_path / f"{imported}.py").write_text(
            "import time\nprint('begun', flush=True)\ntime.sleep(60)\n"
        )
        environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
        process = self.start(*command, "--version", env=environment)
        assert process.stdout
        assert process.stdout.readline() == "begun\n"
        errors, seconds = ended(process, number)
        assert (process.returncode, errors) == (code, f"graspmoduli: {word}\n")
        assert seconds < 5.0

    @pytest.mark.parametrize("work", ["kernel", "writing"])
    def test_work_that_hears_no_signal_ends_too(self, tmp_path, number, code, word, work):
        # Compiled code does not come back to Python; a file is half written.
        script = f"""
import pathlib, sys, time
from graspmoduli import _signals, _core, cli
from graspmoduli import cli
from graspmoduli._files import replacing
def stuck(*_):
    with replacing(pathlib.Path("out.json")) as temporary:
        temporary.write_text("half")
        print("begun", flush=True)
        if {work!r} == "kernel":
            _core.survey(0, 0, 10**10, 1.0, 8, [], 1, 1.0)
        while True:
            try:
                time.sleep(60)
            except BaseException:
                pass
cli._run = stuck
cli.main()
"""
        process = self.start(sys.executable, "-c", script, cwd=tmp_path)
        assert process.stdout
        assert process.stdout.readline() == "begun\n"
        errors, seconds = ended(process, number)
        assert process.returncode == code
        assert errors == f"graspmoduli: {word}\n"
        assert seconds < 5.0
        assert list(tmp_path.iterdir()) == []


def in_child():
    """What a child computes in parallel: batches, searches, synthesis, transfers."""
    surface = gm.shapes.MODELS["e"]
    rng = np.random.default_rng(0)
    contacts, normals = rng.normal(size=(2, 1000, 3, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    values = gm.quality(contacts, normals, np.zeros(3))
    u, theta = gm.sample_points(surface, 40)
    found = [g.quality for g in gm.best_grasps(surface, u, theta, top=3)]
    made = gm.synthesize(surface, top=2)
    ends = [
        gm.transfer(surface, made[0].grasp, gm.shapes.MODELS["f"], method).quality
        for method in ("naive", "gradient", "ascent")
    ]
    return values.tolist(), found, [g.quality for g in made], ends


def in_grandchild(results):
    """Sends what a child finds, and its own child."""
    own = in_child()
    inner = FORK.SimpleQueue()
    child = FORK.Process(target=lambda: inner.put(in_child()))
    child.start()
    results.put((own, inner.get()))


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_forked_children_compute_the_same_in_parallel():
    wanted = in_child()
    results = FORK.Queue()
    child = FORK.Process(target=in_grandchild, args=(results,))
    child.start()
    try:
        assert results.get(timeout=60) == (wanted, wanted)
    finally:
        child.kill()
        child.join()


INTERRUPTED = """
import os, signal, sys, threading
import numpy as np
import graspmoduli as gm

points = np.random.default_rng(0).normal(size=(400_000, 8, 3))
normals = points / np.linalg.norm(points, axis=-1, keepdims=True)
e, f = (gm.shapes.MODELS[name] for name in "ef")
grasp = gm.Grasp([0.5, 0.5, 0.5], [0, 2, 4])
calls = {
    "batch": lambda: gm.quality(points, -normals, np.zeros(3)),
    "gradient": lambda: gm.quality_gradient(points, -normals, np.zeros(3)),
    "best": lambda: gm.smallest_quality(points, -normals, np.zeros(3), edges=200),
    "sampling": lambda: gm.sample_points(f, 3_000_000),
    "synthesis": lambda: [gm.synthesize(f, top=50, seed=seed) for seed in range(1000)],
    "transfer": lambda: gm.transfer(e, grasp, f, "gradient", surfaces=5000, steps=500),
    "ascent": lambda: gm.transfer(e, [grasp] * 5000, f, "ascent"),
    "distance": lambda: [gm.surface_distance(e, f, tolerance=1e-9) for _ in range(10_000)],
}
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    calls[sys.argv[1]]()
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.parametrize(
    "call",
    ["batch", "gradient", "best", "sampling", "synthesis", "transfer", "ascent", "distance"],
)
def test_ctrl_c_ends_calls_of_the_core(call):
    start = time.monotonic()
    command = [sys.executable, "-c", INTERRUPTED, call]
    result = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    assert result.stdout == "interrupted\n", result.stderr
    # They would run for many times as long, on any machine.
    assert time.monotonic() - start < 30.0
