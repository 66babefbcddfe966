"""Shared fixtures."""

import os
import signal
from pathlib import Path

# The tests run side by side; threads of BLAS would only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent

# A shell ignores Ctrl-C for what it starts in the background, and so would the commands that
# the tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)


def uniform_grasps(n, rng, m=3):
    """Uniform in D(1): contacts and centre of mass in the unit ball, normals on the sphere."""

    def sphere(count):
        v = rng.normal(size=(count, 3))
        return v / np.linalg.norm(v, axis=1, keepdims=True)

    def ball(count):
        return sphere(count) * rng.random((count, 1)) ** (1 / 3)

    return ball(m * n).reshape(n, m, 3), sphere(m * n).reshape(n, m, 3), ball(n)


@pytest.fixture(scope="session")
def uniform():
    """200,000 uniform grasps."""
    return uniform_grasps(200_000, np.random.default_rng(20130624))


def some_long(values, is_long):
    """Parameters of a test, of which some run with the longer tests only."""
    return [pytest.param(v, marks=pytest.mark.long if is_long(v) else []) for v in values]


def quick(values, *names):
    """Parameters of a test, of which only those that are named run with the quick tests."""
    return some_long(values, lambda value: getattr(value, "stem", value) not in names)


def objects():
    """Real meshes: the shipped ones, and more where a folder of them lies beside the checkout."""
    found = {path.name: path for path in (ROOT / "examples" / "objects").glob("*.ply")}
    for path in (ROOT.parent / "shared" / "objects").glob("*.ply"):
        found.setdefault(path.name, path)
    return [found[name] for name in sorted(found)]
