"""The only place where input is coerced and checked. Kernels trust what comes from here."""

from __future__ import annotations

import math
import operator
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import GraspModuliError

Floats = NDArray[np.float64]

#: How far the length of a unit normal may be from 1; it is normalised to rounding.
UNIT_TOLERANCE = 1e-4
#: More edges of a friction cone than this are refused: a circle to 1e-9.
MOST_EDGES = 2**12
#: Larger friction coefficients are refused: the kernels would lose them to rounding.
MOST_FRICTION = 1e6


class NoGraspLeftError(GraspModuliError):
    """Constraints that leave no grasp of an object that has some: it names the one that does."""


def floats(name: str, value: Any) -> Floats:
    """``value`` as a contiguous float64 array of finite numbers."""
    return finite(name, numbers(name, value))


def numbers(name: str, value: Any) -> Floats:
    """``value`` as a contiguous float64 array; the very same one if it is that already."""
    if type(value) is np.ndarray and value.dtype == np.float64:
        array = value
    else:
        array = _converted(value)
        if array is None:
            raise GraspModuliError(f"{name} must be an array of numbers, got {brief(value)}")
        if np.ma.is_masked(value):
            raise GraspModuliError(f"{name} must be without masked elements, got {brief(value)}")
    # Arrays in the middle of a message, as Dask sends them, need not begin where numbers do.
    return array if array.flags.c_contiguous and array.flags.aligned else array.copy()


def _converted(value: Any) -> Floats | None:
    """``value`` as a float64 array, or None if it is not made of real numbers."""
    try:
        array = np.asarray(value)
        # NumPy takes None for NaN, reads numbers from text and drops imaginary parts.
        if array.dtype.kind == "O" and not all(hasattr(x, "__float__") for x in array.flat):
            return None
        return array.astype(np.float64, copy=False) if array.dtype.kind in "biufO" else None
    # What an object of somebody else's raises when it is asked for an array is its own choice.
    except Exception:
        return None


def finite(name: str, array: Floats) -> Floats:
    """``array`` if all of it is finite."""
    if not np.isfinite(array).all():
        index = np.argwhere(~np.isfinite(array))[0]
        where = f" at index {tuple(index.tolist())}" if array.ndim else ""
        raise GraspModuliError(f"{name} must be finite, got {array[tuple(index)]}{where}")
    return array


def vectors(name: str, value: Any, shape: str) -> Floats:
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


def coordinates(u: Any, theta: Any) -> tuple[Floats, Floats, tuple[int, ...]]:
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
        if isinstance(value, str | bytes | complex) or getattr(value, "ndim", 0):
            raise TypeError
        result = float(value)
    except Exception:
        raise GraspModuliError(f"{name} must be {wanted}, got {brief(value)}") from None
    if not math.isfinite(result) or (positive and result <= 0.0):
        raise GraspModuliError(f"{name} must be {wanted}, got {result}")
    return result


def count(name: str, value: Any, least: int, most: int = 2**31 - 1) -> int:
    """A whole number from ``least`` to ``most``."""
    try:
        result = operator.index(value)
    except Exception:
        raise GraspModuliError(
            f"{name} must be a whole number of at least {least}, got {brief(value)}"
        ) from None
    if result < least:
        raise GraspModuliError(f"{name} must be at least {least}, got {brief(result)}")
    if result > most:
        raise GraspModuliError(f"{name} must be at most {most}, got {brief(result)}")
    return result


def edges_of(edges: Any) -> int:
    """Number l of edges of a friction cone."""
    return count("edges", edges, 3, MOST_EDGES)


def cone(friction: Any, edges: Any) -> tuple[float, int]:
    """Friction coefficient μ > 0, one for all contacts, and number of edges l ≥ 3."""
    mu = number("friction", friction, positive=True)
    if mu > MOST_FRICTION:
        raise GraspModuliError(f"friction must be at most {MOST_FRICTION:g}, got {mu}")
    return mu, edges_of(edges)


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


def brief(value: Any) -> str:
    """``value`` as errors show it, in at most 60 characters."""
    try:
        text = repr(value).replace("\n", " ")
    except Exception:
        # Whole numbers of thousands of digits, and objects that cannot say what they are.
        text = f"one that cannot be shown, of type {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."


def cells(allowed: ArrayLike | None) -> NDArray[np.bool_] | None:
    """Where contacts may lie: booleans of shape (rows, columns), or everywhere."""
    if allowed is None:
        return None
    try:
        grid = np.asarray(allowed)
    except Exception:
        grid = np.zeros(0)
    if grid.dtype.kind not in "biu":
        raise GraspModuliError(f"allowed must be an array of booleans, got {brief(allowed)}")
    grid = np.ascontiguousarray(grid, dtype=np.bool_)
    if grid.ndim != 2 or not grid.size:
        raise GraspModuliError(f"allowed must have shape (rows, columns), got {grid.shape}")
    return grid


def a_callback(name: str, value: Any) -> Any:
    """``value`` if it can be called, or None."""
    if value is not None and not callable(value):
        raise GraspModuliError(f"{name} must be a function, got {brief(value)}")
    return value


def a_path(value: Any) -> Path:
    """The path of a file."""
    try:
        path = Path(value)
    except TypeError:
        raise GraspModuliError(f"path must be the path of a file, got {brief(value)}") from None
    if "\0" in str(path) or not path.name:
        raise GraspModuliError(f"path must be the path of a file, got {brief(value)}")
    return path


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1
