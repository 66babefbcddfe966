"""The quality of wrenches that are given themselves, beside Qhull's and that of grasps."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import graspmoduli as gm
import reference
from conftest import quick, uniform_grasps


def slow(wrenches):
    """The least offset of Qhull's facets, 0 if one does not lie beyond the origin."""
    return max(0.0, -ConvexHull(wrenches).equations[:, -1].max())


@pytest.mark.parametrize("width", [3, 6])
@pytest.mark.parametrize("seed", quick([0, 1, 2], 0))
def test_random_wrenches_are_qhulls(width, seed):
    rng = np.random.default_rng(seed)
    for count in (width + 1, 10, 24, 60):
        given = rng.normal(size=(40, count, width)) * rng.uniform(0.5, 2.0, (40, 1, width))
        values = gm.quality_of_wrenches(given)
        wanted = [slow(one) for one in given]
        np.testing.assert_allclose(values, wanted, rtol=1e-11, atol=1e-12)
    assert (values > 0.0).any()


@pytest.mark.parametrize("m", [3, 4])
def test_wrenches_of_a_grasp_give_its_quality(m):
    contacts, normals, centers = uniform_grasps(60, np.random.default_rng(5), m)
    wrenches = np.array(
        [reference.wrenches(*one, 1.0, 8) for one in zip(contacts, normals, centers, strict=True)]
    )
    np.testing.assert_allclose(
        gm.quality_of_wrenches(wrenches), gm.quality(contacts, normals, centers), atol=1e-12
    )


def test_the_order_does_not_matter_to_the_bit_and_the_unit_only_as_a_factor():
    rng = np.random.default_rng(1)
    for width in (3, 6):
        wrenches = rng.normal(size=(20, 15, width))
        wrenches[:, 14] = wrenches[:, 3]
        values = gm.quality_of_wrenches(wrenches)
        mixed = wrenches[:, rng.permutation(15)]
        np.testing.assert_array_equal(gm.quality_of_wrenches(mixed), values)
        for unit in (2.0**-300, 2.0**-10, 2.0**300):
            np.testing.assert_allclose(
                gm.quality_of_wrenches(unit * wrenches), unit * values, rtol=1e-12
            )


def test_turned_wrenches_are_as_good():
    rng = np.random.default_rng(2)
    for width in (3, 6):
        turn = np.linalg.qr(rng.normal(size=(width, width)))[0]
        wrenches = rng.normal(size=(30, 20, width))
        np.testing.assert_allclose(
            gm.quality_of_wrenches(wrenches @ turn), gm.quality_of_wrenches(wrenches), atol=1e-12
        )


def test_lattice_points_and_boundaries_are_exact():
    grid = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 6, indexing="ij"), axis=-1).reshape(-1, 6)
    assert gm.quality_of_wrenches(grid) == pytest.approx(1.0, abs=1e-12)
    corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    assert gm.quality_of_wrenches(corners) == pytest.approx(1.0, abs=1e-12)
    # The origin on a facet, an edge, a corner, outside; a flat hull; too few; none.
    half = grid[grid[:, 2] >= 0]
    for zero in (half, half[half[:, 4] >= 0], half + 0.5, grid * [1, 1, 1, 1, 1, 0], grid[:6]):
        assert gm.quality_of_wrenches(zero) == 0.0
    assert gm.quality_of_wrenches(np.zeros((0, 6))) == 0.0
    assert gm.quality_of_wrenches(np.zeros((4, 3))) == 0.0
    assert gm.quality_of_wrenches(np.zeros((2, 0, 3))).tolist() == [0.0, 0.0]
    assert gm.quality_of_wrenches(np.zeros((0, 5, 6))).shape == (0,)


def test_suction_holds_what_it_pulls():
    # A cup on top of a cube that pulls with 1 and pushes as much, shears a half, twists a tenth.
    limits = np.diag([0.5, 0.5, 1.0, 0.1, 0.1, 0.1])
    assert gm.quality_of_wrenches(np.vstack([limits, -limits])) == pytest.approx(
        1 / np.sqrt((1 / np.diag(limits) ** 2).sum())
    )


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (np.zeros(6), r"wrenches must have shape \(..., k, 6\)"),
        (np.zeros((4, 5)), r"wrenches must have shape .* got \(4, 5\)"),
        ([[np.nan] * 6], "wrenches must be finite"),
        ([[np.inf] * 3], "wrenches must be finite"),
        ("x", "wrenches must be"),
    ],
)
def test_wrong_wrenches_are_one_sentence(wrong, sentence):
    with pytest.raises(gm.GraspModuliError, match=sentence):
        gm.quality_of_wrenches(wrong)
