"""The only place where input is coerced and checked. Kernels trust what comes from here."""

from __future__ import annotations

import math
import operator
import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import GraspModuliError

Floats = NDArray[np.float64]

#: How far the length of a unit normal may be from 1; it is normalised to rounding.
UNIT_TOLERANCE = 1e-4


def floats(name: str, value: ArrayLike) -> Floats:
    """``value`` as a contiguous float64 array of finite numbers."""
    return finite(name, numbers(name, value))


def numbers(name: str, value: ArrayLike) -> Floats:
    """``value`` as a contiguous float64 array."""
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise GraspModuliError(f"{name} must be an array of numbers, got {_brief(value)}") from None
    # ascontiguousarray makes a 0-d array 1-d.
    return array.reshape(np.shape(value))


def finite(name: str, array: Floats) -> Floats:
    """``array`` if all of it is finite."""
    if not np.isfinite(array).all():
        index = np.argwhere(~np.isfinite(array))[0]
        where = f" at index {tuple(index.tolist())}" if array.ndim else ""
        raise GraspModuliError(f"{name} must be finite, got {array[tuple(index)]}{where}")
    return array


def vectors(name: str, value: ArrayLike, shape: str) -> Floats:
    """An array with at least as many axes as ``shape`` names, the last of length 3."""
    array = numbers(name, value)
    if array.ndim < shape.count(",") or array.shape[-1] != 3:
        raise GraspModuliError(f"{name} must have shape {shape}, got {array.shape}")
    return array


def unit(name: str, array: Floats) -> Floats:
    """Normals made exactly unit, if they nearly are."""
    lengths = np.linalg.norm(array, axis=-1)
    wrong = ~(np.abs(lengths - 1.0) <= UNIT_TOLERANCE)
    if wrong.any():
        index = np.argwhere(wrong)[0]
        where = f" at index {tuple(index.tolist())}" if lengths.ndim else ""
        raise GraspModuliError(
            f"{name} must be unit vectors, got one of length "
            f"{float(lengths[tuple(index)]):.6g}{where}"
        )
    # What is unit to rounding keeps its bits.
    exact = np.abs(lengths - 1.0) < 1e-15
    return np.where(exact[..., None], array, array / lengths[..., None])


def grasps(
    contacts: ArrayLike, normals: ArrayLike, center_of_mass: ArrayLike
) -> tuple[Floats, Floats, Floats, tuple[int, ...]]:
    """Grasps as (n, m, 3), (n, m, 3), (n, 3), and the shape of the batch."""
    points = vectors("contacts", contacts, "(..., m, 3)")
    directions = vectors("normals", normals, "(..., m, 3)")
    center = vectors("center_of_mass", center_of_mass, "(..., 3)")
    if points.shape[-2] != directions.shape[-2]:
        raise GraspModuliError(
            f"normals must be as many per grasp as contacts, "
            f"got {directions.shape} and {points.shape}"
        )
    if points.shape[-2] == 0:
        raise GraspModuliError(f"contacts must be at least one per grasp, got {points.shape}")
    try:
        batch = np.broadcast_shapes(points.shape[:-2], directions.shape[:-2], center.shape[:-1])
    except ValueError:
        raise GraspModuliError(
            "contacts, normals and center_of_mass must have batch shapes that broadcast, "
            f"got {points.shape}, {directions.shape} and {center.shape}"
        ) from None
    # One quick look at all of it; what it does not like is looked at with care.
    if not _core.is_clean(points, directions, center):
        finite("contacts", points)
        directions = unit("normals", finite("normals", directions))
        finite("center_of_mass", center)
    m = points.shape[-2]

    def flat(array: Floats, tail: tuple[int, ...]) -> Floats:
        return np.ascontiguousarray(np.broadcast_to(array, batch + tail)).reshape((-1, *tail))

    return flat(points, (m, 3)), flat(directions, (m, 3)), flat(center, (3,)), batch


def coordinates(u: ArrayLike, theta: ArrayLike) -> tuple[Floats, Floats, tuple[int, ...]]:
    """(u, θ) as flat arrays of equal length, and their common shape."""
    us, thetas = floats("u", u), floats("theta", theta)
    if ((us < 0.0) | (us > 1.0)).any():
        worst = us.flat[np.argmax(np.abs(us - 0.5))]
        raise GraspModuliError(f"u must lie in [0, 1], got {worst}")
    try:
        shape = np.broadcast_shapes(us.shape, thetas.shape)
    except ValueError:
        raise GraspModuliError(
            f"u and theta must have shapes that broadcast, got {us.shape} and {thetas.shape}"
        ) from None

    def flat(array: Floats) -> Floats:
        return np.ascontiguousarray(np.broadcast_to(array, shape)).reshape(-1)

    return flat(us), flat(thetas), shape


def number(name: str, value: Any, *, positive: bool = False) -> float:
    """A finite number."""
    wanted = "a positive finite number" if positive else "a finite number"
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise GraspModuliError(f"{name} must be {wanted}, got {_brief(value)}") from None
    if not math.isfinite(result) or (positive and result <= 0.0):
        raise GraspModuliError(f"{name} must be {wanted}, got {result}")
    return result


def count(name: str, value: Any, least: int) -> int:
    """A whole number of at least ``least``."""
    try:
        result = operator.index(value)
    except TypeError:
        raise GraspModuliError(
            f"{name} must be a whole number of at least {least}, got {_brief(value)}"
        ) from None
    if result < least:
        raise GraspModuliError(f"{name} must be at least {least}, got {result}")
    return result


def cone(friction: Any, edges: Any) -> tuple[float, int]:
    """Friction coefficient μ > 0 and number of edges l ≥ 3."""
    return number("friction", friction, positive=True), count("edges", edges, 3)


def coefficient(name: str, value: Any) -> float:
    """A finite number, 0 or positive."""
    result = number(name, value)
    if result < 0.0:
        raise GraspModuliError(f"{name} must be a finite number, 0 or positive, got {result}")
    return result


def locked(array: Floats) -> Floats:
    """``array`` made read-only, as those of results are."""
    array.setflags(write=False)
    return array


def _brief(value: Any) -> str:
    text = repr(value).replace("\n", " ")
    return text if len(text) <= 60 else text[:57] + "..."


def cells(allowed: ArrayLike | None) -> NDArray[np.bool_] | None:
    """Where contacts may lie: booleans of shape (rows, columns), or everywhere."""
    if allowed is None:
        return None
    grid = np.ascontiguousarray(allowed, dtype=np.bool_)
    if grid.ndim != 2 or not grid.size:
        raise GraspModuliError(f"allowed must have shape (rows, columns), got {grid.shape}")
    return grid


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1
