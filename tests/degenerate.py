"""Degenerate grasps with their true quality: tested, and shown in docs/degenerate.md."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

import reference

ANGLE = 2 * np.pi * np.arange(3) / 3
CIRCLE = np.stack([np.cos(ANGLE), np.sin(ANGLE), 0 * ANGLE], axis=1)
ORIGIN = np.zeros(3)
SQUEEZE = [[1, 0, 0], [-1, 0, 0]]
SQUEEZE_NORMALS = [[-1, 0, 0], [1, 0, 0]]


@dataclass(frozen=True)
class Case:
    name: str
    contacts: Any
    normals: Any
    center: Any = field(default_factory=lambda: ORIGIN)
    friction: float = 1.0
    #: A theorem: fewer than three contacts, collinear ones, no friction, one-sided. None: from the
    #: twin in lengths of the order of 1, where it is accurate.
    true: float | None = None

    @property
    def size(self):
        return float(np.abs(np.asarray(self.contacts) - self.center).max()) or 1.0

    def truth(self):
        if self.true is not None:
            return self.true
        return reference.scaled_quality(
            np.asarray(self.contacts, float), np.asarray(self.normals, float), self.center,
            self.friction, self.size,
        )  # fmt: skip


def circle(radius):
    return Case(f"three on a circle of radius {radius:g}", radius * CIRCLE, -CIRCLE)


CASES = [
    circle(1.0),
    circle(1e-6),
    circle(1e-4),
    circle(1e4),
    Case(
        "antipodal pair, one contact twice",
        [*SQUEEZE, SQUEEZE[1]],
        [*SQUEEZE_NORMALS, SQUEEZE_NORMALS[1]],
        true=0.0,
    ),
    Case("three collinear", [*SQUEEZE, [0.3, 0, 0]], [*SQUEEZE_NORMALS, [0, 0.6, 0.8]], true=0.0),
    Case("three coincident", [[1, 1, 1]] * 3, [[-1, 0, 0], [1, 0, 0], [0, 0, 1]], true=0.0),
    Case("two contacts", SQUEEZE, SQUEEZE_NORMALS, true=0.0),
    Case("one contact", SQUEEZE[:1], SQUEEZE_NORMALS[:1], true=0.0),
    Case("no friction", CIRCLE, -CIRCLE, friction=0.0, true=0.0),
    Case(
        "nearly collinear, by 1e-3",
        [*SQUEEZE, [0.1, 1e-3, 0]],
        [*SQUEEZE_NORMALS, [0, -1, 0]],
    ),
    Case(
        "nearly collinear, by 1e-6",
        [*SQUEEZE, [0.1, 1e-6, 0]],
        [*SQUEEZE_NORMALS, [0, -1, 0]],
    ),
    Case(
        "a normal at −e₃",
        [[0, 0, 1], [0.5, 0, -1], [-0.5, 0.1, -1]],
        [[0, 0, -1], [0, 0, 1], [0, 0, 1]],
    ),
    Case("a contact at the centre of mass", CIRCLE, -CIRCLE, CIRCLE[0]),
    Case(
        "two squeeze, the third cannot help",
        [*SQUEEZE, [0, 1, 0]],
        [*SQUEEZE_NORMALS, [0, 0, 1]],
        true=0.0,
    ),
    Case("all pushing one way", CIRCLE, [[0, 0, 1]] * 3, true=0.0),
    Case(
        "four in a square, facets of many points",
        [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]],
        [[-1, 0, 0], [0, -1, 0], [1, 0, 0], [0, 1, 0]],
    ),
    Case(
        "four collinear",
        [*SQUEEZE, [0.3, 0, 0], [-0.2, 0, 0]],
        [*SQUEEZE_NORMALS, [0, 0.6, 0.8], [0, -0.6, 0.8]],
        true=0.0,
    ),
]  # fmt: skip
