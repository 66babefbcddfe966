"""What one grasp can do: status, weakest direction, forces against a wrench, comparisons."""

import numpy as np
import pytest

import graspmoduli as gm
import reference
from conftest import uniform_grasps
from degenerate import CASES, CIRCLE, ORIGIN, SQUEEZE, SQUEEZE_NORMALS


@pytest.mark.parametrize("m", [3, 4])
def test_status_agrees_with_linear_programming(m):
    grasps = uniform_grasps(150, np.random.default_rng(51), m)
    seen = set()
    for contacts, normals, center in zip(*grasps, strict=True):
        space = gm.WrenchSpace(contacts, normals, center)
        margin = reference.force_closure_margin(contacts, normals, center)
        wanted = "outside" if margin < -1e-9 else "on the boundary"
        assert space.status == ("force closure" if margin > 1e-9 else wanted)
        seen.add(space.status)
    assert "force closure" in seen
    assert "outside" in seen


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_degenerate_grasps_have_a_status_and_a_weakest_direction(case):
    space = gm.WrenchSpace(case.contacts, case.normals, case.center, friction=case.friction)
    assert (space.status == "force closure") == (case.truth() > 0)
    assert np.linalg.norm(space.weakest) == pytest.approx(1.0)
    # The fingers can apply at most Q along the opposite.
    reach = (space.wrenches @ -space.weakest).max()
    tolerance = 1e-8 * case.size
    assert reach <= space.quality + tolerance
    if space.status != "outside":
        assert reach >= space.quality - tolerance


def test_wrenches_are_the_definition():
    contacts, normals, centers = uniform_grasps(5, np.random.default_rng(52), 4)
    normals[0, 0] = [0, 0, -1]
    for c, n, z in zip(contacts, normals, centers, strict=True):
        space = gm.WrenchSpace(c, n, z, friction=0.6, edges=7)
        wanted = reference.wrenches(c, n, z, 0.6, 7).reshape(4, 7, 6)
        # The reference counts edges from 1.
        np.testing.assert_allclose(
            space.wrenches.reshape(4, 7, 6), np.roll(wanted, 1, axis=1), atol=1e-12
        )


def test_disturbances_up_to_the_quality_are_resisted_and_the_weakest_no_further():
    rng = np.random.default_rng(53)
    grasps = uniform_grasps(300, rng)
    q = gm.quality(*grasps)
    for contacts, normals, center in zip(*(a[q > 0.02][:8] for a in grasps), strict=True):
        space = gm.WrenchSpace(contacts, normals, center)
        for wrench in rng.normal(size=(5, 6)):
            wrench /= np.linalg.norm(wrench)
            found = space.resist(wrench)
            assert found.normal_force <= 1.0 / space.quality * (1 + 1e-9)
            forces = found.forces
            assert forces is not None
            torque = np.cross(contacts - center, forces).sum(0)
            np.testing.assert_allclose(np.hstack([forces.sum(0), torque]), -wrench, atol=1e-8)
            along = (forces * normals).sum(1)
            assert along.sum() == pytest.approx(found.normal_force)
            sideways = np.linalg.norm(forces - along[:, None] * normals, axis=1)
            assert (sideways <= along * space.friction + 1e-9).all()
        worst = space.resist(space.weakest)
        assert worst.normal_force == pytest.approx(1.0 / space.quality, rel=1e-6)


def test_what_cannot_be_resisted_comes_with_a_proof():
    space = gm.WrenchSpace(SQUEEZE, SQUEEZE_NORMALS, ORIGIN)
    assert space.status == "on the boundary"
    turning = space.resist([0, 0, 0, 1, 0, 0])
    assert turning.forces is None
    assert turning.normal_force == np.inf
    for load in ([0, 0, 0, 1, 0, 0], [1, 2, 3, 4, 5, 6]):
        proof = space.resist(load).proof
        assert proof is not None
        assert proof @ load > 1e-6
        assert (space.wrenches @ proof >= -1e-9).all()
    soft = gm.WrenchSpace(SQUEEZE, SQUEEZE_NORMALS, ORIGIN, torsion=0.1)
    torques = soft.resist([0, 0, 0, 1, 0, 0]).torques
    assert torques is not None
    np.testing.assert_allclose((torques[:, None] * soft.normals).sum(0), [-1, 0, 0])


def test_numbers_for_comparison():
    space = gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN)
    from scipy.spatial import ConvexHull

    hull = ConvexHull(space.wrenches, qhull_options="Qt")
    assert space.volume == pytest.approx(hull.volume, rel=1e-6)
    # Three unit levers at 120°: Σ [1, r×; …] has eigenvalues 3/2 and 3.
    assert space.smallest_singular_value == pytest.approx(np.sqrt(1.5))
    assert gm.WrenchSpace(SQUEEZE, SQUEEZE_NORMALS, ORIGIN).smallest_singular_value < 1e-12
    assert gm.WrenchSpace([[1, 0, 0]], [[-1, 0, 0]], ORIGIN).volume == 0.0
    assert repr(space) == "WrenchSpace(3 contacts, Q_8 = 0.544232)"


def test_what_was_computed_stays_true():
    contacts, normals, centers = uniform_grasps(2, np.random.default_rng(54))
    space = gm.WrenchSpace(contacts[0], normals[0], centers[0])
    with pytest.raises(AttributeError, match="make another one, with its friction"):
        space.friction = np.full(3, 0.1)
    with pytest.raises(ValueError, match="read-only"):
        space.friction[0] = 0.1
    with pytest.raises(ValueError, match="read-only"):
        gm.quality_gradient(contacts, normals, centers).value[0] = 1.0


def test_wrong_input():
    with pytest.raises(gm.GraspModuliError, match="one grasp, of shape"):
        gm.WrenchSpace([CIRCLE], [-CIRCLE], ORIGIN)
    with pytest.raises(gm.GraspModuliError, match="wrench must have shape"):
        gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN).resist([1, 0, 0])
    with pytest.raises(gm.GraspModuliError, match="friction must be"):
        gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN, friction=-1)


NEARLY_COLLINEAR = [[-1, 0, 0], [1, 0, 0], [0, 1e-9, 0]], [[1, 0, 0], [-1, 0, 0], [0, -1, 0]]


class TestResist:
    @pytest.mark.parametrize("size", [1e-6, 1e-3, 3e4, 1e5, 1e7, 1e30])
    def test_forces_balance_torques_at_any_lever_arm(self, size):
        space = gm.WrenchSpace(size * CIRCLE, -CIRCLE, ORIGIN)
        for load in np.eye(6):
            held = space.resist(load)
            assert held.forces is not None
            total = np.hstack(
                [held.forces.sum(0), np.cross(space.contacts, held.forces).sum(0)]
            ) / [1, 1, 1, size, size, size]
            wanted = -load / [1, 1, 1, size, size, size]
            error = np.linalg.norm(total - wanted)
            assert error <= 1e-14 * max(np.linalg.norm(wanted), np.linalg.norm(held.forces))

    def test_the_sum_is_the_least(self):
        from scipy.optimize import linprog

        rng = np.random.default_rng(54)
        for contacts, normals, center in zip(*uniform_grasps(60, rng, 4), strict=True):
            space = gm.WrenchSpace(contacts, normals, center, edges=5)
            load = rng.normal(size=6)
            plain = linprog(np.ones(20), A_eq=space.wrenches.T, b_eq=-load)
            held = space.resist(load)
            assert plain.success == (held.proof is None)
            if plain.success:
                assert held.normal_force == pytest.approx(plain.fun, rel=1e-6)

    def test_what_is_called_force_closure_resists_everything(self):
        space = gm.WrenchSpace(*NEARLY_COLLINEAR, ORIGIN)
        assert space.status == "force closure"
        for load in (*np.eye(6), *-np.eye(6), space.weakest):
            held = space.resist(load)
            assert held.proof is None
            assert held.normal_force <= 1.0 / space.quality * (1 + 1e-6)

    @pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
    def test_proofs_are_proofs(self, case):
        space = gm.WrenchSpace(case.contacts, case.normals, case.center, friction=case.friction)
        rng = np.random.default_rng(55)
        units = np.array([1, 1, 1, case.size, case.size, case.size])
        for load in rng.normal(size=(20, 6)) * units:
            found = space.resist(load)
            if space.quality > 0.0:
                assert found.proof is None
            if found.proof is None:
                continue
            proof = found.proof * units
            proof /= np.linalg.norm(proof)
            assert proof @ (load / units) > 1e-10
            assert (space.wrenches / units @ proof).min() >= -1e-12

    def test_huge_and_tiny_loads_are_scaled(self):
        space = gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN)
        one = space.resist([0.3, 0.1, -1.0, 0.2, 0.0, 0.1])
        for size in (1e140, 1e-200):
            held = space.resist(size * np.array([0.3, 0.1, -1.0, 0.2, 0.0, 0.1]))
            assert held.normal_force == pytest.approx(size * one.normal_force, rel=1e-9)
        assert space.resist(np.zeros(6)).normal_force == 0.0
        with pytest.raises(gm.GraspModuliError, match="wrench must be at most 1e\\+150, got 1e"):
            space.resist([1e300, 0, 0, 0, 0, 0])


class TestHalfSpaces:
    @pytest.mark.parametrize("m", [2, 3, 5])
    def test_are_those_of_the_hull(self, m):
        from scipy.spatial import ConvexHull

        rng = np.random.default_rng(56)
        for contacts, normals, center in zip(*uniform_grasps(12, rng, m), strict=True):
            space = gm.WrenchSpace(contacts, normals, center, edges=6, torsion=0.2)
            facets = space.facets
            np.testing.assert_allclose(np.linalg.norm(facets.normals, axis=1), 1.0)
            heights = space.wrenches @ facets.normals.T
            assert (heights <= facets.offsets + 1e-14).all()
            # Six wrenches at least on each, and no two facets are the same.
            assert ((heights > facets.offsets - 1e-9).sum(0) >= 6).all()
            rounded = {tuple(row) for row in facets.normals.round(7).tolist()}
            assert len(rounded) == len(facets.offsets)
            planes = ConvexHull(space.wrenches, qhull_options="Qt").equations
            theirs = {tuple(row) for row in planes[:, :-1].round(5).tolist()}
            assert len(theirs) >= len(facets.offsets)
            if space.quality > 0.0:
                assert facets.offsets.min() == pytest.approx(space.quality, rel=1e-9)
            # A wrench is in S exactly if it is a convex combination of the corners.
            inside = rng.dirichlet(np.ones(len(space.wrenches)), 50) @ space.wrenches
            assert (inside @ facets.normals.T <= facets.offsets + 1e-12).all()
            assert planes[:, -1].max() == pytest.approx(-facets.offsets.min(), abs=1e-9)

    def test_many_wrenches_of_one_facet_make_one_half_space(self):
        # Four fingers in a square: facets of many points.
        square = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
        space = gm.WrenchSpace(square, -square, ORIGIN, edges=4)
        facets = space.facets
        apart = np.linalg.norm(facets.normals[:, None] - facets.normals, axis=-1)
        assert apart[~np.eye(len(apart), dtype=bool)].min() > 1e-6
        assert facets.offsets.min() == pytest.approx(space.quality, rel=1e-12)

    def test_a_flat_hull_lies_between_two(self):
        space = gm.WrenchSpace(SQUEEZE, SQUEEZE_NORMALS, ORIGIN)
        assert space.quality == 0.0
        facets = space.facets
        # No torque about the line: ±e₄ with offset 0.
        across = np.abs(facets.normals[:, 3]) > 1 - 1e-12
        assert across.sum() == 2
        np.testing.assert_allclose(facets.offsets[across], 0.0, atol=1e-15)
        assert (space.wrenches @ facets.normals.T <= facets.offsets + 1e-14).all()
        outside = np.array([0, 0, 0, 0.1, 0, 0])
        assert (outside @ facets.normals.T > facets.offsets + 0.05).any()


class TestFlat:
    @pytest.mark.parametrize("size", [1e-6, 1.0, 1e3, 1e50])
    def test_the_volume_is_exactly_0_where_the_hull_is_flat(self, size):
        line = [[1, 0, 0], [-1, 0, 0], [0.3, 0, 0]]
        for contacts, normals in (
            (CIRCLE[:1], -CIRCLE[:1]),
            (CIRCLE[:2], -CIRCLE[:2]),
            (line, [[-1, 0, 0], [1, 0, 0], [0, 0.6, 0.8]]),
            ([[1, 1, 1]] * 3, [[-1, 0, 0], [1, 0, 0], [0, 0, 1]]),
        ):
            space = gm.WrenchSpace(size * np.array(contacts), normals, ORIGIN)
            assert space.volume == 0.0
            assert space.quality == 0.0
            assert space.smallest_singular_value < 1e-10
        assert gm.WrenchSpace(size * CIRCLE, -CIRCLE, ORIGIN).volume > 0.0

    def test_the_smallest_singular_value_at_any_lever_arm(self):
        # Σ [1, r×; …] has eigenvalues 3 and 3/2 r² here.
        for size in (1e-50, 1e-3, 1.0, 1e3, 1e50):
            space = gm.WrenchSpace(size * CIRCLE, -CIRCLE, ORIGIN)
            wanted = np.sqrt(min(3.0, 1.5 * size**2))
            assert space.smallest_singular_value == pytest.approx(wanted, rel=1e-12)
