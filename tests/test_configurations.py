"""Samples of D(r) and of N_ε(g)."""

# Wrong types are passed on purpose.
# pyright: reportArgumentType=false

import pickle

import numpy as np
import pytest
from scipy import stats

import graspmoduli as gm
from graspmoduli import _core

#: Some two hundred numbers are tested, each at this level.
LEVEL = 1e-5


def uniform(values):
    """The p-value of values that should be uniform in [0, 1]."""
    return stats.kstest(values, "uniform").pvalue


@pytest.mark.parametrize(("m", "r"), [(1, 1.0), (3, 1e-3), (5, 40.0)])
def test_configurations_are_uniform(m, r):
    found = gm.sample_configurations(20_000, r, m, seed=5)
    assert found.contacts.shape == found.normals.shape == (20_000, m, 3)
    points = np.concatenate([found.contacts, found.center_of_mass[:, None]], axis=1) / r
    # Volume goes with the third power of the radius; on a sphere area goes with height.
    radii = np.linalg.norm(points, axis=-1)
    assert radii.max() <= 1.0 + 1e-15
    for i in range(m + 1):
        assert uniform(radii[:, i] ** 3) > LEVEL
    heights = np.concatenate([points / radii[..., None], found.normals], axis=1)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=-1), 1.0, rtol=0, atol=1e-15)
    for i in range(2 * m + 1):
        for axis in range(3):
            assert uniform(0.5 * (1.0 + heights[:, i, axis])) > LEVEL
    # Independent: no block of numbers goes with another.
    flat = np.concatenate([points.reshape(20_000, -1), found.normals.reshape(20_000, -1)], axis=1)
    among = np.corrcoef(flat.T) - np.eye(flat.shape[1])
    assert np.abs(among).max() < 5.0 / np.sqrt(20_000)


@pytest.mark.parametrize("m", [1, 3, 4])
@pytest.mark.parametrize("epsilon", [1e-3, 0.3, 2.0, 5.0])
def test_neighbours_are_uniform_and_near(m, epsilon):
    grasp = gm.sample_configurations(1, 1.0, m, seed=6)[0]
    near = gm.sample_nearby(grasp, epsilon, 5000, seed=7)
    assert max(gm.placed_distance(grasp, g) for g in near) <= epsilon
    points = np.concatenate([near.contacts, near.center_of_mass[:, None]], axis=1)
    middle = np.concatenate([grasp.contacts, grasp.center_of_mass[None]])
    for i in range(m + 1):
        off = (points[:, i] - middle[i]) / epsilon
        radii = np.linalg.norm(off, axis=1)
        assert uniform(radii**3) > LEVEL
        assert uniform(0.5 + 0.5 * off[:, 2] / radii) > LEVEL
    for i in range(m):
        # The square of the chord goes with height, and height with area; all around the axis.
        off = near.normals[:, i] - grasp.normals[i]
        assert uniform(((off / min(epsilon, 2.0)) ** 2).sum(1)) > LEVEL
        tangents = gm.contact_frames(grasp)[i, :3, :2]
        turn = np.arctan2(*(off @ tangents).T)
        assert uniform(turn / (2 * np.pi) % 1.0) > LEVEL


def test_they_are_those_of_the_kernel_of_the_experiments_and_of_the_seed():
    found = gm.sample_configurations(50, seed=3)
    rows = _core.random_grasps(3, 0, 50)
    assert np.array_equal(found.contacts.reshape(50, 9), rows[:, :9])
    assert np.array_equal(found.center_of_mass, rows[:, 18:])
    # The first of many are those of few; other seeds give others.
    assert gm.sample_configurations(10, seed=3) == found[:10]
    assert gm.sample_configurations(50, seed=4) != found
    # The bits themselves, of a seed: they must not change between versions or machines.
    scaled = gm.sample_configurations(50, 2.0, seed=3)
    assert np.array_equal(scaled.contacts, 2.0 * found.contacts)


def test_quality_takes_them_and_they_are_a_sequence_of_grasps():
    found = gm.sample_configurations(500, seed=8)
    values = gm.quality(found)
    assert values.shape == (500,)
    assert (values > 0.0).any()
    assert [gm.quality(g) for g in found] == values.tolist()
    assert len(found) == 500
    assert gm.largest_quality(found).quality == values.max()
    assert gm.quality_gradient(found).contacts.shape == (500, 3, 3)
    assert pickle.loads(pickle.dumps(found)) == found
    with pytest.raises(ValueError, match="read-only"):
        found.contacts[0] = 0.0


def test_wrong_input_is_said_so():
    grasp = gm.sample_configurations(1)[0]
    for call, sentence in (
        (lambda: gm.sample_configurations(0), "n must be at least 1, got 0"),
        (lambda: gm.sample_configurations(2.5), "n must be a whole number"),
        (lambda: gm.sample_configurations(2**40), "n must be at most"),
        (lambda: gm.sample_configurations(3, r=-1.0), "r must be a positive finite number"),
        (lambda: gm.sample_configurations(3, contacts=0), "contacts must be at least 1, got 0"),
        (lambda: gm.sample_configurations(3, seed=-1), "seed must be at least 0, got -1"),
        (lambda: gm.sample_nearby(None, 0.1, 3), "configuration must be a PlacedGrasp, got None"),
        (lambda: gm.sample_nearby(grasp, 0.0, 3), "epsilon must be a positive finite number"),
        (lambda: gm.sample_nearby(grasp, "x", 3), "epsilon must be a positive finite number"),
        (lambda: gm.sample_nearby(grasp, 0.1, 3, seed=2**64), "seed must be at most"),
    ):
        with pytest.raises(gm.GraspModuliError, match=sentence):
            call()
