"""The grasp quality Q_l (Sec. II of the paper), its relatives and its gradient.

Import them from the package: ``graspmoduli.quality`` is the function, which hides this module of
the same name. ``from graspmoduli.quality import ...`` still reaches into the module.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, coefficient, finite, floats, locked, number
from ._batches import Batch, GraspLike, batch, check_gradient
from ._core import GraspModuliError
from ._values import Value


@overload
def quality(
    contacts: ArrayLike | Sequence[GraspLike],
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
    length_scale: ArrayLike | None = None,
) -> Any: ...


@overload
def quality(
    contacts: GraspLike,
    normals: None = None,
    center_of_mass: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
    length_scale: float | None = None,
) -> float: ...


def quality(
    contacts: Any,
    normals: Any = None,
    center_of_mass: Any = None,
    *,
    friction: Any = None,
    edges: Any = None,
    torsion: Any = None,
    norm: str | None = None,
    length_scale: Any = None,
) -> Any:
    """Exact grasp quality Q_l.

    The largest wrench, in any direction, that the grasp resists when the normal forces of all
    fingers sum to 1: the distance from the origin to the boundary of the convex hull of the
    contact wrenches, or exactly 0 where the origin is not in its interior (the grasp is not force
    closure). Two hard contacts, collinear and coincident hard contacts have quality 0.

    Parameters
    ----------
    contacts
        Contact points c_i in the object frame, in the unit of the object. Shape (..., m, 3). Or a
        grasp of the library, or a list of them, with nothing else: it is evaluated with the
        friction, edges, torsion and length scale that it was made with, where it has them and you
        do not say otherwise, so that ``gm.quality(best) == best.quality``. Or contact frames, see
        :func:`graspmoduli.contact_frames`.
    normals
        Unit normals n_i pointing into the object. Shape (..., m, 3).
    center_of_mass
        Centre of mass z, about which torques are taken. Shape (..., 3).
    friction
        Coulomb friction coefficient μ from 0 to 1e6, 1 if not given: a number, one per contact
        (m,), or one per contact of every grasp (..., m). Without friction fewer than seven hard
        contacts, and fewer than four soft ones, have quality 0.
    edges
        Number l of edges of the friction cones, from 3 to 4,096; 8 if not given.
    torsion
        Torsional friction coefficient γ ≥ 0 of soft fingers, a length; 0, hard fingers, if not
        given. With normal force 1 a finger also applies a torque about its normal of up to γ.
        Sliding and torsional friction trade off linearly.
    norm
        ``"sum"``: the normal forces of all fingers sum to at most 1, Q_l. ``"each"``: every one is
        at most 1, the L^∞ measure Q'_l.
    length_scale
        Torques are divided by this length, in the unit of the object; 1 if not given, as in the
        paper. With a length of the object itself Q does not depend on the unit. A number, or one
        per grasp (...).

    Returns
    -------
    float or array of shape (...)
        A float for a single grasp.

    Raises
    ------
    GraspModuliError
        If a shape is wrong, a value is not finite, a normal is not unit (to 1e-4), a coefficient or
        number is out of its range, or the norm is unknown; and where the farthest contact is more
        than 1e60 or less than 1e-60 length scales (but not 0) away from the centre of mass.

    Notes
    -----
    Three hard contacts with ``norm="sum"`` and up to 36 edges have a closed form, which answers
    where no sign hangs on rounding. All else goes by an expanding polytope, several times slower
    for four contacts and a hundred times for eight. "Not in its interior" means for both: in units
    of forces and of torques about the contacts' centroid over the longest distance from it, the
    hull reaches no farther than 1e-12 beyond some plane through the origin (or no farther than
    1e-8, where rounding leaves it open). The order of the contacts does not change a bit of Q.

    Examples
    --------
    Three fingers on the unit circle, pressing towards its centre:

    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> round(gm.quality(circle, -circle, [0, 0, 0]), 9)
    0.544232187

    The same in millimetres, with torques over the circle's radius:

    >>> round(gm.quality(1000 * circle, -circle, [0, 0, 0], length_scale=1000), 9)
    0.544232187
    """
    # A single grasp whose arrays are as they should be; anything else takes the careful way.
    value = _core.quality_of_one(
        contacts, normals, center_of_mass, friction, edges, torsion, norm, length_scale
    )
    if value is not None:
        return value
    grasps = batch(contacts, normals, center_of_mass, friction, edges, torsion, length_scale, norm)
    return grasps.shaped(_core.quality(grasps.arrays, grasps.cone))


@dataclass(frozen=True, eq=False)
class QualityGradient(Value):
    """Q_l and its derivatives."""

    #: Q_l. A float for a single grasp, else shape (...).
    value: Any
    #: ∂Q/∂c_i, per unit of length of the object. Shape (..., m, 3).
    contacts: Floats
    #: ∂Q/∂n_i, tangent to the sphere at n_i. Shape (..., m, 3).
    normals: Floats
    #: ∂Q/∂z, per unit of length of the object. Shape (..., 3).
    center_of_mass: Floats


def quality_gradient(
    contacts: ArrayLike | GraspLike | Sequence[GraspLike],
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
    length_scale: ArrayLike | None = None,
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
    the motion of its tangents is left out. With ``norm="each"``, for up to 122 contacts, the foot
    point is a sum over the fingers, Σ_j α_ij = 1 for each finger i that presses.

    Examples
    --------
    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> slope = gm.quality_gradient(circle, -circle, [0, 0, 0])
    >>> slope.contacts.shape, slope.center_of_mass.shape
    ((3, 3), (3,))
    """
    grasps = batch(contacts, normals, center_of_mass, friction, edges, torsion, length_scale, norm)
    m, shape = grasps.arrays[0].shape[1], grasps.shape
    check_gradient(grasps.cone, m)
    rows = _core.quality_gradient(grasps.arrays, grasps.cone)
    found, by_contact, by_normal, by_center = np.split(rows, [1, 1 + 3 * m, 1 + 6 * m], axis=1)
    # The kernel's derivatives are by lengths over the length scale.
    scale = grasps.scale[..., None]
    return QualityGradient(
        value=grasps.shaped(locked(found[:, 0].copy())),
        contacts=locked((by_contact / scale).reshape((*shape, m, 3))),
        normals=locked(by_normal.reshape((*shape, m, 3))),
        center_of_mass=locked((by_center / scale).reshape((*shape, 3))),
    )


def quality_at_least(
    contacts: ArrayLike | GraspLike | Sequence[GraspLike],
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    threshold: float | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
    length_scale: ArrayLike | None = None,
) -> Any:
    """Is Q_l ≥ ``threshold``?

    The same as comparing :func:`quality`, whose arguments and errors it shares, but each grasp is
    given up as soon as the answer is known. A bool for a single grasp, else
    shape (...).

    Examples
    --------
    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> gm.quality_at_least(circle, -circle, [0, 0, 0], 0.5)
    True
    """
    bar = number("threshold", threshold)
    grasps = batch(contacts, normals, center_of_mass, friction, edges, torsion, length_scale, norm)
    return grasps.shaped(_core.quality_at_least(grasps.arrays, grasps.cone, bar))


@dataclass(frozen=True)
class Extreme:
    """The best or the worst of many grasps."""

    #: Its index in the batch: a tuple as long as the batch has axes.
    index: tuple[int, ...]
    #: Its Q_l.
    quality: float


def largest_quality(
    contacts: ArrayLike | GraspLike | Sequence[GraspLike],
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
    length_scale: ArrayLike | None = None,
) -> Extreme:
    """The best of a batch of grasps by Q_l, the first among equals.

    The same as the maximum of :func:`quality`, whose arguments and errors it shares, but a grasp
    is given up as soon as it is known to be worse than the best so far.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> some = gm.sample_configurations(1000, seed=0)
    >>> best = gm.largest_quality(some)
    >>> bool(best.quality == gm.quality(some).max())
    True
    """
    grasps = batch(contacts, normals, center_of_mass, friction, edges, torsion, length_scale, norm)
    return _extreme(grasps, largest=True)


def smallest_quality(
    contacts: ArrayLike | GraspLike | Sequence[GraspLike],
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    edges: int | None = None,
    torsion: float | None = None,
    norm: str | None = None,
    length_scale: ArrayLike | None = None,
) -> Extreme:
    """The worst of a batch of grasps by Q_l, the first among equals.

    The same as the minimum of :func:`quality`, whose arguments and errors it shares, but a grasp
    is given up as soon as it is known not to be worse than the worst so far.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> gm.smallest_quality(gm.sample_configurations(1000, seed=0)).quality
    0.0
    """
    grasps = batch(contacts, normals, center_of_mass, friction, edges, torsion, length_scale, norm)
    return _extreme(grasps, largest=False)


def _extreme(grasps: Batch, *, largest: bool) -> Extreme:
    found = _core.extreme_quality(grasps.arrays, grasps.cone, largest)
    if found is None:
        raise GraspModuliError(
            f"contacts must hold at least one grasp, got a batch of shape {grasps.shape}"
        )
    index, value = found
    return Extreme(tuple(int(i) for i in np.unravel_index(index, grasps.shape)), value)


@dataclass(frozen=True, eq=False)
class Bounds(Value):
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
    contacts: ArrayLike | GraspLike | Sequence[GraspLike],
    normals: ArrayLike | None = None,
    center_of_mass: ArrayLike | None = None,
    *,
    friction: ArrayLike | None = None,
    torsion: float | None = None,
    norm: str | None = None,
    tolerance: float = 1e-3,
    length_scale: ArrayLike | None = None,
) -> Bounds:
    """The quality with exact, circular friction cones instead of polygonal ones.

    Arguments and errors are those of :func:`quality`. The hull has no finite set of corners, so
    the answer is a lower and an upper bound, see ``value`` of the result. Both are proven but for
    rounding; where the origin is not in the interior, as :func:`quality` defines it, both are 0.
    Unlike Q_l they do not depend on the coordinates' axes.

    Parameters
    ----------
    contacts, normals, center_of_mass, friction, torsion, norm, length_scale
        As in :func:`quality`.
    tolerance
        The bounds are driven to within this of each other, relative to the upper one; from 1e-6
        to 1. They may stay further apart where that takes more than four million facets.

    Examples
    --------
    >>> import numpy as np, graspmoduli as gm
    >>> angle = 2 * np.pi * np.arange(3) / 3
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> bounds = gm.circular_quality(circle, -circle, [0, 0, 0])
    >>> gm.quality(circle, -circle, [0, 0, 0]) < bounds.lower <= bounds.upper
    True
    """
    wanted = number("tolerance", tolerance)
    if not 1e-6 <= wanted <= 1.0:
        raise GraspModuliError(f"tolerance must lie in [1e-6, 1], got {wanted}")
    grasps = batch(contacts, normals, center_of_mass, friction, None, torsion, length_scale, norm)
    rows = _core.circular_quality(grasps.arrays, grasps.cone, wanted)
    lower, upper = (grasps.shaped(column.copy()) for column in rows.T)
    for bound in (lower, upper):
        if isinstance(bound, np.ndarray):
            locked(bound)
    return Bounds(lower, upper, wanted)


def pad_torsion(radius: float, friction: float = 1.0) -> float:
    """The torsional friction coefficient γ of a soft fingertip, a length.

    A round contact of radius a that is pressed with f_n, its pressure that of Hertz, slips under a
    torque about its normal of (3π/16) μ a f_n: K. L. Johnson, Contact Mechanics, 1985, Sec. 7.4;
    R. D. Howe and M. R. Cutkosky, Practical force-motion models for sliding manipulation, Int. J.
    Robotics Research 15(6), 1996. Of an even pressure it is 2/3 in the place of 3π/16.

    Parameters
    ----------
    radius
        Of the contact, in the unit of the object: of a flat pad its own, of a ball that of the
        patch that is pressed flat.
    friction
        Coulomb friction coefficient μ.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> round(gm.pad_torsion(0.01, friction=0.8), 6)
    0.004712
    """
    a = number("radius", radius, positive=True)
    return 3.0 * math.pi / 16.0 * coefficient("friction", friction) * a


def quality_of_wrenches(wrenches: ArrayLike) -> Any:
    """The distance from the origin to the boundary of the convex hull of given wrenches.

    For all that is no friction cone on a surface: suction cups, magnets, tendons, cones of another
    shape, contacts with limits of force of their own. Q_l (Sec. II) is that of the wrenches of its
    cones' edges; with three components it is the planar quality of courses and of many published
    numbers. Exact to rounding, 0 if the origin is not in the interior, the same to the bit
    whatever the order of the wrenches.

    Parameters
    ----------
    wrenches
        Forces and torques, (..., k, 6), or in the plane (f_x, f_y, τ), (..., k, 3). Torques are
        taken as they are: divide them by a length for a distance that does not depend on the unit.

    Returns
    -------
    float or array of shape (...)
        In the unit of the wrenches.

    Raises
    ------
    GraspModuliError
        If the shape is another one or a number is not finite.

    Examples
    --------
    Two fingers with a friction coefficient of 1 on either side of a square of width 2:

    >>> import graspmoduli as gm
    >>> fingers = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
    >>> round(gm.quality_of_wrenches(fingers), 12)
    0.57735026919
    """
    given = finite("wrenches", floats("wrenches", wrenches))
    if given.ndim < 2 or given.shape[-1] not in (3, 6):
        raise GraspModuliError(
            f"wrenches must have shape (..., k, 6), or (..., k, 3) in the plane, got {given.shape}"
        )
    shape, (count, width) = given.shape[:-2], given.shape[-2:]
    rows = given.reshape(int(np.prod(shape)), count, width)
    # Of size 1, as their squares have to be numbers.
    sizes = np.abs(rows).max(axis=(1, 2), initial=0.0)
    unit = np.where(sizes > 0.0, sizes, 1.0)
    scaled = np.ascontiguousarray(rows / unit[:, None, None])
    values = _core.quality_of_wrenches(scaled) * unit if count else np.zeros(len(rows))
    return float(values[0]) if shape == () else values.reshape(shape)
