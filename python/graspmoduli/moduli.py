"""The Grasp Moduli Space: pairs of a surface and a grasp on it (Sec. III)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, count, floats, number
from ._core import GraspModuliError
from .grasps import Grasp, PlacedGrasp
from .surfaces import Surface, combine

#: A point of the Grasp Moduli Space: a surface and a grasp on it.
Point = tuple[Surface, Grasp]


def sample_weights(surfaces: int, n: int, seed: int = 0, concentration: ArrayLike = 1.0) -> Floats:
    """Barycentric coordinates from a Dirichlet distribution, to combine surfaces with.

    Parameters
    ----------
    surfaces
        How many surfaces.
    n
        How many combinations.
    seed
        The same seed gives the same bits.
    concentration
        Positive parameter of the distribution, one for all or one per surface: 1 is uniform on the
        simplex, less prefers its corners, more its middle.

    Returns
    -------
    array of shape (n, surfaces)
        Rows are not negative and sum to 1.
    """
    k = count("surfaces", surfaces, 1)
    alpha = floats("concentration", concentration)
    if alpha.shape not in ((), (k,)):
        raise GraspModuliError(
            f"concentration must be a number or have shape ({k},), got {alpha.shape}"
        )
    if (alpha <= 0.0).any():
        raise GraspModuliError(f"concentration must be positive, got {alpha.min()}")
    generator = np.random.Generator(np.random.Philox(count("seed", seed, 0)))
    return generator.dirichlet(np.broadcast_to(alpha, (k,)), count("n", n, 1))


def sample_combinations(
    surfaces: Sequence[Surface], n: int, seed: int = 0, *, concentration: ArrayLike = 1.0
) -> list[Surface]:
    """Random surfaces of Conv(X), X the given ones (Sec. III), by :func:`sample_weights`."""
    return [
        combine(surfaces, weights)
        for weights in sample_weights(len(surfaces), n, seed, concentration)
    ]


def interpolate(start: Point, end: Point, t: float) -> Point:
    """The point at t on the curve of Eq. (III.1) between two points of the Grasp Moduli Space.

    Surface and heights go straight, angles along the shorter arc; exactly opposite ones straight
    from θ to θ' in [0, 2π), as in the paper. ``t`` lies in [0, 1].
    """
    (first, g), (last, h) = start, end
    share = number("t", t)
    if not 0.0 <= share <= 1.0:
        raise GraspModuliError(f"t must lie in [0, 1], got {share}")
    turn = shortest_turn(g, h)
    u = np.clip((1.0 - share) * g.u + share * h.u, 0.0, 1.0)
    surface = combine([first, last], [1.0 - share, share])
    return surface, Grasp(u, g.theta + share * turn)


def shortest_turn(g: Grasp, h: Grasp) -> Floats:
    """From the angles of one grasp to those of another, in [−π, π]. Shape (m,)."""
    same_number(g, h)
    turn = h.theta - g.theta
    turn = np.where(turn > np.pi, turn - 2 * np.pi, turn)
    return np.where(turn < -np.pi, turn + 2 * np.pi, turn)


def placed_distance(p: PlacedGrasp, q: PlacedGrasp) -> float:
    """d(g, g') of Sec. III: the largest distance between corresponding contacts, normals and
    centres of mass."""
    same_number(p, q)
    return max(
        float(np.linalg.norm(p.contacts - q.contacts, axis=1).max()),
        float(np.linalg.norm(p.normals - q.normals, axis=1).max()),
        float(np.linalg.norm(p.center_of_mass - q.center_of_mass)),
    )


class SurfaceDistance(float):
    """d(S, S'), a number with a proven error bound.

    It is attained at (``u``, ``theta``), and the supremum is at most ``error`` larger.
    """

    error: float
    u: float
    theta: float

    def __new__(cls, value: float, error: float, u: float, theta: float) -> SurfaceDistance:
        """As :func:`surface_distance` makes it."""
        self = super().__new__(cls, value)
        self.error, self.u, self.theta = error, u, theta
        return self


def surface_distance(
    first: Surface, second: Surface, *, tolerance: float = 1e-6
) -> SurfaceDistance:
    """d(S, S') of Sec. III: the supremum of max(‖c_S − c_S'‖, ‖n_S − n_S'‖) over (u, θ).

    By branch and bound, so the error is proven, not estimated. ``tolerance``, from 1e-9 to 1, is
    the relative error wanted; look at ``error`` where surfaces are as hard to tell apart as no
    million cells can.
    """
    wanted = number("tolerance", tolerance)
    if not 1e-9 <= wanted <= 1.0:
        raise GraspModuliError(f"tolerance must lie in [1e-9, 1], got {wanted}")
    value, error, (u, theta) = _core.surface_distance(first._core, second._core, wanted)
    return SurfaceDistance(value, error, u, theta)


#: How far two angles are apart: in the plane of the unit circle, or along it.
ANGLES = ("chord", "arc")


def distance(start: Point, end: Point, *, angles: str = "chord") -> float:
    """The metric of the Grasp Moduli Space: d(S, S') + Σ |u_i − u'_i| + Σ d(θ_i, θ'_i) (Sec. III).

    ``angles`` are measured by their ``"chord"``, as in the paper, or by their ``"arc"``.
    """
    if angles not in ANGLES:
        raise GraspModuliError(f'angles must be "chord" or "arc", got {angles!r}')
    (first, g), (last, h) = start, end
    arc = np.abs(shortest_turn(g, h))
    apart = arc if angles == "arc" else 2.0 * np.sin(0.5 * arc)
    heights = np.abs(g.u - h.u)
    return float(surface_distance(first, last) + heights.sum() + apart.sum())


def same_number(first: Any, second: Any) -> None:
    """Refuses grasps of different numbers of contacts."""
    sizes = [len(g.contacts) if isinstance(g, PlacedGrasp) else len(g) for g in (first, second)]
    if sizes[0] != sizes[1]:
        raise GraspModuliError(
            f"grasps must have the same number of contacts, got {sizes[0]} and {sizes[1]}"
        )
