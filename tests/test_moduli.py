"""The Grasp Moduli Space: combinations, curves, distances."""

# Wrong types are passed on purpose.
# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false

import copy
import pickle
import signal
import sys

import numpy as np
import pytest

import graspmoduli as gm
import long_distances

MODELS = gm.shapes.MODELS
TAU = 2 * np.pi


class TestCombinations:
    def test_weights_are_barycentric_and_reproducible(self):
        weights = gm.sample_weights(4, 5000, seed=3)
        assert weights.shape == (5000, 4)
        assert (weights >= 0).all()
        np.testing.assert_allclose(weights.sum(1), 1.0, atol=1e-12)
        np.testing.assert_array_equal(weights, gm.sample_weights(4, 5000, seed=3))
        # Uniform on the simplex: mean 1/4, variance 3/80.
        np.testing.assert_allclose(weights.mean(0), 0.25, atol=4 * np.sqrt(3 / 80 / 5000))
        np.testing.assert_allclose(weights.var(0), 3 / 80, rtol=0.15)

    def test_concentration_moves_them_to_the_corners_or_the_middle(self):
        corners = gm.sample_weights(3, 2000, concentration=0.1).max(1)
        middle = gm.sample_weights(3, 2000, concentration=20.0).max(1)
        assert corners.mean() > 0.85
        assert middle.mean() < 0.45
        uneven = gm.sample_weights(2, 2000, concentration=[3.0, 1.0]).mean(0)
        np.testing.assert_allclose(uneven, [0.75, 0.25], atol=0.02)

    def test_surfaces_are_the_combinations(self):
        corners = [MODELS[name] for name in "aef"]
        surfaces = gm.sample_combinations(corners, 3, seed=5)
        np.testing.assert_array_equal(surfaces.weights, gm.sample_weights(3, 3, seed=5))
        for surface, weights in zip(surfaces, surfaces.weights, strict=True):
            wanted = sum(w * s.radius(0.3, 1.0) for w, s in zip(weights, corners, strict=True))
            assert surface.radius(0.3, 1.0) == pytest.approx(wanted, abs=1e-12)

    def test_samples_of_the_cone_have_any_total(self):
        weights = gm.sample_weights(3, 4000, seed=2, total=(0.5, 8.0))
        totals = weights.sum(1)
        assert totals.min() >= 0.5 * (1 - 1e-12)
        assert totals.max() <= 8.0 * (1 + 1e-12)
        # The logarithm is uniform: half are below the geometric mean.
        assert (totals < 2.0).mean() == pytest.approx(0.5, abs=0.03)
        np.testing.assert_allclose(weights / totals[:, None], gm.sample_weights(3, 4000, seed=2))
        surfaces = gm.sample_combinations([MODELS["a"], MODELS["b"]], 3, total=(2.0, 2.0))
        for surface, (first, second) in zip(surfaces, surfaces.weights, strict=True):
            assert first + second == pytest.approx(2.0)
            wanted = first * MODELS["a"] + second * MODELS["b"]
            np.testing.assert_allclose(surface.coefficients, wanted.coefficients, rtol=1e-15)

    def test_they_are_pickled_with_their_weights(self):
        surfaces = gm.sample_combinations([MODELS["a"], MODELS["b"]], 3)
        again = pickle.loads(pickle.dumps(surfaces))
        assert again == surfaces
        np.testing.assert_array_equal(again.weights, surfaces.weights)

    @pytest.mark.parametrize(
        ("options", "sentence"),
        [
            ({"total": (2.0, 1.0)}, "total must be two positive numbers"),
            ({"total": 0.0}, "total must be two positive numbers"),
            ({"concentration": "x"}, "concentration must be an array of numbers"),
            ({"concentration": 0.0}, "concentration must be positive, got 0"),
            ({"concentration": [1, 2]}, "concentration must be a number or have shape"),
            ({"n": 0}, "n must be at least 1"),
        ],
    )
    def test_wrong_input(self, options, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.sample_weights(**{"surfaces": 3, "n": 2, **options})


class TestCurve:
    def test_ends_in_both_points_and_is_linear_between(self):
        start = MODELS["a"], gm.Grasp([0.1, 0.5, 0.9], [0.0, 1.0, 2.0])
        end = MODELS["f"], gm.Grasp([0.2, 0.5, 0.7], [0.5, 1.0, 1.0])
        for t, (surface, grasp) in ((0.0, start), (1.0, end)):
            at, here = gm.interpolate(start, end, t)
            assert here == grasp
            assert at.radius(0.4, 2.0) == pytest.approx(surface.radius(0.4, 2.0), abs=1e-12)
        middle, grasp = gm.interpolate(start, end, 0.25)
        np.testing.assert_allclose(grasp.u, [0.125, 0.5, 0.85])
        np.testing.assert_allclose(grasp.theta, [0.125, 1.0, 1.75])
        wanted = 0.75 * MODELS["a"].radius(0.4, 2.0) + 0.25 * MODELS["f"].radius(0.4, 2.0)
        assert middle.radius(0.4, 2.0) == pytest.approx(wanted, abs=1e-12)

    @pytest.mark.parametrize(
        ("start", "end", "middle"),
        [
            (0.1, TAU - 0.1, 0.0),
            (TAU - 0.3, 0.1, TAU - 0.1),
            (1.0, 4.0, 2.5),
            # Exactly opposite: straight in [0, 2π), both ways.
            (0.0, np.pi, np.pi / 2),
            (np.pi, 0.0, np.pi / 2),
            (1.0, 1.0 + np.pi, 1.0 + np.pi / 2),
        ],
    )
    def test_angles_take_the_shorter_arc(self, start, end, middle):
        surface = MODELS["a"]
        a, b = gm.Grasp([0.5], [start]), gm.Grasp([0.5], [end])
        found = gm.interpolate((surface, a), (surface, b), 0.5)[1].theta[0]
        assert np.cos(found - middle) == pytest.approx(1.0, abs=1e-12)

    def test_several_t_give_a_list(self):
        start = MODELS["a"], gm.Grasp([0.1, 0.5], [0.0, 1.0])
        end = MODELS["f"], gm.Grasp([0.2, 0.5], [0.5, 1.0])
        points = gm.interpolate(start, end, [0.0, 0.25, 1.0])
        assert points == [gm.interpolate(start, end, t) for t in (0.0, 0.25, 1.0)]
        assert gm.interpolate(start, end, []) == []

    def test_wrong_input(self):
        point = MODELS["a"], gm.Grasp([0.5], [0.0])
        for t in (-0.1, 1.1):
            with pytest.raises(gm.GraspModuliError, match="t must lie in"):
                gm.interpolate(point, point, t)
        with pytest.raises(gm.GraspModuliError, match=r"t must be a number or have shape \(k,\)"):
            gm.interpolate(point, point, np.zeros((2, 2)))
        for wrong in (MODELS["a"], None, "ab", (MODELS["a"],), (MODELS["a"], MODELS["b"])):
            for call in (gm.distance, lambda p, q: gm.interpolate(p, q, 0.5)):
                with pytest.raises(
                    gm.GraspModuliError, match=r"start must be a pair \(surface, gr"
                ):
                    call(wrong, point)
                with pytest.raises(
                    gm.GraspModuliError, match=r"end must be a pair \(surface, gras"
                ):
                    call(point, wrong)
        two = MODELS["a"], gm.Grasp([0.5, 0.5], [0.0, 1.0])
        with pytest.raises(gm.GraspModuliError, match="same number of contacts, got 1 and 2"):
            gm.interpolate(point, two, 0.5)


class TestPlacedDistance:
    def test_is_a_metric(self):
        rng = np.random.default_rng(71)
        for _ in range(50):
            p, q, r = (
                gm.place(MODELS[name], gm.Grasp(rng.random(3), TAU * rng.random(3)))
                for name in rng.choice(list(MODELS), 3)
            )
            assert gm.placed_distance(p, p) == 0.0
            assert gm.placed_distance(p, q) == gm.placed_distance(q, p) > 0.0
            through = gm.placed_distance(p, r) + gm.placed_distance(r, q)
            assert gm.placed_distance(p, q) <= through + 1e-12

    def test_is_the_largest_of_its_parts(self):
        p = gm.place(MODELS["a"], gm.Grasp([0.2, 0.8], [0.0, 1.0]))
        moved = gm.PlacedGrasp(
            np.add(p.contacts, [[0.3, 0, 0], [0, 0, 0]]), p.normals, p.center_of_mass
        )
        assert gm.placed_distance(p, moved) == pytest.approx(0.3)
        shifted = gm.PlacedGrasp(p.contacts, p.normals, np.add(p.center_of_mass, [0, 0, 0.5]))
        assert gm.placed_distance(p, shifted) == pytest.approx(0.5)
        turned = gm.PlacedGrasp(p.contacts, -p.normals, p.center_of_mass)
        assert gm.placed_distance(p, turned) == pytest.approx(2.0)
        with pytest.raises(gm.GraspModuliError, match="same number of contacts"):
            gm.placed_distance(p, gm.place(MODELS["a"], gm.Grasp([0.2], [0.0])))


def revolved(rng, spread):
    rows, columns = rng.integers(4, 12, 2)
    coefficients = np.exp(spread * rng.normal(size=(rows, 1)))
    bottom = rng.normal()
    return gm.Surface.from_coefficients(
        np.repeat(coefficients, columns, axis=1), bottom, bottom + np.exp(rng.normal())
    )


def patched(rng, spread, bottom=0.0, height=1.0):
    coefficients = np.exp(spread * rng.normal(size=rng.integers(4, 10, 2)))
    return gm.Surface.from_coefficients(coefficients, bottom, bottom + height)


def pairs():
    """Pairs of surfaces that are hard in one way or another."""
    rng = np.random.default_rng(2024)
    for spread in (0.02, 0.3, 1.0):
        for _ in range(8):
            yield "of revolution", revolved(rng, spread), revolved(rng, spread)
            yield "one of revolution", revolved(rng, spread), patched(rng, spread)
            surface = patched(rng, spread)
            moved = 1.0 + 10.0 ** -rng.integers(1, 6) * rng.normal(size=surface.coefficients.shape)
            yield (
                "near",
                surface,
                gm.Surface.from_coefficients(surface.coefficients * abs(moved), 0.0, 1.0),
            )
            yield "general", patched(rng, spread), patched(rng, spread, rng.normal())
            yield "scaled", surface, float(np.exp(rng.normal())) * surface
        for height in (1e-3, 1e3):
            yield f"height {height}", *(patched(rng, spread, 0.0, height) for _ in "ab")
    for name in "abcd":
        yield "scaled model of revolution", MODELS[name], 3.0 * MODELS[name]
        yield "scaled model of revolution", MODELS[name], 1.01 * MODELS[name]
    for name in "abc":
        yield "models of revolution", MODELS["d"], MODELS[name]


def furthest(first, second, round_):
    """The largest distance of points and normals on a grid, and closer about the largest of it."""

    def apart(u, theta):
        points = first.points(u, theta) - second.points(u, theta)
        normals = first.normals(u, theta) - second.normals(u, theta)
        return np.maximum(np.linalg.norm(points, axis=-1), np.linalg.norm(normals, axis=-1))

    u, theta = np.linspace(0, 1, 2001 if round_ else 91), np.array([0.3])
    if not round_:
        u, theta = (a.ravel() for a in np.meshgrid(u, np.linspace(0, TAU, 90)))
    rng = np.random.default_rng(1)
    largest = 0.0
    for step in (0.0, 1e-2, 1e-3, 1e-4):
        at = apart(u, theta)
        k, largest = at.argmax(), max(largest, at.max())
        u_best, theta_best = u[k], np.broadcast_to(theta, u.shape)[k]
        u = np.clip(u_best + (step or 1e-2) * rng.normal(size=200), 0, 1)
        theta = theta_best + (step or 1e-2) * rng.normal(size=200)
    return largest


def test_no_point_is_further_apart_than_proven_whatever_the_surfaces():
    for kind, first, second in pairs():
        found = gm.surface_distance(first, second)
        largest = furthest(first, second, first.is_revolution and second.is_revolution)
        # The grid is rounded, by more where surfaces are flat.
        extent = max(1.0, abs(first.bottom), abs(first.top), first.coefficients.max())
        rounding = 1e-15 * extent * (1.0 + 20.0 / min(1.0, first.top - first.bottom))
        assert largest <= found + found.error + rounding, kind
        at = found.u, found.theta
        own = max(
            np.linalg.norm(first.points(*at) - second.points(*at)),
            np.linalg.norm(first.normals(*at) - second.normals(*at)),
        )
        assert own == pytest.approx(float(found), rel=1e-9, abs=rounding), kind
        assert found.error <= 1e-6 * found + rounding or kind.startswith("height"), kind


def test_distances_between_flat_surfaces_are_at_least_what_their_point_shows():
    rng = np.random.default_rng(2)
    for _ in range(10):
        first, second = (
            gm.Surface.from_coefficients(np.exp(rng.normal(size=(5, 5))), 0, 1e-3) for _ in "ab"
        )
        found = gm.surface_distance(first, second)
        points = first.points(found.u, found.theta) - second.points(found.u, found.theta)
        assert np.linalg.norm(points) <= found * (1 + 1e-14)
        # Normals are never further apart than 2.
        assert found + found.error <= max(2.0, found * (1 + 1e-6)) * (1 + 1e-9)


def test_a_surface_written_on_a_finer_grid_is_no_further_than_rounding():
    rng = np.random.default_rng(6)
    for _ in range(20):
        surface = patched(rng, 0.5)
        rows, columns = surface.coefficients.shape
        fine = gm.Surface.from_coefficients(np.ones((3 * (rows - 3) + 3, 2 * columns)), 0, 1)
        # The surface as it is, on the finer grid, but for a share of 1e-30.
        refined = gm.combine([surface, fine], [1.0, 1e-30])
        found = gm.surface_distance(surface, refined)
        assert found + found.error < 1e-9
        assert gm.surface_distance(surface, surface).error == 0.0


class TestDistancesAreValues:
    @pytest.mark.parametrize(
        "again", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
    )
    def test_copies_keep_all(self, again):
        found = gm.surface_distance(MODELS["a"], MODELS["e"])
        other = again(found)
        assert type(other) is gm.SurfaceDistance
        assert other == found
        assert hash(other) == hash(float(found))
        kept = "error", "u", "theta"
        assert [getattr(other, name) for name in kept] == [getattr(found, name) for name in kept]

    def test_they_do_not_change(self):
        found = gm.surface_distance(MODELS["a"], MODELS["e"])
        for name in ("error", "u", "value"):
            with pytest.raises(AttributeError):
                setattr(found, name, 0.0)


class TestSurfaceDistance:
    def test_no_point_of_a_grid_is_further_apart(self):
        u, theta = np.meshgrid(np.linspace(0, 1, 301), np.linspace(0, TAU, 401), indexing="ij")
        for s, t in ("ab", "cf", "eg", "kl"):
            first, second = MODELS[s], MODELS[t]
            found = gm.surface_distance(first, second)
            assert found.error <= 1e-6 * found
            apart = np.maximum(
                np.linalg.norm(first.points(u, theta) - second.points(u, theta), axis=-1),
                np.linalg.norm(first.normals(u, theta) - second.normals(u, theta), axis=-1),
            )
            assert apart.max() <= found + found.error + 1e-12
            assert apart.max() >= 0.99 * found
            at = found.u, found.theta
            attained = max(
                np.linalg.norm(first.points(*at) - second.points(*at)),
                np.linalg.norm(first.normals(*at) - second.normals(*at)),
            )
            assert attained == pytest.approx(float(found), rel=1e-9)

    def test_is_a_metric(self):
        corners = [MODELS[name] for name in "bfhj"]
        surfaces = gm.sample_combinations(corners, 6, seed=7)
        for s in surfaces[:3]:
            assert gm.surface_distance(s, s) == 0.0
            for t in surfaces[3:]:
                there, back = gm.surface_distance(s, t), gm.surface_distance(t, s)
                assert there == pytest.approx(back, rel=2e-6)
                assert there > 0.0
                for r in surfaces[1:3]:
                    through = gm.surface_distance(s, r) + gm.surface_distance(r, t)
                    assert there <= through * (1 + 4e-6)

    def test_naive_transfers_move_contacts_and_normals_no_further(self):
        # Lemma III.5.
        rng = np.random.default_rng(91)
        surfaces = gm.sample_combinations([MODELS[name] for name in "aehl"], 8, seed=9)
        for s, t in zip(surfaces[:4], surfaces[4:], strict=True):
            limit = gm.surface_distance(s, t)
            grasp = gm.Grasp(rng.random(300), TAU * rng.random(300))
            p, q = gm.place(s, grasp), gm.place(t, grasp)
            reached = gm.placed_distance(p, gm.PlacedGrasp(q.contacts, q.normals, p.center_of_mass))
            assert reached <= limit + limit.error + 1e-12

    def test_a_moved_or_scaled_surface(self):
        surface = MODELS["f"]
        lifted = gm.Surface.from_coefficients(
            surface.coefficients, surface.bottom + 0.1, surface.top + 0.1
        )
        assert gm.surface_distance(surface, lifted) == pytest.approx(0.1)
        # Scaling leaves normals as they are.
        u, theta = np.meshgrid(np.linspace(0, 1, 400), np.linspace(0, TAU, 400), indexing="ij")
        furthest = np.linalg.norm(surface.points(u, theta), axis=-1).max()
        grown = gm.surface_distance(surface, 1.001 * surface)
        assert grown == pytest.approx(1e-3 * furthest, rel=1e-4)

    def test_wrong_input(self):
        with pytest.raises(gm.GraspModuliError, match="tolerance must lie in"):
            gm.surface_distance(MODELS["a"], MODELS["b"], tolerance=0.0)
        with pytest.raises(gm.GraspModuliError, match="first must be a Surface, got None"):
            gm.surface_distance(None, MODELS["b"])
        with pytest.raises(gm.GraspModuliError, match="second must be a Surface, got a str"):
            gm.surface_distance(MODELS["a"], "b")
        with pytest.raises(gm.GraspModuliError, match="p must be a PlacedGrasp, got a Surface"):
            gm.placed_distance(MODELS["a"], MODELS["a"])


class TestDistance:
    def test_is_a_metric_on_pairs(self):
        rng = np.random.default_rng(92)
        surfaces = gm.sample_combinations([MODELS[name] for name in "bfh"], 3, seed=4)
        points = [(s, gm.Grasp(rng.random(2), TAU * rng.random(2))) for s in surfaces]
        p, q, r = points
        for angles in ("chord", "arc"):
            there = gm.distance(p, q, angles=angles)
            assert there == pytest.approx(gm.distance(q, p, angles=angles), rel=1e-5)
            assert gm.distance(p, p, angles=angles) == 0.0
            through = gm.distance(p, r, angles=angles) + gm.distance(r, q, angles=angles)
            assert there <= through + 1e-5

    def test_carries_the_proven_error(self):
        p = MODELS["a"], gm.Grasp([0.2, 0.5], [0.1, 1.0])
        q = MODELS["e"], gm.Grasp([0.5, 0.5], [0.1, 1.0])
        found, surfaces = gm.distance(p, q), gm.surface_distance(p[0], q[0])
        assert found == surfaces + 0.3
        assert surfaces.error <= found.error <= surfaces.error + 1e-14
        assert pickle.loads(pickle.dumps(found)).error == found.error

    def test_counts_heights_and_angles(self):
        surface = MODELS["a"]
        p = surface, gm.Grasp([0.2, 0.5], [0.1, 1.0])
        q = surface, gm.Grasp([0.5, 0.5], [TAU - 0.1, 1.0])
        assert gm.distance(p, q, angles="arc") == pytest.approx(0.3 + 0.2)
        assert gm.distance(p, q) == pytest.approx(0.3 + 2 * np.sin(0.1))
        with pytest.raises(gm.GraspModuliError, match='angles must be "chord" or "arc"'):
            gm.distance(p, q, angles="degrees")


def test_distances_are_no_less_than_those_of_points_in_fifty_digits():
    assert long_distances.main(2 * len(long_distances.KINDS), 1) == 0


def test_nearly_equal_flat_surfaces_are_known_to_be_near():
    # The heights differ by a share of 1e-8; second derivatives of normals are of 1e6.
    rng = np.random.default_rng(3)
    c = np.exp(0.1 * rng.normal(size=(8, 8)))
    first, second = (gm.Surface.from_coefficients(c, 0.0, h) for h in (1e-3, 1e-3 * (1 + 1e-8)))
    found = gm.surface_distance(first, second, tolerance=1e-3)
    assert found + found.error < 1e-7


@pytest.mark.skipif(sys.platform == "win32", reason="no timer that sends signals")
def test_a_long_search_is_interrupted():
    # All of the curve on which normals turn fastest is equally far: the search takes all its cells.
    rng = np.random.default_rng(0)
    c = np.exp(rng.normal(size=(60, 60)))
    first, second = (gm.Surface.from_coefficients(c, 0.0, h) for h in (1e-3, 1.01e-3))

    def interrupt(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.02)
    try:
        with pytest.raises(KeyboardInterrupt):
            gm.surface_distance(first, second, tolerance=1e-9)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
