"""The Grasp Moduli Space: pairs of a surface and a grasp on it (Sec. III)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, brief, count, floats, locked, number
from ._core import GraspModuliError, sin
from .grasps import Grasp, PlacedGrasp
from .splines import what
from .surfaces import Surface, a_surface, combine, some_surfaces

#: A point of the Grasp Moduli Space: a surface and a grasp on it.
Point = tuple[Surface, Grasp]


class Combinations(list[Surface]):
    """Surfaces with the weights that they were combined with, ``weights``. Shape (n, k)."""

    weights: Floats

    def __init__(self, surfaces: Iterable[Surface], weights: Floats) -> None:
        super().__init__(surfaces)
        self.weights = locked(weights)

    def __reduce__(self) -> tuple[Any, ...]:
        return Combinations, (list(self), self.weights.copy())


def sample_weights(
    surfaces: int,
    n: int,
    seed: int = 0,
    concentration: ArrayLike = 1.0,
    *,
    total: tuple[float, float] | None = None,
) -> Floats:
    """Random weights to combine surfaces with: barycentric coordinates, or times a factor.

    Parameters
    ----------
    surfaces
        How many surfaces.
    n
        How many combinations.
    seed
        The same seed gives the same bits.
    concentration
        Parameter α of the Dirichlet distribution that barycentric coordinates are drawn from,
        positive, one for all or one per surface: 1 is uniform on the simplex, less prefers its
        corners, more its middle.
    total
        If given, what each row sums to is drawn between these two positive numbers, its logarithm
        uniformly: then combinations lie in the convex cone of the surfaces.

    Returns
    -------
    array of shape (n, surfaces)
        Rows are not negative and sum to 1 if no ``total`` is given, to rounding.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> gm.sample_weights(3, 1000, seed=0).mean(axis=0).round(1)
    array([0.3, 0.3, 0.3])
    """
    k = count("surfaces", surfaces, 1)
    alpha = floats("concentration", concentration)
    if alpha.shape not in ((), (k,)):
        raise GraspModuliError(
            f"concentration must be a number or have shape ({k},), got {alpha.shape}"
        )
    if (alpha <= 0.0).any():
        raise GraspModuliError(f"concentration must be positive, got {alpha.min()}")
    rows = count("n", n, 1)
    generator = np.random.Generator(np.random.Philox(count("seed", seed, 0)))
    weights = generator.dirichlet(np.broadcast_to(alpha, (k,)), rows)
    if not np.isfinite(weights).all() or (weights.sum(axis=1) < 0.5).any():
        raise GraspModuliError(
            f"concentration must lie between about 1e-2 and 1e300, got {alpha.tolist()}"
        )
    if total is None:
        return weights
    ends = floats("total", total)
    if ends.shape != (2,) or not 0.0 < ends[0] <= ends[1]:
        raise GraspModuliError(
            f"total must be two positive numbers, the smaller first, got {ends.tolist()}"
        )
    low, high = np.log(ends)
    return weights * np.exp(low + (high - low) * generator.random((rows, 1)))


def sample_combinations(
    surfaces: Sequence[Surface],
    n: int,
    seed: int = 0,
    *,
    concentration: ArrayLike = 1.0,
    total: tuple[float, float] | None = None,
) -> Combinations:
    """Random surfaces of Conv(X), X the given ones (Sec. III), or with ``total`` of their cone.

    A list of ``n`` surfaces, with the weights of :func:`sample_weights` that they were made with
    as its ``weights``. Parameters are those of that function.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> corners = [gm.shapes.model(name) for name in ("bottle", "vase", "pear")]
    >>> shapes = gm.sample_combinations(corners, 5, seed=0)
    >>> len(shapes), shapes.weights.shape
    (5, (5, 3))
    >>> shapes[0] == gm.combine(corners, shapes.weights[0])
    True

    With ``total`` they are drawn from Cone(X), here between a half and twice the size:

    >>> larger = gm.sample_combinations(corners, 5, seed=0, total=(0.5, 2.0))
    >>> bool((larger.weights.sum(axis=1) <= 2.0).all())
    True
    """
    given = some_surfaces("surfaces", surfaces)
    weights = sample_weights(len(given), n, seed, concentration, total=total)
    return Combinations((combine(given, row) for row in weights), weights)


@overload
def interpolate(start: Point, end: Point, t: float) -> Point: ...
@overload
def interpolate(start: Point, end: Point, t: Sequence[float] | Floats) -> list[Point]: ...
def interpolate(start: Point, end: Point, t: ArrayLike) -> Point | list[Point]:
    """The point at t on the curve of Eq. (III.1) between two points of the Grasp Moduli Space.

    Surface and heights go straight, angles along the shorter arc; exactly opposite ones straight
    from θ to θ' in [0, 2π), as in the paper.

    Parameters
    ----------
    start, end
        A surface and a grasp on it, each: ``(surface, grasp)``.
    t
        In [0, 1]: a number, or several of shape (k,).

    Returns
    -------
    (Surface, Grasp), or a list of k for several t

    Examples
    --------
    >>> import graspmoduli as gm
    >>> start = gm.shapes.model("bottle"), gm.Grasp([0.2, 0.4, 0.6], [0.0, 2.0, 4.0])
    >>> end = gm.shapes.model("vase"), gm.Grasp([0.3, 0.5, 0.7], [6.0, 2.0, 4.0])
    >>> surface, grasp = gm.interpolate(start, end, 0.5)
    >>> grasp.u  # θ of the first turns the shorter way, through 2π
    array([0.25, 0.45, 0.65])
    >>> len(gm.interpolate(start, end, [0.0, 0.25, 0.5, 0.75, 1.0]))
    5
    """
    (first, g), (last, h) = a_point("start", start), a_point("end", end)
    shares = floats("t", t)
    if shares.ndim > 1:
        raise GraspModuliError(f"t must be a number or have shape (k,), got {shares.shape}")
    if ((shares < 0.0) | (shares > 1.0)).any():
        outside = shares[(shares < 0.0) | (shares > 1.0)].flat[0]
        raise GraspModuliError(f"t must lie in [0, 1], got {outside}")
    turn = shortest_turn(g, h)

    def at(share: float) -> Point:
        u = np.clip((1.0 - share) * g.u + share * h.u, 0.0, 1.0)
        surface = combine([first, last], [1.0 - share, share])
        return surface, Grasp(u, g.theta + share * turn)

    if not shares.ndim:
        return at(float(shares))
    return [at(share) for share in shares.tolist()]


def a_point(name: str, value: Any) -> Point:
    """``value`` if it is a point of the moduli space, a surface and a grasp on it."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise GraspModuliError(f"{name} must be a pair (surface, grasp), got {what(value)}")
    surface, grasp = value
    if not isinstance(surface, Surface) or not isinstance(grasp, Grasp):
        raise GraspModuliError(
            f"{name} must be a pair (surface, grasp), got {what(surface)} and {what(grasp)}"
        )
    return surface, grasp


def shortest_turn(g: Grasp, h: Grasp) -> Floats:
    """From the angles of one grasp to those of another, in [−π, π]. Shape (m,)."""
    same_number(g, h)
    turn = h.theta - g.theta
    turn = np.where(turn > np.pi, turn - 2 * np.pi, turn)
    return np.where(turn < -np.pi, turn + 2 * np.pi, turn)


def placed_distance(p: PlacedGrasp, q: PlacedGrasp) -> float:
    """d(g, g') of Sec. III: the largest distance between corresponding contacts, normals and
    centres of mass.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> bottle, grasp = gm.shapes.model("bottle"), gm.Grasp([0.2, 0.4, 0.6], [0.0, 2.0, 4.0])
    >>> placed = gm.place(bottle, grasp)
    >>> gm.placed_distance(placed, placed)
    0.0
    """
    for name, value in (("p", p), ("q", q)):
        if not isinstance(value, PlacedGrasp):
            raise GraspModuliError(f"{name} must be a PlacedGrasp, got {what(value)}")
    same_number(p, q)
    return max(
        float(np.linalg.norm(p.contacts - q.contacts, axis=1).max()),
        float(np.linalg.norm(p.normals - q.normals, axis=1).max()),
        float(np.linalg.norm([p.center_of_mass - q.center_of_mass], axis=1)[0]),
    )


_D = TypeVar("_D", bound="Distance")


class Distance(float):
    """A distance with a proven error bound: the true one is at most ``error`` larger.

    It compares, adds and hashes as the number that it is.
    """

    __slots__ = ("error",)
    error: float

    def __new__(cls: type[_D], value: float, error: float) -> _D:
        """As :func:`distance` makes it."""
        self = float.__new__(cls, number("value", value))
        object.__setattr__(self, "error", number("error", error))
        return self

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a distance does not change: cannot set {name}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (float(self), self.error)

    def __copy__(self: _D) -> _D:
        return self

    def __deepcopy__(self: _D, memo: dict[int, Any]) -> _D:
        return self


class SurfaceDistance(Distance):
    """d(S, S'), a number with a proven error bound.

    It is the distance of the points or normals at (``u``, ``theta``), to its own rounding, and the
    supremum is at most ``error`` larger.
    """

    __slots__ = ("theta", "u")
    u: float
    theta: float

    def __new__(cls, value: float, error: float, u: float, theta: float) -> SurfaceDistance:
        """As :func:`surface_distance` makes it."""
        self = super().__new__(cls, value, error)
        object.__setattr__(self, "u", number("u", u))
        object.__setattr__(self, "theta", number("theta", theta))
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return SurfaceDistance, (float(self), self.error, self.u, self.theta)


def surface_distance(
    first: Surface, second: Surface, *, tolerance: float = 1e-6
) -> SurfaceDistance:
    """d(S, S') of Sec. III: the supremum of max(‖c_S − c_S'‖, ‖n_S − n_S'‖) over (u, θ).

    By branch and bound, so the error is proven, not estimated, and covers rounding. ``tolerance``,
    from 1e-9 to 1, is the relative error wanted. Look at ``error``: it is larger where a quarter
    of a million cells cannot tell the supremum so well, as for surfaces a thousand times flatter
    than wide, where it can be many times the value, and where rounding does not allow it, as for
    surfaces that are equal but for their last digits.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> bottle = gm.shapes.model("bottle")
    >>> d = gm.surface_distance(bottle, 3 * bottle)
    >>> round(d, 4), d.error < 1e-6
    (1.8462, True)
    """
    wanted = number("tolerance", tolerance)
    if not 1e-9 <= wanted <= 1.0:
        raise GraspModuliError(f"tolerance must lie in [1e-9, 1], got {wanted}")
    one, other = a_surface("first", first), a_surface("second", second)
    value, error, (u, theta) = _core.surface_distance(one._core, other._core, wanted)
    return SurfaceDistance(value, error, u, theta)


#: How far two angles are apart: in the plane of the unit circle, or along it.
ANGLES = ("chord", "arc")


def distance(start: Point, end: Point, *, angles: str = "chord") -> Distance:
    """The metric of the Grasp Moduli Space: d(S, S') + Σ |u_i − u'_i| + Σ d(θ_i, θ'_i) (Sec. III).

    A number with a proven ``error``: that of :func:`surface_distance`, and rounding. ``start`` and
    ``end`` are pairs ``(surface, grasp)``; ``angles`` are measured by their ``"chord"``, as in the
    paper, or by their ``"arc"``.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> bottle, vase = gm.shapes.model("bottle"), gm.shapes.model("vase")
    >>> grasp = gm.Grasp([0.2, 0.4, 0.6], [0.0, 2.0, 4.0])
    >>> d = gm.distance((bottle, grasp), (vase, grasp))
    >>> d == gm.surface_distance(bottle, vase), d.error < 1e-6
    (True, True)
    """
    if not isinstance(angles, str) or angles not in ANGLES:
        raise GraspModuliError(f'angles must be "chord" or "arc", got {brief(angles)}')
    (first, g), (last, h) = a_point("start", start), a_point("end", end)
    arc = np.abs(shortest_turn(g, h))
    apart = arc if angles == "arc" else 2.0 * sin(0.5 * arc)
    rest = float(np.abs(g.u - h.u).sum() + apart.sum())
    surfaces = surface_distance(first, last)
    return Distance(surfaces + rest, surfaces.error + 1e-15 * len(g) * rest)


def same_number(first: Any, second: Any) -> None:
    """Refuses grasps of different numbers of contacts."""
    sizes = [len(g.contacts) if isinstance(g, PlacedGrasp) else len(g) for g in (first, second)]
    if sizes[0] != sizes[1]:
        raise GraspModuliError(
            f"grasps must have the same number of contacts, got {sizes[0]} and {sizes[1]}"
        )
