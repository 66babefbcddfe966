"""The pairs that refute the paper's estimates of ε, by the checker that anyone can run."""

import copy
import importlib
import json
import subprocess
import sys

import pytest

import graspmoduli as gm
from conftest import ROOT

sys.path.insert(0, str(ROOT / "docs"))
checker = importlib.import_module("check_counterexamples")

ROWS = json.loads((ROOT / "docs/counterexamples.json").read_text())


def test_the_checker_needs_scipy_alone():
    path = ROOT / "docs/check_counterexamples.py"
    assert "graspmoduli" not in path.read_text()
    found = subprocess.run([sys.executable, path], capture_output=True, text=True, check=True)
    assert found.stdout.count("eps_8") == len(ROWS)


def test_both_estimates_are_refuted_with_and_without_a_normal_at_the_pole():
    for delta, paper in ((0.05, 0.02), (0.2, 0.1)):
        rows = [row for row in ROWS if row["delta"] == delta]
        assert all(row["paper"] == paper and row["epsilon"] < paper for row in rows)
        lowest = [min(n[2] for n in row["good"]["normals"]) for row in rows]
        assert min(lowest) == -1.0
        assert max(lowest) > -0.9


@pytest.mark.parametrize("row", ROWS)
def test_ours_agrees_and_spoiled_rows_do_not_pass(row):
    q, d, _ = checker.check(row)
    good, lost = (gm.PlacedGrasp(**row[name]) for name in ("good", "lost"))
    assert gm.quality(good) == pytest.approx(q, abs=1e-12)
    assert gm.quality(lost) == 0.0
    assert gm.placed_distance(good, lost) == pytest.approx(d, abs=1e-15)
    for spoil in (
        lambda r: r.update(delta=q + 1e-9),
        lambda r: r.update(epsilon=d - 1e-9),
        lambda r: r.update(lost=r["good"]),
        lambda r: r["good"].update(center_of_mass=[1.0, 0.1, 0.0]),
    ):
        other = copy.deepcopy(row)
        spoil(other)
        with pytest.raises(AssertionError):
            checker.check(other)
