"""What constraints are made of: boxes, half-spaces and other regions, checked once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, brief, floats, number, numbers
from ._core import GraspModuliError

Booleans = NDArray[np.bool_]
Vector = tuple[float, float, float]
#: A box or half-space as the kernels take it: is it a box, and its corners or point and normal.
Zone = tuple[bool, Vector, Vector]


def an_opening(value: Any) -> tuple[float, float] | None:
    """Least and largest distance, if given."""
    if value is None:
        return None
    pair = numbers("opening", value)
    if pair.shape != (2,) or not 0.0 <= pair[0] < pair[1]:
        raise GraspModuliError(
            f"opening must be a least distance and a larger one, 0 or positive, got {brief(value)}"
        )
    return float(pair[0]), float(pair[1])


def an_approach(value: Any) -> tuple[Vector, float] | None:
    """A unit direction and a half-angle in radians, if given."""
    if value is None:
        return None
    direction, angle = _two("approach", value, "a direction (3,) and a half-angle")
    half = number("approach's half-angle", angle, positive=True)
    if half > math.pi:
        raise GraspModuliError(f"approach's half-angle must be at most π, got {half:g}")
    return _unit("approach's direction", direction), half


def a_table(value: Any) -> tuple[Vector, Vector]:
    """A point of a plane and its unit normal."""
    point, normal = _two("table", value, "a point (3,) and a normal (3,)")
    return a_vector("table's point", point), _unit("table's normal", normal)


def _two(name: str, value: Any, wanted: str) -> tuple[Any, Any]:
    try:
        one, other = value
    except (TypeError, ValueError):
        raise GraspModuliError(f"{name} must be {wanted}, got {brief(value)}") from None
    return one, other


def at_least_zero(name: str, value: Any) -> float:
    """A finite number, 0 or positive."""
    found = number(name, value)
    if found < 0.0:
        raise GraspModuliError(f"{name} must be 0 or positive, got {found:g}")
    return found


def a_vector(name: str, value: Any) -> Vector:
    """Three finite numbers."""
    array = floats(name, value)
    if array.shape != (3,):
        raise GraspModuliError(f"{name} must have shape (3,), got {array.shape}")
    x, y, z = array.tolist()
    return x, y, z


def _unit(name: str, value: Any) -> Vector:
    vector = np.array(a_vector(name, value))
    largest = float(np.abs(vector).max())
    if largest == 0.0:
        raise GraspModuliError(f"{name} must not be 0, got {brief(value)}")
    vector /= largest
    x, y, z = (vector / math.sqrt(float((vector * vector).sum()))).tolist()
    return x, y, z


def regions_of(name: str, value: Any) -> tuple[Any, ...]:
    """Zones, functions of points and what has a ``contains``."""
    if isinstance(value, Mapping) or callable(value) or hasattr(value, "contains"):
        value = [value]
    try:
        given = list(value)
    except TypeError:
        raise GraspModuliError(
            f"{name} must be a list of {WANTED[name]}, got {brief(value)}"
        ) from None
    return tuple(_region(name, one) for one in given)


WANTED = {"forbidden": "boxes and half-spaces", "wanted": "regions", "unwanted": "regions"}


def _region(name: str, value: Any) -> Any:
    if name != "forbidden" and (callable(value) or hasattr(value, "contains")):
        return value
    if isinstance(value, Mapping):
        if set(value) == {"point", "normal"}:
            point = a_vector(f"{name}'s point", value["point"])
            return (False, point, _unit(f"{name}'s normal", value["normal"]))
        if set(value) != {"low", "high"}:
            raise GraspModuliError(
                f"{name} must have low and high, or point and normal, got {brief(dict(value))}"
            )
        pair: Any = (value["low"], value["high"])
    elif isinstance(value, tuple) and len(value) == 3 and isinstance(value[0], bool):
        return value
    else:
        pair = _two(name, value, "boxes (low, high) or tables of point and normal")
    low, high = (numbers(f"{name}'s box", corner) for corner in pair)
    if low.shape != (3,) or high.shape != (3,) or not (low < high).all():
        raise GraspModuliError(
            f"{name} must be boxes of a lower and a higher corner, (3,) each, got {brief(value)}"
        )
    return (True, tuple(low.tolist()), tuple(high.tolist()))


def moved(zone: Zone, middle: Floats, size: float, spare: float) -> Zone:
    """In the kernels' coordinates, larger by ``spare``."""
    is_box, one, other = zone
    if is_box:
        low, high = ((np.array(corner) - middle) / size for corner in (one, other))
        return True, tuple((low - spare).tolist()), tuple((high + spare).tolist())
    point = (np.array(one) - middle) / size + spare * np.array(other)
    return False, tuple(point.tolist()), other


def inside(name: str, region: Any, points: Floats) -> Booleans:
    """Do points lie in a region?"""
    if isinstance(region, tuple):
        is_box, one, other = region
        if is_box:
            return ((points >= one) & (points <= other)).all(axis=1)
        return ((points - one) * other).sum(axis=1) <= 0.0
    answer = np.asarray(region.contains(points) if hasattr(region, "contains") else region(points))
    if answer.dtype != np.bool_ or answer.shape != (len(points),):
        raise GraspModuliError(
            f"{name} must say for each of {len(points)} points whether it lies in the region, got "
            f"an answer of type {answer.dtype} and shape {answer.shape}"
        )
    return answer
