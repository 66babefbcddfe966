"""Carrying grasps from one surface to another, and their quality on the way (Sec. III, IV.D)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, cells, cone, count, locked, number
from ._core import GraspModuliError
from .grasps import Grasp
from .moduli import Point, same_number, shortest_turn
from .quality import quality
from .surfaces import Surface, combine

#: How a grasp can be carried to another surface.
METHODS = ("naive", "gradient", "ascent")
#: Centres of mass along a curve are interpolated in t to this, relative to the surfaces' extent.
CENTER_TOLERANCE = 1e-9
#: On how many surfaces they are computed at most.
MOST_CENTERS = 129


@dataclass(frozen=True, eq=False)
class Transfer:
    """A grasp carried to another surface."""

    #: On the target.
    grasp: Grasp
    #: Its Q_l there.
    quality: float
    #: Q_l on the way; the last is ``quality``. Shape (k,).
    path: Floats
    #: Where on the way: the surfaces were (1 − t) S + t T. Shape (k,).
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


def transfer(
    source: Surface,
    grasp: Grasp | Sequence[Grasp],
    target: Surface,
    method: str = "naive",
    *,
    friction: float = 1.0,
    edges: int = 8,
    surfaces: int = 100,
    steps: int = 20,
    step_length: float = 1e-3,
    difference: float | None = None,
    allowed: ArrayLike | None = None,
) -> Any:
    """Carries a grasp from one surface to another along (1 − t) S + t T (Def. III.4, Sec. IV.D).

    Parameters
    ----------
    source, grasp, target
        The surface S, a grasp on it or several with the same number of contacts, the surface T.
    method
        ``"naive"``: the coordinates stay. ``"gradient"``: the paper's, on each of N₁ surfaces N₂
        steps x + δ∇Q, u kept in [0, 1]. ``"ascent"``: ours, for three contacts: on surfaces as near
        to each other as keeps the grasp good, an ascent by all facets of the wrench hull near the
        origin, then one to a local maximum on T; in few steps, in many and at once, and the best
        of these.
    friction, edges
        As in :func:`graspmoduli.quality`, positive.
    surfaces
        N₁; for the naïve transfer, how finely its quality is sampled.
    steps, step_length
        N₂ and δ of the gradient method.
    difference
        h of forward differences for the gradient method, as in the paper (1e-5); exact derivatives
        if not given.
    allowed
        For the ascent, where contacts may lie on the target: booleans over a grid of cells, rows
        along u and columns along θ. Everywhere if not given.

    Returns
    -------
    Transfer, or a list of them for several grasps
        Centres of mass on the way are by Simpson's rule on a grid of 20 by 20, as in Sec. IV.E;
        exact on S and T.
    """
    if method not in METHODS:
        raise GraspModuliError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
    mu, l = cone(friction, edges)
    n1, n2 = count("surfaces", surfaces, 1), count("steps", steps, 0)
    delta = number("step_length", step_length, positive=True)
    h = None if difference is None else number("difference", difference, positive=True)
    grasps = [grasp] if isinstance(grasp, Grasp) else list(grasp)
    for other in grasps[1:]:
        same_number(grasps[0], other)
    if not grasps:
        return []
    if method == "ascent" and len(grasps[0]) != 3:
        raise GraspModuliError(
            f'method "ascent" is for grasps of three contacts, got {len(grasps[0])}'
        )
    region = cells(allowed)
    if region is not None and method != "ascent":
        raise GraspModuliError(f'allowed is for method "ascent", got method {method!r}')
    start = np.ascontiguousarray([np.stack([g.u, g.theta], axis=1) for g in grasps])
    way = _core.Deformation(source._core, target._core)
    if method == "naive":
        carried = way.naive(start, mu, l, n1)
    elif method == "gradient":
        carried = way.by_gradient(start, mu, l, n1, n2, delta, h)
    else:
        carried = way.by_ascent(start, mu, l, region)
    results = [
        Transfer(
            Grasp(at[:, 0], at[:, 1]),
            float(path[-1, 1]),
            locked(path[:, 1].copy()),
            locked(path[:, 0].copy()),
            evaluations,
        )
        for at, path, evaluations in carried
    ]
    return results[0] if isinstance(grasp, Grasp) else results


@dataclass(frozen=True, eq=False)
class QualityAlong:
    """Q_l along a curve in the Grasp Moduli Space."""

    #: Where it was sampled, from 0 to 1. Shape (k,).
    t: Floats
    #: Q_l there. Shape (k,).
    quality: Floats
    #: Where it is lowest, between the samples too.
    worst_t: float
    #: Q_l there.
    worst_quality: float

    @property
    def status(self) -> str:
        """``"force closure"`` if the grasp holds all along the curve, else ``"lost"``."""
        return "force closure" if self.worst_quality > 0.0 else "lost"


def quality_along(
    start: Point, end: Point, *, samples: int = 100, friction: float = 1.0, edges: int = 8
) -> QualityAlong:
    """Q_l along the curve of Eq. (III.1), and its lowest point.

    A surface-only deformation if the grasps are equal, a grasp-only one if the surfaces are, else a
    combined one: see :func:`graspmoduli.interpolate`.

    Parameters
    ----------
    start, end
        A surface and a grasp on it, each.
    samples
        Into how many intervals of equal length the curve is divided. In each in which Q_l falls
        after one end and rises before the other, its lowest point is found to rounding; two such
        dips in one interval may be taken for one.
    friction, edges
        As in :func:`graspmoduli.quality`, positive.
    """
    mu, l = cone(friction, edges)
    n = count("samples", samples, 1)
    (first, g), (last, h) = start, end
    turn = shortest_turn(g, h)
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
        c, s = np.cos(theta), np.sin(theta)
        contacts = np.stack([f * c, f * s, (1.0 - u) * low[:, None] + u * top[:, None]], axis=-1)
        # t₁ × t₂ / f, in the frame that turns with θ: (−H, H f_θ / f, f_u).
        radial, across = -height, height * ft / f
        normals = np.stack([radial * c - across * s, radial * s + across * c, fu], axis=-1)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        return quality(contacts, normals, center(t), friction=mu, edges=l)

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
        return [0.5 - 0.5 * float(np.cos(np.pi * k / (size - 1))) for k in range(size)]

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
            return (shares @ values) / shares.sum(axis=1, keepdims=True)

        if size >= MOST_CENTERS:
            return center
        # Three of the next nodes.
        between = [nodes_of(2 * size - 1)[k] for k in (1, size - 2, 2 * size - 3)]
        error = max(float(np.abs(center(np.array([t]))[0] - exact(t)).max()) for t in between)
        if error <= CENTER_TOLERANCE * extent:
            return center
        size = 2 * size - 1
