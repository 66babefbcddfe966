"""The grasp quality Q_l (Sec. II of the paper), its relatives and its gradient."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, coefficient, count, grasps, locked, number
from ._core import GraspModuliError

#: What ``norm`` may be: the normal forces of all fingers sum to at most 1, or each is at most 1.
NORMS = ("sum", "each")


def quality(
    contacts: ArrayLike,
    normals: ArrayLike,
    center_of_mass: ArrayLike,
    *,
    friction: float = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    norm: str = "sum",
) -> Any:
    """Exact grasp quality Q_l.

    The largest wrench, in any direction, that the grasp resists when the normal forces of all
    fingers sum to 1: the distance from the origin to the boundary of the convex hull of the
    contact wrenches, or exactly 0 where the origin is not in its interior (the grasp is not force
    closure). Two hard contacts, collinear and coincident contacts have quality 0.

    Parameters
    ----------
    contacts
        Contact points c_i in the object frame, in the unit of the object. Shape (..., m, 3).
    normals
        Unit normals n_i pointing into the object. Shape (..., m, 3).
    center_of_mass
        Centre of mass z, about which torques are taken. Shape (..., 3).
    friction
        Coulomb friction coefficient μ ≥ 0. Without friction fewer than seven contacts have
        quality 0.
    edges
        Number l ≥ 3 of edges of the friction cones.
    torsion
        Torsional friction coefficient γ ≥ 0 of soft fingers, a length: with normal force 1 a
        finger also applies a torque about its normal of up to γ. Sliding and torsional friction
        trade off linearly.
    norm
        ``"sum"``: the normal forces of all fingers sum to at most 1, Q_l. ``"each"``: every one is
        at most 1, the L^∞ measure Q'_l.

    Returns
    -------
    float or array of shape (...)
        A float for a single grasp. Torques carry the unit of length, so Q depends on it.

    Raises
    ------
    GraspModuliError
        If a shape is wrong, a value is not finite, a normal is not unit (to 1e-4), μ < 0, l < 3,
        γ < 0, or the norm is unknown.

    Notes
    -----
    Three hard contacts with ``norm="sum"`` have a closed form. All else goes by an expanding
    polytope, some fifty times slower, that takes a hull for 0 if it surrounds the origin by less
    than 1e-9 of the lever arms.

    Examples
    --------
    Three fingers on the unit circle, pressing towards its centre:

    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> round(gm.quality(circle, -circle, [0, 0, 0]), 9)
    0.544232187
    """
    if norm not in NORMS:
        raise GraspModuliError(f'norm must be "sum" or "each", got {norm!r}')
    cone = _cone(friction, edges, torsion)
    points, directions, center, batch = grasps(contacts, normals, center_of_mass)
    values = _core.quality(points, directions, center, *cone, norm == "each")
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
    torsion: float = 0.0,
) -> QualityGradient:
    """Exact gradient of Q_l with respect to contacts, normals and centre of mass.

    Arguments and errors are those of :func:`quality`. With v the unit normal of the facet of the
    wrench hull nearest to the origin and Q v = Σ α_k w_k, α ≥ 0, its foot point in terms of the
    facet's wrenches, dQ = Σ α_k ⟨v, dw_k⟩; dw includes the rotation of the cones with the normals.

    Where several facets are nearest, or the foot point has several such α, Q is not
    differentiable. Then the derivative of one of them is returned: an element of Clarke's
    generalised gradient, the convex hull of the limits of gradients nearby. Where Q = 0 all
    derivatives are 0, which is the gradient inside of the set {Q = 0} and an element of the
    generalised one on its boundary. Where a normal is −e₃ the contact frame is not continuous, and
    the motion of its tangents is left out.
    """
    cone = _cone(friction, edges, torsion)
    points, directions, center, batch = grasps(contacts, normals, center_of_mass)
    m = points.shape[1]
    rows = _core.quality_gradient(points, directions, center, *cone)
    value = rows[:, 0].reshape(batch) if batch else float(rows[0, 0])
    split = 1 + 3 * m
    return QualityGradient(
        value=value,
        contacts=locked(rows[:, 1:split].reshape((*batch, m, 3))),
        normals=locked(rows[:, split : split + 3 * m].reshape((*batch, m, 3))),
        center_of_mass=locked(rows[:, split + 3 * m :].reshape((*batch, 3))),
    )


def quality_at_least(
    contacts: ArrayLike,
    normals: ArrayLike,
    center_of_mass: ArrayLike,
    threshold: float,
    *,
    friction: float = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
) -> Any:
    """Is Q_l ≥ ``threshold``?

    The same as comparing :func:`quality`, whose arguments and errors it shares, but each grasp is
    given up as soon as the answer is known. A bool for a single grasp, else shape (...).
    """
    bar = number("threshold", threshold)
    cone = _cone(friction, edges, torsion)
    points, directions, center, batch = grasps(contacts, normals, center_of_mass)
    values = _core.quality_at_least(points, directions, center, bar, *cone)
    return values.reshape(batch) if batch else bool(values[0])


@dataclass(frozen=True)
class Extreme:
    """The best or the worst of many grasps."""

    #: Its index in the batch: a tuple as long as the batch has axes.
    index: tuple[int, ...]
    #: Its Q_l.
    quality: float


def largest_quality(
    contacts: ArrayLike,
    normals: ArrayLike,
    center_of_mass: ArrayLike,
    *,
    friction: float = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
) -> Extreme:
    """The best of a batch of grasps by Q_l, the first among equals.

    The same as the maximum of :func:`quality`, whose arguments and errors it shares, but a grasp
    is given up as soon as it is known to be worse than the best so far.
    """
    return _extreme(contacts, normals, center_of_mass, _cone(friction, edges, torsion), True)


def smallest_quality(
    contacts: ArrayLike,
    normals: ArrayLike,
    center_of_mass: ArrayLike,
    *,
    friction: float = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
) -> Extreme:
    """The worst of a batch of grasps by Q_l, the first among equals.

    The same as the minimum of :func:`quality`, whose arguments and errors it shares, but a grasp
    is given up as soon as it is known not to be worse than the worst so far.
    """
    return _extreme(contacts, normals, center_of_mass, _cone(friction, edges, torsion), False)


def _extreme(
    contacts: ArrayLike,
    normals: ArrayLike,
    center_of_mass: ArrayLike,
    cone: tuple[float, int, float],
    largest: bool,
) -> Extreme:
    points, directions, center, batch = grasps(contacts, normals, center_of_mass)
    found = _core.extreme_quality(points, directions, center, *cone, largest)
    if found is None:
        raise GraspModuliError(f"contacts must hold at least one grasp, got shape {points.shape}")
    index, value = found
    return Extreme(tuple(int(i) for i in np.unravel_index(index, batch)), value)


@dataclass(frozen=True)
class Bounds:
    """What is proven of a quality: lower ≤ Q ≤ upper. Floats for a single grasp."""

    lower: Any
    upper: Any
    #: How far apart they may be, relative to the upper one, to count as met.
    tolerance: float

    @property
    def value(self) -> Any:
        """The middle where the bounds have met, NaN elsewhere."""
        met = self.upper - self.lower <= self.tolerance * self.upper
        return np.where(met, 0.5 * (self.lower + self.upper), np.nan)[()]


def circular_quality(
    contacts: ArrayLike,
    normals: ArrayLike,
    center_of_mass: ArrayLike,
    *,
    friction: float = 1.0,
    tolerance: float = 1e-3,
) -> Bounds:
    """The quality with exact, circular friction cones instead of polygonal ones.

    Arguments and errors are those of :func:`quality`. The hull has no finite set of corners, so
    the answer is a proven lower and a proven upper bound; see ``value`` of the result. Unlike Q_l
    it does not depend on the coordinates' axes.

    Parameters
    ----------
    contacts, normals, center_of_mass, friction
        As in :func:`quality`.
    tolerance
        The bounds are driven to within this of each other, relative to the upper one; from 1e-6
        to 1. They may stay further apart where that takes more than four million facets.
    """
    mu = coefficient("friction", friction)
    wanted = number("tolerance", tolerance)
    if not 1e-6 <= wanted <= 1.0:
        raise GraspModuliError(f"tolerance must lie in [1e-6, 1], got {wanted}")
    points, directions, center, batch = grasps(contacts, normals, center_of_mass)
    rows = _core.circular_quality(points, directions, center, mu, wanted)
    lower, upper = rows[:, 0], rows[:, 1]
    if batch:
        return Bounds(locked(lower.reshape(batch)), locked(upper.reshape(batch)), wanted)
    return Bounds(float(lower[0]), float(upper[0]), wanted)


def _cone(friction: Any, edges: Any, torsion: Any) -> tuple[float, int, float]:
    return (
        coefficient("friction", friction),
        count("edges", edges, 3),
        coefficient("torsion", torsion),
    )
