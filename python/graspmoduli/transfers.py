"""Carrying grasps from one surface to another, and their quality on the way (Sec. III, IV.D)."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, brief, cells, count, locked, number
from ._batches import NORMS, Cone, carried, check_gradient, fingers
from ._core import GraspModuliError, cos, sin
from ._values import Value
from .grasps import Grasp, RankedGrasp, a_grasp, a_point, a_surface, place
from .moduli import Point, same_number, shortest_turn
from .quality import quality
from .surfaces import Surface, combine
from .synthesis import ranked_grasp

#: How a grasp can be carried to another surface.
METHODS = ("naive", "gradient", "ascent")
#: Centres of mass along a curve are interpolated in t to this, relative to the surfaces' extent.
CENTER_TOLERANCE = 1e-9
#: On how many surfaces they are computed at most.
MOST_CENTERS = 129
#: Surfaces of a transfer, steps on each of them and samples of a curve are at most so many.
MOST_STEPS = 100_000


@dataclass(frozen=True, eq=False)
class Transfer(RankedGrasp):
    """A grasp carried to another surface: there it is a ranked grasp, with the way that it took."""

    #: Q_l on the way; the last is ``quality``. Shape (k,).
    path: Floats
    #: Where on the way: the surfaces were (1 − t) S + t T. In a chain, t counts on from one surface
    #: to the next. Shape (k,).
    t: Floats
    #: How many times Q_l, its gradient or its facets were computed.
    evaluations: int

    @property
    def status(self) -> str:
        """``"force closure"`` or ``"lost"``: whether the grasp holds the target."""
        return "force closure" if self.quality > 0.0 else "lost"

    @property
    def monotone(self) -> bool:
        """Whether the quality never falls along ``path``."""
        return bool((np.diff(self.path) >= 0.0).all())


@overload
def transfer(
    source: Surface,
    grasp: Grasp,
    target: Surface | Sequence[Surface],
    method: str = "naive",
    *,
    friction: ArrayLike = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    norm: str = "sum",
    surfaces: int = 100,
    steps: int = 20,
    step_length: float = 1e-3,
    difference: float | None = None,
    allowed: ArrayLike | None = None,
) -> Transfer: ...
@overload
def transfer(
    source: Point,
    grasp: Surface | Sequence[Surface],
    target: str = "naive",
    *,
    friction: ArrayLike = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    norm: str = "sum",
    surfaces: int = 100,
    steps: int = 20,
    step_length: float = 1e-3,
    difference: float | None = None,
    allowed: ArrayLike | None = None,
) -> Transfer: ...
@overload
def transfer(
    source: Surface,
    grasp: Sequence[Grasp],
    target: Surface | Sequence[Surface],
    method: str = "naive",
    *,
    friction: ArrayLike = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    norm: str = "sum",
    surfaces: int = 100,
    steps: int = 20,
    step_length: float = 1e-3,
    difference: float | None = None,
    allowed: ArrayLike | None = None,
) -> list[Transfer]: ...
def transfer(
    source: Any,
    grasp: Any,
    target: Any = None,
    method: str = "naive",
    *,
    friction: ArrayLike = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    norm: str = "sum",
    surfaces: int = 100,
    steps: int = 20,
    step_length: float = 1e-3,
    difference: float | None = None,
    allowed: ArrayLike | None = None,
) -> Transfer | list[Transfer]:
    """Carries a grasp from one surface to another along (1 − t) S + t T (Def. III.4, Sec. IV.D).

    Parameters
    ----------
    source, grasp
        The surface S, a grasp on it or several with the same number of contacts. Or a point
        (S, g) of the moduli space alone: ``gm.transfer((S, g), T, method)``.
    target
        The surface T; or a list of surfaces, through which the grasp is carried one after the
        other.
    method
        ``"naive"``: the coordinates stay. ``"gradient"``: the paper's, on each of N₁ surfaces N₂
        steps x + δ∇Q, u kept in [0, 1]. ``"ascent"``: ours, for three contacts: on surfaces as near
        to each other as keeps the grasp good, an ascent by all facets of the wrench hull near the
        origin, then one on T towards a local maximum; in few steps, in many and at once, and the
        best of these.
    friction, edges
        As in :func:`graspmoduli.quality`; friction positive, a number or one per finger, (m,).
    torsion
        As in :func:`graspmoduli.quality`: soft fingers, which the ascent does not know.
    norm
        As in :func:`graspmoduli.quality`; for the ascent ``"sum"``.
    surfaces
        N₁; for the naïve transfer, how finely its quality is sampled.
    steps, step_length
        N₂ and δ of the gradient method.
    difference
        h of forward differences for the gradient method, as in the paper (1e-5); exact derivatives
        if not given.
    allowed
        For the ascent, where contacts may lie on the target, the last one of a chain: booleans over
        a grid of cells, rows along u and columns along θ. Everywhere if not given.

    Returns
    -------
    Transfer, or a list of them for several grasps
        Centres of mass on the way are by Simpson's rule on a grid of 20 by 20, as in Sec. IV.E;
        on S and T they are the surfaces' own.

    Raises
    ------
    GraspModuliError
        If an argument is wrong, or ``allowed`` allows no contact at all.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> names = ("bottle", "glass", "vase")
    >>> bottle, glass, vase = (gm.shapes.model(name) for name in names)
    >>> best = gm.synthesize(bottle, top=1)[0]
    >>> gm.transfer(bottle, best.grasp, glass).grasp == best.grasp  # keeps u and θ
    True
    >>> over_the_glass = gm.transfer(bottle, best.grasp, [glass, vase], "gradient")
    >>> over_the_glass.quality > gm.transfer(bottle, best.grasp, vase).quality
    True
    """
    if isinstance(source, tuple):
        method = method if target is None else target
        (source, grasp), target = a_point("source", source), grasp
    if not isinstance(method, str) or method not in METHODS:
        raise GraspModuliError(f"method must be one of {', '.join(METHODS)}, got {brief(method)}")
    a_surface("source", source)
    chain = list(target) if isinstance(target, list | tuple) else [target]
    for one in chain:
        a_surface("target", one)
    if not chain:
        raise GraspModuliError("target must be at least one surface, got an empty list")
    n1, n2 = count("surfaces", surfaces, 1, MOST_STEPS), count("steps", steps, 0, MOST_STEPS)
    delta = number("step_length", step_length, positive=True)
    h = None if difference is None else number("difference", difference, positive=True)
    several = isinstance(grasp, list | tuple)
    grasps = [a_grasp("grasp", one) for one in (grasp if several else [grasp])]
    for other in grasps[1:]:
        same_number(grasps[0], other)
    m = len(grasps[0]) if grasps else 3
    hand = fingers(friction, edges, m, torsion, norm)
    if method == "ascent" and m != 3:
        raise GraspModuliError(f'method "ascent" is for grasps of three contacts, got {m}')
    if method == "ascent" and (hand[2] > 0.0 or hand[3]):
        raise GraspModuliError(
            'method "ascent" is for hard fingers whose forces add up, '
            f'got torsion {hand[2]:g} and norm "{NORMS[hand[3]]}"'
        )
    if method == "gradient":
        check_gradient(hand, m)
    region = cells(allowed)
    if region is not None and method != "ascent":
        raise GraspModuliError(f'allowed is for method "ascent", got method {method!r}')
    if region is not None and not region.any():
        raise GraspModuliError("allowed must allow some contact, got no cell that does")
    if not grasps:
        return []
    at = [np.stack([g.u, g.theta], axis=1) for g in grasps]
    paths: list[list[Floats]] = [[] for _ in grasps]
    evaluations = [0] * len(grasps)
    for k, (first, last) in enumerate(zip([source, *chain], chain, strict=False)):
        way = _core.Deformation(first._core, last._core)
        start = np.ascontiguousarray(at)
        if method == "naive":
            arrived = way.naive(start, hand, n1)
        elif method == "gradient":
            arrived = way.by_gradient(start, hand, n1, n2, delta, h)
        else:
            arrived = way.by_ascent(start, hand, region if k == len(chain) - 1 else None)
        at = [grasp_at for grasp_at, _, _ in arrived]
        for i, (_, path, more) in enumerate(arrived):
            # The end of one is the start of the next.
            paths[i].append(path[min(k, 1) :] + np.array([k, 0.0]))
            evaluations[i] += more
    carried_over = [
        _arrived(chain[-1], Grasp(x[:, 0], x[:, 1]), hand, np.concatenate(path), spent)
        for x, path, spent in zip(at, paths, evaluations, strict=True)
    ]
    return carried_over if several else carried_over[0]


def _arrived(target: Surface, grasp: Grasp, hand: Cone, path: Floats, evaluations: int) -> Transfer:
    z = target.center_of_mass
    ranked = ranked_grasp(target, grasp, (float(z[0]), float(z[1]), float(z[2])), hand)
    path[-1, 1] = ranked.quality
    own = {field.name: getattr(ranked, field.name) for field in fields(ranked)}
    return Transfer(
        **own,
        path=locked(path[:, 1].copy()),
        t=locked(path[:, 0].copy()),
        evaluations=evaluations,
    )


@dataclass(frozen=True, eq=False)
class QualityAlong(Value):
    """Q_l along a curve in the Grasp Moduli Space."""

    #: Where it was sampled, from 0 to 1. Shape (k,).
    t: Floats
    #: Q_l there. Shape (k,).
    quality: Floats
    #: Where the lowest value was found, between the samples too.
    worst_t: float
    #: Q_l there.
    worst_quality: float

    @property
    def status(self) -> str:
        """``"lost"`` if Q_l is 0 somewhere that was looked at, else ``"force closure"``."""
        return "force closure" if self.worst_quality > 0.0 else "lost"


#: A curve in the moduli space: points joined by the curves of Eq. (III.1), or a function.
Curve = Sequence[Point] | Callable[[float], Point]


def quality_along(
    start: Point | Curve,
    end: Point | None = None,
    *,
    samples: int = 100,
    friction: ArrayLike = 1.0,
    edges: int = 8,
    torsion: float = 0.0,
    norm: str = "sum",
) -> QualityAlong:
    """Q_l along a curve in the Grasp Moduli Space, and the lowest point that was found.

    Between two points it is the curve of Eq. (III.1): a surface-only deformation if the grasps are
    equal, a grasp-only one if the surfaces are, else a combined one; see
    :func:`graspmoduli.interpolate`.

    Parameters
    ----------
    start, end
        A surface and a grasp on it, each. Or, as ``start`` alone, a list of such points, which are
        joined by these curves in equal shares of t; or a function that takes t in [0, 1] to a
        point.
    samples
        Into how many intervals of equal length the curve is divided (at least; so many that every
        point of a list is a sample). In each in which Q_l falls after one end and rises before the
        other, a lowest point is found to rounding. Dips that are narrower than an interval may be
        missed, and of two dips in one interval the deeper one may be.
    friction, edges
        As in :func:`graspmoduli.quality`; friction positive, a number or one per finger, (m,).
    torsion, norm
        As in :func:`graspmoduli.quality`: soft fingers, and Q'_l in the place of Q_l.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> bottle, vase = gm.shapes.model("bottle"), gm.shapes.model("vase")
    >>> best = gm.synthesize(bottle, top=1)[0].grasp
    >>> hard = gm.quality_along((bottle, best), (vase, best), samples=10)
    >>> soft = gm.quality_along((bottle, best), (vase, best), samples=10, torsion=0.1)
    >>> hard.worst_quality <= soft.worst_quality
    True
    """
    n = count("samples", samples, 1, MOST_STEPS)
    measure = {"torsion": torsion, "norm": norm}
    if callable(start):
        pieces = [_by_function(start, friction, edges, measure)]
    else:
        points = [start, end] if end is not None else start
        if not isinstance(points, list | tuple) or len(points) < 2:
            raise GraspModuliError(
                "start must be a point (surface, grasp) with an end, a list of at least two "
                f"points, or a function of t, got {brief(start)}"
            )
        points = [a_point("start" if k == 0 else "end", p) for k, p in enumerate(points)]
        pieces = [_by_line(*pair, friction, edges, measure) for pair in itertools.pairwise(points)]
    n = -(-n // len(pieces)) * len(pieces)

    def at(t: Floats) -> Floats:
        place = t * len(pieces)
        piece = np.minimum(place.astype(int), len(pieces) - 1)
        values = np.empty(len(t))
        for k in np.unique(piece):
            values[piece == k] = pieces[k](place[piece == k] - k)
        return values

    t = np.arange(n + 1) / n
    values = at(t)
    # To the right of each interval's first end and to the left of its last.
    step = 1e-6 / n
    falls = at(t[:-1] + step) < values[:-1]
    rises = at(t[1:] - step) < values[1:]
    low, high = t[:-1][falls & rises], t[1:][falls & rises]
    found_t, found = [t], [values]
    # Each round leaves two of ten parts of an interval; the last are narrower than rounding.
    for _ in range(24):
        if not low.size:
            break
        inner = low[:, None] + (high - low)[:, None] * np.arange(11) / 10
        inside = at(inner.ravel()).reshape(inner.shape)
        found_t.append(inner.ravel())
        found.append(inside.ravel())
        least = inside.argmin(axis=1)
        rows = np.arange(low.size)
        low = inner[rows, np.maximum(least - 1, 0)]
        high = inner[rows, np.minimum(least + 1, 10)]
    everything = np.concatenate(found)
    worst = int(everything.argmin())
    return QualityAlong(
        locked(t),
        locked(values),
        float(np.concatenate(found_t)[worst]),
        float(everything[worst]),
    )


def _by_function(
    curve: Callable[[float], Point], friction: ArrayLike, edges: int, measure: dict[str, Any]
) -> Callable[[Floats], Floats]:
    """Q_l at many t of a curve that is given as a function."""

    def at(t: Floats) -> Floats:
        placed = [place(*a_point("start(t)", curve(float(x)))) for x in t]
        hand = fingers(friction, edges, len(placed[0].contacts))
        return quality(placed, friction=carried(hand), edges=edges, **measure)

    return at


def _by_line(
    start: Point, end: Point, friction: ArrayLike, edges: int, measure: dict[str, Any]
) -> Callable[[Floats], Floats]:
    """Q_l at many t of the curve of Eq. (III.1)."""
    (first, g), (last, h) = start, end
    turn = shortest_turn(g, h)
    hand = fingers(friction, edges, len(g))
    center = _centers(first, last)
    heights = [np.array([s.bottom, s.top]) for s in (first, last)]

    def at(t: Floats) -> Floats:
        share = t[:, None]
        u = np.clip((1.0 - share) * g.u + share * h.u, 0.0, 1.0)
        theta = g.theta + share * turn
        radii = [s._core.radius(u.ravel(), theta.ravel())[:, :3] for s in (first, last)]
        # f, f_u and f_θ are linear in the surface.
        both = [r.reshape((*u.shape, 3)) for r in radii]
        f, fu, ft = np.moveaxis(
            (1.0 - share)[..., None] * both[0] + share[..., None] * both[1], -1, 0
        )
        low, top = ((1.0 - share) * heights[0] + share * heights[1]).T
        height = (top - low)[:, None]
        c, s = cos(theta), sin(theta)
        contacts = np.stack([f * c, f * s, (1.0 - u) * low[:, None] + u * top[:, None]], axis=-1)
        # t₁ × t₂ / f, in the frame that turns with θ: (−H, H f_θ / f, f_u).
        radial, across = -height, height * ft / f
        normals = np.stack([radial * c - across * s, radial * s + across * c, fu], axis=-1)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        return quality(contacts, normals, center(t), friction=carried(hand), edges=edges, **measure)

    return at


def _centers(first: Surface, last: Surface) -> Any:
    """z of (1 − t) S + t T as a function of t (k,): a polynomial through exact ones."""
    if first is last:
        return lambda t: np.broadcast_to(first.center_of_mass, (len(t), 3))
    extent = max(abs(h) for s in (first, last) for h in (s.bottom, s.top, s.radius(0.5, 0.0)))
    known: dict[float, Floats] = {}

    def exact(t: float) -> Floats:
        if t not in known:
            known[t] = combine([first, last], [1.0 - t, t]).center_of_mass
        return known[t]

    def nodes_of(size: int) -> list[float]:
        """Chebyshev's points with both ends; those of a finer set contain them."""
        return (0.5 - 0.5 * cos(np.pi * np.arange(size) / (size - 1))).tolist()

    size = 9
    while True:
        nodes = nodes_of(size)
        values = np.array([exact(t) for t in nodes])
        signs = np.where(np.arange(size) % 2, -1.0, 1.0)
        signs[[0, -1]] *= 0.5
        at, weights = np.array(nodes), signs

        def center(
            t: Floats, at: Floats = at, weights: Floats = weights, values: Floats = values
        ) -> Floats:
            # Barycentric interpolation.
            apart = t[:, None] - at
            hit = np.abs(apart) < 1e-15
            shares = np.where(
                hit.any(axis=1, keepdims=True), hit, weights / np.where(hit, 1.0, apart)
            )
            # Not by BLAS, whose last bits depend on the processor.
            total = (shares[..., None] * values).sum(axis=1)
            return total / shares.sum(axis=1, keepdims=True)

        if size >= MOST_CENTERS:
            return center
        # Three of the next nodes.
        between = [nodes_of(2 * size - 1)[k] for k in (1, size - 2, 2 * size - 3)]
        error = max(float(np.abs(center(np.array([t]))[0] - exact(t)).max()) for t in between)
        if error <= CENTER_TOLERANCE * extent:
            return center
        size = 2 * size - 1
