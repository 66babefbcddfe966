"""The model surfaces, and the interpolation that they come from."""

import hashlib

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import graspmoduli as gm
from graspmoduli import _core
from graspmoduli.splines import clamped_knots, greville

BITS = "1b99b1d71076a512691b2d4557f542095a4bd7ddfd0bcd0165a53a4b9b036622"


def test_the_bits_of_the_models_are_those_of_every_other_machine():
    digest = hashlib.sha256()
    for name, surface in gm.shapes.MODELS.items():
        digest.update(f"{name} {surface.bottom} {surface.top} ".encode())
        digest.update(surface.coefficients.astype("<f8").tobytes())
    assert digest.hexdigest() == BITS


@pytest.mark.parametrize("name", gm.shapes.MODELS)
def test_models_lie_in_the_unit_ball_and_have_two_names(name):
    surface = gm.shapes.MODELS[name]
    u, theta = np.meshgrid(np.linspace(0, 1, 101), np.linspace(0, 2 * np.pi, 101))
    assert np.linalg.norm(surface.points(u, theta), axis=-1).max() <= 1.0
    assert gm.shapes.model(gm.shapes.NAMES[name]) is surface


@pytest.mark.parametrize("shape", [(1, 4), (2, 5), (8, 8), (13, 7), (64, 33), (512, 9)])
def test_interpolation_is_scipys(shape):
    intervals, columns = shape
    values = np.random.default_rng(intervals).uniform(1.0, 2.0, (intervals + 3, columns))
    sites, knots = greville(intervals), clamped_knots(intervals)
    rows = make_interp_spline(sites, values, k=3, t=knots).c
    # Row j of the system in θ is (1, 4, 1)/6 at j, j + 1, j + 2.
    ring = np.eye(columns)
    system = (ring + 4 * np.roll(ring, 1, axis=1) + np.roll(ring, 2, axis=1)) / 6
    wanted = np.linalg.solve(system, rows.T).T
    np.testing.assert_allclose(_core.interpolate(values), wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("name", "of"), [("sin", np.sin), ("cos", np.cos), ("exp", np.exp)])
def test_elementary_functions_are_numpys_to_a_last_bit(name, of):
    x = np.random.default_rng(1).uniform(-20, 20, (50, 40))
    np.testing.assert_allclose(getattr(_core, name)(x), of(x), rtol=1e-15, atol=1e-16)
    np.testing.assert_allclose(_core.power(np.abs(x), -0.125), np.abs(x) ** -0.125, rtol=1e-15)
    angle = _core.arctan2(x[0], x[1])
    np.testing.assert_allclose(angle, np.arctan2(x[0], x[1]), rtol=1e-15)
