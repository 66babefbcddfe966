"""The triangle of shapes."""

from __future__ import annotations

import numpy as np

from ..._arrays import Floats

#: The triangle of shapes, in the plane that the first look is at: its corners.
TRIANGLE = np.array([[1.5, 0.0, -0.75], [3.1, 0.0, -0.75], [2.3, 0.0, 0.64]])


def barycentric(point: Floats) -> Floats:
    """Weights of the corners of the triangle, at the nearest point of it. Shape (3,)."""
    a, b, c = TRIANGLE
    sides = np.stack([b - a, c - a], axis=1)
    s, t = np.linalg.lstsq(sides, point - a, rcond=None)[0]
    weights = np.array([1.0 - s - t, s, t])
    if (weights >= 0.0).all():
        return weights
    best, nearest = weights, np.inf
    for i, k in ((0, 1), (1, 2), (2, 0)):
        along = TRIANGLE[k] - TRIANGLE[i]
        share = float(np.clip((point - TRIANGLE[i]) @ along / (along @ along), 0.0, 1.0))
        edge = np.zeros(3)
        edge[i], edge[k] = 1.0 - share, share
        far = float(np.linalg.norm(edge @ TRIANGLE - point))
        if far < nearest:
            best, nearest = edge, far
    return best
