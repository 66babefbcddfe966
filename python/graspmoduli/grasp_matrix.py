"""The singular values of the grasp matrix, which takes contact forces to their wrench."""

from __future__ import annotations

import numpy as np

from ._arrays import Floats
from .halfspaces import FLAT


def singular_values(
    contacts: Floats, normals: Floats, centers: Floats, torsion: float, scale: float
) -> Floats:
    """Of G, which takes the forces of m contacts to their wrench, torques over ``scale``.

    Contacts and normals (n, m, 3), centres of mass (n, 3). Of soft fingers G has a fourth column
    per contact, the torque about its normal in units of γ. Shape (n, 6), from the largest; exactly
    0 beyond the rank, to 1e-12 with torques about the contacts' centroid over the longest distance
    from it.
    """
    n = len(contacts)
    middle = contacts.mean(axis=1)
    arms = contacts - middle[:, None]
    reach = np.maximum(np.linalg.norm(arms, axis=-1).max(axis=1), torsion)
    reach = np.where(reach > 0.0, reach, 1.0)
    balanced = _matrix(arms / reach[:, None, None], normals, torsion / reach)
    matrix = _matrix((contacts - centers[:, None]) / scale, normals, np.full(n, torsion / scale))

    # Values are right to the rounding of the largest; through the inverse, to that of the least.
    values = np.zeros((n, 6))
    direct = np.linalg.svd(matrix, compute_uv=False)
    values[:, : direct.shape[1]] = direct
    extents = np.linalg.svd(balanced, compute_uv=False)
    ranks = (extents > FLAT * extents[:, :1]).sum(axis=1)
    full = ranks == 6
    if full.any():
        # From wrenches about the centre of mass to balanced ones.
        back = np.zeros((full.sum(), 6, 6))
        back[:, :3, :3] = np.eye(3)
        back[:, 3:, :3] = _cross((centers - middle)[full] / reach[full, None])
        back[:, 3:, 3:] = np.eye(3) * (scale / reach[full])[:, None, None]
        inverse = np.linalg.pinv(balanced[full], rcond=FLAT) @ back
        with np.errstate(divide="ignore"):
            through = 1.0 / np.linalg.svd(inverse, compute_uv=False)[:, ::-1]
        large = direct[full] ** 2 >= direct[full][:, :1] * through[:, 5:]
        values[full] = np.where(large, direct[full], through)
    return np.where(np.arange(6) < ranks[:, None], values, 0.0)


def _matrix(arms: Floats, normals: Floats, spins: Floats) -> Floats:
    """Forces over torques, a column for each component: (n, 6, 3m), or (n, 6, 4m) of soft ones."""
    n, m, _ = arms.shape
    per = 4 if spins.any() else 3
    columns = np.zeros((n, m, per, 6))
    columns[:, :, :3, :3] = np.eye(3)
    columns[:, :, :3, 3:] = _cross(arms).swapaxes(2, 3)
    if per == 4:
        columns[:, :, 3, 3:] = spins[:, None, None] * normals
    return columns.reshape(n, m * per, 6).swapaxes(1, 2)


def _cross(arms: Floats) -> Floats:
    """The matrices of r × ·. Shape (..., 3, 3)."""
    x, y, z = np.moveaxis(arms, -1, 0)
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape((*arms.shape, 3))
