"""The check of portability itself: it must be able to fail."""

import numpy as np
import pytest

from portable.check import TOLERANCE, differences, environments, lattice, random, symmetric


def test_one_last_bit_of_a_model_is_a_difference():
    one = {"models/a": np.array([1.0, 2.0]), "grasp/mug": np.array([0.5])}
    other = {**one, "models/a": np.array([1.0, np.nextafter(2.0, 3.0)])}
    assert differences(one, one) == {}
    assert differences(one, other) == {"models/a": pytest.approx(4.4e-16, rel=0.1)}


@pytest.mark.parametrize("kind", TOLERANCE)
def test_fits_differ_beyond_their_tolerance(kind):
    one, bar = {f"{kind}/mug": np.array([0.5])}, TOLERANCE[kind]
    assert differences(one, {f"{kind}/mug": np.array([0.5 + 0.9 * bar])}) == {}
    assert list(differences(one, {f"{kind}/mug": np.array([0.5 + 1.1 * bar])})) == [f"{kind}/mug"]
    for wrong in (np.array([np.nan]), np.zeros((0,))):
        assert list(differences(one, {f"{kind}/mug": wrong})) == [f"{kind}/mug"]


def test_what_is_missing_differs():
    assert differences({"Q": np.zeros(1)}, {}) == differences({}, {"Q": np.zeros(1)})
    assert differences({"Q": np.zeros(1)}, {}) == {"Q": np.inf}


def test_every_kind_of_environment_is_among_them():
    places = environments()
    named = {name for variables in places.values() for name in variables}
    assert places["as it is"] == {}
    assert {"NPY_DISABLE_CPU_FEATURES", "GLIBC_TUNABLES", "RAYON_NUM_THREADS"} <= named


def test_the_grasps_hold_both_answers():
    import graspmoduli as gm

    rng = np.random.Generator(np.random.Philox(1))
    for batch in (lattice(1000, rng), random(1000, 3, rng), random(200, 5, rng)):
        assert 0 < (gm.quality(*batch) > 0).sum() < len(batch[0])
        np.testing.assert_allclose(np.linalg.norm(batch[1], axis=-1), 1.0, atol=1e-15)
    q = gm.quality(*symmetric())
    assert (q > 0).all()
    # All are one triangle.
    contacts = symmetric()[0]
    sides = np.linalg.norm(contacts - np.roll(contacts, 1, axis=1), axis=-1)
    np.testing.assert_allclose(sides, np.sqrt(3.0), atol=1e-15)
