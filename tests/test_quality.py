"""Q_l and its relatives: published numbers, twins, invariants, degenerate and wrong input."""

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

import graspmoduli as gm
import reference
from conftest import uniform_grasps
from degenerate import CASES, CIRCLE

PINCH = np.array([[1.0, 0, 0], [-1, 0, 0.5], [-1, 0, -0.5]])
PINCH_NORMALS = np.array([[-1.0, 0, 0], [1, 0, 0], [1, 0, 0]])
ORIGIN = np.zeros(3)


def rotation_about_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


class TestNumbers:
    def test_three_fingers_on_a_circle(self):
        assert gm.quality(CIRCLE, -CIRCLE, ORIGIN) == pytest.approx(0.544232186874, abs=5e-13)

    def test_one_finger_against_two(self):
        value = gm.quality(PINCH, PINCH_NORMALS, ORIGIN)
        assert value == pytest.approx(0.240427835894, abs=5e-13)

    def test_one_finger_against_two_off_centre(self):
        contacts = PINCH.copy()
        contacts[0, 2] = 0.25
        value = gm.quality(contacts, PINCH_NORMALS, ORIGIN)
        assert value == pytest.approx(0.225299014077, abs=5e-13)

    def test_shares_of_uniform_grasps_are_the_published_ones(self):
        n = 1_000_000
        q = gm.quality(*uniform_grasps(n, np.random.default_rng(1)))

        def four_sigma(share):
            return 4 * np.sqrt(share * (1 - share) / n)

        assert (q >= 0.05).mean() == pytest.approx(0.0413, abs=four_sigma(0.0413) + 0.0002)
        assert (q >= 0.2).mean() == pytest.approx(0.00064, abs=four_sigma(0.00064) + 0.00001)
        assert (q == 0).mean() == pytest.approx(0.8707, abs=four_sigma(0.8707) + 0.0003)

    def test_where_only_two_contacts_carry_the_quality_is_exactly_0(self, uniform):
        # 3.4 % of uniform grasps have 0 on the boundary of the hull: linear programming finds
        # an equilibrium, but none that uses all wrenches.
        contacts, normals, centers = (array[:700] for array in uniform)
        q = gm.quality(contacts, normals, centers)
        boundary = 0
        for i in range(len(q)):
            margin = reference.force_closure_margin(contacts[i], normals[i], centers[i])
            assert (q[i] > 0) == (margin > 1e-9)
            boundary += abs(margin) <= 1e-9
        assert boundary / len(q) == pytest.approx(0.034, abs=4 * np.sqrt(0.034 / len(q)))


@pytest.mark.parametrize("friction", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("edges", [4, 8, 13])
def test_values_agree_with_qhull(uniform, friction, edges):
    q = gm.quality(*uniform, friction=friction, edges=edges)
    chosen = [*np.flatnonzero(q > 0)[:60], *range(20)]
    for i in chosen:
        contacts, normals, center = (array[i] for array in uniform)
        wanted = reference.quality(contacts, normals, center, friction, edges)
        assert q[i] == pytest.approx(max(wanted, 0.0), abs=1e-9)


@pytest.mark.parametrize("m", [4, 5, 8])
@pytest.mark.parametrize("edges", [3, 8, 13])
def test_values_of_more_contacts_agree_with_qhull(m, edges):
    grasps = uniform_grasps(30, np.random.default_rng(m), m)
    q = gm.quality(*grasps, friction=0.7, edges=edges)
    assert (q > 0).sum() > 2
    for value, contacts, normals, center in zip(q, *grasps, strict=True):
        wanted = reference.quality(contacts, normals, center, 0.7, edges)
        assert value == pytest.approx(max(wanted, 0.0), abs=1e-9)


class TestRelatives:
    """Other norms and cones, against hulls of all their points."""

    def test_each_finger_at_most_1_is_the_minkowski_sum(self):
        contacts, normals, centers = uniform_grasps(40, np.random.default_rng(21))
        q = gm.quality(contacts, normals, centers, edges=3, norm="each")
        for i in range(len(q)):
            wrenches = reference.wrenches(contacts[i], normals[i], centers[i], edges=3)
            own = [np.vstack([np.zeros(6), w]) for w in wrenches.reshape(3, 3, 6)]
            points = [sum(choice) for choice in itertools.product(*own)]
            wanted = -ConvexHull(points, qhull_options="QJ Q12").equations[:, -1].max()
            # QJ moves the points by some 1e-10.
            assert q[i] == pytest.approx(max(wanted, 0.0), abs=1e-7)
        assert (q > 0).any()

    def test_a_force_limit_per_finger_helps_at_most_m_times(self, uniform):
        grasps = [array[:300] for array in uniform]
        total, each = gm.quality(*grasps), gm.quality(*grasps, norm="each")
        assert (each >= total - 1e-12).all()
        assert (each <= 3 * total + 1e-9).all()
        stable = [part[each > 0.0] for part in grasps]
        q = each[each > 0.0]
        for bar in (0.1, q.max(), np.nextafter(q.max(), 1.0)):
            at_least = gm.quality_at_least(*stable, threshold=bar, norm="each")
            np.testing.assert_array_equal(at_least, q >= bar)
        best = gm.largest_quality(*stable, norm="each")
        worst = gm.smallest_quality(*stable, norm="each")
        assert (best.index, best.quality) == ((q.argmax(),), q.max())
        assert (worst.index, worst.quality) == ((q.argmin(),), q.min())

    def test_soft_fingers_join_two_wrenches_each(self):
        contacts, normals, centers = uniform_grasps(60, np.random.default_rng(22))
        q = gm.quality(contacts, normals, centers, torsion=0.2)
        for i in range(len(q)):
            wrenches = [reference.wrenches(contacts[i], normals[i], centers[i])]
            for c, n in zip(contacts[i], normals[i], strict=True):
                torque = np.cross(c - centers[i], n)
                wrenches += [[[*n, *(torque + 0.2 * n)]], [[*n, *(torque - 0.2 * n)]]]
            hull = ConvexHull(np.concatenate(wrenches), qhull_options="Qt")
            assert q[i] == pytest.approx(max(-hull.equations[:, -1].max(), 0.0), abs=1e-9)

    def test_two_soft_fingers_can_hold_an_object(self):
        pair = [[1, 0, 0], [-1, 0, 0]], [[-1, 0, 0], [1, 0, 0]], ORIGIN
        assert gm.quality(*pair) == 0.0
        soft = gm.quality(*pair, torsion=0.1)
        assert 0.0 < soft <= 0.1
        assert gm.quality(*pair, torsion=0.2) > soft

    def test_circular_cones_lie_between_fine_polygonal_ones(self):
        for m in (3, 4):
            grasps = uniform_grasps(40, np.random.default_rng(23), m)
            bounds = gm.circular_quality(*grasps, friction=0.8, tolerance=1e-3)
            inside = gm.quality(*grasps, friction=0.8, edges=64)
            outside = gm.quality(*grasps, friction=0.8 / np.cos(np.pi / 64), edges=64)
            assert (bounds.lower <= bounds.upper).all()
            assert (inside <= bounds.upper + 1e-12).all()
            assert (bounds.lower <= outside + 1e-12).all()
            assert (bounds.upper - bounds.lower <= 1e-3 * bounds.upper).all()
            assert not np.isnan(bounds.value).any()

    @pytest.mark.parametrize("norm", ["sum", "each"])
    @pytest.mark.parametrize("torsion", [0.0, 0.3])
    def test_so_they_do_for_any_fingers(self, norm, torsion):
        rng = np.random.default_rng(7)
        for m in (2, 3, 4):
            grasps = uniform_grasps(60, rng, m)
            hand: Any = {"torsion": torsion, "norm": norm}
            bounds = gm.circular_quality(*grasps, friction=0.8, tolerance=1e-2, **hand)
            inner = gm.quality(*grasps, friction=0.8, edges=40, **hand)
            outer = gm.quality(*grasps, friction=0.8 / np.cos(np.pi / 40), edges=40, **hand)
            assert (bounds.upper - bounds.lower <= 0.01 * bounds.upper + 1e-12).all()
            assert (inner <= bounds.upper + 1e-9).all()
            assert (bounds.lower <= outer + 1e-9).all()
            assert ((inner > 0) <= (bounds.upper > 0)).all()
            if m > 2 or torsion > 0:
                assert (inner > 0).any()

    def test_the_gradient_of_many_fingers_with_limits_is_refused(self):
        many = uniform_grasps(1, np.random.default_rng(0), 123)
        with pytest.raises(gm.GraspModuliError, match=r"at most 122 .* got 123"):
            gm.quality_gradient(*many, norm="each")

    def test_circular_cones_do_not_depend_on_the_axes(self):
        contacts, normals, centers = uniform_grasps(40, np.random.default_rng(24))
        turn = np.linalg.qr(np.random.default_rng(25).normal(size=(3, 3)))[0]
        turn *= np.linalg.det(turn)
        one = gm.circular_quality(contacts, normals, centers, tolerance=1e-4)
        other = gm.circular_quality(contacts @ turn, normals @ turn, centers @ turn, tolerance=1e-4)
        assert (one.lower <= other.upper + 1e-12).all()
        assert (other.lower <= one.upper + 1e-12).all()

    def test_bounds_of_a_single_grasp_are_floats(self):
        bounds = gm.circular_quality(CIRCLE, -CIRCLE, ORIGIN)
        assert type(bounds.lower) is float
        assert bounds.lower <= bounds.value <= bounds.upper
        with pytest.raises(gm.GraspModuliError, match="tolerance must lie in"):
            gm.circular_quality(CIRCLE, -CIRCLE, ORIGIN, tolerance=0.0)

    def test_seven_contacts_can_do_without_friction(self):
        # Fingers on the faces of a cube, off their centres so that they turn it both ways.
        contacts = [
            [1, 0.5, 0.3], [-1, -0.4, 0.2], [0.2, 1, 0.5], [0.3, -1, -0.4], [0.5, 0.1, 1],
            [-0.4, -0.3, -1], [1, -0.5, -0.6], [-0.5, 0.4, 1], [-1, 0.5, -0.3],
        ]  # fmt: skip
        normals = [[-np.sign(c[k]) if abs(c[k]) == 1 else 0 for k in range(3)] for c in contacts]
        q = gm.quality(contacts, normals, ORIGIN, friction=0.0)
        points = reference.wrenches(contacts, np.array(normals, float), ORIGIN, 0.0)
        wanted = -ConvexHull(points[::8], qhull_options="Qt").equations[:, -1].max()
        assert q == pytest.approx(max(wanted, 0.0), abs=1e-9)
        assert gm.quality(contacts[:6], normals[:6], ORIGIN, friction=0.0) == 0.0


class TestThresholds:
    @pytest.mark.parametrize("m", [3, 4])
    def test_answers_are_those_of_comparing(self, m):
        grasps = uniform_grasps(2000, np.random.default_rng(31), m)
        q = gm.quality(*grasps)
        for threshold in (-1.0, 0.0, 1e-3, 0.05, 0.2, float(np.median(q[q > 0]))):
            answers = gm.quality_at_least(*grasps, threshold)
            np.testing.assert_array_equal(answers, q >= threshold)
        assert gm.quality_at_least(*(a[0] for a in grasps), threshold=0.0) is True

    @pytest.mark.parametrize("m", [3, 4])
    def test_the_best_and_the_worst(self, m):
        grasps = uniform_grasps(3000, np.random.default_rng(32), m)
        q = gm.quality(*grasps)
        stable = [a[q > 0].reshape(-1, 1, *a.shape[1:]) for a in grasps]
        q = q[q > 0]
        best, worst = gm.largest_quality(*stable), gm.smallest_quality(*stable)
        assert best == gm.Extreme((int(q.argmax()), 0), q.max())
        assert worst == gm.Extreme((int(q.argmin()), 0), q.min())

    def test_among_equals_it_is_the_first(self):
        contacts = np.stack([0.5 * CIRCLE, CIRCLE, CIRCLE, 0.5 * CIRCLE])
        normals = np.stack([-CIRCLE] * 4)
        assert gm.largest_quality(contacts, normals, ORIGIN).index == (1,)
        assert gm.smallest_quality(contacts, normals, ORIGIN).index == (0,)
        with pytest.raises(gm.GraspModuliError, match="at least one grasp"):
            gm.largest_quality(contacts[:0], normals[:0], ORIGIN)


class TestInvariance:
    @pytest.fixture
    def stable(self, uniform):
        q = gm.quality(*uniform)
        return [array[q > 0.01][:2000] for array in uniform]

    def test_order_of_contacts(self, stable):
        contacts, normals, centers = stable
        q = gm.quality(contacts, normals, centers)
        for order in ([1, 0, 2], [2, 1, 0], [1, 2, 0]):
            permuted = gm.quality(contacts[:, order], normals[:, order], centers)
            np.testing.assert_allclose(permuted, q, rtol=1e-11)

    def test_translation(self, stable):
        contacts, normals, centers = stable
        shift = np.array([3.0, -2.0, 5.0])
        q = gm.quality(contacts, normals, centers)
        moved = gm.quality(contacts + shift, normals, centers + shift)
        np.testing.assert_allclose(moved, q, rtol=1e-11)

    def test_turns_that_map_the_cones_to_themselves(self, stable):
        contacts, normals, centers = stable
        q = gm.quality(contacts, normals, centers)
        turn = rotation_about_z(3 * 2 * np.pi / 8).T
        turned = gm.quality(contacts @ turn, normals @ turn, centers @ turn)
        np.testing.assert_allclose(turned, q, rtol=1e-11)

    def test_any_rotation_changes_finely_polygonal_cones_little(self, stable):
        contacts, normals, centers = (array[:50] for array in stable)
        axis = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
        axis *= np.linalg.det(axis)
        q = gm.quality(contacts, normals, centers, edges=64)
        turned = gm.quality(contacts @ axis, normals @ axis, centers @ axis, edges=64)
        # The polygon's sagitta: cos(π/64) is 1 − 1.2e-3.
        np.testing.assert_allclose(turned, q, rtol=0.02, atol=1e-3)

    def test_larger_friction_with_the_same_edges_never_hurts(self, stable):
        values = [gm.quality(*stable, friction=mu) for mu in (0.3, 0.6, 1.0, 1.5)]
        for lower, higher in itertools.pairwise(values):
            assert (higher >= lower - 1e-12).all()

    def test_change_is_bounded_by_the_largest_wrench_displacement(self, stable):
        rng = np.random.default_rng(4)
        contacts, normals, centers = (array[:300] for array in stable)
        moved = contacts + 0.01 * rng.normal(size=contacts.shape)
        q, other = gm.quality(contacts, normals, centers), gm.quality(moved, normals, centers)
        for i in range(len(q)):
            before = reference.wrenches(contacts[i], normals[i], centers[i])
            after = reference.wrenches(moved[i], normals[i], centers[i])
            assert abs(q[i] - other[i]) <= np.linalg.norm(before - after, axis=1).max() + 1e-12

    def test_torque_is_not_rescaled(self):
        # With the lever arms all torques vanish; the quality follows in proportion.
        small = gm.quality(1e-6 * CIRCLE, -CIRCLE, ORIGIN)
        smaller = gm.quality(1e-7 * CIRCLE, -CIRCLE, ORIGIN)
        assert small / smaller == pytest.approx(10.0, rel=1e-6)


class TestGradient:
    def test_is_that_of_finite_differences(self, uniform):
        q = gm.quality(*uniform)
        contacts, normals, centers = (array[q > 0.02][:200] for array in uniform)
        gradient = gm.quality_gradient(contacts, normals, centers)
        np.testing.assert_array_equal(gradient.value, gm.quality(contacts, normals, centers))
        rng = np.random.default_rng(5)
        h = 1e-6
        wrong = 0
        for _ in range(5):
            dc, dn, dz = (rng.normal(size=a.shape) for a in (contacts, normals, centers))

            def at(step, dc=dc, dn=dn, dz=dz):
                turned = normals + step * dn
                turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
                return gm.quality(contacts + step * dc, turned, centers + step * dz)

            difference = (at(h) - at(-h)) / (2 * h)
            predicted = (
                (gradient.contacts * dc).sum((1, 2))
                + (gradient.normals * dn).sum((1, 2))
                + (gradient.center_of_mass * dz).sum(1)
            )
            # A facet may change between the two sides: there Q has a kink.
            kink = np.abs(at(h) + at(-h) - 2 * gradient.value) > 1e-9
            wrong += (np.abs(difference - predicted) > 1e-6 * (1 + np.abs(predicted)))[~kink].sum()
            assert kink.mean() < 0.02
        assert wrong == 0

    @pytest.mark.parametrize(
        "options",
        [
            {},
            {"torsion": 0.1},
            {"edges": 5, "friction": 0.6},
            {"norm": "each"},
            {"norm": "each", "torsion": 0.2, "edges": 6},
        ],
    )
    @pytest.mark.parametrize("m", [2, 3, 4, 6])
    def test_is_that_of_finite_differences_for_any_hand(self, m, options):
        rng = np.random.default_rng(m)
        grasps = uniform_grasps(1000, rng, m)
        q = gm.quality(*grasps, **options)
        contacts, normals, centers = (array[q > 0.02][:20] for array in grasps)
        if m == 2 and "torsion" not in options:
            assert len(contacts) == 0
            return
        gradient = gm.quality_gradient(contacts, normals, centers, **options)
        np.testing.assert_array_equal(
            gradient.value, gm.quality(contacts, normals, centers, **options)
        )
        h, wrong, kinks = 1e-6, 0, 0
        for _ in range(3):
            dc, dn, dz = (rng.normal(size=a.shape) for a in (contacts, normals, centers))

            def at(step, dc=dc, dn=dn, dz=dz):
                turned = normals + step * dn
                turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
                return gm.quality(contacts + step * dc, turned, centers + step * dz, **options)

            difference = (at(h) - at(-h)) / (2 * h)
            predicted = (
                (gradient.contacts * dc).sum((1, 2))
                + (gradient.normals * dn).sum((1, 2))
                + (gradient.center_of_mass * dz).sum(1)
            )
            kink = np.abs(at(h) + at(-h) - 2 * gradient.value) > 1e-9
            wrong += (np.abs(difference - predicted) > 1e-5 * (1 + np.abs(predicted)))[~kink].sum()
            kinks += kink.sum()
        assert wrong == 0
        assert kinks <= 0.1 * 3 * len(contacts)

    @pytest.mark.parametrize("m", [10, 11, 26, 27, 40])
    def test_of_many_fingers_with_a_limit_each(self, m):
        contacts, normals, centers = uniform_grasps(2, np.random.default_rng(m), m)
        found = gm.quality_gradient(contacts, normals, centers, norm="each", edges=5)
        step = np.random.default_rng(1).normal(size=contacts.shape)
        h = 1e-6
        values = [
            gm.quality(contacts + s * step, normals, centers, norm="each", edges=5) for s in (h, -h)
        ]
        predicted = (found.contacts * step).sum((1, 2))
        assert np.abs(predicted).min() > 0.0
        np.testing.assert_allclose((values[0] - values[1]) / (2 * h), predicted, rtol=1e-4)

    @pytest.mark.parametrize("m", [3, 4])
    def test_at_a_kink_is_a_mean_of_gradients_nearby(self, m):
        # Regular polygons of fingers have many nearest facets. An element of Clarke's generalised
        # gradient is a convex combination of gradients at points nearby.
        angle = 2 * np.pi * np.arange(m) / m
        circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        gradient = gm.quality_gradient(circle, -circle, ORIGIN)

        def flat(g):
            return np.concatenate([g.contacts, g.normals], axis=-2).reshape(-1, 6 * m)

        rng = np.random.default_rng(41)
        n, h = 4000, 1e-7
        moved = circle + h * rng.normal(size=(n, m, 3))
        turned = -circle + h * rng.normal(size=(n, m, 3))
        turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
        nearby = flat(gm.quality_gradient(moved, turned, h * rng.normal(size=(n, 3))))
        assert np.ptp(nearby, axis=0).max() > 0.1
        columns = np.vstack([nearby.T, 10.0 * np.ones(n)])
        target = np.concatenate([flat(gradient)[0], [10.0]])
        _, residual = nnls(columns, target, maxiter=20_000)
        assert residual < 1e-4

    def test_normals_have_tangent_gradients_and_translations_none(self, uniform):
        contacts, normals, centers = (array[:2000] for array in uniform)
        gradient = gm.quality_gradient(contacts, normals, centers)
        along = (gradient.normals * normals).sum(-1)
        assert np.abs(along).max() < 1e-12
        total = gradient.contacts.sum(1) + gradient.center_of_mass
        assert np.abs(total).max() < 1e-12

    def test_is_0_where_the_quality_is_0(self):
        gradient = gm.quality_gradient(CIRCLE, [[0, 0, 1]] * 3, ORIGIN)
        assert gradient.value == 0.0
        assert not gradient.contacts.any()
        assert not gradient.normals.any()

    def test_two_contacts_have_the_shapes_of_two(self):
        gradient = gm.quality_gradient(CIRCLE[:2], -CIRCLE[:2], ORIGIN)
        assert gradient.contacts.shape == (2, 3)
        assert gradient.center_of_mass.shape == (3,)

    def test_results_cannot_be_changed(self):
        gradient = gm.quality_gradient(CIRCLE, -CIRCLE, ORIGIN)
        with pytest.raises(ValueError, match="read-only"):
            gradient.contacts[0, 0] = 1.0


class TestDegenerate:
    @pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
    def test_quality_is_the_true_one(self, case):
        q = gm.quality(case.contacts, case.normals, case.center, friction=case.friction)
        true = case.truth()
        if true == 0.0:
            assert q == 0.0
        else:
            assert q == pytest.approx(true, rel=1e-9, abs=1e-16)
        gradient = gm.quality_gradient(
            case.contacts, case.normals, case.center, friction=case.friction
        )
        assert gradient.value == q
        assert np.isfinite(gradient.contacts).all()
        assert np.isfinite(gradient.normals).all()

    def test_collinear_to_rounding_after_any_rotation(self):
        rng = np.random.default_rng(6)
        line = np.array([[1.0, 0, 0], [-1, 0, 0], [0.3, 0, 0]])
        normals = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 0.6, 0.8]])
        for _ in range(200):
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            turn *= np.sign(np.linalg.det(turn))
            shift = rng.normal(size=3)
            assert gm.quality(line @ turn + shift, normals @ turn, shift) == 0.0

    def test_nearly_collinear_is_nearly_0_and_right(self):
        for height in (1e-3, 1e-6, 1e-9):
            contacts = np.array([[1.0, 0, 0], [-1, 0, 0], [0.1, height, 0]])
            normals = np.array([[-1.0, 0, 0], [1, 0, 0], [0, -1, 0]])
            q = gm.quality(contacts, normals, ORIGIN)
            assert 0.0 <= q <= 2 * height
            assert q == pytest.approx(
                max(reference.quality(contacts, normals, ORIGIN), 0), abs=1e-10
            )

    def test_symmetric_grasps_whose_facets_coincide(self):
        # Grasps in a plane through an axis of revolution have many facets at the same distance.
        rng = np.random.default_rng(7)
        for _ in range(300):
            z = rng.uniform(-1, 1, 3)
            contacts = np.array([[1, 0, z[0]], [-1, 0, z[1]], [-1, 0, z[2]]])
            q = gm.quality(contacts, PINCH_NORMALS, ORIGIN)
            wanted = reference.quality(contacts, PINCH_NORMALS, ORIGIN)
            assert q == pytest.approx(max(wanted, 0.0), abs=1e-10)


class TestShapes:
    def test_a_single_grasp_gives_a_float(self):
        assert type(gm.quality(CIRCLE, -CIRCLE, ORIGIN)) is float

    def test_batches_of_any_shape_broadcast_the_centre(self):
        contacts = np.broadcast_to(CIRCLE, (2, 5, 3, 3))
        assert gm.quality(contacts, -contacts, ORIGIN).shape == (2, 5)
        assert gm.quality(contacts[:0], -contacts[:0], ORIGIN).shape == (0, 5)

    def test_lists_strides_and_single_precision_work(self):
        value = gm.quality(CIRCLE, -CIRCLE, ORIGIN)
        assert gm.quality(CIRCLE.tolist(), (-CIRCLE).tolist(), [0, 0, 0]) == value
        assert gm.quality(np.asfortranarray(CIRCLE), -CIRCLE, ORIGIN) == value
        single = CIRCLE.astype(np.float32)
        assert gm.quality(single, -single, ORIGIN) == pytest.approx(value, abs=1e-6)

    def test_results_do_not_depend_on_the_batch(self, uniform):
        q = gm.quality(*(array[:3000] for array in uniform))
        alone = [gm.quality(*(array[i] for array in uniform)) for i in range(0, 3000, 10)]
        np.testing.assert_array_equal(q[::10], alone)


class TestWrongInput:
    @pytest.mark.parametrize(
        ("arguments", "options", "sentence"),
        [
            ((CIRCLE[:, :2], -CIRCLE, ORIGIN), {}, "contacts must have shape .* got \\(3, 2\\)"),
            ((CIRCLE, -CIRCLE[:2], ORIGIN), {}, "normals must be as many per grasp as contacts"),
            ((CIRCLE, -CIRCLE, [0, 0]), {}, "center_of_mass must have shape"),
            (
                (CIRCLE, -2 * CIRCLE, ORIGIN),
                {},
                "normals must be unit vectors, got one of length 2",
            ),
            ((CIRCLE * np.nan, -CIRCLE, ORIGIN), {}, "contacts must be finite, got nan at index"),
            ((CIRCLE, -CIRCLE, [0, np.inf, 0]), {}, "center_of_mass must be finite, got inf"),
            ((CIRCLE, -CIRCLE, ORIGIN), {"torsion": -0.1}, "torsion must be .* got -0.1"),
            ((CIRCLE, -CIRCLE, ORIGIN), {"norm": "L2"}, 'norm must be "sum" or "each", got \'L2\''),
            ((CIRCLE, -CIRCLE, ORIGIN), {"friction": -1}, "friction must be .* got -1"),
            ((CIRCLE, -CIRCLE, ORIGIN), {"friction": "rough"}, "friction must be .* got 'rough'"),
            ((CIRCLE, -CIRCLE, ORIGIN), {"edges": 2}, "edges must be at least 3, got 2"),
            ((CIRCLE, -CIRCLE, ORIGIN), {"edges": 8.5}, "edges must be a whole number"),
            (("here", -CIRCLE, ORIGIN), {}, "contacts must be an array of numbers, got 'here'"),
            ((CIRCLE[:0], CIRCLE[:0], ORIGIN), {}, "contacts must be at least one"),
            (
                (np.stack([CIRCLE] * 2), -CIRCLE, np.zeros((3, 3))),
                {},
                "must have batch shapes that broadcast",
            ),
        ],
    )
    def test_one_sentence_says_what_was_wanted(self, arguments, options, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence) as caught:
            gm.quality(*arguments, **options)
        assert "\n" not in str(caught.value)
        assert isinstance(caught.value, ValueError)


def test_soft_fingers_can_what_hard_ones_cannot():
    # Four coincident ones without friction, three collinear ones; three without friction cannot.
    tetrahedron = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]) / np.sqrt(3)

    def value(m: int) -> float:
        return gm.quality(np.zeros((m, 3)), tetrahedron[:m], ORIGIN, friction=0.0, torsion=1.0)

    assert value(4) > 0.3
    assert [value(m) for m in (1, 2, 3)] == [0.0, 0.0, 0.0]
    line = np.array([[1.0, 0, 0], [-1, 0, 0], [0.5, 0, 0]])
    normals = np.array([[-1.0, 0, 0], [1, 0, 0], [-1, 0, 0]])
    assert gm.quality(line, normals, ORIGIN) == 0.0
    assert gm.quality(line, normals, ORIGIN, torsion=0.2) > 0.0
