"""Units and friction: one object in any unit, each contact with its own friction, grasps as they
come."""

import numpy as np
import pytest

import graspmoduli as gm
import reference
from conftest import uniform_grasps
from degenerate import CIRCLE, ORIGIN

#: Lengths of a metre in millimetres, metres and inches.
UNITS = (1000.0, 1.0, 1 / 0.0254)


@pytest.fixture(scope="module")
def stable():
    """Force-closure grasps of four contacts."""
    grasps = uniform_grasps(300, np.random.default_rng(71), 4)
    q = gm.quality(*grasps)
    return [array[q > 0.03][:20] for array in grasps]


@pytest.fixture(scope="module")
def best():
    return gm.synthesize(gm.shapes.model("bottle"), top=3, friction=0.8, edges=6)


class TestUnits:
    @pytest.mark.parametrize("options", [{}, {"torsion": 0.05}, {"norm": "each", "edges": 5}])
    def test_qualities_are_the_same_in_every_unit(self, stable, options):
        contacts, normals, centers = stable
        values = []
        for unit in UNITS:
            scaled = dict(options)
            if "torsion" in scaled:
                scaled["torsion"] *= unit
            values.append(
                gm.quality(
                    unit * contacts, normals, unit * centers, length_scale=0.3 * unit, **scaled
                )
            )
        assert values[0].min() > 0.0
        np.testing.assert_allclose(values[1], values[0], rtol=1e-9)
        np.testing.assert_allclose(values[2], values[0], rtol=1e-9)
        # And torques count 1 / 0.3 times what they do without: another number.
        assert np.abs(values[1] - gm.quality(*stable, **options)).max() > 0.01

    def test_the_length_scale_divides_torques(self, stable):
        for contacts, normals, center in zip(*(a[:8] for a in stable), strict=True):
            q = gm.quality(contacts, normals, center, length_scale=0.3)
            wanted = reference.quality(contacts / 0.3, normals, center / 0.3)
            assert q == pytest.approx(wanted, abs=1e-9)

    def test_thresholds_and_extremes_use_it_too(self, stable):
        options = {"length_scale": 0.3}
        q = gm.quality(*stable, **options)
        bar = float(np.median(q))
        np.testing.assert_array_equal(
            gm.quality_at_least(*stable, threshold=bar, **options), q >= bar
        )
        assert gm.largest_quality(*stable, **options) == gm.Extreme((int(q.argmax()),), q.max())
        assert gm.smallest_quality(*stable, **options) == gm.Extreme((int(q.argmin()),), q.min())
        bounds = gm.circular_quality(*stable, **options)
        other = gm.circular_quality(stable[0] / 0.3, stable[1], stable[2] / 0.3)
        np.testing.assert_array_equal(bounds.lower, other.lower)

    def test_the_gradient_is_in_the_callers_unit(self, stable):
        contacts, normals, centers = stable
        gradient = gm.quality_gradient(contacts, normals, centers, length_scale=0.3)
        rng = np.random.default_rng(72)
        dc, dz = rng.normal(size=contacts.shape), rng.normal(size=centers.shape)
        h = 1e-7

        def at(step):
            return gm.quality(contacts + step * dc, normals, centers + step * dz, length_scale=0.3)

        predicted = (gradient.contacts * dc).sum((1, 2)) + (gradient.center_of_mass * dz).sum(1)
        measured = (at(h) - at(-h)) / (2 * h)
        kink = np.abs(at(h) + at(-h) - 2 * gradient.value) > 1e-10
        assert kink.sum() <= 2
        np.testing.assert_allclose(measured[~kink], predicted[~kink], rtol=1e-4, atol=1e-5)

    def test_a_length_scale_for_each_grasp(self, stable):
        scales = np.linspace(0.2, 2.0, len(stable[0]))
        q = gm.quality(*stable, length_scale=scales)
        alone = [
            gm.quality(*one, length_scale=scale)
            for *one, scale in zip(*stable, scales.tolist(), strict=True)
        ]
        np.testing.assert_array_equal(q, alone)

    def test_wrench_spaces_take_and_give_the_callers_own_units(self, stable):
        push = np.array([0.3, -0.2, -1.0, 0.05, 0.02, -0.04])
        for contacts, normals, center in zip(*(a[:6] for a in stable), strict=True):
            found = []
            for unit in UNITS:
                space = gm.WrenchSpace(
                    unit * contacts, normals, unit * center, length_scale=0.3 * unit
                )
                units = np.array([1, 1, 1, unit, unit, unit])
                held = space.resist(push * units)
                assert held.forces is not None
                torque = np.cross(unit * (contacts - center), held.forces).sum(0)
                total = np.hstack([held.forces.sum(0), torque])
                np.testing.assert_allclose(total / units, -push, atol=1e-10)
                # The weakest disturbance takes 1 / Q.
                worst = space.resist(space.weakest)
                assert worst.normal_force == pytest.approx(1.0 / space.quality, rel=1e-9)
                facets = space.facets
                assert facets.offsets.min() == pytest.approx(space.quality, rel=1e-9)
                found.append(
                    [
                        space.quality,
                        held.normal_force,
                        space.volume,
                        space.smallest_singular_value,
                        *(space.weakest / units),
                    ]
                )
            np.testing.assert_allclose(found[1], found[0], rtol=1e-7, atol=1e-9)
            np.testing.assert_allclose(found[2], found[0], rtol=1e-7, atol=1e-9)

    @pytest.mark.parametrize("length", [1e78, 1e-80])
    def test_lengths_beyond_what_can_be_computed_are_refused_and_scaled_ones_are_not(self, length):
        with pytest.raises(gm.GraspModuliError, match="choose length_scale"):
            gm.quality(length * CIRCLE, -CIRCLE, ORIGIN)
        value = gm.quality(length * CIRCLE, -CIRCLE, ORIGIN, length_scale=length)
        assert value == pytest.approx(gm.quality(CIRCLE, -CIRCLE, ORIGIN), rel=1e-12)


class TestGraspsAsTheyCome:
    def test_a_ranked_grasp_has_the_quality_that_it_says(self, best):
        for ranked in best:
            assert gm.quality(ranked) == ranked.quality
            assert gm.quality_gradient(ranked).value == ranked.quality
            assert ranked.wrench_space().quality == ranked.quality
            assert gm.quality(ranked.wrench_space()) == ranked.quality
            assert gm.quality_at_least(ranked, threshold=ranked.quality) is True
            inside = gm.circular_quality(ranked).upper
            assert inside >= ranked.quality
        np.testing.assert_array_equal(gm.quality(best), [ranked.quality for ranked in best])
        # Equal ones, to 1e-6, come in the order of their contacts.
        assert gm.largest_quality(best).quality == max(ranked.quality for ranked in best)

    def test_what_the_caller_says_comes_first(self, best):
        plain = best[0].contacts, best[0].normals, best[0].center_of_mass
        assert gm.quality(best[0], edges=9) == gm.quality(*plain, friction=0.8, edges=9)
        assert gm.quality(best[0], friction=0.5) == gm.quality(*plain, friction=0.5, edges=6)
        higher = plain[2] + [0, 0, 0.1]
        assert gm.quality(best[0], center_of_mass=higher) == gm.quality(
            plain[0], plain[1], higher, friction=0.8, edges=6
        )

    def test_carried_and_placed_grasps_are_grasps(self, best):
        bottle, glass = gm.shapes.model("bottle"), gm.shapes.model("glass")
        for method in gm.transfers.METHODS:
            carried = gm.transfer(bottle, best[0].grasp, glass, method, friction=0.8, edges=6)
            assert gm.quality(carried) == carried.quality == carried.path[-1]
            assert carried.surface is glass
        placed = gm.place(bottle, best[0].grasp)
        assert gm.quality(placed, friction=0.8, edges=6) == best[0].quality
        assert gm.place([bottle, glass], best[0].grasp)[1] == gm.place(glass, best[0].grasp)

    def test_frames_stand_for_contacts_and_normals(self, best):
        frames = best[0].frames
        assert frames.shape == (3, 4, 4)
        for frame, normal in zip(frames, best[0].normals, strict=True):
            np.testing.assert_allclose(frame[:3, :3], reference.rotation(normal), atol=1e-12)
        value = gm.quality(frames, center_of_mass=best[0].center_of_mass, friction=0.8, edges=6)
        assert value == best[0].quality
        several = gm.contact_frames(*(np.stack([a, a]) for a in (CIRCLE, -CIRCLE)))
        assert several.shape == (2, 3, 4, 4)
        assert gm.quality(several, center_of_mass=ORIGIN).shape == (2,)
        with pytest.raises(gm.GraspModuliError, match="last row is"):
            gm.quality(2 * frames, center_of_mass=ORIGIN)
        with pytest.raises(gm.GraspModuliError, match="center_of_mass must be given"):
            gm.quality(frames)

    def test_lists_of_different_hands_are_refused(self, best):
        bottle = gm.shapes.model("bottle")
        with pytest.raises(gm.GraspModuliError, match="same edges, got \\[6, 8\\]"):
            gm.quality([*best, *gm.synthesize(bottle, top=1)])
        with pytest.raises(gm.GraspModuliError, match="as many contacts each, got \\[2, 3\\]"):
            gm.quality([best[0], gm.PlacedGrasp(CIRCLE[:2], -CIRCLE[:2], ORIGIN)])


class TestFriction:
    def test_each_contact_has_its_own(self):
        grasps = uniform_grasps(200, np.random.default_rng(73), 4)
        mu = np.array([0.3, 0.6, 1.0, 1.4])
        q = gm.quality(*grasps, friction=mu)
        assert (q > 0.0).sum() > 10
        for i in np.flatnonzero(q > 0)[:15]:
            contacts, normals, center = (a[i] for a in grasps)
            points = np.concatenate(
                [
                    reference.wrenches(contacts[k : k + 1], normals[k : k + 1], center, mu[k])
                    for k in range(4)
                ]
            )
            from scipy.spatial import ConvexHull

            wanted = -ConvexHull(points, qhull_options="Qt").equations[:, -1].max()
            assert q[i] == pytest.approx(wanted, abs=1e-9)

    def test_each_grasp_has_its_own(self):
        grasps = uniform_grasps(600, np.random.default_rng(74))
        mu = np.random.default_rng(75).uniform(0.2, 1.5, (600, 3))
        q = gm.quality(*grasps, friction=mu)
        some = np.flatnonzero(q > 0)[:20]
        assert len(some) == 20
        for i in some:
            assert q[i] == gm.quality(*(a[i] for a in grasps), friction=mu[i])
        gradient = gm.quality_gradient(*grasps, friction=mu)
        np.testing.assert_array_equal(gradient.value, q)
        np.testing.assert_array_equal(
            gm.quality_at_least(*grasps, threshold=0.05, friction=mu), q >= 0.05
        )
        # Contacts may come in any order with their frictions.
        order = [2, 0, 1]
        turned = gm.quality(
            grasps[0][:, order], grasps[1][:, order], grasps[2], friction=mu[:, order]
        )
        np.testing.assert_array_equal(turned, q)
        one_each = gm.quality(*grasps, friction=mu[:, :1])
        assert one_each[some[0]] == gm.quality(
            *(a[some[0]] for a in grasps), friction=float(mu[some[0], 0])
        )

    def test_forces_stay_in_the_cones_of_their_contacts(self):
        mu = np.array([0.4, 0.8, 1.2])
        space = gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN, friction=mu)
        held = space.resist([0.2, 0.1, -1.0, 0.1, 0.0, 0.2])
        assert held.forces is not None
        along = (held.forces * space.normals).sum(1)
        sideways = np.linalg.norm(held.forces - along[:, None] * space.normals, axis=1)
        assert (sideways <= along * mu + 1e-12).all()
        assert space.facets.offsets.min() == pytest.approx(space.quality, rel=1e-9)

    def test_searches_know_what_candidates_are_made_of(self):
        surface = gm.shapes.model("vase")
        u, theta = gm.sample_points(surface, 30, seed=3)
        mu = np.where(u < 0.5, 0.3, 1.0)
        found = gm.best_grasps(surface, u, theta, friction=mu, top=4)
        index = np.array([[a, b, c] for a in range(30) for b in range(a) for c in range(b)])
        placed = surface.points(u, theta)[index], surface.normals(u, theta)[index]
        q = gm.quality(*placed, surface.center_of_mass, friction=mu[index])
        np.testing.assert_allclose([g.quality for g in found], np.sort(q)[::-1][:4], rtol=1e-12)
        for ranked in found:
            assert gm.quality(ranked) == ranked.quality
            np.testing.assert_array_equal(ranked.friction, np.where(ranked.grasp.u < 0.5, 0.3, 1.0))

    @pytest.mark.parametrize(
        ("friction", "sentence"),
        [
            ([0.5, 0.5], "friction must be a number or have shape \\(..., 3\\).* got \\(2,\\)"),
            ([0.5, -0.5, 0.5], "friction must be 0 or positive, got -0.5"),
            ([0.5, np.nan, 0.5], "friction must be finite, got nan at index"),
            (1e7, "friction must be at most 1e\\+06"),
            ("rough", "friction must be .* got 'rough'"),
        ],
    )
    def test_wrong_friction(self, friction, sentence):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            gm.quality(CIRCLE, -CIRCLE, ORIGIN, friction=friction)
