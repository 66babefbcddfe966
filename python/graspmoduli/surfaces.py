"""Surfaces with cylindrical coordinates S_{f,a,b} (Sec. III of the paper)."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, coordinates, count, floats, locked, number
from ._core import GraspModuliError
from ._files import replacing

#: Spline intervals per direction at which ``Surface.from_function`` gives up refining.
FINEST_GRID = 512


class SecondDerivatives(NamedTuple):
    """Second derivatives of the surface point. Each of shape (..., 3)."""

    uu: Floats
    u_theta: Floats
    theta_theta: Floats


class Surface:
    """S = {(f cos θ, f sin θ, (1 − u) a + u b)}: heights a < b, radius f(u, θ) > 0.

    f is a tensor product of uniform cubic B-splines, clamped in u ∈ [0, 1] and periodic in θ
    [rad]. All its coefficients are positive, so f > 0 everywhere. Surfaces form a convex cone
    (Lemma III.1): ``2.0 * S + 0.5 * T`` is exact, whatever the two grids.

    Make one with :meth:`from_function`, :meth:`from_coefficients`, :meth:`load` or
    :func:`graspmoduli.fit`. Surfaces do not change.
    """

    __slots__ = ("_core",)
    _core: _core.Surface

    def __init__(self, core: _core.Surface) -> None:
        self._core = core

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
            Largest error of the radius, relative to the largest radius. The grid is refined
            until it is met; a warning says so if 512 intervals are not enough.
        """
        a, b = _heights(bottom, top)
        tolerance = number("tolerance", tolerance, positive=True)

        def sample(u: Floats, theta: Floats) -> Floats:
            us, thetas = np.meshgrid(u, theta, indexing="ij")
            values = np.asarray(radius(us, thetas), dtype=np.float64)
            try:
                values = np.broadcast_to(values, us.shape)
            except ValueError:
                raise GraspModuliError(
                    f"radius must return one value per (u, theta), "
                    f"got shape {values.shape} for {us.shape}"
                ) from None
            wrong = ~(np.isfinite(values) & (values > 0.0))
            if wrong.any():
                i, j = np.argwhere(wrong)[0]
                raise GraspModuliError(
                    f"radius must be positive and finite, got {values[i, j]} "
                    f"at u = {u[i]:.6g}, theta = {theta[j]:.6g}"
                )
            return values

        # Offsets without a common divisor, so that no pattern falls between all of them.
        offsets = np.array([0.137, 0.319, 0.5, 0.682, 0.891])
        rows, columns = 8, 8
        while True:
            u, theta = _greville(rows), 2 * np.pi * np.arange(columns) / columns
            coefficients = _core.interpolate(np.ascontiguousarray(sample(u, theta)))
            scale = float(coefficients.max())
            fine_u = ((np.arange(rows)[:, None] + offsets) / rows).ravel()
            fine_theta = ((np.arange(columns)[:, None] + offsets) * 2 * np.pi / columns).ravel()
            # At the sites of one direction only the other one is interpolated.
            error_u = _error(coefficients, sample(fine_u, theta), fine_u, theta)
            error_theta = _error(coefficients, sample(u, fine_theta), u, fine_theta)
            bar = tolerance * scale
            refine_u = error_u > bar and rows < FINEST_GRID
            refine_theta = error_theta > bar and columns < FINEST_GRID
            positive = bool((coefficients > 0.0).all())
            if not positive and not (refine_u or refine_theta):
                # The control net lies above the surface once the grid is fine enough.
                refine_u, refine_theta = rows < FINEST_GRID, columns < FINEST_GRID
                if not (refine_u or refine_theta):
                    raise GraspModuliError(
                        "radius must stay clear of 0 for a spline to represent it, "
                        f"got {float(sample(fine_u, theta).min()):.3g} "
                        f"beside {scale:.3g} on the finest grid"
                    )
            if not (refine_u or refine_theta):
                break
            rows, columns = rows * (1 + refine_u), columns * (1 + refine_theta)
        error = max(error_u, error_theta)
        if error > bar:
            warnings.warn(
                f"the radius is represented to {error / scale:.1e} of its largest value, not to "
                f"the tolerance {tolerance:.1e}: it is not smooth enough for the finest grid",
                stacklevel=2,
            )
        if np.ptp(coefficients, axis=1).max() <= 1e-14 * scale:
            # A surface of revolution needs no more than the smallest periodic spline.
            coefficients = coefficients[:, :4]
        return cls.from_coefficients(coefficients, a, b)

    @classmethod
    def from_coefficients(cls, coefficients: ArrayLike, bottom: float, top: float) -> Surface:
        """From spline coefficients: a row per basis function in u, a column per one in θ.

        With n rows there are n − 3 intervals in u, with k columns k in θ. The value at angle
        2πj/k is (c_j + 4 c_{j+1} + c_{j+2})/6. Shape (n, k), both at least 4, all positive.
        """
        a, b = _heights(bottom, top)
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

    # Points -------------------------------------------------------------------------------

    def radius(self, u: ArrayLike, theta: ArrayLike) -> Any:
        """f(u, θ). Shape of the arguments broadcast; a float for numbers."""
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
        """The nearest contact coordinates to points in space.

        From the nearest point of a grid of 64 by 128 by Newton's method on the surface, u kept in
        [0, 1]; to rounding where the nearest point is unique and the grid finds its valley.

        Parameters
        ----------
        points
            Shape (..., 3).

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
        return self._core.radius_about((float(point[0]), float(point[1]), float(point[2])))

    # The convex cone ----------------------------------------------------------------------

    def __mul__(self, factor: float) -> Surface:
        return Surface(_core.combine([number("factor", factor, positive=True)], [self._core]))

    __rmul__ = __mul__

    def __add__(self, other: Surface) -> Surface:
        if not isinstance(other, Surface):
            return NotImplemented
        return Surface(_core.combine([1.0, 1.0], [self._core, other._core]))

    def __repr__(self) -> str:
        rows, columns = self._core.coefficients.shape
        return f"Surface(bottom={self.bottom:.6g}, top={self.top:.6g}, {rows} × {columns} spline)"

    # Files --------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes heights and coefficients as a NumPy ``.npz`` file."""
        with replacing(Path(path)) as temporary, temporary.open("wb") as file:
            np.savez(file, coefficients=self.coefficients, bottom=self.bottom, top=self.top)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Surface:
        """Reads what :meth:`save` wrote."""
        try:
            with np.load(path) as data:
                parts = data["coefficients"], float(data["bottom"]), float(data["top"])
        except FileNotFoundError:
            raise GraspModuliError(f"path must be a surface's file, got no file {path}") from None
        except Exception as error:
            raise GraspModuliError(
                f"path must be a file written by Surface.save, got {path} ({error})"
            ) from None
        return cls.from_coefficients(*parts)


def combine(surfaces: Sequence[Surface], weights: ArrayLike) -> Surface:
    """Σ weights_i · surfaces_i in the convex hull Conv(X) of Sec. III.

    Weights are not negative and sum to 1 (to 1e-9). For the cone use ``2.0 * S + 0.5 * T``.
    """
    values = floats("weights", weights)
    if values.shape != (len(surfaces),) or not len(surfaces):
        raise GraspModuliError(
            f"weights must be one per surface, got shape {values.shape} for {len(surfaces)}"
        )
    if (values < 0.0).any():
        raise GraspModuliError(f"weights must not be negative, got {values.min()}")
    if abs(values.sum() - 1.0) > 1e-9:
        raise GraspModuliError(f"weights must sum to 1, got {values.sum()}")
    terms = [(w, s) for w, s in zip(values.tolist(), surfaces, strict=True) if w > 0.0]
    return Surface(_core.combine([w for w, _ in terms], [s._core for _, s in terms]))


def closest_combination(surface: Surface, surfaces: Sequence[Surface]) -> Floats:
    """Barycentric coordinates of the surface of Conv(X) closest to a given one (Sec. III).

    Closest in the mean of ‖c_S(u, θ) − c_{S'}(u, θ)‖² over u and θ: a convex problem with one
    answer if the given ones are independent. Shape (n,), not negative, summing to 1.
    """
    from scipy.optimize import nnls

    if not len(surfaces):
        raise GraspModuliError("surfaces must hold at least one surface, got none")
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
    """
    return Surface(surface._core.project())


def _heights(bottom: float, top: float) -> tuple[float, float]:
    a, b = number("bottom", bottom), number("top", top)
    if not a < b:
        raise GraspModuliError(f"bottom must be below top, got bottom {a} and top {b}")
    return a, b


def clamped_knots(intervals: int) -> Floats:
    """Knots on [0, 1] of the spline in u."""
    inner = np.linspace(0.0, 1.0, intervals + 1)
    return np.concatenate([[0.0] * 3, inner, [1.0] * 3])


def _greville(intervals: int) -> Floats:
    """The sites at which a clamped cubic spline is interpolated stably."""
    knots = clamped_knots(intervals)
    return (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3.0


def _error(coefficients: Floats, values: Floats, u: Floats, theta: Floats) -> float:
    """Largest difference of the spline from values on a tensor grid."""
    us, thetas = np.meshgrid(u, theta, indexing="ij")
    # A spline need not be positive to be compared: lift it above 0, which it passes on exactly.
    lift = 1.0 - min(0.0, float(coefficients.min()))
    core = _core.Surface(0.0, 1.0, coefficients + lift)
    radii = core.radius(us.ravel(), thetas.ravel())[:, 0].reshape(us.shape)
    return float(np.abs(radii - lift - values).max())
