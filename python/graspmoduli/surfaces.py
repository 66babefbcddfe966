"""Surfaces with cylindrical coordinates S_{f,a,b} (Sec. III of the paper)."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, brief, coordinates, count, floats, locked, number
from ._core import GraspModuliError
from ._files import replacing
from .splines import caller, heights, interpolated, what

#: Points further away than this have no coordinates: the square of a distance would overflow.
FARTHEST = 1e100


class SecondDerivatives(NamedTuple):
    """Second derivatives of the surface point. Each of shape (..., 3)."""

    uu: Floats
    u_theta: Floats
    theta_theta: Floats


class Surface:
    """S = {(f cos θ, f sin θ, (1 − u) a + u b)}: heights a < b, radius f(u, θ) > 0.

    f is a tensor product of uniform cubic B-splines, clamped in u ∈ [0, 1] and periodic in θ
    [rad]. All its coefficients are positive, so f > 0 everywhere; radii and heights lie between
    1e-50 and 1e50. Surfaces form a convex cone (Lemma III.1): ``2.0 * S + 0.5 * T``, ``S / 2.0``
    and ``sum([S, T])`` are exact to rounding, on the coarsest grid that refines both. (A sum is
    refused if that has more than 8192 intervals in a direction or 2 million coefficients.)

    Make one with :meth:`from_function`, :meth:`revolution`, :meth:`from_coefficients`,
    :meth:`load` or :func:`graspmoduli.fit`. Surfaces do not change; they are equal if heights and
    coefficients are.
    """

    __slots__ = ("_core",)
    _core: _core.Surface
    # NumPy leaves products with its numbers and arrays to this class.
    __array_ufunc__ = None

    def __init__(self, *core: _core.Surface) -> None:
        if len(core) != 1 or not isinstance(core[0], _core.Surface):
            raise GraspModuliError(
                "surfaces are made by Surface.from_function(radius, bottom, top), "
                "Surface.revolution, Surface.from_coefficients or Surface.load, "
                f"got {len(core)} arguments for Surface itself"
            )
        self._core = core[0]

    @classmethod
    def from_function(
        cls,
        radius: Callable[[Floats, Floats], ArrayLike],
        bottom: float,
        top: float,
        *,
        tolerance: float = 1e-6,
    ) -> Surface:
        """The spline surface that interpolates a radius function.

        Parameters
        ----------
        radius
            ``radius(u, theta)``, positive and 2π-periodic in θ, for arrays of equal shape.
        bottom, top
            Heights a < b.
        tolerance
            Largest error of the radius, relative to the largest radius, at the points where
            spline and function are compared: five between neighbouring sites of the grid in each
            direction, and 16,384 points or two per cell, whichever is more, spread evenly over
            the (u, θ) rectangle. The grid is refined until it is met there; a warning says so if
            512 intervals are not enough. What lies between all of these points, such as a bump
            of less than a hundredth of the rectangle in both directions, is not seen.

        Examples
        --------
        >>> import numpy as np, graspmoduli as gm
        >>> screw = gm.Surface.from_function(
        ...     lambda u, theta: 0.4 + 0.08 * np.cos(3 * theta - 2 * np.pi * u), -0.6, 0.6
        ... )
        >>> screw.is_revolution, abs(screw.radius(0.0, 0.0) - 0.48) < 1e-6
        (False, True)
        """
        call = caller(radius, 2, "u and theta", "for one of u alone there is Surface.revolution")
        return cls.from_coefficients(*interpolated(call, bottom, top, tolerance))

    @classmethod
    def revolution(
        cls,
        radius: Callable[[Floats], ArrayLike],
        bottom: float,
        top: float,
        *,
        tolerance: float = 1e-6,
    ) -> Surface:
        """The surface of revolution of a radius function.

        Parameters
        ----------
        radius
            ``radius(u)``, positive, for arrays.
        bottom, top, tolerance
            As in :meth:`from_function`.

        Examples
        --------
        >>> import numpy as np, graspmoduli as gm
        >>> gourd = gm.Surface.revolution(lambda u: 0.35 + 0.15 * np.cos(3 * np.pi * u), -0.7, 0.7)
        >>> gourd.is_revolution, (gourd / 2.0).top
        (True, 0.35)
        """
        call = caller(radius, 1, "u", "for one of u and theta there is Surface.from_function")
        return cls.from_coefficients(*interpolated(lambda u, _: call(u), bottom, top, tolerance))

    @classmethod
    def from_coefficients(cls, coefficients: ArrayLike, bottom: float, top: float) -> Surface:
        """From spline coefficients: a row per basis function in u, a column per one in θ.

        With n rows there are n − 3 intervals in u, with k columns k in θ. The value at angle
        2πj/k is (c_j + 4 c_{j+1} + c_{j+2})/6. Shape (n, k), both at least 4, all positive.
        """
        a, b = heights(bottom, top)
        array = floats("coefficients", coefficients)
        if array.ndim != 2:
            raise GraspModuliError(f"coefficients must have shape (n, k), got {array.shape}")
        return cls(_core.Surface(a, b, array))

    # The definition -----------------------------------------------------------------------

    @property
    def bottom(self) -> float:
        """a: height at u = 0."""
        return self._core.bottom

    @property
    def top(self) -> float:
        """b: height at u = 1."""
        return self._core.top

    @property
    def coefficients(self) -> Floats:
        """Spline coefficients. Shape (n, k), read-only."""
        return locked(self._core.coefficients)

    @property
    def is_revolution(self) -> bool:
        """Whether the radius is the same all around, to 1e-14 of the largest coefficient."""
        return self._core.is_revolution

    # Points -------------------------------------------------------------------------------

    @overload
    def radius(  # pyright: ignore[reportOverlappingOverload]: numbers are arrays, too
        self, u: float, theta: float
    ) -> float: ...
    @overload
    def radius(self, u: ArrayLike, theta: ArrayLike) -> Floats: ...
    def radius(self, u: ArrayLike, theta: ArrayLike) -> Floats | float:
        """f(u, θ). Shape of the arguments broadcast; a float for numbers.

        Here and below u lies in [0, 1] and θ is any real number. It is reduced modulo 2π first,
        which turns points along the surface by up to 1e-16 θ.
        """
        us, thetas, shape = coordinates(u, theta)
        values = self._core.radius(us, thetas)[:, 0]
        return values.reshape(shape) if shape else float(values[0])

    def points(self, u: ArrayLike, theta: ArrayLike) -> Floats:
        """c_S(u, θ). Shape (..., 3)."""
        return self._place(u, theta)[..., 0, :]

    def normals(self, u: ArrayLike, theta: ArrayLike) -> Floats:
        """n_S(u, θ), unit, pointing inward. Shape (..., 3)."""
        return self._place(u, theta)[..., 1, :]

    def tangents(self, u: ArrayLike, theta: ArrayLike) -> tuple[Floats, Floats]:
        """t₁ = ∂c/∂u and t₂ = ∂c/∂θ; t₁ × t₂ points inward. Each of shape (..., 3)."""
        placed = self._place(u, theta)
        return placed[..., 2, :], placed[..., 3, :]

    def normal_derivatives(self, u: ArrayLike, theta: ArrayLike) -> tuple[Floats, Floats]:
        """∂n/∂u and ∂n/∂θ. Each of shape (..., 3)."""
        placed = self._place(u, theta)
        return placed[..., 4, :], placed[..., 5, :]

    def second_derivatives(self, u: ArrayLike, theta: ArrayLike) -> SecondDerivatives:
        """∂²c/∂u², ∂²c/∂u∂θ and ∂²c/∂θ²."""
        placed = self._place(u, theta)
        return SecondDerivatives(placed[..., 6, :], placed[..., 7, :], placed[..., 8, :])

    def _place(self, u: ArrayLike, theta: ArrayLike) -> Floats:
        us, thetas, shape = coordinates(u, theta)
        return self._core.place(us, thetas).reshape((*shape, 9, 3))

    def coordinates(self, points: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Contact coordinates of a nearest point of the surface to points in space.

        By Newton's method on the surface, u kept in [0, 1], from the nearest point of a grid of 64
        by 128: a point to which none nearby is nearer. It is the nearest of all where that lies in
        the same valley of the distance as the grid's, as on surfaces without waves finer than the
        grid and not much flatter than wide.

        Parameters
        ----------
        points
            Shape (..., 3), no coordinate beyond 1e100.

        Returns
        -------
        u, theta, distance
            Each of shape (...): (u, θ) of the nearest point of the surface, and how far it is.
        """
        from scipy.spatial import KDTree

        targets = floats("points", points)
        if targets.ndim < 1 or targets.shape[-1] != 3:
            raise GraspModuliError(f"points must have shape (..., 3), got {targets.shape}")
        flat = targets.reshape(-1, 3)
        if (np.abs(flat) > FARTHEST).any():
            raise GraspModuliError(
                f"points must have coordinates up to {FARTHEST:g}, got {np.abs(flat).max():g}"
            )
        grid_u, grid_theta = (
            a.ravel()
            for a in np.meshgrid(
                np.linspace(0.0, 1.0, 64), 2 * np.pi * np.arange(128) / 128, indexing="ij"
            )
        )
        nearest = KDTree(self.points(grid_u, grid_theta)).query(flat)[1]
        u, theta = grid_u[nearest], grid_theta[nearest]
        off = self.points(u, theta) - flat
        for _ in range(50):
            t1, t2 = self.tangents(u, theta)
            bend = self.second_derivatives(u, theta)
            slope = np.stack([(off * t1).sum(-1), (off * t2).sum(-1)], axis=-1)
            # At an end of the surface u does not go further.
            held = ((u <= 0.0) & (slope[:, 0] > 0.0)) | ((u >= 1.0) & (slope[:, 0] < 0.0))
            uu = (t1 * t1).sum(-1) + np.maximum((off * bend.uu).sum(-1), 0.0)
            ut = (t1 * t2).sum(-1) + (off * bend.u_theta).sum(-1)
            tt = (t2 * t2).sum(-1) + np.maximum((off * bend.theta_theta).sum(-1), 0.0)
            determinant = uu * tt - ut * ut
            plain = (determinant <= 1e-3 * uu * tt) | held
            ut, determinant = np.where(plain, 0.0, ut), np.where(plain, uu * tt, determinant)
            du = np.where(held, 0.0, (ut * slope[:, 1] - tt * slope[:, 0]) / determinant)
            dtheta = (ut * slope[:, 0] - uu * slope[:, 1]) / determinant
            share = np.ones(len(flat))
            square = (off * off).sum(-1)
            next_u, next_theta, next_off = u, theta, off
            worse = np.zeros(len(flat), dtype=bool)
            for _ in range(30):
                next_u = np.clip(u + share * du, 0.0, 1.0)
                next_theta = theta + share * dtheta
                next_off = self.points(next_u, next_theta) - flat
                worse = (next_off * next_off).sum(-1) > square
                if not worse.any():
                    break
                share = np.where(worse, 0.5 * share, share)
            better = ~worse
            moved = np.abs(next_u - u) + np.abs(next_theta - theta)
            u, theta = np.where(better, next_u, u), np.where(better, next_theta, theta)
            off = np.where(better[:, None], next_off, off)
            if not (better & (moved > 1e-14)).any():
                break
        shape = targets.shape[:-1]
        distance = np.linalg.norm(off, axis=-1)
        return u.reshape(shape), (theta % (2 * np.pi)).reshape(shape), distance.reshape(shape)

    # Integrals ----------------------------------------------------------------------------

    @property
    def area(self) -> float:
        """Area of the surface, without lids."""
        return self._core.integrals()[0]

    @property
    def center_of_mass(self) -> Floats:
        """z_S: centre of mass of the surface, as in the paper. Shape (3,)."""
        return locked(np.array(self._core.integrals()[1]))

    @property
    def volume(self) -> float:
        """Volume of the solid between the surface and flat lids."""
        return self._core.integrals()[2]

    @property
    def solid_center_of_mass(self) -> Floats:
        """Centre of mass of that solid. Shape (3,)."""
        return locked(np.array(self._core.integrals()[3]))

    def center_of_mass_by_simpson(self, steps: int = 60) -> Floats:
        """z_S by Simpson's rule with ``steps`` steps each way, as the paper computes it."""
        steps = count("steps", steps, 2)
        if steps % 2:
            raise GraspModuliError(f"steps must be even for Simpson's rule, got {steps}")
        return locked(np.array(self._core.integrals(steps)[1]))

    def radius_about(self, center: ArrayLike) -> float:
        """Largest distance of the surface from a point, on a grid of 64 by 64."""
        point = floats("center", center)
        if point.shape != (3,):
            raise GraspModuliError(f"center must have shape (3,), got {point.shape}")
        if (np.abs(point) > FARTHEST).any():
            raise GraspModuliError(
                f"center must have coordinates up to {FARTHEST:g}, got {np.abs(point).max():g}"
            )
        return self._core.radius_about((float(point[0]), float(point[1]), float(point[2])))

    # The convex cone ----------------------------------------------------------------------

    def __mul__(self, factor: float) -> Surface:
        return Surface(_core.combine([number("factor", factor, positive=True)], [self._core]))

    __rmul__ = __mul__

    def __truediv__(self, divisor: float) -> Surface:
        d = number("divisor", divisor, positive=True)
        # Lengths that overflow are refused with the others that are too large.
        with np.errstate(over="ignore"):
            coefficients = self.coefficients / d
        return Surface.from_coefficients(coefficients, self.bottom / d, self.top / d)

    def __add__(self, other: Surface) -> Surface:
        if not isinstance(other, Surface):
            return NotImplemented
        return Surface(_core.combine([1.0, 1.0], [self._core, other._core]))

    def __radd__(self, other: Any) -> Surface:
        # sum() starts with 0.
        return self if isinstance(other, int) and other == 0 else NotImplemented

    # Values -------------------------------------------------------------------------------

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Surface):
            return NotImplemented
        return (
            self.bottom == other.bottom
            and self.top == other.top
            and np.array_equal(self._core.coefficients, other._core.coefficients)
        )

    def __hash__(self) -> int:
        return hash((self.bottom, self.top, self._core.coefficients.tobytes()))

    def __copy__(self) -> Surface:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Surface:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return Surface.from_coefficients, (self._core.coefficients, self.bottom, self.top)

    def __repr__(self) -> str:
        rows, columns = self._core.coefficients.shape
        return f"Surface(bottom={self.bottom:.6g}, top={self.top:.6g}, {rows} × {columns} spline)"

    # Files --------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes heights and coefficients as a NumPy ``.npz`` file."""
        try:
            with replacing(Path(path)) as temporary, temporary.open("wb") as file:
                np.savez(file, coefficients=self.coefficients, bottom=self.bottom, top=self.top)
        except GraspModuliError:
            raise
        except (OSError, TypeError, ValueError) as error:
            raise GraspModuliError(
                f"path must be a file that can be written, got {brief(path)} ({brief(str(error))})"
            ) from None

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Surface:
        """Reads what :meth:`save` wrote."""
        try:
            with np.load(path) as data:
                parts = data["coefficients"], float(data["bottom"]), float(data["top"])
        except FileNotFoundError:
            raise GraspModuliError(
                f"path must be a surface's file, got no file {brief(path)}"
            ) from None
        except Exception as error:
            raise GraspModuliError(
                "path must be a file written by Surface.save, "
                f"got {brief(path)} ({brief(str(error))})"
            ) from None
        return cls.from_coefficients(*parts)


def combine(surfaces: Sequence[Surface], weights: ArrayLike) -> Surface:
    """Σ weights_i · surfaces_i, in the convex cone of Lemma III.1.

    Weights are not negative and not all 0. Where they sum to 1 the result lies in the convex hull
    Conv(X) of Sec. III, and is of the size of the surfaces; where they sum to s it is s times as
    large as that. Exact to rounding, as sums of surfaces are.

    Parameters
    ----------
    surfaces
        n of them.
    weights
        One per surface. Shape (n,).

    Examples
    --------
    >>> import graspmoduli as gm
    >>> bottle, vase = gm.shapes.model("bottle"), gm.shapes.model("vase")
    >>> shape = gm.combine([bottle, vase], [0.25, 0.75])
    >>> round(0.25 * bottle.top + 0.75 * vase.top, 12) == round(shape.top, 12)
    True
    """
    given = some_surfaces("surfaces", surfaces)
    values = floats("weights", weights)
    if values.shape != (len(given),):
        raise GraspModuliError(
            f"weights must be one per surface, got shape {values.shape} for {len(given)}"
        )
    if (values < 0.0).any():
        raise GraspModuliError(f"weights must not be negative, got {values.min()}")
    if not values.any():
        raise GraspModuliError(f"weights must not all be 0, got {values.tolist()}")
    terms = [(w, s) for w, s in zip(values.tolist(), given, strict=True) if w > 0.0]
    return Surface(_core.combine([w for w, _ in terms], [s._core for _, s in terms]))


def a_surface(name: str, value: Any) -> Surface:
    """``value`` if it is a surface."""
    if not isinstance(value, Surface):
        raise GraspModuliError(f"{name} must be a Surface, got {what(value)}")
    return value


def some_surfaces(name: str, value: Any) -> list[Surface]:
    """``value`` as a list, if it is a sequence of surfaces and not empty."""
    if isinstance(value, Surface) or not isinstance(value, Sequence) or isinstance(value, str):
        raise GraspModuliError(f"{name} must be a list of surfaces, got {what(value)}")
    if not value:
        raise GraspModuliError(f"{name} must hold at least one surface, got none")
    return [a_surface(f"{name}[{i}]", one) for i, one in enumerate(value)]


def closest_combination(surface: Surface, surfaces: Sequence[Surface]) -> Floats:
    """Barycentric coordinates of the surface of Conv(X) closest to a given one (Sec. III).

    Closest in the mean of ‖c_S(u, θ) − c_{S'}(u, θ)‖² over u and θ: a convex problem with one
    answer if the given ones are independent. Shape (n,), not negative, summing to 1.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> corners = [gm.shapes.model(name) for name in ("bottle", "vase", "pear")]
    >>> between = gm.combine(corners, [0.5, 0.3, 0.2])
    >>> gm.closest_combination(between, corners).round(6)
    array([0.5, 0.3, 0.2])
    """
    from scipy.optimize import nnls

    a_surface("surface", surface)
    surfaces = some_surfaces("surfaces", surfaces)
    nodes, weights = np.polynomial.legendre.leggauss(48)
    u, theta = np.meshgrid(0.5 * (nodes + 1.0), 2 * np.pi * np.arange(96) / 96, indexing="ij")
    root = np.sqrt(np.repeat(0.5 * weights, 96) / 96)

    def vector(s: Surface) -> Floats:
        heights = (1.0 - u) * s.bottom + u * s.top
        return np.concatenate([root * s.radius(u, theta).ravel(), root * heights.ravel()])

    offsets = np.stack([vector(s) for s in surfaces], axis=1) - vector(surface)[:, None]
    # The point of a convex hull nearest to the origin, as a non-negative least-squares problem:
    # the sum of the weights is asked for at a price, and divided out.
    price = max(float(np.linalg.norm(offsets, axis=0).max()), 1e-300)
    system = np.vstack([offsets / price, np.ones(len(surfaces))])
    found, _ = nnls(system, np.append(np.zeros(len(offsets)), 1.0))
    return found / found.sum()


def project(surface: Surface) -> Surface:
    """π(S): the surface of revolution with the mean radius over θ (Sec. IV.E); exact.

    The way there is ``interpolate((S, g), (project(S), g), t)``, or ``transfer`` to it.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> gm.project(gm.shapes.model("box")).is_revolution
    True
    """
    return Surface(a_surface("surface", surface)._core.project())
