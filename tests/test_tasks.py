"""Task quality: against another solver of linear programs, invariants, degenerate, wrong input."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import graspmoduli as gm
import objects_made
from conftest import uniform_grasps
from degenerate import CIRCLE
from graspmoduli import tasks

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


@pytest.mark.parametrize("norm", ["sum", "each"])
@pytest.mark.parametrize(("m", "torsion"), [(2, 0.3), (3, 0.0), (4, 0.1), (6, 0.0)])
def test_the_gradient_agrees_with_differences(m, torsion, norm):
    rng = np.random.default_rng(m)
    hand: Any = {"friction": 0.7, "edges": 6, "torsion": torsion, "norm": norm}
    some = uniform_grasps(4000, rng, m)
    held = np.flatnonzero(gm.quality(*some, **hand) > 0.01)[:12]
    task = rng.normal(size=(2, 6))
    checked = 0
    for k in held:
        contacts, normals, center = (array[k] for array in some)
        slope = gm.task_gradient(contacts, normals, center, task, **hand)
        assert slope.value == gm.task_quality(contacts, normals, center, task, **hand)
        for _ in range(4):
            move, turn, shift = rng.normal(size=(m, 3)), rng.normal(size=(m, 3)), rng.normal(size=3)
            turn -= (turn * normals).sum(axis=1, keepdims=True) * normals

            def at(h, move=move, turn=turn, shift=shift, k=k):
                ways = some[1][k] + h * turn
                ways /= np.linalg.norm(ways, axis=1, keepdims=True)
                return gm.task_quality(
                    some[0][k] + h * move, ways, some[2][k] + h * shift, task, **hand
                )

            step = 1e-6
            ahead, behind = (at(step) - at(0)) / step, (at(0) - at(-step)) / step
            if abs(ahead - behind) > 1e-4 * (1 + abs(ahead)):
                continue  # A kink: another basis is best on either side.
            exact = (
                (slope.contacts * move).sum()
                + (slope.normals * turn).sum()
                + (slope.center_of_mass * shift).sum()
            )
            assert exact == pytest.approx((ahead + behind) / 2, rel=1e-4, abs=1e-5)
            checked += 1
    assert checked > 20


def test_a_load_that_nothing_resists_has_no_slope():
    slope = gm.task_gradient(CIRCLE[:2], -CIRCLE[:2], ORIGIN, [[0, 0, 1.0, 0, 0, 0], [1e9] * 6])
    assert slope.value == 0.0
    assert not slope.contacts.any()


@pytest.mark.parametrize("norm", ["sum", "each"])
def test_the_core_agrees_with_the_forces_of_a_wrench_space(norm):
    """The slow twin, on uniform, flat and lattice grasps."""
    rng = np.random.default_rng(8)
    for m in (3, 4):
        contacts, normals, centers = uniform_grasps(200, rng, m)
        contacts[50:100, :, 2] *= 1e-5
        contacts[100:150] = np.round(2 * contacts[100:150])
        axes = np.concatenate([np.eye(3), -np.eye(3)])
        normals[100:150] = axes[rng.integers(0, 6, (50, m))]
        tasks = rng.normal(size=(200, 2, 6))
        found = gm.task_quality(contacts, normals, centers, tasks, friction=0.8, norm=norm)
        for k in range(200):
            space = gm.WrenchSpace(contacts[k], normals[k], centers[k], friction=0.8)
            slow = min(1.0 / space.resist(load, norm=norm).normal_force for load in tasks[k])
            assert found[k] == pytest.approx(slow, rel=1e-8, abs=1e-12)


class TestGraspsForATask:
    LIFT, LID = gm.gravity(1.0, directions=16), np.eye(6)[[5, 5]] * [[1.0], [-1.0]]

    def test_each_task_has_its_own_best_grasp(self):
        jar = gm.shapes.MODELS["j"]
        lifting = gm.synthesize(jar, task=self.LIFT, top=3)
        turning = gm.synthesize(jar, task=self.LID, top=3)
        for grasps, own, other in ((lifting, self.LIFT, turning), (turning, self.LID, lifting)):
            values = [gm.task_quality(grasp, task=own) for grasp in grasps]
            assert values == sorted(values, reverse=True)
            assert values[0] > 1.05 * max(gm.task_quality(g, task=own) for g in other)
            free = gm.synthesize(jar, top=5)
            assert values[0] >= max(gm.task_quality(g, task=own) for g in free)

    @pytest.mark.parametrize("options", [{"contacts": 4}, {"contacts": 2, "torsion": 0.1}])
    def test_other_fingers_climb_in_their_task(self, options):
        pot = gm.shapes.MODELS["c"]
        best = gm.synthesize(pot, task=self.LID, top=1, **options)[0]
        free = gm.synthesize(pot, top=5, **options)
        assert gm.task_quality(best, task=self.LID) > max(
            gm.task_quality(grasp, task=self.LID) for grasp in free
        )

    @pytest.mark.parametrize("seed", [0, 2])
    def test_a_task_never_leaves_less_than_no_task(self, seed):
        vase = gm.shapes.MODELS["l"]
        for friction in (0.1, 0.3):
            options = {"friction": friction, "seed": seed}
            best, free = (
                max(gm.task_quality(g, task=self.LID) for g in gm.synthesize(vase, **own))
                for own in ({**options, "task": self.LID}, options)
            )
            assert best >= free > 0.0

    def test_on_a_mesh(self):
        fit = gm.fit(objects_made.OBJECTS["bottle"]())
        axis = fit.pose[:3, 2]
        lid = np.concatenate([np.zeros((2, 3)), [axis, -axis]], axis=1)
        found = fit.synthesize(task=lid)
        values = [grasp.task_quality or 0.0 for grasp in found]
        assert values == sorted(values, reverse=True)
        assert found[0].task_quality == gm.task_quality(found[0], task=lid)
        assert values[0] > 1.02 * max(gm.task_quality(g, task=lid) for g in fit.synthesize())

    def test_files(self, tmp_path):
        rows = tmp_path / "lid.txt"
        rows.write_text("0 0 0 0 0 1  # open\n0, 0, 0, 0, 0, -1\n")
        np.save(tmp_path / "lid.npy", self.LID)
        (tmp_path / "lid.toml").write_text("wrenches = [[0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, -1]]")
        for name in ("lid.txt", "lid.npy", "lid.toml"):
            np.testing.assert_array_equal(tasks.read_task(tmp_path / name), self.LID)
        rows.write_text("0 0 0\n")
        for name, words in (("lid.txt", "task must have shape"), ("none", "task must be gravity")):
            with pytest.raises(gm.GraspModuliError, match=words):
                tasks.read_task(tmp_path / name)
