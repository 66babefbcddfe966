"""Other measures: against hulls and linear programs, invariants, degenerate and wrong input."""

import copy
import pickle
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

import graspmoduli as gm
from conftest import uniform_grasps
from degenerate import CASES, CIRCLE, ORIGIN, SQUEEZE, SQUEEZE_NORMALS

#: Contacts and cones: many, soft, of their own friction.
HANDS: list[tuple[int, dict[str, Any]]] = [
    (2, {"torsion": 0.4, "friction": 0.8}),
    (3, {}),
    (3, {"torsion": 0.2, "edges": 5}),
    (4, {"friction": [0.3, 0.9, 1.5, 0.6]}),
    (5, {"edges": 6, "friction": 0.6}),
    (7, {"friction": 0.2, "edges": 4}),
]
#: Norms for which hulls are small.
FEW: list[tuple[int, dict[str, Any]]] = [
    (2, {"torsion": 0.4, "friction": 0.8}),
    (3, {"edges": 4}),
    (3, {"edges": 3, "torsion": 0.2}),
    (4, {"edges": 3, "friction": [0.5, 0.9, 1.5, 0.7]}),
]


def named(hands):
    return pytest.mark.parametrize(("m", "hand"), hands, ids=lambda value: str(value))


def stable_grasps(m, hand, count, seed=0):
    """Force closure ones, uniform otherwise."""
    some = uniform_grasps(4000, np.random.default_rng(seed + m), m)
    rows = np.flatnonzero(gm.quality(*some, **hand) > 1e-3)[:count]
    assert len(rows) == count
    return tuple(array[rows] for array in some)


def corners_of(space, norm):
    """Points whose hull the fingers reach: each wrench, or sums of one, or none, of each finger."""
    if norm == "sum":
        return space.wrenches
    m = len(space.contacts)
    own = np.concatenate([space.wrenches.reshape(m, -1, 6), np.zeros((m, 1, 6))], axis=1)
    return np.array([sum(choice) for choice in product(*own)])


def largest(space, norm, direction):
    """The largest t such that t times a wrench is resisted, by a linear program."""
    m, n = len(space.contacts), len(space.wrenches)
    limits = np.kron(np.eye(m), np.ones(n // m)) if norm == "each" else np.ones((1, n))
    found = linprog(
        np.append(np.zeros(n), -1.0),
        A_ub=np.hstack([limits, np.zeros((len(limits), 1))]),
        b_ub=np.ones(len(limits)),
        A_eq=np.hstack([space.wrenches.T, np.asarray(direction)[:, None]]),
        b_eq=np.zeros(6),
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    return -found.fun


class TestForceAndTorque:
    @pytest.mark.parametrize("norm", ["sum", "each"])
    @named(FEW)
    def test_are_what_the_hull_of_all_corners_has(self, m, hand, norm):
        grasps = stable_grasps(m, hand, 12)
        found = gm.measures(*grasps, norm=norm, **hand)
        for k, grasp in enumerate(zip(*grasps, strict=True)):
            planes = ConvexHull(corners_of(gm.WrenchSpace(*grasp, **hand), norm)).equations
            for value, part in ((found.force, planes[:, :3]), (found.torque, planes[:, 3:6])):
                wanted = (-planes[:, 6] / np.maximum(np.linalg.norm(part, axis=1), 1e-12)).min()
                assert value[k] == pytest.approx(wanted, rel=1e-8)

    @named(HANDS)
    def test_are_what_the_half_spaces_have(self, m, hand):
        grasps = stable_grasps(m, hand, 20)
        found = gm.measures(*grasps, **hand)
        for k, grasp in enumerate(zip(*grasps, strict=True)):
            facets = gm.WrenchSpace(*grasp, **hand).facets
            for value, part in ((found.force, slice(0, 3)), (found.torque, slice(3, 6))):
                wanted = facets.offsets / np.linalg.norm(facets.normals[:, part], axis=1)
                assert value[k] == pytest.approx(wanted.min(), rel=1e-9)

    @pytest.mark.parametrize("norm", ["sum", "each"])
    @named(HANDS)
    def test_no_direction_is_worse_and_one_is_as_bad_by_linear_programs(self, m, hand, norm):
        grasps = stable_grasps(m, hand, 1)
        rng = np.random.default_rng(m)
        found = gm.measures(*grasps, norm=norm, **hand)
        for k, grasp in enumerate(zip(*grasps, strict=True)):
            space = gm.WrenchSpace(*grasp, **hand)
            for value, part in ((found.force[k], slice(0, 3)), (found.torque[k], slice(3, 6))):
                least, worst = np.inf, np.zeros(6)
                # From everywhere, then ever nearer to the worst so far.
                for spread in (np.inf, *np.repeat(0.5 ** np.arange(1, 20), 8)):
                    for _ in range(60 if spread == np.inf else 1):
                        direction = np.zeros(6)
                        direction[part] = rng.normal(size=3)
                        if spread < np.inf:
                            direction = worst + spread * direction
                        direction /= np.linalg.norm(direction)
                        t = largest(space, norm, direction)
                        assert t >= value * (1 - 1e-8)
                        if t < least:
                            least, worst = t, direction
                assert least <= value * 1.02

    def test_the_worst_direction_is_as_bad(self):
        for contacts, normals, center in zip(*stable_grasps(4, {}, 10), strict=True):
            found = gm.measures(contacts, normals, center)
            # The weakest direction where torques weigh nothing, and where forces do.
            for scale, part, value in ((1e-20, slice(0, 3), found.force),
                                       (1e20, slice(3, 6), found.torque)):  # fmt: skip
                weakest = gm.WrenchSpace(contacts, normals, center, length_scale=scale).weakest
                push = np.zeros(6)
                push[part] = weakest[part] / np.linalg.norm(weakest[part])
                at = gm.task_quality(contacts, normals, center, [push])
                assert at == pytest.approx(value, rel=1e-8)

    def test_slopes_are_those_of_the_quality_with_such_a_length_scale(self):
        contacts, normals, centers = stable_grasps(4, {}, 6)
        rng = np.random.default_rng(11)
        step = 1e-6 * rng.normal(size=contacts.shape)
        for scale, name in ((1e-20, "force"), (1e20, "torque")):
            slope = gm.quality_gradient(contacts, normals, centers, length_scale=scale)
            unit = max(scale, 1.0)
            one, other = (getattr(gm.measures(contacts + way * step, normals, centers), name)
                          for way in (-1, 1))  # fmt: skip
            wanted = 2 * (slope.contacts * step).sum((1, 2)) * unit
            np.testing.assert_allclose(slope.value * unit, (one + other) / 2, rtol=1e-7)
            np.testing.assert_allclose(other - one, wanted, rtol=1e-4, atol=1e-9)

    def test_round_cones_bound_them_from_above(self):
        grasps = stable_grasps(3, {}, 4)
        found = gm.measures(*grasps, edges=8)
        finer = gm.measures(*grasps, edges=200)
        for scale, name in ((1e-20, "force"), (1e20, "torque")):
            round_ones = gm.circular_quality(*grasps, length_scale=scale, tolerance=1e-2)
            lower, upper = round_ones.lower * max(scale, 1.0), round_ones.upper * max(scale, 1.0)
            assert (getattr(found, name) <= upper).all()
            assert (getattr(finer, name) <= upper).all()
            assert (getattr(finer, name) >= lower * 0.999).all()

    def test_are_no_less_than_the_quality(self):
        some = uniform_grasps(1000, np.random.default_rng(3), 4)
        for norm in ("sum", "each"):
            found = gm.measures(*some, norm=norm)
            for scale in (0.2, 1.0, 5.0):
                q = gm.quality(*some, norm=norm, length_scale=scale)
                assert (found.force >= q * (1 - 1e-12)).all()
                assert (found.torque >= q * scale * (1 - 1e-12)).all()
                np.testing.assert_array_equal(found.force > 0.0, q > 0.0)
                np.testing.assert_array_equal(found.torque > 0.0, q > 0.0)

    def test_weight_from_everywhere_is_held(self):
        grasps = stable_grasps(3, {}, 5)
        by_weight = gm.task_quality(*grasps, task=gm.gravity(1.0, directions=300))
        force = gm.measures(*grasps).force
        assert (by_weight * 9.80665 >= force * (1 - 1e-9)).all()
        assert (by_weight * 9.80665 <= force * 1.1).all()


class TestGraspMatrix:
    @named(HANDS)
    @pytest.mark.parametrize("scale", [1.0, 0.3])
    def test_singular_values_are_those_of_the_matrix(self, m, hand, scale):
        grasps = uniform_grasps(20, np.random.default_rng(m), m)
        found = gm.measures(*grasps, length_scale=scale, **hand)
        for k, (contacts, normals, center) in enumerate(zip(*grasps, strict=True)):
            columns = []
            for point, normal in zip(contacts, normals, strict=True):
                for axis in np.eye(3):
                    torque = np.cross(point - center, axis) / scale
                    columns.append(np.append(axis, torque))
                if "torsion" in hand:
                    columns.append(np.append(np.zeros(3), hand["torsion"] / scale * normal))
            matrix = np.array(columns).T
            wanted = np.linalg.svd(matrix, compute_uv=False)
            # Two hard fingers do not turn about their line.
            np.testing.assert_allclose(found.singular_values[k], wanted, atol=1e-13)
            assert found.isotropy[k] == pytest.approx(wanted[5] / wanted[0], abs=1e-12)
            determinant = np.linalg.det(matrix @ matrix.T)
            assert found.ellipsoid_volume[k] == pytest.approx(np.sqrt(determinant), rel=1e-9)
            space = gm.WrenchSpace(contacts, normals, center, length_scale=scale, **hand)
            least = space.smallest_singular_value
            assert least == pytest.approx(found.singular_values[k, 5], rel=1e-12)

    @pytest.mark.parametrize("size", [1e-50, 1e-9, 1.0, 1e9, 1e50])
    def test_all_of_them_are_right_at_any_lever_arm(self, size):
        # Six fingers at ±r e_i: Σ [1, r×; …] has the eigenvalues 6 and 4 r², each three times.
        six = size * np.vstack([np.eye(3), -np.eye(3)])
        found = gm.measures(six, -six / size, ORIGIN)
        wanted = np.sort([np.sqrt(6.0)] * 3 + [2.0 * size] * 3)[::-1]
        np.testing.assert_allclose(found.singular_values, wanted, rtol=1e-13)
        assert found.ellipsoid_volume == pytest.approx((2.0 * size * np.sqrt(6.0)) ** 3, rel=1e-12)
        other = gm.measures(six, -six / size, ORIGIN, length_scale=size)
        np.testing.assert_allclose(other.singular_values, np.sqrt([6.0] * 3 + [4.0] * 3))
        assert other.isotropy == pytest.approx(np.sqrt(2.0 / 3.0), rel=1e-13)

    def test_too_few_columns_and_directions_are_zeros(self):
        for m, rank in ((1, 3), (2, 5)):
            found = gm.measures(CIRCLE[:m], -CIRCLE[:m], ORIGIN)
            assert (found.singular_values[:rank] > 0.5).all()
            np.testing.assert_array_equal(found.singular_values[rank:], 0.0)
            assert found.isotropy == found.ellipsoid_volume == 0.0
        soft = gm.measures(SQUEEZE, SQUEEZE_NORMALS, ORIGIN, torsion=0.1)
        # Two fingers that twist by 0.1 each about their line.
        assert soft.singular_values[5] == pytest.approx(0.1 * np.sqrt(2.0), rel=1e-12)


class TestCentroid:
    def test_is_where_the_contacts_are_on_average(self):
        contacts, normals, centers = uniform_grasps(30, np.random.default_rng(7), 4)
        wanted = [np.linalg.norm(sum(c) / 4 - z) for c, z in zip(contacts, centers, strict=True)]
        for scale in (1.0, 0.3):
            found = gm.measures(contacts, normals, centers, length_scale=scale)
            np.testing.assert_allclose(found.centroid_distance, wanted, rtol=1e-12)


class TestMinWeight:
    @named(HANDS)
    def test_is_the_linear_program_of_its_definition(self, m, hand):
        grasps = stable_grasps(m, hand, 15)
        found = gm.measures(*grasps, **hand).min_weight
        for k, grasp in enumerate(zip(*grasps, strict=True)):
            wrenches = gm.WrenchSpace(*grasp, **hand).wrenches
            n = len(wrenches)
            # α, and l, the least of them, is what is largest.
            program = linprog(
                np.append(np.zeros(n), -1.0),
                A_ub=np.hstack([-np.eye(n), np.ones((n, 1))]),
                b_ub=np.zeros(n),
                A_eq=np.vstack(
                    [np.hstack([wrenches.T, np.zeros((6, 1))]), np.append(np.ones(n), 0)]
                ),
                b_eq=np.eye(7)[6],
                bounds=[(None, None)] * (n + 1),
                options={"primal_feasibility_tolerance": 1e-10},
            )
            assert found[k] == pytest.approx(-n * program.fun, abs=1e-9)
        assert ((found > 0.0) & (found < 1.0)).all()

    def test_is_one_where_all_wrenches_balance_alike(self):
        assert gm.measures(CIRCLE, -CIRCLE, ORIGIN).min_weight == 1.0
        six = np.vstack([np.eye(3), -np.eye(3)])
        assert gm.measures(six, -six, ORIGIN, friction=0.3).min_weight == 1.0

    def test_neither_norm_nor_length_scale_matter(self):
        grasps = stable_grasps(4, {}, 10)
        wanted = gm.measures(*grasps).min_weight
        np.testing.assert_array_equal(gm.measures(*grasps, norm="each").min_weight, wanted)
        other = gm.measures(*grasps, length_scale=0.2).min_weight
        np.testing.assert_allclose(other, wanted, rtol=1e-10)


FIELDS = ("force", "torque", "singular_values", "centroid_distance", "min_weight")


class TestInvariants:
    @named(HANDS)
    def test_rigid_motions_do_not_matter(self, m, hand):
        contacts, normals, centers = stable_grasps(m, hand, 8)
        found = gm.measures(contacts, normals, centers, **hand)
        edges = hand.get("edges", 8)
        # The cones' edges turn with e₃, by as much as takes one edge to the next.
        c, s = np.cos(2 * np.pi / edges), np.sin(2 * np.pi / edges)
        turn, shift = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([0.3, -2.0, 0.7])
        moved = gm.measures(contacts @ turn.T + shift, normals @ turn.T, centers @ turn.T + shift,
                            **hand)  # fmt: skip
        for name in FIELDS:
            np.testing.assert_allclose(getattr(moved, name), getattr(found, name), rtol=1e-9)
        any_turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
        turned = gm.measures(contacts @ any_turn, normals @ any_turn, centers @ any_turn, **hand)
        for name in ("singular_values", "centroid_distance"):
            np.testing.assert_allclose(getattr(turned, name), getattr(found, name), rtol=1e-9)

    def test_the_order_of_contacts_does_not_matter(self):
        contacts, normals, centers = stable_grasps(5, {}, 10)
        friction = np.array([0.5, 1.0, 0.7, 1.2, 0.9])
        found = gm.measures(contacts, normals, centers, friction=friction)
        order = [3, 1, 4, 0, 2]
        mixed = gm.measures(
            contacts[:, order], normals[:, order], centers, friction=friction[order]
        )
        np.testing.assert_array_equal(mixed.force, found.force)
        np.testing.assert_array_equal(mixed.torque, found.torque)
        for name in FIELDS:
            np.testing.assert_allclose(getattr(mixed, name), getattr(found, name), rtol=1e-9)

    @named(HANDS)
    @pytest.mark.parametrize("unit", [1e-20, 1e-3, 1e3, 1e20])
    def test_units_are_the_callers(self, m, hand, unit):
        contacts, normals, centers = stable_grasps(m, hand, 6)
        found = gm.measures(contacts, normals, centers, **hand)
        other = dict(hand)
        if "torsion" in hand:
            other["torsion"] = unit * hand["torsion"]
        scaled = gm.measures(unit * contacts, normals, unit * centers, length_scale=unit, **other)
        alone = gm.measures(unit * contacts, normals, unit * centers, **other)
        for name, power in (("force", 0), ("torque", 1), ("centroid_distance", 1),
                            ("min_weight", 0)):  # fmt: skip
            wanted = getattr(found, name) * unit**power
            np.testing.assert_allclose(getattr(scaled, name), wanted, rtol=1e-9)
            np.testing.assert_allclose(getattr(alone, name), wanted, rtol=1e-9)
        np.testing.assert_allclose(scaled.singular_values, found.singular_values, rtol=1e-9)

    def test_a_pure_torque_does_not_know_the_centre_of_mass(self):
        contacts, normals, centers = stable_grasps(4, {}, 10)
        found = gm.measures(contacts, normals, centers)
        away = gm.measures(contacts, normals, centers + np.array([0.5, -3.0, 20.0]))
        np.testing.assert_allclose(away.torque, found.torque, rtol=1e-8)
        assert (away.force < 0.5 * found.force).all()
        np.testing.assert_allclose(
            gm.measures(contacts, normals, centers, length_scale=0.1).torque,
            found.torque,
            rtol=1e-9,
        )


class TestDegenerate:
    @pytest.mark.parametrize("norm", ["sum", "each"])
    @pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
    def test_all_are_numbers_and_zeros_where_not_force_closure(self, case, norm):
        found = gm.measures(
            case.contacts, case.normals, case.center, friction=case.friction, norm=norm
        )
        closed = case.truth() > 0
        for name in ("force", "torque", "min_weight"):
            assert (getattr(found, name) > 0.0) == closed
        numbers = [*found.singular_values, found.isotropy, found.ellipsoid_volume, found.force,
                   found.torque, found.min_weight, found.centroid_distance]  # fmt: skip
        assert np.isfinite(numbers).all()
        assert min(numbers) >= 0.0

    @pytest.mark.parametrize("norm", ["sum", "each"])
    @pytest.mark.parametrize("away", [0.0, 1e3, 1e6])
    def test_nearly_flat_ones_far_away_are_what_the_kernel_says(self, away, norm):
        rng = np.random.default_rng(9)
        contacts, normals, centers = uniform_grasps(600, rng, 5)
        flat = 10.0 ** rng.uniform(-7, 0, (600, 1, 2))
        contacts[..., 1:] *= flat
        contacts += away * rng.normal(size=3)
        found = gm.measures(contacts, normals, centers, norm=norm)
        q = gm.quality(contacts, normals, centers, norm=norm)
        assert (q > 0.0).sum() > 100
        for value in (found.force, found.torque):
            assert (value >= q * (1 - 1e-9)).all()
            np.testing.assert_array_equal(value > 0.0, q > 0.0)
        np.testing.assert_array_equal(found.min_weight > 0.0, q > 0.0)
        assert (found.singular_values[q > 0.0] > 0.0).all()

    def test_two_hard_fingers_hold_forces_only_on_a_knifes_edge(self):
        found = gm.measures(SQUEEZE, SQUEEZE_NORMALS, ORIGIN)
        assert found.force == found.torque == found.min_weight == 0.0
        assert gm.task_quality(SQUEEZE, SQUEEZE_NORMALS, ORIGIN, gm.gravity(1.0)) > 0.0

    def test_contacts_all_in_the_centre_of_mass(self):
        hands: list[dict[str, Any]] = [{}, {"torsion": 0.3}]
        for hand in hands:
            found = gm.measures(np.zeros((3, 3)), -CIRCLE, ORIGIN, **hand)
            assert found.force == found.torque == found.min_weight == found.centroid_distance == 0.0
            rank = 5 if hand else 3
            np.testing.assert_array_equal(found.singular_values > 0.0, np.arange(6) < rank)

    def test_lever_arms_of_any_length_side_by_side(self):
        sizes = np.array([1e-50, 1e-3, 1e40])
        contacts = sizes[:, None, None] * CIRCLE
        hands: list[dict[str, Any]] = [{}, {"norm": "each"}, {"torsion": 1e-59}]
        for hand in hands:
            found = gm.measures(contacts, -CIRCLE, ORIGIN, **hand)
            np.testing.assert_allclose(found.force, found.force[1], rtol=1e-9)
            np.testing.assert_allclose(found.torque, found.torque[1] * sizes / 1e-3, rtol=1e-9)


class TestShapes:
    def test_many_are_each_by_itself(self):
        contacts, normals, centers = (a.reshape(2, 3, *a.shape[1:])
                                      for a in stable_grasps(4, {}, 6))  # fmt: skip
        frictions = np.linspace(0.5, 1.5, 24).reshape(2, 3, 4)
        scales = np.linspace(0.5, 2.0, 6).reshape(2, 3)
        many = gm.measures(contacts, normals, centers, friction=frictions, length_scale=scales)
        assert many.force.shape == many.isotropy.shape == (2, 3)
        assert many.singular_values.shape == (2, 3, 6)
        for k in np.ndindex(2, 3):
            one = gm.measures(
                contacts[k], normals[k], centers[k], friction=frictions[k], length_scale=scales[k]
            )
            assert isinstance(one.force, float)
            assert isinstance(one.isotropy, float)
            for name in (*FIELDS, "isotropy", "ellipsoid_volume"):
                np.testing.assert_allclose(getattr(many, name)[k], getattr(one, name), rtol=1e-12)

    def test_none_is_an_empty_batch(self):
        none = gm.measures(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), ORIGIN)
        assert none.force.shape == none.min_weight.shape == none.ellipsoid_volume.shape == (0,)
        assert none.singular_values.shape == (0, 6)
        soft = gm.measures(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), ORIGIN, torsion=0.1)
        assert soft.torque.shape == (0,)

    def test_grasps_of_the_library_come_as_they_are(self):
        best = gm.synthesize(gm.shapes.model("bottle"), top=2)
        many = gm.measures(best)
        one = gm.measures(
            best[1].contacts, best[1].normals, best[1].center_of_mass,
            length_scale=best[1].length_scale,
        )  # fmt: skip
        for name in FIELDS:
            np.testing.assert_allclose(getattr(many, name)[1], getattr(one, name), rtol=1e-12)

    def test_results_compare_copy_and_do_not_change(self):
        found = gm.measures(np.stack([CIRCLE, CIRCLE]), -CIRCLE, ORIGIN)
        for other in (copy.deepcopy(found), pickle.loads(pickle.dumps(found))):
            assert other == found
            for name in (*FIELDS, "isotropy", "ellipsoid_volume"):
                with pytest.raises(ValueError, match="read-only"):
                    getattr(other, name)[0] = 1.0

    @pytest.mark.parametrize(
        ("wrong", "sentence"),
        [
            ({"friction": -1}, "friction must be"),
            ({"edges": 2}, "edges must be"),
            ({"torsion": -0.1}, "torsion must be"),
            ({"norm": "both"}, "norm must be"),
            ({"length_scale": 0}, "length_scale must be"),
            ({"center_of_mass": None}, "center_of_mass must be given"),
        ],
    )
    def test_wrong_arguments_are_one_sentence(self, wrong, sentence):
        right = {"contacts": CIRCLE, "normals": -CIRCLE, "center_of_mass": ORIGIN}
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.measures(**(right | wrong))
