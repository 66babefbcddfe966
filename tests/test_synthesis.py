"""Grasps, exhaustive search and synthesis."""

import itertools
from typing import Any

import numpy as np
import pytest

import graspmoduli as gm
import reference
from conftest import ROOT, quick

NOT_ROUND = "efghijkl"
OBJECTS = ROOT / "examples" / "objects"


def exhaustive(surface, u, theta, **options):
    """Every subset's quality: the slow twin of best_grasps."""
    index = np.array(list(itertools.combinations(range(len(u)), 3)))
    points, normals = surface.points(u, theta), surface.normals(u, theta)
    return index, gm.quality(points[index], normals[index], surface.center_of_mass, **options)


class TestGrasp:
    def test_angles_are_kept_in_one_turn_and_arrays_locked(self):
        grasp = gm.Grasp([0.1, 0.2, 0.3], [-1.0, 7.0, 0.0])
        assert ((grasp.theta >= 0) & (grasp.theta < 2 * np.pi)).all()
        with pytest.raises(ValueError, match="read-only"):
            grasp.u[0] = 0.5
        with pytest.raises(AttributeError, match="does not change"):
            grasp.u = grasp.theta

    def test_equal_grasps_are_equal(self):
        assert gm.Grasp([0.1], [1.0]) == gm.Grasp([0.1], [1.0])
        assert hash(gm.Grasp([0.1], [1.0])) == hash(gm.Grasp([0.1], [1.0]))
        assert gm.Grasp([0.1], [1.0]) != gm.Grasp([0.2], [1.0])

    def test_placing_gives_contacts_on_the_surface(self):
        surface = gm.shapes.MODELS["g"]
        grasp = gm.Grasp([0.2, 0.5, 0.8], [0.0, 2.0, 4.0])
        placed = gm.place(surface, grasp)
        np.testing.assert_array_equal(placed.contacts, surface.points(grasp.u, grasp.theta))
        np.testing.assert_array_equal(placed.normals, surface.normals(grasp.u, grasp.theta))
        np.testing.assert_array_equal(placed.center_of_mass, surface.center_of_mass)
        assert gm.quality(placed) == gm.quality(
            placed.contacts, placed.normals, placed.center_of_mass
        )

    @pytest.mark.parametrize(
        ("u", "theta", "sentence"),
        [
            ([0.1, 1.2], [0, 0], r"u must lie in \[0, 1\]"),
            ([0.1], [0, 0], "must have the same shape"),
            ([], [], "must have the same shape"),
            ([0.1], [np.nan], "theta must be finite"),
        ],
    )
    def test_wrong_input(self, u, theta, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.Grasp(u, theta)


class TestSearch:
    @pytest.mark.parametrize("name", ["a", "f", "j", "k"])
    def test_equals_evaluating_every_subset(self, name):
        surface = gm.shapes.MODELS[name]
        u, theta = gm.sample_points(surface, 40, seed=2)
        index, q = exhaustive(surface, u, theta)
        best = gm.best_grasps(surface, u, theta, top=20)
        np.testing.assert_array_equal([b.quality for b in best], np.sort(q)[::-1][:20])
        for ranked, chosen in zip(best, index[np.argsort(-q, kind="stable")], strict=False):
            np.testing.assert_array_equal(ranked.grasp.u, u[chosen])

    def test_other_friction_and_edges(self):
        surface = gm.shapes.MODELS["h"]
        u, theta = gm.sample_points(surface, 30, seed=4)
        options = {"friction": 0.4, "edges": 5}
        _, q = exhaustive(surface, u, theta, **options)
        best = gm.best_grasps(surface, u, theta, top=5, **options)
        wanted = np.sort(q)[::-1][:5]
        np.testing.assert_array_equal([b.quality for b in best], wanted[wanted > 0])

    @pytest.mark.parametrize("m", [2, 4, 5])
    def test_other_hands(self, m):
        surface = gm.shapes.MODELS["f"]
        u, theta = gm.sample_points(surface, 12, seed=5)
        index = np.array(list(itertools.combinations(range(12), m)))
        points, normals = surface.points(u, theta), surface.normals(u, theta)
        q = gm.quality(points[index], normals[index], surface.center_of_mass)
        best = gm.best_grasps(surface, u, theta, contacts=m, top=10)
        wanted = np.sort(q)[::-1][:10]
        np.testing.assert_array_equal([b.quality for b in best], wanted[wanted > 0])
        # A finger more or less often changes nothing: among equals any one will do.
        order = np.argsort(-q, kind="stable")
        gaps = np.diff(np.concatenate([[-np.inf], -q[order], [np.inf]]))
        for rank, ranked in enumerate(best):
            if min(gaps[rank], gaps[rank + 1]) > 1e-9:
                np.testing.assert_array_equal(ranked.grasp.u, u[index[order[rank]]])
        placed = [gm.quality(gm.place(surface, ranked.grasp)) for ranked in best]
        np.testing.assert_allclose(placed, wanted[wanted > 0], rtol=1e-12)
        again = gm.best_grasps(surface, u, theta, contacts=m, top=10, threads=1)
        assert again == best

    def test_the_number_of_threads_changes_nothing(self):
        surface = gm.shapes.MODELS["e"]
        u, theta = gm.sample_points(surface, 90, seed=8)
        results = [gm.best_grasps(surface, u, theta, top=50, threads=t) for t in (1, 2, 4, 7)]
        assert all(result == results[0] for result in results)

    def test_only_force_closure_grasps_are_ranked(self):
        surface = gm.shapes.MODELS["a"]
        assert gm.best_grasps(surface, [0.1, 0.2, 0.3], [0.0, 0.0, 0.01], top=3) == []

    def test_progress_reaches_the_end_and_can_stop_the_search(self):
        surface = gm.shapes.MODELS["a"]
        u, theta = gm.sample_points(surface, 120)
        calls = []
        gm.best_grasps(surface, u, theta, progress=lambda done, total: calls.append((done, total)))
        total = 120 * 119 * 118 // 6
        assert calls[-1] == (total, total)
        assert calls == sorted(calls)

        def stop(done, total):
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            gm.best_grasps(surface, u, theta, progress=stop)

    @pytest.mark.parametrize(
        ("options", "sentence"),
        [
            ({"contacts": 4}, "at least 4 contacts, got 3"),
            ({"contacts": 0}, "contacts must be at least 1"),
            ({"top": 0}, "top must be at least 1"),
            ({"threads": 0}, "threads must be at least 1"),
            ({"friction": 0}, "friction must be a positive"),
            ({"center_of_mass": [0, 0]}, "center_of_mass must have shape"),
        ],
    )
    def test_wrong_input(self, options, sentence):
        surface = gm.shapes.MODELS["a"]
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.best_grasps(surface, [0.1, 0.5, 0.9], [0, 2, 4], **options)
        with pytest.raises(gm.GraspModuliError, match="at least 3 contacts, got 2"):
            gm.best_grasps(surface, [0.1, 0.5], [0, 2])


def _same_grasps(one, two, turns=1):
    """The same in the same order; where Q is flat the place is less certain than the quality.

    On a surface of revolution a grasp may come turned by an eighth: the friction cones' eight edges
    turn with it, so that is the same but for rounding, and no start is better than another.
    """
    assert len(one) == len(two) > 0
    for a, b in zip(one, two, strict=True):
        assert a.quality == pytest.approx(b.quality, rel=1e-8)
        by = 2 * np.pi / turns * np.round((a.grasp.theta - b.grasp.theta)[0] / (2 * np.pi / turns))
        turn = (a.grasp.theta - b.grasp.theta - by + np.pi) % (2 * np.pi) - np.pi
        assert np.abs([a.grasp.u - b.grasp.u, turn]).max() < 1e-4


class TestSynthesis:
    @pytest.mark.parametrize("name", NOT_ROUND)
    def test_is_at_least_as_good_as_the_best_of_50_samples(self, name):
        surface = gm.shapes.MODELS[name]
        best = gm.best_grasps(surface, *gm.sample_points(surface, 50, seed=1))[0]
        assert gm.synthesize(surface)[0].quality >= best.quality

    @pytest.mark.parametrize("name", gm.shapes.MODELS)
    def test_grasps_are_ranked_different_and_have_the_stated_quality(self, name):
        surface = gm.shapes.MODELS[name]
        grasps = gm.synthesize(surface, top=4)
        values = [g.quality for g in grasps]
        # Equal ones come in the order of their contacts.
        assert (np.diff(values) <= 1e-6 * values[0]).all()
        assert len(grasps) >= 2
        points = []
        for ranked in grasps:
            placed = gm.place(surface, ranked.grasp)
            assert gm.quality(placed) == pytest.approx(ranked.quality, rel=1e-12)
            twin = reference.quality(placed.contacts, placed.normals, placed.center_of_mass)
            assert ranked.quality == pytest.approx(twin, abs=1e-9)
            points.append(placed.contacts)
        for one, other in itertools.combinations(points, 2):
            apart = min(
                np.linalg.norm(one - other[list(order)], axis=1).max()
                for order in itertools.permutations(range(3))
            )
            assert apart > 0.15 * surface.radius_about(surface.center_of_mass) - 1e-9

    @pytest.mark.parametrize("name", gm.shapes.MODELS)
    def test_nothing_near_a_grasp_is_better(self, name):
        surface = gm.shapes.MODELS[name]
        rng = np.random.default_rng(0)
        for best in gm.synthesize(surface, top=2):
            steps = rng.normal(size=(10_000, 2, 3))
            steps *= 10.0 ** rng.uniform(-6, -1, (10_000, 1, 1)) / np.linalg.norm(
                steps, axis=(1, 2), keepdims=True
            )
            u = np.clip(best.grasp.u + steps[:, 0], 0, 1)
            theta = best.grasp.theta + steps[:, 1]
            placed = surface.points(u, theta), surface.normals(u, theta)
            assert gm.quality(*placed, surface.center_of_mass).max() <= best.quality * (1 + 1e-5)
            again = gm.transfer(surface, best.grasp, surface, "ascent")
            assert again.quality <= best.quality * (1 + 1e-5)

    @pytest.mark.parametrize("name", gm.shapes.MODELS)
    def test_the_last_bits_of_a_surface_do_not_choose_another_grasp(self, name):
        surface = gm.shapes.MODELS[name]
        rng = np.random.default_rng(1)
        noise = 1.0 + 1e-14 * rng.uniform(-1, 1, surface.coefficients.shape)
        other = gm.Surface.from_coefficients(
            surface.coefficients * noise, surface.bottom, surface.top
        )
        turns = 1 if name in NOT_ROUND else 8
        _same_grasps(gm.synthesize(surface), gm.synthesize(other), turns)

    @pytest.mark.parametrize(
        "path",
        quick(sorted(OBJECTS.glob("*.ply")), "coffee_mug", "yogurt_bottle"),
        ids=lambda path: path.stem,
    )
    def test_nor_do_the_last_bits_of_a_fit(self, path):
        fit = gm.fit(path)
        surface, rng = fit.surface, np.random.default_rng(2)
        noise = 1.0 + 1e-14 * rng.uniform(-1, 1, surface.coefficients.shape)
        other = gm.Surface.from_coefficients(
            surface.coefficients * noise, surface.bottom, surface.top
        )
        one, two = (gm.synthesize(s, allowed=fit.allowed, top=3) for s in (surface, other))
        _same_grasps(one, two)

    def test_contacts_come_in_order_of_height(self):
        for ranked in gm.synthesize(gm.shapes.MODELS["k"]):
            assert (np.diff(ranked.grasp.u) > -1e-3).all()

    def test_same_seed_same_bits(self):
        surface = gm.shapes.MODELS["i"]
        assert gm.synthesize(surface, seed=3) == gm.synthesize(surface, seed=3)

    def test_contacts_stay_where_they_are_allowed(self):
        surface = gm.shapes.MODELS["b"]
        allowed = np.zeros((20, 36), bool)
        allowed[4:16, :] = True
        allowed[:, 10:15] = False
        grasps = gm.synthesize(surface, allowed=allowed)
        assert grasps
        for ranked in grasps:
            row = (ranked.grasp.u * 20).astype(int)
            column = (ranked.grasp.theta / (2 * np.pi) * 36).astype(int)
            assert allowed[row, column].all()

    def test_nowhere_allowed_gives_no_grasp(self):
        assert gm.synthesize(gm.shapes.MODELS["b"], allowed=np.zeros((4, 4), bool)) == []

    def test_another_centre_of_mass(self):
        surface = gm.shapes.MODELS["a"]
        center = surface.solid_center_of_mass
        best = gm.synthesize(surface, center_of_mass=center)[0]
        placed = gm.place(surface, best.grasp)
        value = gm.quality(placed.contacts, placed.normals, center)
        assert value == pytest.approx(best.quality, rel=1e-12)

    def test_little_friction_finds_fewer_grasps_without_failing(self):
        surface = gm.shapes.MODELS["e"]
        best = []
        for friction in (0.05, 0.2, 1.0):
            found = gm.synthesize(surface, friction=friction)
            for ranked in found:
                placed = gm.place(surface, ranked.grasp)
                assert ranked.quality == pytest.approx(gm.quality(placed, friction=friction)) != 0.0
            best.append(found[0].quality if found else 0.0)
        assert best == sorted(best)
        assert best[1] > 0.0

    def test_wrong_input(self):
        with pytest.raises(gm.GraspModuliError, match="allowed must have shape"):
            gm.synthesize(gm.shapes.MODELS["a"], allowed=[True])
        with pytest.raises(gm.GraspModuliError, match="top must be at least 1"):
            gm.synthesize(gm.shapes.MODELS["a"], top=0)


class TestSoftFingers:
    """Best subsets of soft contacts, and what is carried of them."""

    @pytest.mark.parametrize("norm", ["sum", "each"])
    @pytest.mark.parametrize("m", [2, 3, 4])
    def test_equal_evaluating_every_subset(self, m, norm):
        box = gm.shapes.model("box")
        u, theta = gm.sample_points(box, 14, seed=3)
        subsets = np.array(list(itertools.combinations(range(14), m)))
        contacts, normals = box.points(u, theta)[subsets], box.normals(u, theta)[subsets]
        hand: Any = {"friction": 0.6, "torsion": 0.15, "norm": norm}
        q = gm.quality(contacts, normals, box.center_of_mass, **hand)
        order = np.argsort(-q, kind="stable")[:3]
        found = gm.best_grasps(box, u, theta, contacts=m, top=3, **hand)
        assert [grasp.quality for grasp in found] == q[order].tolist()
        assert q[order[0]] > 0.0
        for grasp, row in zip(found, subsets[order], strict=True):
            np.testing.assert_array_equal(grasp.grasp.u, u[row])
            assert gm.quality(grasp) == grasp.quality
            assert gm.quality(grasp, torsion=0.0) < grasp.quality

    def test_so_do_hard_fingers_with_a_limit_each(self):
        vase = gm.shapes.model("vase")
        u, theta = gm.sample_points(vase, 16, seed=4)
        subsets = np.array(list(itertools.combinations(range(16), 3)))
        grasps = vase.points(u, theta)[subsets], vase.normals(u, theta)[subsets]
        q = gm.quality(*grasps, vase.center_of_mass, norm="each")
        order = np.argsort(-q, kind="stable")[:4]
        found = gm.best_grasps(vase, u, theta, top=4, norm="each")
        assert [grasp.quality for grasp in found] == q[order].tolist()
        assert q[order[0]] > gm.best_grasps(vase, u, theta)[0].quality
        end = gm.transfer(vase, found[0].grasp, 2.0 * vase, norm="each", surfaces=2)
        assert end.norm == "each"
        assert gm.quality(end) == end.quality == end.path[-1]
        moved = gm.transfer(vase, found[0].grasp, 2.0 * vase, "gradient", norm="each", surfaces=10)
        assert moved.quality > end.quality
        crowd = gm.Grasp(np.linspace(0.1, 0.9, 123), np.arange(123.0))
        with pytest.raises(gm.GraspModuliError, match="at most 122"):
            gm.transfer(vase, crowd, vase, "gradient", norm="each")

    def test_two_soft_fingers_are_carried_by_what_they_can_do(self):
        can = gm.Surface.revolution(lambda u: 0.4 + 0.0 * u, -0.3, 0.3)
        wide = 1.2 * can
        jaw = gm.Grasp([0.5, 0.5], [0.0, np.pi])
        for method in ("naive", "gradient"):
            end = gm.transfer(can, jaw, wide, method, torsion=0.1, surfaces=10)
            assert (
                end.quality == gm.quality(end) == gm.quality(gm.place(wide, end.grasp), torsion=0.1)
            )
            assert end.quality > 0.0
            assert gm.transfer(can, jaw, wide, method, surfaces=10).quality == 0.0
        with pytest.raises(gm.GraspModuliError, match=r"hard fingers .*, got torsion"):
            gm.transfer(can, gm.Grasp([0.5] * 3, [0, 2, 4]), wide, "ascent", torsion=0.1)
