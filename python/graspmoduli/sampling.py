"""Contacts distributed uniformly by area (Arvo's method, reference [2] of the paper)."""

from __future__ import annotations

import numpy as np

from . import _core
from ._arrays import Floats, count, locked
from .surfaces import Surface, a_surface


def sample_points(surface: Surface, n: int, seed: int = 0) -> tuple[Floats, Floats]:
    """``n`` contact coordinates, uniform by area and stratified.

    The unit square is cut into n cells of equal area, one point is drawn in each, and the points
    are mapped to the surface so that equal areas go to equal areas: u by the marginal
    distribution of the area density ‖t₁ × t₂‖, θ by the conditional one, both inverted by
    bisection to 1e-9 of a grid interval. Areas are those of Simpson's rule with two steps per
    spline interval, at least 60: to 1e-4 on smooth surfaces, to a few percent beside spikes as
    narrow as an interval.

    Returns
    -------
    u, theta
        Each of shape (n,), read-only. The same seed gives the same bits.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> u, theta = gm.sample_points(gm.shapes.model("bottle"), 200, seed=0)
    >>> u.shape, theta.shape
    ((200,), (200,))
    """
    core = a_surface("surface", surface)._core
    points = _core.sample_points(core, unit_square(count("n", n, 1), seed))
    return locked(points[:, 0].copy()), locked(points[:, 1].copy())


def unit_square(n: int, seed: int) -> Floats:
    """``n`` points of the unit square, one in each of n cells of equal area. Shape (n, 2)."""
    seed = count("seed", seed, 0)
    jitter = np.random.Generator(np.random.Philox(seed)).random((n, 2))
    # Rows as high as the share of the n cells that they hold.
    row_count = max(1, round(n**0.5))
    row = np.arange(n) * row_count // n
    starts = np.searchsorted(row, np.arange(row_count + 1))
    cells = np.diff(starts)[row]
    column = np.arange(n) - starts[row]
    return np.stack(
        [(starts[row] + jitter[:, 0] * cells) / n, (column + jitter[:, 1]) / cells], axis=1
    )
