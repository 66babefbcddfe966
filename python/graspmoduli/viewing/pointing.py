"""Where a pointer is on a surface."""

from __future__ import annotations

import numpy as np

from .._arrays import Floats
from ..surfaces import Surface


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
