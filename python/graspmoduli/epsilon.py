"""ε_l(δ₋, δ₊, r) of Sec. III: how near to a good grasp every configuration is good enough.

Derived in docs/mathematics.md. The lower end is a theorem; the upper end is a pair of
configurations that a search finds (an evolution strategy with an adapted covariance matrix, see
Hansen, *The CMA Evolution Strategy: A Tutorial*, 2016).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._arrays import Floats, coefficient, cone, count, number
from ._core import GraspModuliError
from ._values import Value
from .configurations import sample_configurations
from .grasps import PlacedGrasp
from .moduli import placed_distance
from .quality import circular_quality, quality, quality_gradient

#: Edges of the polygons inscribed in round cones by which the search finds g' good enough.
INSCRIBED = 16
#: Searches that run side by side, and samples of each per round.
RESTARTS, SAMPLES = 24, 16
#: Rounds of all searches, at most, before the best ones go on.
ROUNDS, BEST = 150, 4
#: Uniform configurations from which the searches start.
UNIFORM = 100_000
#: What a shortfall of quality counts beside ε, in multiples of what the theorem says ε gains.
PENALTY = 8.0
#: The cones of g keep this far below δ₋, relative to their lever arms: more than rounding.
MARGIN = 1e-9


@dataclass(frozen=True, eq=False)
class Epsilon(Value):
    """What is known of ε_l(δ₋, δ₊, r): lower ≤ ε ≤ upper."""

    #: Proven: every configuration nearer than this to a grasp of D(r) with Q ≥ δ₊ has Q > δ₋.
    lower: float
    #: The distance of the pair; infinite where no grasp with Q ≥ δ₊ was found.
    upper: float
    #: (g', g) with g' in D(r), Q(g') ≥ δ₊, Q(g) ≤ δ₋ and d(g', g) = ``upper``; None if not found.
    pair: tuple[PlacedGrasp, PlacedGrasp] | None


def epsilon(
    delta_minus: float,
    delta_plus: float,
    r: float = 1.0,
    *,
    contacts: int = 3,
    friction: float = 1.0,
    edges: int | None = 8,
    seed: int = 0,
    rounds: int = 1000,
) -> Epsilon:
    """ε_l(δ₋, δ₊, r) of Sec. III, between a proven lower end and a pair that proves the upper one.

    The largest ε such that Q_l(g) > δ₋ for every configuration g within ε, by the metric d, of some
    g' in D(r) with Q_l(g') ≥ δ₊. It takes ten seconds to a minute; docs/epsilon.md has a table of
    common settings.

    Parameters
    ----------
    delta_minus, delta_plus
        0 ≤ δ₋ < δ₊.
    r
        Radius of the domain D(r), in the unit of the object.
    contacts
        Number m ≥ 3 of contacts. Fewer hard contacts are never force closure. The search is over
        three, of which one is doubled as often as there are more: that changes neither Q nor d.
    friction
        Friction coefficient μ > 0 of all contacts.
    edges
        Edges l of the friction cones; None: round cones. With polygons a normal near −e₃, where the
        contact frame R(n) is not continuous, may turn its cone by next to no motion: the lower
        end is 0 where that could cost δ₊ − δ₋.
    seed, rounds
        Of the search. More rounds bring the upper end down.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> found = gm.epsilon(0.0, 0.2, edges=None, rounds=100)
    >>> bool(0.0447 < found.lower < found.upper < 0.1)
    True
    >>> good, lost = found.pair
    >>> bool(gm.circular_quality(good).lower >= 0.2 and gm.circular_quality(lost).upper == 0.0)
    True
    >>> gm.placed_distance(good, lost) == found.upper
    True
    """
    low, high = coefficient("delta_minus", delta_minus), number("delta_plus", delta_plus)
    if not high > low:
        raise GraspModuliError(f"delta_plus must be greater than delta_minus, got {high} and {low}")
    if high > 1e60:
        raise GraspModuliError(f"delta_plus must be at most 1e60, got {high}")
    radius = number("r", r, positive=True)
    m = count("contacts", contacts, 3, 1000)
    mu, l = cone(friction, INSCRIBED if edges is None else edges)
    setting = Setting(low, high, radius, mu, None if edges is None else l)
    pair = _search(setting, count("seed", seed, 0, 2**64 - 1), count("rounds", rounds, 1, 100_000))
    lower = proven(setting)
    if pair is None:
        return Epsilon(lower, np.inf, None)
    more = [0] * (m - 3) + [0, 1, 2]
    good, lost = (PlacedGrasp(g.contacts[more], g.normals[more], g.center_of_mass) for g in pair)
    return Epsilon(lower, placed_distance(good, lost), (good, lost))


class Setting(NamedTuple):
    """The arguments of ε."""

    low: float
    high: float
    radius: float
    friction: float
    #: None: round cones.
    edges: int | None

    @property
    def moves(self) -> float:
        """By how many ε a lever arm moves. Force closure does not depend on the centre of mass."""
        return 2.0 if self.low > 0.0 else 1.0


def proven(s: Setting) -> float:
    """The lower end: the theorem of docs/mathematics.md."""
    fastest = np.hypot(1.0, 2.0 * s.radius)
    cos = 1.0 if s.edges is None else np.cos(np.pi / s.edges)
    a = 1.0 + s.friction**2
    across = (s.friction * s.high + np.sqrt(max(a * fastest**2 - s.high**2, 0.0))) / a
    left = s.high - s.low - s.friction * (1.0 - cos) * across
    speed = np.hypot(1.0, s.friction * cos) * np.hypot(1.0, 2.0 * s.radius + s.moves)
    # Rounding.
    return float(max(left, 0.0) / speed * (1.0 - 1e-9))


class Trial(NamedTuple):
    """Good grasps g' of three contacts, and how their neighbours are made."""

    contacts: Floats
    normals: Floats
    center: Floats
    #: The unit twists (v, ω) along which the neighbours are to be bad.
    twist: Floats
    #: Directions in which the neighbours' centres of mass move, at most of length 1.
    shift: Floats
    #: By how much the tilt of each normal is turned from the steepest one. Shape (n, 3).
    turn: Floats
    epsilon: Floats


def _read(x: Floats, s: Setting, poles: int) -> Trial:
    """The numbers of the search as what they mean. Shape (n, 35)."""
    n = len(x)
    points = _in_ball(x[:, :12].reshape(n, 4, 3)) * s.radius
    normals = _unit(x[:, 12:21].reshape(n, 3, 3))
    normals[:, :poles] = [0.0, 0.0, -1.0]
    twist = np.concatenate([x[:, 21:24], x[:, 24:27] / max(1.0, s.radius)], axis=1)
    shift = _in_ball(x[:, 27:30]) if s.low > 0.0 else np.zeros((n, 3))
    turn = x[:, 30:33] if s.edges else np.zeros((n, 3))
    epsilon = np.exp(np.clip(x[:, 33], -30.0, 5.0))
    return Trial(points[:, :3], normals, points[:, 3], _unit(twist), shift, turn, epsilon)


def _write(g: Trial, s: Setting) -> Floats:
    """The reverse of :func:`_read`."""
    n = len(g.contacts)
    points = np.concatenate([g.contacts, g.center[:, None]], axis=1) / s.radius
    spin = g.twist[:, 3:] * max(1.0, s.radius)
    return np.concatenate(
        [points.reshape(n, 12), g.normals.reshape(n, 9), g.twist[:, :3], spin, g.shift, g.turn,
         np.log(g.epsilon)[:, None]], axis=1,
    )  # fmt: skip


def _neighbours(g: Trial, s: Setting) -> tuple[Floats, Floats, Floats, Floats]:
    """Contacts, normals and centres of mass of the neighbours, and how much they hold.

    The last is the support of their wrench hulls along the twist: an upper bound of their Q.
    """
    e = g.epsilon[:, None, None]
    spin = np.broadcast_to(g.twist[:, None, 3:], g.contacts.shape)
    center = g.center + g.epsilon[:, None] * g.shift
    speed = g.twist[:, None, :3] + _cross(spin, g.contacts - center[:, None])
    angle = 2.0 * np.arcsin(np.minimum(0.5 * e, 1.0))
    moved, normals = np.zeros_like(speed), g.normals
    for _ in range(3):
        along = speed + _cross(spin, moved)
        normals = _tilted(g.normals, along, angle, g.turn)
        _, force = _top(normals, along, s)
        moved = -e * _unit(_cross(force, spin))
    held, _ = _top(normals, speed + _cross(spin, moved), s)
    return g.contacts + moved, normals, center, held.max(1)


def _tilted(n: Floats, v: Floats, angle: Floats, turn: Floats) -> Floats:
    """Normals n turned away from v, or beside that by an angle about n."""
    across = _unit(v - (v * n).sum(-1, keepdims=True) * n)
    side = _cross(n, across)
    way = np.cos(turn)[..., None] * across + np.sin(turn)[..., None] * side
    return _unit(np.cos(angle) * n - np.sin(angle) * way)


def _top(n: Floats, v: Floats, s: Setting) -> tuple[Floats, Floats]:
    """The largest ⟨f, v⟩ of the forces f of the cones about n, and that f."""
    if s.edges is None:
        along = (v * n).sum(-1, keepdims=True)
        force = n + s.friction * _unit(v - along * n)
    else:
        shape = n.shape[:-1]
        frame = _core.tangents(np.ascontiguousarray(n.reshape(-1, 3))).reshape((*shape, 2, 3))
        x, y = ((frame[..., k, :] * v).sum(-1) for k in (0, 1))
        step = 2.0 * np.pi / s.edges
        edge = step * np.round(np.arctan2(y, x) / step)
        force = n + s.friction * (
            np.cos(edge)[..., None] * frame[..., 0, :] + np.sin(edge)[..., None] * frame[..., 1, :]
        )
    return (force * v).sum(-1), force


def _search(s: Setting, seed: int, rounds: int) -> tuple[PlacedGrasp, PlacedGrasp] | None:
    """The nearest pair found."""
    starts = _starts(s, seed)
    if not len(starts.contacts):
        return None
    random, first = np.random.Generator(np.random.Philox(seed)), min(ROUNDS, rounds)
    found = _evolve(_write(starts, s), s, 0, 0.05, first, random)
    rows = [(0, found)]
    if s.edges:
        # The same grasps, turned as a whole so that a normal, and then two, start at −e₃.
        ends = _read(found[1][found[0].argsort()], s, 0)
        for poles in (1, 2):
            turned = _to_the_pole(ends, random)
            rows.append((poles, _evolve(_write(turned, s), s, poles, 0.05, first, random)))
    best: tuple[float, Floats, int] | None = None
    for poles, (values, x) in rows:
        x = x[values.argsort()[:BEST]]
        values, x = _evolve(x, s, poles, 0.01, rounds, random)
        k = int(values.argmin())
        if best is None or values[k] < best[0]:
            best = float(values[k]), x[k : k + 1], poles
    if best is None or not np.isfinite(best[0]):
        return None
    return _proof(_read(best[1], s, best[2]), s)


def _good(g: Trial, s: Setting) -> Floats:
    """Q of the good grasps; with round cones, that of inscribed ones."""
    edges = s.edges or INSCRIBED
    return np.asarray(quality(g.contacts, g.normals, g.center, friction=s.friction, edges=edges))


def _proof(g: Trial, s: Setting) -> tuple[PlacedGrasp, PlacedGrasp] | None:
    """The pair, if it is one by the quality itself: else ε is widened a little."""
    good = PlacedGrasp(g.contacts[0], g.normals[0], g.center[0])
    for _ in range(60):
        c, n, z, _ = _neighbours(g, s)
        lost = PlacedGrasp(c[0], n[0], z[0])
        if s.edges is None:
            bounds = [circular_quality(p, friction=s.friction) for p in (good, lost)]
            fine = bounds[0].lower >= s.high or _good(g, s)[0] >= s.high
            fine = fine and bounds[1].upper <= s.low
        else:
            options: Any = {"friction": s.friction, "edges": s.edges}
            fine = quality(good, **options) >= s.high and quality(lost, **options) <= s.low
        if fine:
            return good, lost
        g = g._replace(epsilon=g.epsilon * (1.0 + 1e-3))
    return None


def _starts(s: Setting, seed: int) -> Trial:
    """Uniform grasps with Q ≥ δ₊, or the best ones led up there, that fewest ε lose."""
    edges = s.edges or INSCRIBED
    options: Any = {"friction": s.friction, "edges": edges}
    all_of = sample_configurations(UNIFORM, s.radius, 3, seed)
    values = np.asarray(quality(all_of, **options))
    order = np.argsort(-values, kind="stable")
    enough = int((values >= s.high).sum())
    order = order[: max(20 * RESTARTS, 0)] if enough < 20 * RESTARTS else order[:enough]
    # Not only the best ones: those with as much quality as needed are lost sooner.
    order = order[:: max(1, len(order) // (20 * RESTARTS))]
    c, n, z = (a[order] for a in (all_of.contacts, all_of.normals, all_of.center_of_mass))
    length = 0.05 * np.ones(len(c))
    q = values[order]
    for _ in range(80):
        short = q < s.high
        if not short.any():
            break
        slope = quality_gradient(c, n, z, **options)
        steps = slope.contacts * s.radius, slope.normals, slope.center_of_mass * s.radius
        size = np.sqrt(sum((x**2).reshape(len(c), -1).sum(1) for x in steps))
        by = (short * length / np.maximum(size, 1e-300))[:, None]
        c2 = _in_ball(c / s.radius + by[..., None] * steps[0]) * s.radius
        n2 = _unit(n + by[..., None] * steps[1])
        z2 = _in_ball(z / s.radius + by * steps[2]) * s.radius
        q2 = np.asarray(quality(c2, n2, z2, **options))
        up = q2 > q
        c, n, z = (np.where(up.reshape(-1, *[1] * (a.ndim - 1)), b, a)
                   for a, b in ((c, c2), (n, n2), (z, z2)))  # fmt: skip
        q = np.where(up, q2, q)
        length = np.where(up, 1.3 * length, 0.5 * length)
    fine = q >= s.high
    c, n, z = c[fine], n[fine], z[fine]
    k = len(c)
    if not k:
        return Trial(c, n, z, np.zeros((0, 6)), z, z, np.zeros(0))
    kernel = [s.friction], edges, 0.0, False

    def weakest(i: int) -> list[float]:
        row = slice(i, i + 1)
        return _core.weakest((c[row], n[row], z[row], None), kernel)[1]

    twists = np.array([weakest(i) for i in range(k)])
    trials = []
    for sign in (1.0, -1.0):
        low, high = np.full(k, 1e-6), np.full(k, 2.0)
        zero = np.zeros((k, 3))
        g = Trial(c, n, z, _unit(sign * twists), zero, zero, high)
        for _ in range(24):
            middle = np.sqrt(low * high)
            held = _neighbours(g._replace(epsilon=middle), s)[3] > s.low
            low, high = np.where(held, middle, low), np.where(held, high, middle)
        trials.append(g._replace(epsilon=high))
    g = Trial(*(np.concatenate(parts) for parts in zip(*trials, strict=True)))
    return _chosen(g, np.argsort(g.epsilon, kind="stable")[:RESTARTS])


def _chosen(g: Trial, index: Any) -> Trial:
    return Trial(*(part[index] for part in g))


def _to_the_pole(g: Trial, random: np.random.Generator) -> Trial:
    """Turned rigidly so that the first normal, of contacts in any order, is −e₃."""
    order = random.permuted(np.tile(np.arange(3), (len(g.contacts), 1)), axis=1)
    rows = np.arange(len(order))[:, None]
    c, n = g.contacts[rows, order], g.normals[rows, order]
    phi = 2.0 * np.pi * random.random(len(c))
    # Two frames: one of the first normal, with any spin about it, and one of −e₃.
    a = _core.tangents(np.ascontiguousarray(n[:, 0]))
    first = np.cos(phi)[:, None] * a[:, 0] + np.sin(phi)[:, None] * a[:, 1]
    own = np.stack([first, _cross(n[:, 0], first), n[:, 0]], axis=1)
    pole = np.diag([1.0, -1.0, -1.0])

    def turn(vectors: Floats) -> Floats:
        return vectors @ np.swapaxes(own, 1, 2) @ pole

    flat = turn(np.stack([g.center, g.twist[:, :3], g.twist[:, 3:], g.shift], axis=1))
    twist = np.concatenate([flat[:, 1], flat[:, 2]], axis=1)
    # A tilt beside the steepest one also turns the polygon, by twice as much.
    tilt = np.pi / 8.0 * (2.0 * random.random((len(c), 3)) - 1.0)
    return Trial(turn(c), turn(n), flat[:, 0], twist, flat[:, 3], tilt, g.epsilon)


def _evolve(
    x: Floats, s: Setting, poles: int, sigma: float, rounds: int, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """Searches side by side, a row each: the least ε of each, infinite for none, and where."""

    # How fast a support falls with ε, at most.
    speed = np.hypot(1.0, s.friction) * np.hypot(1.0, 2.0 * s.radius + s.moves)

    def objective(rows: Floats) -> tuple[Floats, Floats]:
        g = _read(rows, s, poles)
        short = np.maximum(s.high - _good(g, s), 0.0)
        held = _neighbours(g, s)[3]
        margin = MARGIN * (1.0 + 2.0 * s.radius) + (2e-3 * s.low if s.edges is None else 0.0)
        over = np.maximum(held - (s.low - margin), 0.0)
        fine = (short == 0.0) & (over == 0.0)
        cost = g.epsilon + PENALTY * (short + over) / speed
        return cost, np.where(fine, g.epsilon, np.inf)

    return _strategies(objective, x, sigma, rounds, random)


def _strategies(
    objective: Callable[[Floats], tuple[Floats, Floats]],
    x: Floats,
    size: float,
    rounds: int,
    random: np.random.Generator,
) -> tuple[Floats, Floats]:
    """The strategy of the tutorial (its default weights and rates), k of them side by side."""
    k, d = x.shape
    half = SAMPLES // 2
    weights = np.log(half + 0.5) - np.log(np.arange(1, half + 1))
    weights /= weights.sum()
    mass = 1.0 / (weights**2).sum()
    cc = (4.0 + mass / d) / (d + 4.0 + 2.0 * mass / d)
    cs = (mass + 2.0) / (d + mass + 5.0)
    c1 = 2.0 / ((d + 1.3) ** 2 + mass)
    cm = min(1.0 - c1, 2.0 * (mass - 2.0 + 1.0 / mass) / ((d + 2.0) ** 2 + mass))
    damping = 1.0 + 2.0 * max(0.0, np.sqrt((mass - 1.0) / (d + 1.0)) - 1.0) + cs
    normal = np.sqrt(d) * (1.0 - 0.25 / d + 1.0 / (21.0 * d * d))
    mean, sigma = x.copy(), np.full(k, size)
    shape = np.broadcast_to(np.eye(d), (k, d, d)).copy()
    axes, widths = shape.copy(), np.ones((k, d))
    path, steps = np.zeros((k, d)), np.zeros((k, d))
    least, where = np.full(k, np.inf), x.copy()
    rows = np.arange(k)
    for number_ in range(rounds):
        if number_ % 8 == 0:
            squares, axes = np.linalg.eigh(0.5 * (shape + np.swapaxes(shape, 1, 2)))
            widths = np.sqrt(np.maximum(squares, 1e-20))
        z = random.standard_normal((k, SAMPLES, d)) * widths[:, None]
        y = z @ np.swapaxes(axes, 1, 2)
        trial = mean[:, None] + sigma[:, None, None] * y
        cost, value = (a.reshape(k, SAMPLES) for a in objective(trial.reshape(-1, d)))
        best = value.argmin(1)
        better = value[rows, best] < least
        least = np.where(better, value[rows, best], least)
        where = np.where(better[:, None], trial[rows, best], where)
        chosen = y[rows[:, None], np.argsort(cost, axis=1, kind="stable")[:, :half]]
        step = weights @ chosen
        mean = mean + sigma[:, None] * step
        white = ((step[:, None] @ axes)[:, 0] / widths)[:, None] @ np.swapaxes(axes, 1, 2)
        steps = (1.0 - cs) * steps + np.sqrt(cs * (2.0 - cs) * mass) * white[:, 0]
        length = np.linalg.norm(steps, axis=1)
        steady = (
            length / np.sqrt(1.0 - (1.0 - cs) ** (2 * number_ + 2))
            < (1.4 + 2.0 / (d + 1.0)) * normal
        )
        path = (1.0 - cc) * path + steady[:, None] * np.sqrt(cc * (2.0 - cc) * mass) * step
        shape = (
            (1.0 - c1 - cm) * shape
            + c1 * path[:, :, None] * path[:, None]
            + cm * np.swapaxes(chosen * weights[:, None], 1, 2) @ chosen
        )
        sigma = sigma * np.exp(cs / damping * (length / normal - 1.0))
    return least, where


def _unit(v: Floats) -> Floats:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)


def _in_ball(v: Floats) -> Floats:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1.0)


def _cross(a: Floats, b: Floats) -> Floats:
    """The cross product, without the checks of NumPy's that take longer than it."""
    x, y, z = (a[..., i] for i in range(3))
    p, q, r = (b[..., i] for i in range(3))
    return np.stack([y * r - z * q, z * p - x * r, x * q - y * p], axis=-1)
