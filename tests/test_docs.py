"""What the documentation shows runs."""

import re
import subprocess
import sys

import pytest

from conftest import ROOT, some_long


def named(*names):
    """Has a path one of these in it?"""
    return lambda path: any(name in str(path) for name in names)


def run_blocks(path):
    """Executes the Python blocks of a page, one after the other."""
    scope: dict = {}
    for block in re.findall(r"```python\n(.*?)```", path.read_text(), re.DOTALL):
        exec(compile(block, path.name, "exec"), scope)


@pytest.mark.parametrize(
    "path",
    # That of torch runs where torch is: in tests/extras.
    some_long(
        [
            ROOT / "README.md",
            *sorted({*(ROOT / "docs").glob("*.md")} - {ROOT / "docs/gradient.md"}),
        ],
        named("paper.md", "cluster.md", "transfer.md", "object.md", "scan.md"),
    ),
    ids=lambda p: p.name,
)
@pytest.mark.filterwarnings("ignore:a table was found", "ignore:.* are flying pixels")
def test_python_blocks_run(path, monkeypatch, tmp_path):
    # What they write stays out of the checkout; what they read is where it is there.
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    run_blocks(path)


def test_linked_files_exist():
    for path in [ROOT / "README.md", *ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text()):
            assert (path.parent / target).exists(), f"{path.name} links to {target}"


@pytest.mark.parametrize(
    "path",
    some_long(
        sorted((ROOT / "examples").rglob("*.py")),
        named("examples/paper", "02_own", "03_family", "04_transfer"),
    ),
    ids=lambda p: p.stem,
)
def test_examples_run(path, tmp_path):
    result = subprocess.run(
        [sys.executable, path], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    assert len(path.read_text().splitlines()) < 80
    assert list(tmp_path.rglob("*.png"))
