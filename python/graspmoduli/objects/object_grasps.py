"""Grasps in the coordinates of a real object, and what ranks them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from .._arrays import Floats
from ..grasps import Grasp, PlacedGrasp
from ..quality import circular_quality
from ..surfaces import Surface
from ..tasks import task_quality
from .touching import ContactCheck

#: Half of the friction stands for what a scan does not tell; what is left then counts, and so does
#: this share of the quality, and half as much again for each contact that was seen.
LEFT, QUALITY, SEEN = 0.5, 0.1, 0.5
#: A grasp that this share of errors of aim leave in force closure comes first before others of up
#: to twice its quality; as in the kernels, which do not know the bounds for round cones.
SURE, HALF = 0.99, 0.5


@dataclass(frozen=True, eq=False)
class ObjectGrasp(PlacedGrasp):
    """A grasp in the coordinates of a real object.

    Contacts, normals and centre of mass are in the object's coordinates and unit, and the quality
    is that of torques divided by ``length_scale``. ``gm.quality(best)`` is ``best.quality``, and
    ``best.wrench_space()`` tells which forces hold against which disturbances.

    On a mesh, contacts are where a fingertip touches it, and normals what the tip feels.
    """

    #: Contact coordinates on the fitted surface; None if a contact is farther from it than 2 % of
    #: the object's size, so that the grasp has no place in G^cyl.
    grasp: Grasp | None
    #: The fitted surface, in its own coordinates.
    surface: Surface = field(repr=False)
    #: Q_l.
    quality: float
    #: Friction coefficient, or one per contact.
    friction: float | tuple[float, ...]
    #: Edges of the friction cones.
    edges: int
    #: Torques are divided by it for the quality.
    length_scale: float
    #: Torsional friction coefficient, a length.
    torsion: float = 0.0
    #: What a unit of strength means: ``"sum"`` or ``"each"``, as in :func:`graspmoduli.quality`.
    norm: str = "sum"
    #: Proven lower and upper bound of the quality with round friction cones, which does not depend
    #: on the axes of the file.
    round_quality: tuple[float, float] | None = None
    #: Coordinates of each contact on the fitted surface, NaN where it is not on it. Shape (m, 2).
    coordinates: Floats | None = field(default=None, repr=False)
    #: What the mesh or the points of a scan say of each contact.
    checks: tuple[ContactCheck, ...] | None = field(default=None, repr=False)
    #: Q_l with the normals of the mesh's own triangles where the contacts are.
    exact_quality: float | None = None
    #: Share of combinations of errors of aim under which the grasp is force closure; of half a tip
    #: radius, or what was asked for.
    held: float | None = None
    #: Q_l that nine of ten of these errors leave.
    low_quality: float | None = None
    #: How much of the task it can do that it was looked for: :func:`graspmoduli.task_quality`.
    task_quality: float | None = None


def by_round_cones(grasp: ObjectGrasp) -> float:
    """What ranks a grasp: what is proven for round cones."""
    return grasp.quality if grasp.round_quality is None else grasp.round_quality[0]


def by_errors(grasp: ObjectGrasp) -> float:
    """What ranks a grasp under errors of aim."""
    return 0.0 if grasp.low_quality is None else grasp.low_quality


def by_task(grasp: ObjectGrasp) -> float:
    """What ranks a grasp for a task."""
    return 0.0 if grasp.task_quality is None else grasp.task_quality


def for_task(grasps: list[ObjectGrasp], loads: Floats | None) -> list[ObjectGrasp]:
    """Grasps that know how much of a task they can do."""
    if loads is None:
        return grasps
    return [replace(one, task_quality=task_quality(one, task=loads)) for one in grasps]


def surest_first(
    ranked: list[ObjectGrasp], key: Callable[[ObjectGrasp], float]
) -> list[ObjectGrasp]:
    """Without those before the first that bad aim does not lose, if there is any that is half as
    good as the best."""
    for number, grasp in enumerate(ranked):
        if key(grasp) < HALF * key(ranked[0]):
            break
        if grasp.held is not None and grasp.held >= SURE:
            return ranked[number:]
    return ranked


def by_evidence(flat: ObjectGrasp, pressed: ObjectGrasp) -> float:
    """What ranks a grasp of a scan, given on the fitted surface and on the points."""
    left = min(
        circular_quality(
            one,
            friction=LEFT * np.asarray(one.friction),
            norm=one.norm,
            length_scale=one.length_scale,
        ).lower
        for one in (flat, pressed)
    )
    seen = sum(check.seen for check in pressed.checks or ())
    return (left + QUALITY * by_round_cones(pressed)) * (1.0 + SEEN * seen)
