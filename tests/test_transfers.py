"""Quality along curves, and grasps carried between real objects."""

from typing import Any

import numpy as np
import pytest
import trimesh

import graspmoduli as gm
from conftest import ROOT, quick

TAU = 2 * np.pi

MODELS = gm.shapes.MODELS


@pytest.fixture(scope="module")
def grasps():
    """The best of 100 sampled contacts on some models."""
    found = {}
    for name in "acefgk":
        u, theta = gm.sample_points(MODELS[name], 100, seed=0)
        found[name] = gm.best_grasps(MODELS[name], u, theta)[0].grasp
    return found


class TestQualityAlong:
    @pytest.mark.parametrize("pair", quick(["ac", "ef", "ce"], "ac", "ef"))
    def test_agrees_with_the_curve_and_finds_its_lowest_point(self, grasps, pair):
        s, t = pair
        start = MODELS[s], grasps[s]
        ends = {
            "surface only": (MODELS[t], grasps[s]),
            "grasp only": (MODELS[s], grasps[t]),
            "combined": (MODELS[t], grasps[t]),
        }
        for end in ends.values():
            found = gm.quality_along(start, end, samples=20, edges=6)
            fine = np.linspace(0.0, 1.0, 201)
            slow = [gm.quality(gm.place(*gm.interpolate(start, end, x)), edges=6) for x in fine]
            np.testing.assert_allclose(found.quality, slow[::10], atol=1e-8)
            assert found.worst_quality <= min(slow) + 1e-8
            at = gm.quality(gm.place(*gm.interpolate(start, end, found.worst_t)), edges=6)
            assert at == pytest.approx(found.worst_quality, abs=1e-8)
            assert found.status == ("force closure" if found.worst_quality > 0 else "lost")

    def test_a_dip_between_samples_is_found(self):
        # Down and up again within the one interval that is sampled.
        start = MODELS["c"], gm.Grasp([0.32, 0.32, 0.57], [1.96, 4.13, 6.18])
        end = MODELS["f"], gm.Grasp([0.5, 0.0, 1.0], [0.0, 3.14, 3.14])
        fine = gm.quality_along(start, end, samples=2000)
        assert 0.0 < fine.worst_quality < 0.1 * min(fine.quality[0], fine.quality[-1])
        for samples in (1, 5, 16, 50):
            found = gm.quality_along(start, end, samples=samples)
            assert found.worst_quality == pytest.approx(fine.worst_quality, abs=1e-9)
            assert found.worst_quality <= found.quality.min()

    def test_a_point_is_a_curve(self, grasps):
        point = MODELS["f"], grasps["f"]
        found = gm.quality_along(point, point, samples=3)
        assert np.ptp(found.quality) <= 1e-14
        assert found.worst_quality == pytest.approx(gm.quality(gm.place(*point)), abs=1e-14)

    def test_wrong_input(self, grasps):
        start = MODELS["f"], grasps["f"]
        with pytest.raises(gm.GraspModuliError, match="samples must be at least 1"):
            gm.quality_along(start, start, samples=0)
        with pytest.raises(gm.GraspModuliError, match="same number of contacts, got 3 and 1"):
            gm.quality_along(start, (MODELS["f"], gm.Grasp([0.5], [0.0])))
        with pytest.raises(gm.GraspModuliError, match="friction must be a positive"):
            gm.quality_along(start, start, friction=-1)


class TestTransfer:
    def test_naive_keeps_the_coordinates(self, grasps):
        found = gm.transfer(MODELS["e"], grasps["e"], MODELS["k"])
        assert found.grasp == grasps["e"]
        placed = gm.place(MODELS["k"], grasps["e"])
        assert found.quality == pytest.approx(gm.quality(placed), abs=1e-10)
        start = gm.quality(gm.place(MODELS["e"], grasps["e"]))
        assert found.path[0] == pytest.approx(start, abs=1e-12)
        assert found.path[-1] == found.quality
        assert len(found.path) == len(found.t) == 101
        half = gm.place(gm.combine([MODELS["e"], MODELS["k"]], [0.5, 0.5]), grasps["e"])
        # The centre of mass on the way is by Simpson's rule.
        assert found.path[50] == pytest.approx(gm.quality(half), abs=1e-3)

    @pytest.mark.parametrize("method", ["gradient", "ascent"])
    def test_quality_is_that_of_the_grasp_and_u_stays_on_the_surface(self, grasps, method):
        for source in "aefgk":
            for target in "efg":
                found = gm.transfer(MODELS[source], grasps[source], MODELS[target], method)
                placed = gm.place(MODELS[target], found.grasp)
                assert found.quality == pytest.approx(gm.quality(placed), abs=1e-10)
                assert found.status == "force closure"
                assert (found.grasp.u >= 0).all()
                assert (found.grasp.u <= 1).all()
                assert found.t[0] == 0.0
                assert found.t[-1] == 1.0

    def test_ours_beats_the_papers_in_fewer_evaluations(self, grasps):
        pairs = [(s, t) for s in "aefgk" for t in "aefgk"]
        better = spent = allowance = 0
        for source, target in pairs:
            arguments = MODELS[source], grasps[source], MODELS[target]
            naive = gm.transfer(*arguments)
            theirs, ours = (gm.transfer(*arguments, m) for m in ("gradient", "ascent"))
            spent += ours.evaluations
            allowance += theirs.evaluations
            assert ours.quality >= naive.quality
            better += ours.quality >= theirs.quality
        assert better >= 0.9 * len(pairs)
        assert spent <= 0.6 * allowance

    @pytest.mark.parametrize("source", "aefgk")
    def test_nothing_near_the_end_of_an_ascent_is_better(self, grasps, source):
        rng = np.random.default_rng(3)
        for target in "eil":
            surface = MODELS[target]
            end = gm.transfer(MODELS[source], grasps[source], surface, "ascent")
            steps = rng.normal(size=(10_000, 2, 3))
            steps *= 10.0 ** rng.uniform(-6, -1, (10_000, 1, 1)) / np.linalg.norm(
                steps, axis=(1, 2), keepdims=True
            )
            u = np.clip(end.grasp.u + steps[:, 0], 0, 1)
            theta = end.grasp.theta + steps[:, 1]
            placed = surface.points(u, theta), surface.normals(u, theta)
            assert gm.quality(*placed, surface.center_of_mass).max() <= end.quality * (1 + 1e-5)
            again = gm.transfer(surface, end.grasp, surface, "ascent")
            assert again.quality <= end.quality * (1 + 1e-5)

    def test_where_nothing_is_allowed_there_is_no_way(self, grasps):
        none = np.zeros((3, 3), bool)
        with pytest.raises(gm.GraspModuliError, match="allowed must allow some contact"):
            gm.transfer(MODELS["a"], grasps["a"], MODELS["e"], "ascent", allowed=none)

    def test_finite_differences_follow_exact_derivatives(self, grasps):
        arguments = MODELS["f"], grasps["f"], MODELS["k"], "gradient"
        options: Any = {"surfaces": 20, "steps": 5}
        exact = gm.transfer(*arguments, **options)
        finite = gm.transfer(*arguments, difference=1e-6, **options)
        np.testing.assert_allclose(finite.path, exact.path, atol=2e-3)
        assert finite.evaluations == 100 * 7 + 21
        assert exact.evaluations == 100 + 21

    def test_on_one_surface_it_is_an_ascent(self, grasps):
        start = gm.quality(gm.place(MODELS["g"], grasps["g"]))
        for method in ("gradient", "ascent"):
            assert gm.transfer(MODELS["g"], grasps["g"], MODELS["g"], method).quality >= start

    def test_several_at_once_are_as_one_by_one(self, grasps):
        several = list(grasps.values())
        for method in ("naive", "gradient", "ascent"):
            together = gm.transfer(MODELS["a"], several, MODELS["f"], method)
            for grasp, found in zip(several, together, strict=True):
                alone = gm.transfer(MODELS["a"], grasp, MODELS["f"], method)
                assert alone.grasp == found.grasp
                np.testing.assert_array_equal(alone.path, found.path)
        assert gm.transfer(MODELS["a"], [], MODELS["f"]) == []

    def test_other_hands(self):
        surface = MODELS["f"]
        u, theta = gm.sample_points(surface, 20, seed=2)
        grasp = gm.best_grasps(surface, u, theta, contacts=4)[0].grasp
        naive = gm.transfer(surface, grasp, MODELS["k"])
        moved = gm.transfer(surface, grasp, MODELS["k"], "gradient", surfaces=10, steps=5)
        assert moved.quality > naive.quality
        with pytest.raises(gm.GraspModuliError, match="three contacts, got 4"):
            gm.transfer(surface, grasp, MODELS["k"], "ascent")

    @pytest.mark.parametrize(
        ("options", "sentence"),
        [
            ({"method": "magic"}, "method must be one of naive, gradient, ascent, got 'magic'"),
            ({"friction": 0}, "friction must be a positive"),
            ({"surfaces": 0}, "surfaces must be at least 1"),
            ({"step_length": -1}, "step_length must be a positive"),
            ({"difference": 0}, "difference must be a positive"),
        ],
    )
    def test_wrong_input(self, grasps, options, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.transfer(MODELS["a"], grasps["a"], MODELS["f"], **options)

    def test_wrong_grasps(self, grasps):
        with pytest.raises(gm.GraspModuliError, match="same number of contacts, got 3 and 1"):
            gm.transfer(MODELS["a"], [grasps["a"], gm.Grasp([0.5], [0.0])], MODELS["f"])


@pytest.fixture(scope="module")
def fits():
    paths = sorted((ROOT / "examples" / "objects").glob("*.ply"))
    return {path: gm.fit(path) for path in paths}


class TestBetweenRealObjects:
    def test_every_carried_grasp_holds_the_targets_mesh(self, fits):
        for source in fits.values():
            best = source.synthesize(top=1)[0]
            for path, target in fits.items():
                if target is source:
                    continue
                carried = source.transfer_to(target, best)
                assert carried.quality > 0.0
                assert gm.quality(carried) == carried.quality
                # Not by the product's own rays: every contact lies on the mesh of the file, with
                # the normal of the triangle there but for the rounding of edges by a fingertip.
                mesh = trimesh.load_mesh(path)
                _, off, face = trimesh.proximity.closest_point(mesh, carried.contacts)
                assert off.max() < 1e-6 * target.residual.size
                flat = np.abs((mesh.face_normals[face] * carried.normals).sum(axis=1))
                assert flat.min() > np.cos(np.radians(35.0))

    def test_on_the_mesh_is_on_the_mesh(self, fits):
        path, fit = next(iter(fits.items()))
        grasp = gm.synthesize(fit.unit_surface, top=1, allowed=fit.allowed)[0].grasp
        mesh = trimesh.load_mesh(path)
        real = fit.on_mesh(mesh, grasp)
        _, distance, _ = trimesh.proximity.closest_point(mesh, real.contacts)
        assert distance.max() < 1e-9 * fit.residual.size
        surface = fit.in_object(grasp)
        off = np.linalg.norm(real.contacts - surface.contacts, axis=1)
        assert off.max() <= fit.residual.max
        np.testing.assert_allclose(
            trimesh.proximity.closest_point(mesh, surface.contacts)[1], off, atol=1e-9
        )
        # Whatever way round the mesh's faces are.
        flipped = fit.on_mesh((mesh.vertices, mesh.faces[:, ::-1]), grasp)
        np.testing.assert_allclose(flipped.normals, real.normals, atol=1e-12)
        assert (real.normals * surface.normals).sum(axis=1).min() > 0.9

    def test_wrong_input(self, fits):
        fit = next(iter(fits.values()))
        grasp = fit.on_surface(fit.synthesize(top=1)[0])
        with pytest.raises(gm.GraspModuliError, match="mesh must have faces"):
            fit.on_mesh(np.random.default_rng(0).random((100, 3)), grasp)
        with pytest.raises(gm.GraspModuliError, match="method must be one of"):
            fit.transfer_to(fit, grasp, "magic")
        with pytest.raises(gm.GraspModuliError, match='allowed is for method "ascent"'):
            gm.transfer(MODELS["a"], grasp, MODELS["e"], allowed=fit.allowed)


class TestChainsAndCurves:
    PATH = tuple((MODELS[name], gm.Grasp([0.2, 0.5, 0.8], [0.0, 2.0, 4.0])) for name in "afe")

    def test_a_chain_goes_from_surface_to_surface(self):
        (a, g), (f, _), (e, _) = self.PATH
        options = {"method": "gradient", "surfaces": 4, "steps": 3}
        chain = gm.transfer(a, g, [f, e], **options)
        first = gm.transfer(a, g, f, **options)
        last = gm.transfer(f, first.grasp, e, **options)
        assert chain.grasp == last.grasp
        assert chain.quality == last.quality
        assert chain.evaluations == first.evaluations + last.evaluations
        assert chain.t[0] == 0.0
        assert chain.t[-1] == 2.0
        assert (np.diff(chain.t) >= 0.0).all()

    def test_a_point_is_a_surface_and_a_grasp(self):
        (a, g), (f, _), _ = self.PATH
        assert gm.transfer((a, g), f, "gradient", surfaces=3) == gm.transfer(
            a, g, f, "gradient", surfaces=3
        )

    def test_a_polyline_is_its_pieces_and_a_function_the_same(self):
        start, middle, end = self.PATH
        found = gm.quality_along(list(self.PATH), samples=6)
        pieces = [gm.quality_along(*pair, samples=3) for pair in ((start, middle), (middle, end))]
        joined = np.concatenate([pieces[0].quality, pieces[1].quality[1:]])
        np.testing.assert_allclose(found.quality, joined, atol=1e-12)
        assert found.worst_quality == pytest.approx(
            min(piece.worst_quality for piece in pieces), abs=1e-9
        )

        def curve(t):
            return gm.interpolate(start, middle, t)

        own = gm.quality_along(curve, samples=3)
        np.testing.assert_allclose(own.quality, pieces[0].quality, atol=1e-8)
        with pytest.raises(gm.GraspModuliError, match="a list of at least two points"):
            gm.quality_along([start])


def test_soft_fingers_and_the_other_norm_along_a_curve():
    start, end = (MODELS["e"], gm.Grasp([0.5] * 3, [0, 2, 4])), (
        MODELS["f"], gm.Grasp([0.4, 0.5, 0.6], [0.1, 2.1, 4.1]))  # fmt: skip
    measures: list[dict[str, Any]] = [
        {"torsion": 0.2}, {"norm": "each"}, {"torsion": 0.1, "norm": "each"}
    ]  # fmt: skip
    for options in measures:
        along = gm.quality_along(start, end, samples=4, **options)
        by_function = gm.quality_along(
            lambda t: gm.interpolate(start, end, t), samples=4, **options
        )
        plain = gm.quality_along(start, end, samples=4)
        for k, t in enumerate(along.t):
            expected = gm.quality(gm.place(*gm.interpolate(start, end, float(t))), **options)
            assert along.quality[k] == pytest.approx(expected, abs=1e-9)
        np.testing.assert_allclose(along.quality, by_function.quality, rtol=0, atol=1e-9)
        assert (along.quality > plain.quality).all()
    with pytest.raises(gm.GraspModuliError, match='norm must be "sum" or "each", got 3'):
        gm.quality_along(start, end, norm=3)  # pyright: ignore[reportArgumentType]
    with pytest.raises(gm.GraspModuliError, match="torsion must be"):
        gm.quality_along(start, end, torsion=-1.0)
