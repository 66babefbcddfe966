"""Area-uniform sampling."""

import numpy as np
import pytest
from scipy import stats

import graspmoduli as gm


@pytest.mark.parametrize("name", ["c", "e", "i"])
def test_shares_of_the_area_are_the_shares_of_the_points(name):
    surface = gm.shapes.MODELS[name]
    n = 40_000
    u, theta = gm.sample_points(surface, n, seed=3)
    rows, columns, fine = 12, 8, 40
    grid_u, grid_theta = np.meshgrid(
        (np.arange(rows * fine) + 0.5) / (rows * fine),
        2 * np.pi * (np.arange(columns * fine) + 0.5) / (columns * fine),
        indexing="ij",
    )
    density = np.linalg.norm(np.cross(*surface.tangents(grid_u, grid_theta)), axis=-1)
    expected = density.reshape(rows, fine, columns, fine).sum((1, 3))
    expected *= n / expected.sum()
    cell = (u * rows).astype(int) * columns + (theta / (2 * np.pi) * columns).astype(int)
    counts = np.bincount(cell, minlength=rows * columns).reshape(rows, columns)
    # Stratified counts vary less than independent ones, so this is generous.
    assert stats.chisquare(counts.ravel(), expected.ravel()).pvalue > 1e-3


def test_strata_spread_the_points_more_evenly_than_chance():
    surface = gm.Surface.from_function(lambda u, t: 1.0 + 0 * u, 0.0, 2 * np.pi)
    u, theta = gm.sample_points(surface, 400, seed=1)
    cell = (u * 20).astype(int) * 20 + (theta / (2 * np.pi) * 20).astype(int)
    assert len(np.unique(cell)) == 400


@pytest.mark.parametrize("n", [1, 2, 3, 7, 50, 201])
def test_any_number_of_points(n):
    u, theta = gm.sample_points(gm.shapes.MODELS["a"], n)
    assert u.shape == theta.shape == (n,)
    assert ((u >= 0) & (u <= 1) & (theta >= 0) & (theta <= 2 * np.pi)).all()


def test_the_seed_decides_every_bit():
    surface = gm.shapes.MODELS["j"]
    first, again = gm.sample_points(surface, 100, seed=5), gm.sample_points(surface, 100, seed=5)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, gm.sample_points(surface, 100, seed=6))


def test_wrong_input():
    with pytest.raises(gm.GraspModuliError, match="n must be at least 1, got 0"):
        gm.sample_points(gm.shapes.MODELS["a"], 0)
    with pytest.raises(gm.GraspModuliError, match="seed must be at least 0, got -1"):
        gm.sample_points(gm.shapes.MODELS["a"], 5, seed=-1)
    for wrong in (None, "a", gm.shapes.MODELS):
        with pytest.raises(gm.GraspModuliError, match="surface must be a Surface, got"):
            gm.sample_points(wrong, 5)  # pyright: ignore[reportArgumentType]
