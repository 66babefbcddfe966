"""What is proven of grasps nearby: certified radii (derived in docs/mathematics.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import cone
from ._batches import batch
from ._core import GraspModuliError
from .grasps import Grasp, PlacedGrasp, place
from .splines import what
from .surfaces import Surface, a_surface

#: Relative error of d(S, T) in a bound: that which surface_distance has unless told otherwise.
ACCURACY = 1e-6


def certified_radius(placed: PlacedGrasp, *, friction: float = 1.0, edges: int = 8) -> float:
    """A ρ such that every configuration within ρ of this one is force closure, proven.

    "Within" is by the metric d of Sec. III on contacts, normals and centre of mass; the last does
    not matter for force closure, so it may move any distance. The proof is for the polygonal cones
    as they are, wherever R(n) lays their edges out: it goes through the circular cones inscribed
    in them. The largest such ρ is larger.

    Parameters
    ----------
    placed
        The grasp, any number of contacts.
    friction, edges
        As in :func:`graspmoduli.quality`, positive.

    Returns
    -------
    float
        0 if the grasp is not force closure even with the inscribed cones.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> best = gm.synthesize(gm.shapes.model("bottle"), top=1)[0]
    >>> 0.05 < gm.certified_radius(best) < 0.2
    True
    """
    if not isinstance(placed, PlacedGrasp):
        raise GraspModuliError(f"placed must be a PlacedGrasp, got {what(placed)}")
    cone(friction, edges)
    grasp = batch(placed.contacts, placed.normals, placed.center_of_mass, friction, edges, 0.0, 1.0)
    return _core.certified_radius(grasp.arrays, grasp.cone)


@dataclass(frozen=True)
class Certificate:
    """Whether a naïve transfer is proven to keep a grasp force closure."""

    #: The certified radius of the grasp on its own surface.
    radius: float
    #: The largest distance by which a contact or normal moves.
    distance: float

    @property
    def certified(self) -> bool:
        """Force closure on the target is proven."""
        return self.distance <= self.radius


def certify_transfer(
    source: Surface, grasp: Grasp, target: Surface, *, friction: float = 1.0, edges: int = 8
) -> Certificate:
    """Is the naïve transfer of a grasp proven to be force closure? (Sec. III, Lemma III.5)

    By the lemma no contact and no normal moves further than d(S, T). How far those of this grasp
    move is computed, which is less, and compared with its certified radius. A grasp that is not
    certified may hold all the same.

    Parameters
    ----------
    source, grasp, target
        The surface S, a grasp on it, the surface T.
    friction, edges
        As in :func:`graspmoduli.quality`, positive.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> bottle = gm.shapes.model("bottle")
    >>> best = gm.synthesize(bottle, top=1)[0]
    >>> gm.certify_transfer(bottle, best.grasp, 1.05 * bottle).certified
    True
    """
    if not isinstance(grasp, Grasp):
        raise GraspModuliError(f"grasp must be a Grasp, got {what(grasp)}")
    p = place(a_surface("source", source), grasp)
    q = place(a_surface("target", target), grasp)
    moved = [
        np.linalg.norm(p.contacts - q.contacts, axis=1).max(),
        np.linalg.norm(p.normals - q.normals, axis=1).max(),
    ]
    radius = certified_radius(p, friction=friction, edges=edges)
    return Certificate(radius, float(max(moved)))


def transfer_bound(source: Surface, target: Surface) -> float:
    """No grasp moves further than this by the naïve transfer (Lemma III.5): d(g, g') ≤ bound.

    The paper's bound is d(S, T). That is the distance of points and normals, while d(g, g') counts
    the centre of mass too, which can move further (docs/mathematics.md has surfaces with which it
    does). The bound here is the larger of d(S, T), with its error, and ‖z_S − z_T‖, z as in
    :attr:`Surface.center_of_mass`.

    Examples
    --------
    >>> import graspmoduli as gm
    >>> bottle = gm.shapes.model("bottle")
    >>> gm.transfer_bound(bottle, 1.01 * bottle) < 0.02
    True
    """
    start, end = a_surface("source", source), a_surface("target", target)
    return _core.transfer_bound(start._core, end._core, ACCURACY)
