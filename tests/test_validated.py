"""Published numbers: what docs/validated.md prints is what is computed here, and what is computed
is what was published, unless the page says why not."""

import re
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import graspmoduli as gm
from conftest import ROOT

PAGE = (ROOT / "docs" / "validated.md").read_text()
#: The functions that the page shows, as its readers have them.
SHOWN: dict[str, Any] = {}
exec(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[0], SHOWN)
planar, limited_each = SHOWN["planar"], SHOWN["limited_each"]


def rows():
    """Question, published numbers, ours, and why they differ."""
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if line.startswith("| ") and cells[0] != "question":
            question, published, ours, why = [*cells[:3], " ".join(cells[3:]).strip(" |")]
            yield question, published.split(", "), ours.split(", "), why


ROWS = list(rows())
COMPUTED: dict[str, Callable[[], Any]] = {}


def answers(question):
    """Marks what computes the numbers of the row whose question begins so."""

    def mark(function):
        assert question not in COMPUTED
        COMPUTED[question] = function
        return function

    return mark


def to_its_last_digit(printed, value):
    """Is a number what is printed of it, to half a unit of the last digit?"""
    decimals = len(printed.partition(".")[2])
    return abs(float(printed) - value) <= 0.5 * 10.0**-decimals * (1 + 1e-9)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0][:60])
def test_the_page_says_what_is_computed_and_what_was_published(row):
    question, published, ours, why = row
    (found,) = [compute for begins, compute in COMPUTED.items() if question.startswith(begins)]
    values = np.atleast_1d(np.asarray(found(), float))
    assert len(values) == len(ours) == len(published)
    for printed, value in zip(ours, values, strict=True):
        assert to_its_last_digit(printed, value), f"the page says {printed}, computed is {value}"
    alike = [to_its_last_digit(text, value) for text, value in zip(published, values, strict=True)]
    assert all(alike) == (not why), f"published {published}, computed {values}, why: {why!r}"


def test_every_computation_is_on_the_page():
    questions = [question for question, *_ in ROWS]
    for begins in COMPUTED:
        assert sum(question.startswith(begins) for question in questions) == 1, begins
    assert len(COMPUTED) == len(questions) > 20


def test_a_wrong_number_would_be_found():
    assert to_its_last_digit("0.233", 0.23281)
    assert not to_its_last_digit("0.234", 0.23281)
    assert not to_its_last_digit("0.2329", 0.23281)
    assert to_its_last_digit("18", 18)
    assert not to_its_last_digit("18", 17)


# The square of half side 1 -----------------------------------------------------------------------
TOP, RIGHT, BOTTOM = [0.0, 1.0], [1.0, 0.0], [0.0, -1.0]


def middles(*points):
    return np.array(points), -np.array(points)


@answers("two opposite contacts")
def _():
    return gm.quality_of_wrenches(planar(*middles(TOP, BOTTOM), 0.5))


@answers("three contacts, μ = 0.7")
def _():
    return gm.quality_of_wrenches(planar(*middles(TOP, RIGHT, BOTTOM), 0.7))


@answers("two on neighbouring sides")
def _():
    return [gm.quality_of_wrenches(planar(*middles(TOP, RIGHT), mu)) for mu in (0.7, 1.0)]


def pushed(*points):
    """Which of eight pushes are resisted: in space, where sides and cones' edges are along axes."""
    contacts, inward = (np.pad(array, ((0, 0), (0, 1))) for array in middles(*points))
    for angle in np.pi / 4 * np.arange(8):
        push = [np.cos(angle), np.sin(angle), 0, 0, 0, 0]
        yield gm.task_quality(contacts, inward, np.zeros(3), [push], friction=0.7, edges=4) > 0.0


@answers("of eight pushes")
def _():
    return list(pushed(TOP, RIGHT))


@answers("how many of them three contacts resist")
def _():
    return sum(pushed(TOP, RIGHT, BOTTOM))


THREE = np.array([[-0.8, 1.0], [-0.8, -1.0], [0.8, -1.0]])
THREE_NORMALS = np.array([[0.0, -1.0], [0.0, 1.0], [0.0, 1.0]])


@answers("$L^1$")
def _():
    return gm.quality_of_wrenches(planar(THREE, THREE_NORMALS, 0.5, unit=True))


@answers("$L^\\infty$")
def _():
    return gm.quality_of_wrenches(limited_each(planar(THREE, THREE_NORMALS, 0.5, unit=True), 3))


@answers("the first and the last contact alone")
def _():
    return gm.quality_of_wrenches(planar(THREE[[0, 2]], THREE_NORMALS[[0, 2]], 0.5, unit=True))


# Five polygons -----------------------------------------------------------------------------------
HEXAGON = 0.1 + 2 * np.pi * np.arange(6) / 6
POLYGONS = {
    "rectangle": np.array([[-45, -20], [45, -20], [45, 20], [-45, 20]]) / 1000,
    "hexagon": 0.033 * np.stack([np.cos(HEXAGON), np.sin(HEXAGON)], axis=1),
    "triangle": np.array([[-45, -26], [45, -26], [0, 52]]) / 1000,
    "L": np.array([[-40, -30], [40, -30], [40, 0], [-8, 0], [-8, 45], [-40, 45]]) / 1000,
    "wedge": np.array([[-48, -18], [48, -6], [48, 6], [-48, 18]]) / 1000,
}


def around(corners, count):
    """Points evenly along an outline, about the centroid, with inward normals."""
    x, y = corners.T
    after = np.roll(corners, -1, axis=0)
    doubled = x * after[:, 1] - after[:, 0] * y
    centroid = ((corners + after) * doubled[:, None]).sum(axis=0) / (3 * doubled.sum())
    lengths = np.linalg.norm(after - corners, axis=1)
    ends = np.cumsum(lengths)
    along = np.linspace(0.0, ends[-1], count, endpoint=False)
    side = np.searchsorted(ends, along, side="right")
    ahead = (after - corners)[side] / lengths[side, None]
    points = after[side] - (ends[side] - along)[:, None] * ahead
    return points - centroid, np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)


@cache
def pairs(name, friction=0.4, count=90, lever=0.05):
    """Contacts and normals of all pairs that a gripper reaches, (n, 2, 2), and their qualities."""
    points, normals = around(POLYGONS[name], count)
    one, other = np.triu_indices(count, k=1)
    apart = np.linalg.norm(points[one] - points[other], axis=1)
    reached = (apart >= 0.008) & (apart <= 0.075)
    two = np.stack([one, other], axis=1)[reached]
    wrenches = planar(points[two], normals[two], friction, lever, unit=True)
    return points[two], normals[two], gm.quality_of_wrenches(wrenches)


def share(quality):
    return 100 * (quality > 0.0).mean()


HELD = [name for name in POLYGONS if name != "triangle"]


@answers("pairs on the five polygons")
def _():
    return [len(pairs(name)[2]) for name in POLYGONS]


@answers("force closure, %")
def _():
    return [share(pairs(name)[2]) for name in POLYGONS]


@answers("best quality on rectangle")
def _():
    return [pairs(name)[2].max() for name in HELD]


@answers("worst quality that is not 0")
def _():
    return [min(q for q in pairs(name)[2] if q > 0.0) for name in HELD]


@answers("two opposite, and two offset contacts of the rectangle")
def _():
    two = np.array([[[10, -20], [10, 20]], [[36, -20], [-20, 20]]]) / 1000
    normals = np.array([[[0.0, 1.0], [0.0, -1.0]]] * 2)
    return gm.quality_of_wrenches(planar(two, normals, 0.4, 0.05, unit=True))


@answers("force closure with μ = 1")
def _():
    return [share(pairs(name, 1.0, 70)[2]) for name in POLYGONS]


@cache
def over_units():
    """For each polygon: how many pairs are best for some unit, and the first one's worst place."""
    found = []
    for name in ("rectangle", "L", "wedge"):
        units = (0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.20, 0.35, 0.60)
        qualities = [pairs(name, lever=unit)[2] for unit in units]
        first = qualities[0].argmax()
        places = [1 + (q > q[first]).sum() for q in qualities]
        found.append((len({q.argmax() for q in qualities}), max(places)))
    return found


@answers("best pairs for nine units of length")
def _():
    return [different for different, _ in over_units()]


@answers("of these, the worst place")
def _():
    return [place for _, place in over_units()]


@cache
def random_contacts():
    """Shares of force closure, in the order in which the contacts were drawn."""
    rng = np.random.default_rng(3)
    points, normals = around(POLYGONS["hexagon"], 120)
    found = {}
    for friction in (0.0, 0.1, 0.3, 0.6):
        for count in (2, 3, 4, 5, 6):
            rows = np.array([rng.choice(120, size=count, replace=False) for _ in range(600)])
            wrenches = planar(points[rows], normals[rows], friction, 0.05, unit=True)
            found[friction, count] = share(gm.quality_of_wrenches(wrenches))
    return found


@answers("2 to 6 random contacts")
def _():
    return [random_contacts()[0.0, count] for count in (2, 3, 4, 5, 6)]


@answers("the same with μ = 0.3")
def _():
    return [random_contacts()[0.3, count] for count in (2, 3, 4, 5, 6)]


@answers("the best and the worst grasp of the L")
def _():
    points, normals, quality = pairs("L")
    held = []
    for k in (quality.argmax(), np.where(quality > 0.0, quality, np.inf).argmin()):
        # In space; sides are along the axes, and so are the edges of cones with four of them.
        contacts, inward = (np.pad(array[k], ((0, 0), (0, 1))) for array in (points, normals))
        up = gm.task_quality(
            contacts, inward, np.zeros(3), [[0, -1, 0, 0, 0, 0]], friction=0.4, edges=4
        )
        # Edges of unit length.
        held.append(20 * up / np.sqrt(1 + 0.4**2))
    return held


@answers("and in the worst direction")
def _():
    quality = pairs("L")[2]
    return [20 * quality.max(), 20 * quality[quality > 0.0].min()]


@answers("grasps of the L that are force closure")
def _():
    quality = pairs("L")[2]
    held = 20 * quality[quality > 0.0]
    return [len(held), 100 * (held < 1.0).mean()]


# Courses -----------------------------------------------------------------------------------------
#: Contact forces without friction: points, forces, verdict.
CUBE = [[0, 0, 1], [-1, 0, 0], [0, 1, 0], [0, 0, -1], [1, 0, 0], [0, -1, 0], [0, 0, -1]]
FAR, NEAR = [1, -1, -1], [-1, 1, 1]
FORM_CLOSURE = [
    ([[-1, -1], [0, -2], [1, 1], [0, 2]], [[1, 0], [0, 1], [-1, 0], [0, -1]], False),
    ([[-1, -2], [-1, -2], [1, 2], [1, 2]], [[1, 0], [0, 1], [-1, 0], [0, -1]], True),
    ([FAR, FAR, FAR, NEAR, NEAR, NEAR, [1, 1, 1]], CUBE, False),
    ([[1, 0, -1], FAR, FAR, NEAR, NEAR, NEAR, [1, 1, 1]], CUBE, True),
]
SIDES = [[-1.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]]
CORNER = [[-1.0, 0, 0], [0, 0, -1], [0, 0, 1]], [[1.0, 0, 0], [0, 0, 1], [0, 0, -1]]


def force_closure(points, normals, friction):
    points, normals = np.asarray(points, float), np.asarray(normals, float)
    if points.shape[-1] == 2:
        return gm.quality_of_wrenches(planar(points, normals, friction)) > 0.0
    return gm.quality(points, normals, np.zeros(3), friction=friction) > 0.0


@answers("Stanford CS237B, homework 2: verdicts")
def _():
    right = 0
    for points, forces, verdict in FORM_CLOSURE:
        if len(points[0]) == 2:
            wrenches = planar(np.array(points), np.array(forces), 0.0)
        else:
            wrenches = np.hstack([forces, np.cross(points, forces)])
        right += (gm.quality_of_wrenches(wrenches) > 0.0) == verdict
    cases = [(*SIDES, [1, 0], False), (*SIDES, [1, 1], True),
             (*CORNER, [1, 1, 1], True), (*CORNER, [0, 1, 1], False)]  # fmt: skip
    # A square of side 1: below, on the right at height h, above at c, and friction below only.
    for c, h in ((0.25, 0.5), (0.3, 0.7), (0.2, 0.7), (0.3, 0.3), (0.2, 0.3)):
        points, normals = [[0, -0.5], [0.5, h - 0.5], [c, 0.5]], [[0, 1], [-1, 0], [0, -1]]
        cases += [(points, normals, [c / h + 1e-3, 0, 0], True),
                  (points, normals, [c / h - 1e-3, 0, 0], False)]  # fmt: skip
    return right + sum(force_closure(*case) == verdict for *case, verdict in cases)


@answers("the same, the fingers' forces")
def _():
    # The planar pair in space, with edges along the axes.
    points, normals = (np.pad(np.array(array), ((0, 0), (0, 1))) for array in SIDES)
    largest = 0.0
    for contacts, inward, friction, wanted in (
        (points, normals, 1.0, [[0.5, 0.5, 0], [-0.5, 0.5, 0]]),
        (*CORNER, [0.0, 1.0, 1.0], [[0, 0, 0], [0, 0.5, 0.5], [0, 0.5, -0.5]]),
    ):
        space = gm.WrenchSpace(contacts, inward, np.zeros(3), friction=friction)
        held = space.resist([0, -1, 0, 0, 0, 0]).forces
        assert held is not None
        largest = max(largest, np.abs(held - wanted).max())
    # The homework's own tolerance is 1e-5.
    assert largest < 1e-12
    return largest


@answers("MIT 6.832, problem set 5")
def _():
    few = [([0.1, 1], [-0.1, -1.1]), ([0.3, -0.4], [-0.4, 1.1]), ([-0.7, -0.5], [0.8, 1.1])]
    points, normals = (np.array(array) for array in zip(*few, strict=True))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    pair = np.array(SIDES[0])
    right = [
        force_closure(*SIDES, 0.2),
        force_closure(points, normals, 1.5),
        not force_closure(points, normals, 1e-7),
        not force_closure(pair, [[-1, 0], [-1, 0]], 0.2),
    ]
    # On a circle, drawn as there.
    draw = np.random.RandomState(42)
    for _ in range(100):
        theta = np.pi * draw.rand(2)
        circle = np.stack([np.sin(theta), np.cos(theta)], axis=1)
        right.append(not force_closure(circle, -circle, 1e-7))
    for _ in range(3):
        theta = 2 * np.pi * draw.rand(100)
        theta[-1] = theta[-2] + np.pi
        circle = np.stack([np.sin(theta), np.cos(theta)], axis=1)
        right.append(force_closure(circle, -circle, 0.1))
    for _ in range(3):
        theta = np.pi / 3 * draw.rand(100)
        circle = np.stack([np.sin(theta), np.cos(theta)], axis=1)
        right.append(not force_closure(circle, circle, 0.1))
    return sum(right)


# Theorems ----------------------------------------------------------------------------------------
@answers("the fewest contacts without friction")
def _():
    rng = np.random.default_rng(0)

    def directions(count, size):
        given = rng.normal(size=(4000, count, size))
        return given / np.linalg.norm(given, axis=2, keepdims=True)

    def fewest(size):
        for count in range(1, 10):
            points, normals = rng.normal(size=(4000, count, size)), directions(count, size)
            if size == 2:
                found = gm.quality_of_wrenches(planar(points, normals, 0.0))
            else:
                found = gm.quality(points, normals, np.zeros(3), friction=0.0)
            if found.max() > 0.0:
                return count
        return 0

    return [fewest(2), fewest(3)]


@answers("two fingers in the plane are force closure exactly")
def _():
    agree = 0
    for name in POLYGONS:
        points, normals, quality = pairs(name)
        line = points[:, 1] - points[:, 0]
        line /= np.linalg.norm(line, axis=1, keepdims=True)
        along = np.stack([(line * normals[:, 0]).sum(1), -(line * normals[:, 1]).sum(1)])
        inside = (along > np.cos(np.arctan(0.4))).all(axis=0)
        agree += ((quality > 0.0) == inside).sum()
    return agree


@answers("two soft fingers in space")
def _():
    rng = np.random.default_rng(4)
    points = rng.normal(size=(2000, 2, 3))
    line = points[:, 1] - points[:, 0]
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    # Near the line, towards the other finger or away from it.
    sense = rng.choice([-1.0, 1.0], size=2000)[:, None]
    aims = np.stack([sense * line, -sense * line], axis=1)
    normals = aims + rng.uniform(0.0, 0.5, (2000, 2, 1)) * rng.normal(size=(2000, 2, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    along = np.stack([(normals[:, 0] * line).sum(1), -(normals[:, 1] * line).sum(1)])
    cosine = np.cos(np.arctan(0.6))
    inside = (along > cosine).all(axis=0) | (along < -cosine).all(axis=0)
    assert 400 < inside.sum() < 1600
    assert (inside & (sense[:, 0] < 0)).sum() > 200
    found = gm.circular_quality(points, normals, np.zeros(3), friction=0.6, torsion=0.1,
                                tolerance=1.0)  # fmt: skip
    return ((found.lower > 0.0) == inside).sum()


@answers("singular values of six fingers")
def _():
    six = 0.5 * np.vstack([np.eye(3), -np.eye(3)])
    values = gm.measures(six, -2 * six, np.zeros(3)).singular_values
    np.testing.assert_allclose(values, np.repeat([np.sqrt(6.0), 1.0], 3), rtol=1e-14)
    return values[[0, 5]]


@answers("the least μ with which two fingers hold an equilateral triangle")
def _():
    # In the middle of two sides, whose normals meet at 120°.
    angles = np.array([np.pi / 6, 5 * np.pi / 6])
    points = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    low, high = 0.0, 2.0
    while high - low > 1e-11:
        middle = (low + high) / 2
        low, high = (low, middle) if force_closure(points, -2 * points, middle) else (middle, high)
    return high
