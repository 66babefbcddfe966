"""Task quality: against another solver of linear programs, invariants, degenerate, wrong input."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import graspmoduli as gm
from conftest import uniform_grasps
from degenerate import CIRCLE

ORIGIN = np.zeros(3)


def slow(space, wrenches, norm):
    """The largest t as one linear program for each wrench."""
    m = len(space.contacts)
    corners = space.wrenches.T
    per = corners.shape[1] // m
    least = np.inf
    for wrench in wrenches:
        limits = np.kron(np.eye(m), np.ones(per)) if norm == "each" else np.ones((1, m * per))
        found = linprog(
            np.append(np.zeros(m * per), -1.0),
            A_ub=np.hstack([limits, np.zeros((len(limits), 1))]),
            b_ub=np.ones(len(limits)),
            A_eq=np.hstack([corners, wrench[:, None]]),
            b_eq=np.zeros(6),
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        least = min(least, -found.fun)
    return least


@pytest.mark.parametrize("norm", ["sum", "each"])
@pytest.mark.parametrize(("m", "torsion"), [(2, 0.3), (3, 0.0), (3, 0.2), (4, 0.0), (5, 0.0)])
def test_agrees_with_linear_programs(m, torsion, norm):
    rng = np.random.default_rng(10 * m + int(10 * torsion))
    hand: Any = {"friction": 0.7, "edges": 7, "torsion": torsion}
    some = uniform_grasps(1500, rng, m)
    stable = gm.quality(*some, **hand) > 0.0
    rows = [*np.flatnonzero(stable)[:15], *np.flatnonzero(~stable)[:8]]
    contacts, normals, centers = (array[rows] for array in some)
    tasks = rng.normal(size=(len(rows), 3, 6))
    found = gm.task_quality(contacts, normals, centers, tasks, norm=norm, **hand)
    assert stable[rows].sum() > 5
    assert (found[stable[rows]] > 0.0).all()
    for k in range(len(rows)):
        space = gm.WrenchSpace(contacts[k], normals[k], centers[k], **hand)
        assert found[k] == pytest.approx(slow(space, tasks[k], norm), abs=1e-9)


def test_all_directions_are_the_quality():
    # The least over many unit wrenches is no less than Q, and gets there in the weakest direction.
    space = gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN)
    some = np.random.default_rng(3).normal(size=(200, 6))
    some /= np.linalg.norm(some, axis=1, keepdims=True)
    assert gm.task_quality(CIRCLE, -CIRCLE, ORIGIN, some) >= space.quality
    worst = space.weakest[None]
    found = gm.task_quality(CIRCLE, -CIRCLE, ORIGIN, worst)
    assert found == pytest.approx(space.quality, abs=1e-12)


def test_units_order_and_motion_do_not_matter():
    rng = np.random.default_rng(5)
    contacts, normals, centers = (a[0] for a in uniform_grasps(1, rng, 5))
    task = rng.normal(size=(4, 6))
    options: Any = {"friction": 0.8, "norm": "each"}
    wanted = gm.task_quality(contacts, normals, centers, task, **options)
    assert wanted > 0.0
    in_mm = task * [1, 1, 1, 1000, 1000, 1000]
    assert gm.task_quality(1000 * contacts, normals, 1000 * centers, in_mm, **options) == (
        pytest.approx(wanted, rel=1e-9)
    )
    other = [3, 1, 4, 0, 2]
    assert gm.task_quality(contacts[other], normals[other], centers, task[::-1], **options) == (
        pytest.approx(wanted, rel=1e-9)
    )
    # Twice the task is half as often resisted, and the hull of a task is the task.
    assert gm.task_quality(contacts, normals, centers, 2.0 * task, **options) == (
        pytest.approx(0.5 * wanted, rel=1e-9)
    )
    more = np.concatenate([task, rng.dirichlet(np.ones(4), 20) @ task])
    assert gm.task_quality(contacts, normals, centers, more, **options) == (
        pytest.approx(wanted, rel=1e-9)
    )


def test_what_balances_only_just_is_told_from_what_does_not():
    # Two hard fingers on a line resist any force, and no torque about it.
    pair = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    ask = [[0.0, 0, -1, 0, 0, 0]]
    assert gm.task_quality(pair, -pair, ORIGIN, ask, friction=0.5) == pytest.approx(0.5)
    assert gm.task_quality(pair, -pair, ORIGIN, ask, friction=0.5, norm="each") == pytest.approx(
        1.0
    )
    about = [[0.0, 0, 0, 1, 0, 0]]
    for norm in ("sum", "each"):
        assert gm.task_quality(pair, -pair, ORIGIN, about, friction=0.5, norm=norm) == 0.0
        assert gm.task_quality(pair, -pair, ORIGIN, [ask[0], about[0]], norm=norm) == 0.0


def test_a_lid_is_not_lifted_as_it_is_turned():
    bottle = gm.shapes.model("bottle")
    grasps = gm.synthesize(bottle, top=4)
    turn = [[0, 0, 0, 0, 0, 1.0], [0, 0, 0, 0, 0, -1.0]]
    by_turn = gm.task_quality(grasps, task=turn)
    by_lift = gm.task_quality(grasps, task=gm.gravity(1.0, [0, 0, -1]))
    assert by_turn.shape == by_lift.shape == (4,)
    assert by_turn.min() > 0.0
    assert np.argsort(by_turn).tolist() != np.argsort(by_lift).tolist()


def test_the_least_largest_force_balances():
    rng = np.random.default_rng(8)
    contacts, normals, centers = (a[0] for a in uniform_grasps(1, rng, 6))
    space = gm.WrenchSpace(contacts, normals, centers)
    load = rng.normal(size=6)
    both = [space.resist(load, norm=norm) for norm in ("sum", "each")]
    for answer in both:
        assert answer.forces is not None
        total = answer.forces.sum(0)
        turn = np.cross(contacts - centers, answer.forces).sum(0)
        np.testing.assert_allclose(np.append(total, turn), -load, atol=1e-9)
    pressed = [(np.asarray(answer.forces) * normals).sum(1) for answer in both]
    assert pressed[1].max() == pytest.approx(both[1].normal_force, abs=1e-9)
    assert pressed[1].max() <= pressed[0].max() + 1e-9
    assert pressed[0].sum() <= pressed[1].sum() + 1e-9


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"task": None}, "task must be given"),
        ({"task": [1, 0, 0, 0, 0, 0]}, r"task must have shape .* got \(6,\)"),
        ({"task": np.zeros((1, 6))}, "task must hold no wrench that is 0"),
        ({"task": [[np.nan, 0, 0, 0, 0, 0]]}, "task must be finite"),
        ({"task": np.ones((5, 2, 6)), "several": True}, "task must have a batch shape"),
        ({"task": np.ones((2, 6)), "norm": "both"}, 'norm must be "sum" or "each"'),
    ],
)
def test_wrong_arguments(arguments, sentence):
    given = dict(arguments)
    several = given.pop("several", False)
    contacts = np.stack([CIRCLE] * 3) if several else CIRCLE
    with pytest.raises(gm.GraspModuliError, match=sentence):
        gm.task_quality(contacts, -contacts, ORIGIN, **given)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((-1.0,), "mass must be"),
        ((1.0, [0, 0, 0]), "direction must have shape"),
        ((1.0, [0, 1]), "direction must have shape"),
    ],
)
def test_wrong_weights(arguments, sentence):
    with pytest.raises(gm.GraspModuliError, match=sentence):
        gm.gravity(*arguments)


def test_weight_comes_from_everywhere():
    task = gm.gravity(2.0, directions=500)
    np.testing.assert_allclose(np.linalg.norm(task[:, :3], axis=1), 19.6133)
    assert np.abs(task[:, :3].mean(0)).max() < 0.01 * 19.6
    assert not task[:, 3:].any()
