"""The singular values of the grasp matrix, which takes contact forces to their wrench."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._arrays import Floats
from .halfspaces import FLAT


def singular_values(levers: Floats, normals: Floats, torsion: float, scale: Any) -> Floats:
    """Of G, which takes the forces of m contacts to their wrench, torques over ``scale``.

    Lever arms and normals (n, m, 3), ``scale`` (n,) or a number. Of soft fingers G has a fourth
    column per contact, the torque about its normal in units of γ. Shape (n, 6), from the largest;
    exactly 0 beyond the rank, to 1e-12 in units of the longest lever arm.
    """
    n, m, _ = levers.shape
    reach = np.maximum(np.linalg.norm(levers, axis=-1).max(axis=1), torsion)
    reach = np.where(reach > 0.0, reach, 1.0)
    arms = levers / reach[:, None, None]
    # Columns of forces, then of torques: (n, 6, 3m) or (n, 6, 4m).
    per = 4 if torsion > 0.0 else 3
    balanced = np.zeros((n, 6, m, per))
    balanced[:, :3, :, :3] = np.eye(3)[:, None]
    for axis in range(3):
        balanced[:, 3:, :, axis] = np.cross(arms, np.eye(3)[axis]).transpose(0, 2, 1)
    if torsion > 0.0:
        spin = torsion / reach[:, None, None]
        balanced[:, 3:, :, 3] = spin * normals.transpose(0, 2, 1)
    balanced = balanced.reshape(n, 6, m * per)
    weights = np.ones((n, 6))
    weights[:, 3:] = (reach / scale)[:, None]

    # Values are right to the rounding of the largest; through the inverse, to that of the least.
    values = np.zeros((n, 6))
    direct = np.linalg.svd(balanced * weights[:, :, None], compute_uv=False)
    values[:, : direct.shape[1]] = direct
    extents = np.linalg.svd(balanced, compute_uv=False)
    ranks = (extents > FLAT * extents[:, :1]).sum(axis=1)
    full = ranks == 6
    if full.any():
        inverse = np.linalg.pinv(balanced[full], rcond=FLAT) / weights[full][:, None]
        with np.errstate(divide="ignore"):
            through = 1.0 / np.linalg.svd(inverse, compute_uv=False)[:, ::-1]
        large = direct[full] ** 2 >= direct[full][:, :1] * through[:, 5:]
        values[full] = np.where(large, direct[full], through)
    return np.where(np.arange(6) < ranks[:, None], values, 0.0)
