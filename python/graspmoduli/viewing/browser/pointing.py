"""Where a pointer is: on a surface, or in the triangle of shapes."""

from __future__ import annotations

import numpy as np

from ..._arrays import Floats
from ...surfaces import Surface

#: The triangle of shapes, in the plane that the first look is at: its corners.
TRIANGLE = np.array([[1.5, 0.0, -0.75], [3.1, 0.0, -0.75], [2.3, 0.0, 0.64]])


def under_pointer(surface: Surface, eye: Floats, through: Floats) -> tuple[float, float]:
    """(u, θ) where the ray from the eye through a point meets the surface, or comes nearest."""
    ray = through - eye
    ray = ray / np.linalg.norm(ray)
    reach = float(np.linalg.norm(eye)) + 3.0
    points = eye + np.linspace(0.05, reach, 1500)[:, None] * ray
    span = surface.top - surface.bottom
    u = (points[:, 2] - surface.bottom) / span
    theta = np.arctan2(points[:, 1], points[:, 0])
    outside = np.hypot(points[:, 0], points[:, 1]) - surface.radius(np.clip(u, 0.0, 1.0), theta)
    # Beyond the ends it is the way to them that counts.
    beyond = np.maximum(np.maximum(-u, u - 1.0), 0.0) * span
    distance = np.hypot(np.maximum(outside, 0.0), beyond)
    # Through an open end one sees the inside of the far wall; the near wall is meant.
    enters = np.flatnonzero((outside[1:] <= 0.0) & (outside[:-1] > 0.0) & (beyond[1:] == 0.0))
    at = int(enters[0]) + 1 if enters.size else int(distance.argmin())
    return float(np.clip(u[at], 0.0, 1.0)), float(theta[at])


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
