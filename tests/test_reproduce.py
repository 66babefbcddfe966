"""Runs of the paper's experiments: reports, kept pieces, killed runs, and the command."""

import contextlib
import json
import random
import re
import signal
import sqlite3
import subprocess
import sys
import time
from dataclasses import replace

import pytest

import graspmoduli as gm
from graspmoduli import cli
from graspmoduli.experiments import (
    EXPERIMENTS,
    FAMILIES,
    NAMES,
    reproduce,
    store,
)
from graspmoduli.experiments.report import BEYOND
from graspmoduli.experiments.settings import SCALES
from graspmoduli.experiments.store import Piece, Store
from test_experiments import TINY


@pytest.fixture
def tiny(monkeypatch):
    monkeypatch.setitem(SCALES, "quick", TINY)


class TestReproduce:
    @pytest.mark.long
    def test_every_figure_has_its_rows_and_pictures_and_the_table_all_numbers(self, tiny, tmp_path):
        steps = []
        outcomes = reproduce(out=tmp_path, threads=2, progress=steps.append)
        assert list(outcomes) == [f"fig{k}" for k in range(1, 13)]
        results = json.loads((tmp_path / "results.json").read_text())
        assert results["configuration"]["survey_grasps"] == 5_000
        page = (tmp_path / "report.html").read_text()
        for name, (title, *_) in EXPERIMENTS.items():
            assert f"{name}: {title}" in page
            assert results["experiments"][name]["title"] == title
            assert list(tmp_path.glob(f"{name}*.png"))
        # Self-contained: nothing is loaded from anywhere.
        assert "http:" not in page
        assert "https:" not in page
        assert not re.search(r"<(script|link|iframe)|@import|url\(", page)
        assert page.count("<img") == page.count("data:image/png;base64,")
        assert 'src="data:' in page
        markdown = (tmp_path / "report.md").read_text()
        assert "twelve surfaces are not public" in markdown
        assert "splines with positive coefficients" in markdown
        assert all(
            outcome.captions.keys() == outcome.pictures.keys() for outcome in outcomes.values()
        )
        for row in results["experiments"]["fig5"]["rows"]:
            assert row["what"] in markdown
        totals = {name: FAMILIES[name].pieces(TINY) for name in ("fig8", "fig10")}
        assert [s for s in steps if s.name == "fig10"][-1].done == totals["fig10"]
        # The table is made of the same pieces, which are there.
        for picture in tmp_path.glob("*.png"):
            picture.unlink()
        outcomes = reproduce(["table"], out=tmp_path)
        assert list(outcomes) == ["fig5", "fig7", "fig8", "fig9", "fig10", "fig11", "fig12"]
        assert all(outcome.rows for outcome in outcomes.values())
        for outcome in outcomes.values():
            for row in outcome.rows:
                # Each row says what agreement means, or that there is nothing to compare.
                assert row.criterion
                assert row.criterion != BEYOND or row.agrees is None
        assert not list(tmp_path.glob("*.png"))

    @pytest.mark.long
    def test_the_number_of_threads_does_not_matter(self, tiny, tmp_path):
        names = ["fig5", "fig11", "fig12"]
        texts = set()
        for threads in (1, 2, 4):
            reproduce(names, out=tmp_path / str(threads), threads=threads)
            texts.add((tmp_path / str(threads) / "results.json").read_bytes())
        assert len(texts) == 1

    def test_what_is_there_is_not_computed_again(self, tiny, tmp_path, monkeypatch):
        reproduce(["fig5"], out=tmp_path)
        first = (tmp_path / "results.json").read_bytes()
        with Store(tmp_path, json.loads(first)["configuration"]) as store:
            assert store.done() == {Piece("survey", k) for k in range(6)}
        steps = []
        reproduce(["fig5"], out=tmp_path, progress=steps.append)
        assert [step.done for step in steps] == [6]
        assert (tmp_path / "results.json").read_bytes() == first

    def test_pieces_of_other_code_stay_and_are_not_used(self, tiny, tmp_path, monkeypatch):
        reproduce(["fig5"], out=tmp_path)
        first = (tmp_path / "results.json").read_bytes()
        steps = []
        with monkeypatch.context() as other:
            other.setattr(store, "code_version", lambda: "other code")
            reproduce(["fig5"], out=tmp_path, progress=steps.append)
        assert [step.done for step in steps] == [0, 1, 2, 3, 4, 5, 6]
        steps.clear()
        reproduce(["fig5"], out=tmp_path, progress=steps.append)
        assert [step.done for step in steps] == [6]
        assert (tmp_path / "results.json").read_bytes() == first

    def test_another_configuration_is_refused(self, tiny, tmp_path, monkeypatch):
        reproduce(["fig5"], out=tmp_path)
        before = (tmp_path / "results.json").read_bytes()
        monkeypatch.setitem(SCALES, "quick", replace(TINY, seed=1))
        with pytest.raises(gm.GraspModuliError, match="seed 0 there, 1 asked for"):
            reproduce(["fig5"], out=tmp_path)
        assert (tmp_path / "results.json").read_bytes() == before

    @pytest.mark.parametrize(
        ("options", "sentence"),
        [
            ({"names": ["fig13"]}, "name must be one of fig1, .* got 'fig13'"),
            ({"scale": "huge"}, "scale must be one of quick, paper, got 'huge'"),
            ({"threads": 0}, "threads must be at least 1"),
            ({"workers": 0}, "workers must be at least 1"),
            ({"workers": 2, "scheduler": "tcp://x"}, "exclude each other"),
        ],
    )
    def test_wrong_input(self, tmp_path, options, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            reproduce(**{"names": ["fig5"], "out": tmp_path, **options})

    def test_a_folder_that_is_a_file(self, tiny, tmp_path):
        (tmp_path / "file").write_text("")
        with pytest.raises(gm.GraspModuliError, match="out must be a folder that results"):
            reproduce(["fig5"], out=tmp_path / "file")

    def test_something_else_in_the_place_of_the_store(self, tiny, tmp_path):
        (tmp_path / "pieces.sqlite").write_text("not a database, not a database, not a database")
        with pytest.raises(gm.GraspModuliError, match="not a database"):
            reproduce(["fig5"], out=tmp_path)


#: Runs as `python -c RUN FOLDER`: the tiny scale in a process of its own.
RUN = """
import sys
import graspmoduli as gm
from graspmoduli.experiments import reproduce
from graspmoduli.experiments.settings import SCALES, Scale
SCALES["quick"] = {tiny}
if len(sys.argv) > 2:
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    reproduce(["fig5", "fig11"], out=sys.argv[1], threads=2)
except gm.GraspModuliError as error:
    print(error)
    sys.exit(2)
"""


def start(folder, *limits):
    output = (folder.parent / f"{folder.name}.txt").open("w")
    with output:
        command = [sys.executable, "-c", RUN.replace("{tiny}", repr(TINY)), str(folder), *limits]
        return subprocess.Popen(command, stdout=output)


def pieces_in(folder):
    """How many pieces a killed run left."""
    if not (folder / "pieces.sqlite").exists():
        return 0
    with contextlib.closing(sqlite3.connect(folder / "pieces.sqlite")) as connection:
        if ("results",) not in connection.execute("SELECT name FROM sqlite_master").fetchall():
            return 0
        return connection.execute("SELECT count(*) FROM results").fetchone()[0]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    assert start(folder).wait() == 0
    return (folder / "results.json").read_bytes()


@pytest.mark.long
def test_a_run_that_is_killed_goes_on(undisturbed, tmp_path):
    # Killed when it has so many pieces, whatever time that takes; the last one runs to its end.
    folder = tmp_path / "run"
    left = []
    for pieces in (1, 4, 9):
        process = start(folder)
        while process.poll() is None and pieces_in(folder) < pieces:
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        process.wait()
        left.append(pieces_in(folder))
        assert left[-1] >= pieces
    # Nothing that was there is lost.
    assert left == sorted(left)
    assert start(folder).wait() == 0
    assert (folder / "results.json").read_bytes() == undisturbed
    assert {p.name for p in folder.iterdir() if p.name.startswith(".")} == set()


@pytest.mark.long
def test_a_run_killed_at_any_moment_goes_on(undisturbed, tmp_path):
    # While modules load, the store is made, pictures are drawn.
    folder = tmp_path / "run"
    for seconds in random.Random(7).sample([0.3, 0.6, 0.9, 1.2, 1.8], 5):
        process = start(folder)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        process.kill()
        process.wait()
    assert start(folder).wait() == 0
    assert (folder / "results.json").read_bytes() == undisturbed


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="limits of file sizes are POSIX's")
def test_a_full_disk_is_one_sentence_and_loses_nothing(undisturbed, tmp_path):
    folder = tmp_path / "run"
    assert start(folder, "16000").wait() == 2
    output = (tmp_path / "run.txt").read_text()
    assert output.startswith("out")
    assert output.count("\n") == 1
    assert not (folder / "results.json").exists()
    assert start(folder).wait() == 0
    assert (folder / "results.json").read_bytes() == undisturbed


class TestCommand:
    def run(self, *arguments):
        command = [sys.executable, "-m", "graspmoduli", "reproduce", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    @pytest.mark.long
    def test_writes_a_report(self, tmp_path):
        result = self.run("fig12", "fig2", "--out", str(tmp_path))
        assert result.returncode == 0, result.stderr
        assert "models e–l" in result.stdout
        assert (tmp_path / "report.html").exists()
        again = self.run("fig12", "fig2", "--out", str(tmp_path))
        assert "fig12: going on, 24 of 24 pieces are there" in again.stderr

    @pytest.mark.parametrize(
        ("arguments", "sentence"),
        [
            (["fig99"], f"name must be one of {', '.join(NAMES)}, got 'fig99'"),
            (["--scale", "giant"], "scale must be one of quick, paper, got 'giant'"),
            (["--threads", "many"], "threads must be a whole number, got 'many'"),
        ],
    )
    def test_errors_are_one_line(self, arguments, sentence, tmp_path, capsys):
        assert cli._run(["reproduce", *arguments, "--out", str(tmp_path)]) == 2
        assert capsys.readouterr().err == f"graspmoduli: {sentence}\n"
