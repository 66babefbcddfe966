"""The grasp quality Q_l (Sec. II of the paper)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, cone, grasps, locked


def quality(
    contacts: ArrayLike,
    normals: ArrayLike,
    center_of_mass: ArrayLike,
    *,
    friction: float = 1.0,
    edges: int = 8,
) -> Any:
    """Exact grasp quality Q_l.

    The largest wrench, in any direction, that the grasp resists when the normal forces of all
    fingers sum to 1: the distance from the origin to the boundary of the convex hull of the
    contact wrenches, or exactly 0 where the origin is not in its interior (the grasp is not force
    closure). Two contacts, collinear and coincident contacts have quality 0.

    Parameters
    ----------
    contacts
        Contact points c_i in the object frame, in the unit of the object. Shape (..., m, 3),
        m at most 3 in this version.
    normals
        Unit normals n_i pointing into the object. Shape (..., m, 3).
    center_of_mass
        Centre of mass z, about which torques are taken. Shape (..., 3).
    friction
        Coulomb friction coefficient μ > 0.
    edges
        Number l ≥ 3 of edges of the friction cones.

    Returns
    -------
    float or array of shape (...)
        A float for a single grasp. Torques carry the unit of length, so Q depends on it.

    Raises
    ------
    GraspModuliError
        If a shape is wrong, a value is not finite, a normal is not unit (to 1e-4), μ ≤ 0 or l < 3.

    Examples
    --------
    Three fingers on the unit circle, pressing towards its centre:

    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> round(gm.quality(circle, -circle, [0, 0, 0]), 9)
    0.544232187
    """
    mu, l = cone(friction, edges)
    points, directions, center, batch = grasps(contacts, normals, center_of_mass)
    values = _core.quality(points, directions, center, mu, l)
    return values.reshape(batch) if batch else float(values[0])


@dataclass(frozen=True)
class QualityGradient:
    """Q_l and its derivatives."""

    #: Q_l. A float for a single grasp, else shape (...).
    value: Any
    #: ∂Q/∂c_i. Shape (..., m, 3).
    contacts: Floats
    #: ∂Q/∂n_i, tangent to the sphere at n_i. Shape (..., m, 3).
    normals: Floats
    #: ∂Q/∂z. Shape (..., 3).
    center_of_mass: Floats


def quality_gradient(
    contacts: ArrayLike,
    normals: ArrayLike,
    center_of_mass: ArrayLike,
    *,
    friction: float = 1.0,
    edges: int = 8,
) -> QualityGradient:
    """Exact gradient of Q_l with respect to contacts, normals and centre of mass.

    Arguments and errors are those of :func:`quality`. With v the unit normal of the facet of the
    wrench hull nearest to the origin and Q v = Σ α_k w_k its foot point in terms of the facet's
    wrenches, dQ = Σ α_k ⟨v, dw_k⟩; dw includes the rotation of the cones with the normals.

    Where several facets are nearest, Q is not differentiable and the gradient is that of the
    distance to one of them. Where Q = 0 all derivatives are 0.
    """
    mu, l = cone(friction, edges)
    points, directions, center, batch = grasps(contacts, normals, center_of_mass)
    m = points.shape[1]
    if m < 3:
        # Fewer than three contacts are never force closure.
        rows = _core.quality(points, directions, center, mu, l)[:, None].repeat(6 * m + 4, axis=1)
    else:
        rows = _core.quality_gradient(points, directions, center, mu, l)
    value = rows[:, 0].reshape(batch) if batch else float(rows[0, 0])
    split = 1 + 3 * m
    return QualityGradient(
        value=value,
        contacts=locked(rows[:, 1:split].reshape((*batch, m, 3))),
        normals=locked(rows[:, split : split + 3 * m].reshape((*batch, m, 3))),
        center_of_mass=locked(rows[:, split + 3 * m :].reshape((*batch, 3))),
    )
