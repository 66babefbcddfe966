"""Splines over (u, θ) that follow a function: knots, sites, and refinement until they do."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from . import _core
from ._arrays import Floats, number
from ._core import GraspModuliError

#: Spline intervals per direction at which ``Surface.from_function`` gives up refining.
FINEST_GRID = 512
#: Scattered points at which it compares at least, and how many per cell of the grid.
SCATTERED, PER_CELL = 2**14, 2


def clamped_knots(intervals: int) -> Floats:
    """Knots on [0, 1] of the spline in u."""
    inner = np.linspace(0.0, 1.0, intervals + 1)
    return np.concatenate([[0.0] * 3, inner, [1.0] * 3])


def greville(intervals: int) -> Floats:
    """The sites at which a clamped cubic spline is interpolated stably."""
    knots = clamped_knots(intervals)
    return (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3.0


def heights(bottom: float, top: float) -> tuple[float, float]:
    """Bottom and top, if they are."""
    a, b = number("bottom", bottom), number("top", top)
    if not a < b:
        raise GraspModuliError(f"bottom must be below top, got bottom {a} and top {b}")
    return a, b


def interpolated(
    radius: Callable[[Floats, Floats], Any], bottom: float, top: float, tolerance: float
) -> tuple[Floats, float, float]:
    """Coefficients, bottom and top of a function r(u, θ), refined until the spline follows it.

    The warning that it does not points at who calls the caller.
    """
    a, b = heights(bottom, top)
    tolerance = number("tolerance", tolerance, positive=True)

    def at(us: Floats, thetas: Floats) -> Floats:
        returned = radius(us, thetas)
        try:
            values = np.asarray(returned)
            if values.dtype.kind not in "biuf":
                raise TypeError
            values = np.broadcast_to(values.astype(np.float64), us.shape)
        except (TypeError, ValueError):
            raise GraspModuliError(
                f"radius must return one number per (u, theta), got {what(returned)} for {us.shape}"
            ) from None
        wrong = ~(np.isfinite(values) & (values > 0.0))
        if wrong.any():
            first = tuple(np.argwhere(wrong)[0])
            raise GraspModuliError(
                f"radius must be positive and finite, got {values[first]} "
                f"at u = {us[first]:.6g}, theta = {thetas[first]:.6g}"
            )
        return values

    def sample(u: Floats, theta: Floats) -> Floats:
        us, thetas = np.meshgrid(u, theta, indexing="ij")
        return at(us, thetas)

    # Between the sites of one direction, where only that one is interpolated.
    offsets = np.array([0.137, 0.319, 0.5, 0.682, 0.891])
    rows, columns = 8, 8
    while True:
        u, theta = greville(rows), 2 * np.pi * np.arange(columns) / columns
        coefficients = _core.interpolate(np.ascontiguousarray(sample(u, theta)))
        scale = float(coefficients.max())
        bar = tolerance * scale
        fine_u = ((np.arange(rows)[:, None] + offsets) / rows).ravel()
        fine_theta = ((np.arange(columns)[:, None] + offsets) * 2 * np.pi / columns).ravel()
        error_u = _error(coefficients, sample, fine_u, theta)
        error_theta = _error(coefficients, sample, u, fine_theta)
        error = max(error_u, error_theta)
        refine_u = error_u > bar and rows < FINEST_GRID
        refine_theta = error_theta > bar and columns < FINEST_GRID
        if not (refine_u or refine_theta):
            # What vanishes on all lines of the grid, as products of ripples can.
            scattered = _scattered(max(SCATTERED, PER_CELL * rows * columns))
            off = _values(coefficients, *scattered) - at(*scattered)
            error = max(error, float(np.abs(off).max()))
            low = float(coefficients.min())
            # The control net lies above the surface once the grid is fine enough.
            if error > bar or low <= 0.0:
                refine_u, refine_theta = rows < FINEST_GRID, columns < FINEST_GRID
            if low <= 0.0 and not (refine_u or refine_theta):
                raise GraspModuliError(
                    "radius must stay clear of 0 for a spline to represent it, "
                    f"got {float(sample(fine_u, theta).min()):.3g} "
                    f"beside {scale:.3g} on the finest grid"
                )
        if not (refine_u or refine_theta):
            break
        rows, columns = rows * (1 + refine_u), columns * (1 + refine_theta)
    if error > bar:
        warnings.warn(
            f"the radius is represented to {error / scale:.1e} of its largest value, not to "
            f"the tolerance {tolerance:.1e}: it is not smooth enough for the finest grid",
            stacklevel=3,
        )
    if np.ptp(coefficients, axis=1).max() <= 1e-14 * scale:
        # A surface of revolution needs no more than the smallest periodic spline.
        coefficients = np.repeat(coefficients[:, :1], 4, axis=1)
    return coefficients, a, b


def _values(coefficients: Floats, u: Floats, theta: Floats) -> Floats:
    """A spline at points."""
    # It need not be positive to be compared: lift it above 0, which it passes on exactly, and make
    # it of the size of 1, as a function may be of any.
    scale = float(np.abs(coefficients).max())
    lift = 1.0 - min(0.0, float(coefficients.min()) / scale)
    core = _core.Surface(0.0, 1.0, coefficients / scale + lift)
    radii = core.radius(np.ascontiguousarray(u.ravel()), np.ascontiguousarray(theta.ravel()))
    return (radii[:, 0].reshape(u.shape) - lift) * scale


def _error(
    coefficients: Floats, sample: Callable[[Floats, Floats], Floats], u: Floats, theta: Floats
) -> float:
    """Largest difference of the spline from a function on a tensor grid."""
    us, thetas = np.meshgrid(u, theta, indexing="ij")
    return float(np.abs(_values(coefficients, us, thetas) - sample(u, theta)).max())


def _scattered(n: int) -> tuple[Floats, Floats]:
    """(u, θ) of n points spread evenly over the rectangle, on no line of any grid: additive
    recurrence with powers of the reciprocal of 1.3247…, the root of x³ = x + 1."""
    k = np.arange(1.0, n + 1.0)
    root = 1.324717957244746
    return (k / root) % 1.0, 2 * np.pi * ((k / root**2) % 1.0)


def caller(radius: Any, arguments: int, of: str, else_: str) -> Callable[..., Any]:
    """``radius``, if it can be called with so many arrays; what it raises then is a sentence."""
    wanted = f"radius must be a function of arrays of {of} ({else_})"
    if not callable(radius):
        raise GraspModuliError(f"{wanted}, got {what(radius)}")
    try:
        inspect.signature(radius).bind(*[None] * arguments)
    except TypeError as error:
        raise GraspModuliError(f"{wanted}, got one with {error}") from None
    except ValueError:
        # Functions in C need not have a signature.
        pass

    def call(*arrays: Floats) -> Any:
        try:
            return radius(*arrays)
        except GraspModuliError:
            raise
        except (TypeError, ValueError, ArithmeticError) as error:
            raise GraspModuliError(
                f"{wanted}, got one that raises: {error} (np.vectorize makes functions of numbers "
                "take arrays)"
            ) from error

    return call


def what(value: Any) -> str:
    """What came instead of what was wanted, in a word or two."""
    if value is None:
        return "None"
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape} and type {value.dtype}"
    return f"a {type(value).__name__}"
