"""How a grasp in hand gets better: climbed, with fingers elsewhere, or found anew."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .._batches import fingers as cone_of
from .._core import GraspModuliError
from ..grasps import Grasp
from ..objects.mesh_grasps import Search, press
from ..transfers import transfer
from .held import EDGE, Contact, Hand, Held, Touch

if TYPE_CHECKING:
    from typing import TypeGuard

#: Places of each of two fingers that are moved at once.
PAIRS = 70
#: Gains of less than this share are none.
GAIN = 1e-4


def improved(touch: Touch, held: Held, hand: Hand) -> tuple[Held | None, str]:
    """A better grasp, true on the object, and what was done; or None and why there is none.

    Climbed where it is; else the one finger that gains most elsewhere; from Q = 0 also two
    fingers at once, and at last a grasp found anew.
    """
    before = touch.worth(held, hand)
    better = _climbed(touch, held, hand)
    if _is_better(better, touch, before, hand):
        return better, _said(touch, "climbed", before, better, hand)
    moves = [("moved one finger", _one_moved), ("moved two fingers", _two_moved)]
    for done, move in moves if before == 0.0 else moves[:1]:
        moved = move(touch, held, hand)
        for better in (_climbed(touch, moved, hand), moved):
            if _is_better(better, touch, before, hand):
                return better, _said(touch, done, before, better, hand)
    if before > 0.0 and not touch.untrue(held, hand):
        return None, "no finger, moved alone, makes this grasp better"
    anew = _anew(touch, held, hand)
    if _is_better(anew, touch, before, hand):
        return anew, _said(touch, "found a grasp anew", before, anew, hand)
    if before > 0.0:
        return None, "no grasp that is true on the object has a higher Q near here"
    return None, (
        f"no grasp of this object by {len(held.fingers)} such fingers is force closure with "
        f"μ = {hand.friction:g}: raise the friction"
    )


def _is_better(held: Held | None, touch: Touch, before: float, hand: Hand) -> TypeGuard[Held]:
    if held is None or touch.worth(held, hand) <= before * (1.0 + GAIN):
        return False
    return not touch.untrue(held, hand)


def _said(touch: Touch, done: str, before: float, held: Held, hand: Hand) -> str:
    return f"{done}: Q from {before:.4f} to {touch.worth(held, hand):.4f}"


def _climbed(touch: Touch, held: Held | None, hand: Hand) -> Held | None:
    """Climbed on the mesh, or on the fitted surface and pressed on the points."""
    if held is None:
        return None
    count = len(held.fingers)
    if touch.fit.mesh is not None:
        cone = cone_of(hand.friction, hand.edges, count, hand.torsion, hand.norm)
        errors = 0.5 * touch.radius
        wanted = Search(cone, touch.center, touch.scale, count, 1, errors)
        found = press(touch.fit.mesh, touch.share, held.contacts, held.normals, wanted)
        if found is None:
            return None
        fingers = map(touch.judge, found.contacts, found.normals)
        return Held(tuple(fingers), None, found.held, found.low_quality)
    local = (held.contacts - touch.fit.pose[:3, 3]) @ touch.fit.pose[:3, :3]
    start = Grasp(*touch.fit.surface.coordinates(local)[:2])
    unit = touch.fit.unit_surface
    moved = transfer(
        unit, start, unit, "ascent",
        friction=hand.friction, edges=hand.edges, allowed=touch.fit.allowed,
    )  # fmt: skip
    fingers = [
        touch.put(*touch.on_surface(u, theta))
        for u, theta in zip(moved.grasp.u.tolist(), moved.grasp.theta.tolist(), strict=True)
    ]
    return Held(tuple(fingers))


def _at(touch: Touch, place: int) -> Contact:
    return touch.put(touch.places.contacts[place], touch.places.normals[place])


def _good(touch: Touch) -> Any:
    """Places that a grasp can be true at, a third of all: what is found is climbed from."""
    some = np.arange(len(touch.places.contacts))
    return some[touch.places.flatness >= 1.0 - EDGE][::3]


def _one_moved(touch: Touch, held: Held, hand: Hand) -> Held | None:
    """The one finger elsewhere that gains most; first those that do not touch as they are."""
    good = _good(touch)
    bad = [k - 1 for k, _ in held.whys]
    best, chosen = 0.0, None
    for index in bad if len(bad) == 1 else range(len(held.fingers)):
        values = touch.what_if(held, index, hand, good)
        if len(good) and values.max() > best:
            best, chosen = float(values.max()), (index, int(good[values.argmax()]))
    return None if chosen is None else held.with_finger(chosen[0], _at(touch, chosen[1]))


def _two_moved(touch: Touch, held: Held, hand: Hand) -> Held | None:
    """Two fingers at other places, the same ones every time."""
    good = _good(touch)
    some = good[:: max(1, len(good) // PAIRS)]
    one, two = (grid.ravel() for grid in np.meshgrid(some, some, indexing="ij"))
    best, chosen = 0.0, None
    for i in range(len(held.fingers)):
        for k in range(i):
            contacts = np.repeat(held.contacts[None], len(one), axis=0)
            normals = np.repeat(held.normals[None], len(one), axis=0)
            for index, at in ((i, one), (k, two)):
                contacts[:, index] = touch.places.contacts[at]
                normals[:, index] = touch.places.normals[at]
            values = np.asarray(touch.quality(contacts, normals, hand))
            if len(values) and values.max() > best:
                at = int(values.argmax())
                best, chosen = float(values[at]), (i, k, int(one[at]), int(two[at]))
        # All pairs of many fingers would take too long.
        if best > 0.0:
            break
    if chosen is None:
        return None
    i, k, first, second = chosen
    return held.with_finger(i, _at(touch, first)).with_finger(k, _at(touch, second))


def _anew(touch: Touch, held: Held, hand: Hand) -> Held | None:
    try:
        found = touch.fit.synthesize(
            contacts=len(held.fingers), top=1, friction=hand.friction, edges=hand.edges,
            torsion=hand.torsion, norm=hand.norm, center_of_mass=touch.center,
            tip_radius=touch.radius,
        )  # fmt: skip
    except GraspModuliError:
        return None
    return replace(touch.held(found[0]), offered=None) if found else None
