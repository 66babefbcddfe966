"""The two ends of ε_l(δ₋, δ₊, r)."""

# Wrong types are passed on purpose.
# pyright: reportArgumentType=false

import importlib
import json
from typing import Any

import numpy as np
import pytest

import graspmoduli as gm
from conftest import ROOT
from graspmoduli.experiments.worst import proven_radius

# The package's name of the module is that of the function.
module = importlib.import_module("graspmoduli.epsilon")


#: A search of a few seconds: its pairs are proofs all the same.
SHORT: Any = {"rounds": 50}


@pytest.mark.parametrize(
    ("low", "high", "r", "options"),
    [
        (0.0, 0.1, 1.0, {"edges": None}),
        (0.05, 0.1, 0.5, {"edges": None, "friction": 0.7}),
        (0.0, 0.05, 1.0, {}),
        (0.02, 0.1, 2.0, {"edges": 5, "contacts": 5}),
    ],
)
def test_the_pair_proves_the_upper_end(low, high, r, options):
    found = gm.epsilon(low, high, r, **options, **SHORT)
    assert found.pair is not None
    good, lost = found.pair
    assert found.upper == gm.placed_distance(good, lost)
    assert found.lower < found.upper < 2.0
    assert len(good.contacts) == options.get("contacts", 3)
    for points in (good.contacts, good.center_of_mass[None]):
        assert np.linalg.norm(points, axis=1).max() <= r * (1 + 1e-12)
    friction = options.get("friction", 1.0)
    if options.get("edges", 8) is None:
        assert gm.circular_quality(good, friction=friction, tolerance=1e-4).lower >= high * (
            1 - 1e-4
        )
        assert gm.circular_quality(lost, friction=friction).upper <= low
    else:
        options = {"friction": friction, "edges": options.get("edges", 8)}
        # Doubled contacts are left to rounding.
        assert gm.quality(good, **options) >= high * (1 - 1e-9)
        assert gm.quality(lost, **options) <= low + 1e-9


def test_the_same_seed_gives_the_same_pair_and_another_another():
    one = gm.epsilon(0.0, 0.1, edges=None, seed=1, **SHORT)
    assert gm.epsilon(0.0, 0.1, edges=None, seed=1, **SHORT) == one
    other = gm.epsilon(0.0, 0.1, edges=None, seed=2, **SHORT)
    assert other.upper != one.upper
    assert other.lower == one.lower


@pytest.mark.parametrize(
    ("low", "high", "r", "friction", "edges"),
    [(0.0, 0.1, 1.0, 1.0, None), (0.02, 0.05, 0.7, 0.8, None), (0.0, 0.1, 1.0, 0.6, 32)],
)
def test_no_neighbour_within_the_lower_end_is_worse(low, high, r, friction, edges):
    lower = module.proven(module.Setting(low, high, r, friction, edges))
    assert lower > 0.0
    # Inscribed polygons hold less than round cones.
    options = {"friction": friction, "edges": edges or 24}
    grasps = gm.sample_configurations(200_000, r, seed=2)
    good = np.flatnonzero(gm.quality(grasps, **options) >= high)[:40]
    assert len(good) > 5
    for i in good:
        near = gm.sample_nearby(grasps[i], lower, 300, seed=int(i))
        assert gm.smallest_quality(near, **options).quality > low
        # Against the gradient, to the boundary of the neighbourhood.
        slope = gm.quality_gradient(grasps[i], **options)

        def unit(v):
            return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)

        tilted = unit(grasps[i].normals - lower * (1 - 1e-3) * unit(slope.normals))
        worse = gm.quality(
            grasps[i].contacts - lower * unit(slope.contacts),
            tilted,
            grasps[i].center_of_mass - lower * unit(slope.center_of_mass),
            **options,
        )
        assert worse > low


def test_the_lower_end_of_round_cones_is_the_lipschitz_constant_of_the_theorem():
    found = module.proven(module.Setting(0.0, 0.2, 1.0, 1.0, None))
    assert found == pytest.approx(0.2 / np.sqrt(20.0), rel=1e-8)
    found = module.proven(module.Setting(0.1, 0.2, 1.0, 1.0, None))
    assert found == pytest.approx(0.1 / np.sqrt(34.0), rel=1e-8)
    # Polygons of many edges come near to it.
    fine = module.proven(module.Setting(0.1, 0.2, 1.0, 1.0, 4096))
    assert fine == pytest.approx(found, rel=1e-4)
    # That of the report, of four numbers.
    for delta, friction, edges in ((0.2, 1.0, 8), (0.05, 1.0, 8), (0.3, 0.4, 6)):
        setting = module.Setting(0.0, delta, 1.0, friction, edges)
        assert module.proven(setting) == proven_radius(delta, friction, edges)


def test_where_no_grasp_is_as_good_there_is_no_pair():
    found = gm.epsilon(0.0, 0.9, **SHORT)
    assert found.upper == np.inf
    assert found.pair is None
    assert found.lower > 0.0


def test_wrong_input_is_said_so():
    for call, sentence in (
        (lambda: gm.epsilon(-0.1, 0.2), "delta_minus must be a finite number, 0 or positive"),
        (lambda: gm.epsilon(0.2, 0.2), "delta_plus must be greater than delta_minus, got 0.2"),
        (lambda: gm.epsilon(0.0, None), "delta_plus must be a finite number, got None"),
        (lambda: gm.epsilon(0.0, 1e300), "delta_plus must be at most 1e60"),
        (lambda: gm.epsilon(0.0, 0.2, 1e300), "contacts must be from 1e-60 to 1e60"),
        (lambda: gm.epsilon(0.0, 0.2, rounds=10**6), "rounds must be at most"),
        (lambda: gm.epsilon(0.0, 0.2, 0.0), "r must be a positive finite number, got 0.0"),
        (lambda: gm.epsilon(0.0, 0.2, contacts=2), "contacts must be at least 3, got 2"),
        (lambda: gm.epsilon(0.0, 0.2, friction=0), "friction must be a positive finite number"),
        (lambda: gm.epsilon(0.0, 0.2, edges=2), "edges must be at least 3, got 2"),
        (lambda: gm.epsilon(0.0, 0.2, seed=-1), "seed must be at least 0, got -1"),
    ):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            call()


def test_the_table_of_the_page_is_that_of_its_pairs_and_they_are_proofs():
    page = (ROOT / "docs/epsilon.md").read_text()
    rows = json.loads((ROOT / "docs/epsilon.json").read_text())
    assert len(rows) >= 5
    for row in rows:
        low, high, r, friction, edges = row["setting"]
        good, lost = (gm.PlacedGrasp(**g) for g in row["pair"])
        assert gm.placed_distance(good, lost) == pytest.approx(row["upper"], rel=1e-12)
        assert module.proven(module.Setting(*row["setting"])) == row["lower"]
        for points in (good.contacts, good.center_of_mass):
            assert np.linalg.norm(points, axis=-1).max() <= r * (1 + 1e-12)
        if edges is None:
            sixteen = gm.quality(good, friction=friction, edges=16)
            assert max(sixteen, gm.circular_quality(good, friction=friction).lower) >= high
            assert gm.circular_quality(lost, friction=friction).upper <= low
            factor = row["upper"] / row["lower"]
            assert factor < (2.4 if low > 0.0 else 2.1 if r > 1.0 else 2.0)
        else:
            assert gm.quality(good, friction=friction, edges=edges) >= high
            assert gm.quality(lost, friction=friction, edges=edges) <= low
        line = (
            f"| {low:g} | {high:g} | {r:g} | {friction:g} | {edges or 'round'} "
            f"| {row['lower']:.4f} | {row['upper']:.4f} |"
        )
        assert line in page
