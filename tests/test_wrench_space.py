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
    assert gm.WrenchSpace([[1, 0, 0]], [[-1, 0, 0]], ORIGIN).volume < 1e-9
    assert repr(space) == "WrenchSpace(3 contacts, Q_8 = 0.544232)"


def test_wrong_input():
    with pytest.raises(gm.GraspModuliError, match="one grasp, of shape"):
        gm.WrenchSpace([CIRCLE], [-CIRCLE], ORIGIN)
    with pytest.raises(gm.GraspModuliError, match="wrench must have shape"):
        gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN).resist([1, 0, 0])
    with pytest.raises(gm.GraspModuliError, match="friction must be"):
        gm.WrenchSpace(CIRCLE, -CIRCLE, ORIGIN, friction=-1)
