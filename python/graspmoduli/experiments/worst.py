"""How bad a grasp near a good one can be: by search, and proven (Sec. IV.A and beyond it).

ε_l(δ₋, δ₊, r) of Sec. III is a supremum over all grasps with Q_l ≥ δ₊ and all their neighbours.
What is sampled of it is an estimate from above only; a search finds worse neighbours, a proof
bounds it from below. Grasps are rows of 21 numbers: contacts, normals, centre of mass.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._arrays import Floats
from .._core import arctan2, cos, sin
from ..quality import quality, quality_gradient
from .settings import PAPERS_CONE, Cone

#: The search keeps normals away from −e₃, where R(n) is not continuous, by this third component.
LOWEST_NORMAL = -0.9
#: How near to −e₃ a normal is put where that is what is looked for.
NEAR_POLE = 1e-9


class Worst(NamedTuple):
    """The worst pair found of a grasp with Q ≥ δ and a neighbour of it."""

    #: Q of the neighbour.
    smallest: float
    #: The good grasp and the neighbour.
    grasp: Floats
    neighbour: Floats


def split(rows: Floats) -> tuple[Floats, Floats, Floats]:
    """Contacts (n, 3, 3), normals (n, 3, 3) and centres of mass (n, 3)."""
    n = len(rows)
    return rows[:, :9].reshape(n, 3, 3), rows[:, 9:18].reshape(n, 3, 3), rows[:, 18:]


def join(contacts: Floats, normals: Floats, centers: Floats) -> Floats:
    """The reverse of :func:`split`."""
    n = len(centers)
    return np.concatenate([contacts.reshape(n, 9), normals.reshape(n, 9), centers], axis=1)


def worst_neighbour(
    good: Floats,
    delta: float,
    epsilon: float,
    rounds: int,
    *,
    pole: bool = False,
    cone: Cone = PAPERS_CONE,
) -> Worst:
    """Descends from good grasps to the worst pair (g', g) with Q(g') ≥ δ and d(g', g) ≤ ε.

    The neighbour goes to the corner of N_ε(g') that the gradient points away from. The good grasp
    follows the neighbour's gradient downwards, as far as its own quality allows.

    R(n), the smallest rotation from e₃ to n, is not continuous at −e₃: a normal that moves by next
    to nothing there may turn its polygonal cone by any angle. With ``pole``, n₁ of every good grasp
    is put to −e₃ and stays there; else normals stay away from it.
    """
    grasps, start = good, good
    if pole:
        grasps = _to_the_pole(good)
        grasps = grasps[_values(grasps, cone) >= delta]
        start = _turned(grasps, cone)
    near, values = _descend(grasps, start, epsilon, cone)
    reach = np.full(len(grasps), 0.3 * max(epsilon, 0.01))
    for _ in range(rounds):
        if not values.min() > 0.0:
            break
        _, down = _slope(near, cone)
        own, up = _slope(grasps, cone)
        if pole:
            down[:, 9:12] = up[:, 9:12] = 0.0
        # Not downwards for the good grasp, unless it has quality to spare.
        overlap = (down * up).sum(1) / np.maximum((up * up).sum(1), 1e-300)
        held = (overlap > 0.0) & (own < 1.02 * delta)
        step = -(down - np.where(held, overlap, 0.0)[:, None] * up)
        step *= (reach / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
        trial = _lifted(_retract(grasps + step), delta, pole, cone)
        beside = _retract(near + (trial - grasps))
        trial_near, trial_values = _descend(trial, beside, epsilon, cone, 3)
        better = (_values(trial, cone) >= delta) & (trial_values < values)
        if not pole:
            better &= (trial[:, [11, 14, 17]] > LOWEST_NORMAL).all(1)
        grasps = np.where(better[:, None], trial, grasps)
        near = np.where(better[:, None], trial_near, near)
        values = np.where(better, trial_values, values)
        reach = np.where(better, 1.3 * reach, 0.5 * reach)
    least = int(values.argmin())
    return Worst(float(values[least]), grasps[least], near[least])


def steepest_at_the_pole(good: Floats, cone: Cone = PAPERS_CONE) -> tuple[float, Floats, Floats]:
    """The largest drop of Q found when a normal leaves −e₃ by :data:`NEAR_POLE`, and the pair."""
    grasps = _to_the_pole(good)
    near = _turned(grasps, cone)
    drop = _values(grasps, cone) - _values(near, cone)
    most = int(drop.argmax())
    return float(drop[most]), grasps[most], near[most]


def proven_radius(
    delta: float, friction: float = 1.0, edges: int = 8, radius: float = 1.0
) -> float:
    """A proven lower bound of ε_l(0, δ, r): docs/mathematics.md derives it.

    0 where turning the polygonal cones could already cost δ.
    """
    cos = np.cos(np.pi / edges)
    # Lever arms are at most 2r: how fast a contact moves under a unit twist.
    fastest = np.hypot(1.0, 2.0 * radius)
    a = 1.0 + friction**2
    across = (friction * delta + np.sqrt(max(a * fastest**2 - delta**2, 0.0))) / a
    left = delta - friction * (1.0 - cos) * across
    speed = np.hypot(1.0, friction * cos) * np.hypot(1.0, 2.0 * radius + 1.0)
    # Rounding.
    return float(max(left, 0.0) / speed * (1.0 - 1e-9))


def _values(rows: Floats, cone: Cone) -> Floats:
    return np.asarray(quality(*split(rows), friction=cone.friction, edges=cone.edges))


def _slope(rows: Floats, cone: Cone) -> tuple[Floats, Floats]:
    found = quality_gradient(*split(rows), friction=cone.friction, edges=cone.edges)
    return found.value, join(found.contacts, found.normals, found.center_of_mass)


def _retract(rows: Floats) -> Floats:
    """Into D(1): points into the unit ball, normals onto the unit sphere."""
    contacts, normals, centers = split(rows)
    points = np.concatenate([contacts, centers[:, None]], axis=1)
    points = points / np.maximum(np.linalg.norm(points, axis=2, keepdims=True), 1.0)
    normals = normals / np.linalg.norm(normals, axis=2, keepdims=True)
    return join(points[:, :3], normals, points[:, 3])


def _lifted(rows: Floats, delta: float, pole: bool, cone: Cone) -> Floats:
    """Up the gradient until Q ≥ δ, in a few Newton steps."""
    for _ in range(4):
        value, up = _slope(rows, cone)
        if pole:
            up[:, 9:12] = 0.0
        short = np.maximum(delta * (1.0 + 1e-9) - value, 0.0)
        step = up * (short / np.maximum((up * up).sum(1), 1e-12))[:, None]
        length = np.linalg.norm(step, axis=1, keepdims=True)
        rows = _retract(rows + step * np.minimum(1.0, 0.1 / np.maximum(length, 1e-300)))
    return rows


def _descend(
    grasps: Floats, start: Floats, epsilon: float, cone: Cone, rounds: int = 12
) -> tuple[Floats, Floats]:
    """From a start to a bad neighbour within N_ε of each grasp, and its Q."""
    near = _within(grasps, start, epsilon)
    values, slope = _slope(near, cone)
    for _ in range(rounds):
        # The corner of N_ε that the linear model is least at.
        corner = _corner(grasps, slope, epsilon)
        better = np.zeros(len(grasps), dtype=bool)
        best, best_values = near, values
        for share in (1.0, 0.5, 0.2, 0.05):
            trial = _within(grasps, near + share * (corner - near), epsilon)
            trial_values = _values(trial, cone)
            wins = trial_values < best_values
            best = np.where(wins[:, None], trial, best)
            best_values = np.where(wins, trial_values, best_values)
            better |= wins
        if not better.any():
            break
        near, (values, slope) = best, _slope(best, cone)
    return near, values


def _corner(grasps: Floats, slope: Floats, epsilon: float) -> Floats:
    contacts, normals, centers = split(slope)
    _, axes, _ = split(grasps)
    across = normals - (normals * axes).sum(2, keepdims=True) * axes

    def unit(vectors: Floats) -> Floats:
        return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)

    moved = join(-epsilon * unit(contacts), -epsilon * unit(across), -epsilon * unit(centers))
    return grasps + moved


def _within(grasps: Floats, rows: Floats, epsilon: float) -> Floats:
    """Each block of the rows drawn back into N_ε of the grasps."""
    # A hair inside, so that rounding does not lead out.
    reach = epsilon * (1.0 - 1e-12)
    contacts, normals, centers = split(rows)
    c, n, z = split(grasps)

    def ball(points: Floats, middle: Floats) -> Floats:
        off = points - middle
        length = np.linalg.norm(off, axis=-1, keepdims=True)
        return middle + off * np.minimum(1.0, reach / np.maximum(length, 1e-300))

    turned = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    across = turned - (turned * n).sum(-1, keepdims=True) * n
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    along = (turned * n).sum(-1, keepdims=True)
    angle = arctan2(length.ravel(), along.ravel()).reshape(length.shape)
    # Of a chord as long as that.
    half = arctan2(np.array([0.5 * reach]), np.sqrt([1.0 - 0.25 * reach**2]))
    angle = np.minimum(angle, 2.0 * half)
    turned = cos(angle) * n + sin(angle) * across / np.maximum(length, 1e-300)
    turned = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
    return join(ball(contacts, c), turned, ball(centers, z))


def _to_the_pole(rows: Floats) -> Floats:
    """Turned rigidly so that n₁ = −e₃."""
    contacts, normals, centers = split(rows)
    target = np.array([0.0, 0.0, -1.0])
    # Two reflections: n₁ to −n₁ + …, in all the rotation about n₁ + target by π.
    middle = normals[:, 0] + target
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)

    def turn(vectors: Floats) -> Floats:
        axis = middle[:, None]
        return 2.0 * (vectors * axis).sum(-1, keepdims=True) * axis - vectors

    moved = join(turn(contacts), turn(normals), turn(centers[:, None])[:, 0])
    moved[:, 9:12] = target
    return _retract(moved)


def _turned(rows: Floats, cone: Cone, directions: int = 16) -> Floats:
    """n₁ moved away from −e₃ by a little, in the direction that is worst for each row."""
    best, best_values = rows, np.full(len(rows), np.inf)
    # From direction φ the cone is turned by 2φ; a polygon of l edges is its own after 2π/l.
    angles = np.pi / cone.edges * np.arange(directions) / directions
    for x, y in zip(cos(angles), sin(angles), strict=True):
        trial = rows.copy()
        trial[:, 9:12] = [NEAR_POLE * x, NEAR_POLE * y, -1.0]
        values = _values(trial, cone)
        wins = values < best_values
        best = np.where(wins[:, None], trial, best)
        best_values = np.where(wins, values, best_values)
    return best
