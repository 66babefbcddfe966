"""Fingertips on the points of a scan: what they feel there, and what is in their way."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from .._arrays import Floats, floats, locked
from .._values import Value
from .touching import ContactCheck
from .walls import Booleans

#: Fewest points under a tip from which it is known what it feels.
FEWEST = 6
#: What lies under a tip is at most so many of its radii nearer or farther than expected.
DEPTH = 1.0
#: The points under a tip lie around its middle: their mean is at most this far off, by its radius.
AROUND = 0.4
#: cos 40°: what a tip feels is about what the fitted surface has there.
ALIKE = 0.766
#: A contact is seen if points lie under this share of the pad, if what it feels differs from the
#: fitted surface by at most 15°, in radians, and if its slope has a standard error of at most this:
#: at an edge or a rim, or among much noise, it is not to be trusted.
PAD, SURE, SLOPE = 0.75, 0.262, 0.1
#: Points in the way of a finger stop it, nearer than this to its middle, by the radius of its tip.
IN_THE_WAY = 0.35
#: So many points in the way are noise.
NOISE = 2
#: Neighbours that make a pad where points are few, and points of which that is asked.
DOZEN, SOME = 13, 500
#: Clearance is looked at up to so many radii.
FARTHEST = 4.0


class Scanned(Value):
    """The points of an object that was scanned, in its own coordinates.

    Parameters
    ----------
    points
        Shape (n, 3).
    size
        The object's largest extent.
    sure
        Cells of the fitted surface, over u and θ, where a straight finger must meet what was seen;
        None where it is not known from where it was seen. Shape (k, n).
    """

    def __init__(self, points: Floats, size: float, sure: Booleans | None = None) -> None:
        self.points = locked(np.ascontiguousarray(points, dtype=np.float64).copy())
        self.size = float(size)
        self.sure = sure

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Scanned):
            return NotImplemented
        return (
            self.size == other.size
            and np.array_equal(self.points, other.points)
            and np.array_equal(_cells(self.sure), _cells(other.sure))
        )

    def __hash__(self) -> int:
        return hash((self.size, (self.points + 0.0).tobytes()))

    def __repr__(self) -> str:
        return f"Scanned({len(self.points)} points, size {self.size:.4g})"

    @cached_property
    def spacing(self) -> float:
        """Radius about a point within which there are a dozen others, where points are as dense as
        in the middle of all."""
        from scipy.spatial import KDTree

        some = self.points[:: max(1, len(self.points) // SOME)]
        distances: Any = KDTree(self.points).query(some, k=min(DOZEN, len(self.points)))[0]
        return float(np.median(distances[:, -1]))

    def saved(self) -> dict[str, Any]:
        """Arrays for a file."""
        return {"points": self.points} | ({} if self.sure is None else {"sure": self.sure})

    @classmethod
    def loaded(cls, data: Any, size: float) -> Scanned | None:
        """From the arrays of a file, if they are there."""
        if "points" not in data:
            return None
        points = floats("points", data["points"]).reshape(-1, 3)
        sure = data["sure"].astype(bool, casting="no") if "sure" in data else None
        return cls(points, size, sure)

    def press(
        self, contact: Floats, way: Floats, radius: float
    ) -> tuple[Floats, Floats, ContactCheck] | None:
        """Where a tip lands that comes to a contact along a way, and what it feels.

        Where nothing was seen, the contact and its normal stay. None if something stands in the
        way of the finger. Among few points the tip is as large as it takes to meet a dozen.
        """
        radius = max(radius, self.spacing)
        away = self.points - contact
        along = away @ way
        beside = np.sqrt(np.maximum((away * away).sum(axis=1) - along * along, 0.0))
        distance = float(np.sqrt((away * away).sum(axis=1).min()))
        felt = self._felt(away, along, beside, way, radius)
        landing = 0.0 if felt is None else felt[0]
        before = np.sort(beside[along < landing - 2.0 * radius])
        # A few points may be noise.
        clearance = FARTHEST * radius
        if len(before) > NOISE:
            clearance = min(float(before[NOISE]), clearance)
        if clearance < IN_THE_WAY * radius:
            return None
        if felt is None:
            nothing = float("nan")
            return contact, way, ContactCheck(distance, nothing, False, clearance, nothing)
        _, normal, bearing, error = felt
        point = contact + landing * way
        angle = float(np.arccos(min(1.0, float(normal @ way))))
        seen = bearing >= PAD and angle <= SURE and error <= SLOPE
        # From the surface that is seen under the tip.
        return point, normal, ContactCheck(0.0, angle, seen, clearance, bearing)

    def _felt(
        self, away: Floats, along: Floats, beside: Floats, way: Floats, radius: float
    ) -> tuple[float, Floats, float, float] | None:
        """How much deeper a tip lands, the normal that it feels, the share of the pad's eighths
        that have points under them, and the standard error of the slope.

        By regression of the depth on the place under the tip, with one curvature for all
        directions: the slope is that of the pad's mean, the middle not that of a chord.
        """
        under = (beside < radius) & (np.abs(along) < DEPTH * radius)
        if under.sum() < FEWEST:
            return None
        side = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
        side /= np.sqrt(side @ side)
        other = np.cross(way, side)
        x, y = away[under] @ side / radius, away[under] @ other / radius
        depth = along[under] / radius
        if np.hypot(x.mean(), y.mean()) > AROUND:
            return None
        design = np.stack([np.ones(len(x)), x, y, x * x + y * y], axis=1)
        weights = np.ones(len(x))
        found: Any = np.zeros(4)
        error = np.zeros(len(x))
        for _ in range(4):
            root = np.sqrt(weights)[:, None]
            found = np.linalg.lstsq(root * design, root[:, 0] * depth, rcond=None)[0]
            error = np.abs(depth - design @ found)
            scale = max(3.0 * float(np.median(error)), 1e-3)
            weights = 1.0 / (1.0 + (error / scale) ** 2)
        variance = float(weights @ (error * error) / weights.sum())
        spread = np.linalg.pinv(design.T @ (weights[:, None] * design))
        slope = float(np.sqrt(variance * (spread[1, 1] + spread[2, 2])))
        normal = way - found[1] * side - found[2] * other
        normal /= np.sqrt(normal @ normal)
        if abs(found[0]) > DEPTH or normal @ way < ALIKE:
            return None
        sector = np.floor(np.arctan2(y, x) / (2.0 * np.pi) * 8.0).astype(int) % 8
        bearing = len(np.unique(sector)) / 8.0
        return float(found[0]) * radius, normal, bearing, slope


def _cells(sure: Booleans | None) -> Booleans:
    return np.zeros((0, 0), dtype=np.bool_) if sure is None else sure
