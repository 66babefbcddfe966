"""The best grasps of a mesh: fingertips pressed on it, within constraints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import Floats, NoGraspLeftError, cores
from .._batches import Cone
from ..constraints import Constraints
from ..synthesis import APART
from ..tasks import scaled_task
from .touching import BEARING, NORMAL, POINT, SAMPLES, ContactCheck, TriangleMesh, places

#: Samples of a mesh if only a part of it is to be grasped, or few places are allowed; and if even
#: then there are fewer than FEW.
OF_A_PART, OF_A_SPOT, FEW = 4_000, 20_000, 200


class Pressed(NamedTuple):
    """A grasp found on a mesh, in the object's own coordinates, and what the mesh says of it."""

    contacts: Floats
    normals: Floats
    checks: tuple[ContactCheck, ...]
    #: Q_l with the normals of the triangles where the contacts are.
    exact_quality: float
    #: Share of errors of aim under which the grasp is force closure.
    held: float
    #: Q_l that nine of ten of these reach.
    low_quality: float


class Search(NamedTuple):
    """What grasps are looked for."""

    hand: Cone
    #: Centre of mass and length scale, in the object's unit.
    center_of_mass: Floats
    length_scale: float
    contacts: int
    top: int
    #: Errors of aim, in the object's unit.
    errors: float
    #: Where fingers may go.
    constraints: Constraints = Constraints()
    #: Loads that grasps are for, (k, 6) with torques in the object's unit; None if for all.
    task: Floats | None = None
    #: Do grasps climb on the mesh itself, or only from place to place?
    polished: bool = True


def search(
    mesh: TriangleMesh,
    radius: float,
    seed: int,
    wanted: Search,
    within: Callable[[Floats], NDArray[np.bool_]] | None = None,
) -> list[Pressed]:
    """Different grasps of the mesh, true ones by exact normals, by balls and under bad aim.

    Fingers start where ``within`` is true of their contacts, if it is given.
    """
    rows = _allowed_places(mesh, radius, seed, wanted, within)
    if len(rows) < wanted.contacts:
        if wanted.constraints.given:
            raise _nothing_left(mesh, radius, seed, wanted)
        return []
    _check_pairs(mesh, radius, rows, wanted)
    found = mesh.core.grasps(radius, rows, _request(mesh, radius, wanted), cores())
    return [_pressed(mesh, one) for one in found]


def _allowed_places(
    mesh: TriangleMesh,
    radius: float,
    seed: int,
    wanted: Search,
    within: Callable[[Floats], NDArray[np.bool_]] | None,
) -> Floats:
    """Places where single fingers may press: more samples where few are."""
    limits = wanted.constraints.limits(radius * mesh.size)
    rows = np.zeros((0, BEARING + 2))
    for samples in (SAMPLES, OF_A_PART, OF_A_SPOT):
        rows = places(mesh, radius, seed, samples)
        total = len(rows)
        points = mesh.back(rows[:, POINT])
        allowed = wanted.constraints.places(points, rows[:, NORMAL], limits)
        if within is not None:
            allowed &= within(points)
        rows = rows[allowed]
        # Evenly all over the object: samples come in the order of its triangles.
        some = np.arange(min(len(rows), SAMPLES)) * len(rows) // max(1, min(len(rows), SAMPLES))
        rows = np.ascontiguousarray(rows[some])
        if 2 * len(rows) >= total or len(rows) >= (SAMPLES if samples == SAMPLES else FEW):
            break
    return rows


def _nothing_left(mesh: TriangleMesh, radius: float, seed: int, wanted: Search) -> NoGraspLeftError:
    """Which constraints leave how many of the places where single fingers may press."""
    constraints = wanted.constraints
    rows = places(mesh, radius, seed)
    points, ways = mesh.back(rows[:, POINT]), rows[:, NORMAL]
    left = {}
    for name in constraints.given:
        alone = constraints.only(name)
        allowed = alone.places(points, ways, alone.limits(radius * mesh.size))
        left[name] = int(allowed.sum())
    counts = ", ".join(
        f"{name} {count}"
        for name, count in sorted(left.items(), key=lambda item: item[1])
        if count < len(rows)
    )
    return NoGraspLeftError(
        f"constraints must leave places for {wanted.contacts} fingers on the object, got too few: "
        f"of {len(rows)} where a tip may press {counts or 'none'} by itself"
    )


def _check_pairs(mesh: TriangleMesh, radius: float, rows: Floats, wanted: Search) -> None:
    """An error if no two places are as far from each other as fingers must be."""
    constraints = wanted.constraints
    if wanted.contacts < 2 or (constraints.opening is None and constraints.gap is None):
        return
    points, ways = np.ascontiguousarray(mesh.back(rows[:, POINT])), rows[:, NORMAL].copy()
    for name in ("opening", "gap"):
        alone = constraints.only(name)
        if not _core.pairs_allowed(alone.limits(radius * mesh.size), points, ways).any():
            away = points[:, None] - points
            distances = np.sqrt((away * away).sum(axis=2))[~np.eye(len(points), dtype=np.bool_)]
            raise NoGraspLeftError(
                f"{name} must leave two places for fingers on the object, got "
                f"{getattr(constraints, name)} where places are {distances.min():.4g} to "
                f"{distances.max():.4g} from each other"
            )


def press(
    mesh: TriangleMesh, radius: float, contacts: Floats, normals: Floats, wanted: Search
) -> Pressed | None:
    """A grasp pressed on the mesh near given contacts and climbed there; None if it is lost."""
    ways = np.ascontiguousarray(normals)
    aims = mesh.local(contacts)
    near = mesh.core.nearest(aims)
    rows = mesh.core.settle(radius, near, ways)
    if np.isnan(rows).any():
        return None
    found = mesh.core.climb(radius, rows, _request(mesh, radius, wanted))
    return None if found is None else _pressed(mesh, found)


def _request(mesh: TriangleMesh, radius: float, wanted: Search) -> Any:
    x, y, z = mesh.local(wanted.center_of_mass).tolist()
    mu, edges, torsion, each = wanted.hand
    return (
        # Torsion is a length: the kernels divide lengths by the length scale.
        (mu, edges, torsion / wanted.length_scale, each),
        (x, y, z),
        mesh.size / wanted.length_scale,
        wanted.contacts,
        wanted.top,
        APART * wanted.length_scale / mesh.size,
        wanted.errors / mesh.size,
        wanted.polished,
        wanted.constraints.limits(radius * mesh.size, mesh.middle, mesh.size),
        scaled_task(wanted.task, wanted.length_scale),
    )


def _pressed(mesh: TriangleMesh, found: tuple[Floats, list[float], Floats]) -> Pressed:
    rows, (_, exact, _, held, low), contacts = found
    checks = tuple(
        ContactCheck(
            distance=float(distance * mesh.size),
            angle=float(np.arccos(min(1.0, cosine))),
            seen=True,
            clearance=float(clearance * mesh.size),
            bearing=float(bearing),
        )
        for (distance, cosine, clearance), bearing in zip(contacts, rows[:, BEARING], strict=True)
    )
    normals = np.ascontiguousarray(rows[:, NORMAL])
    return Pressed(mesh.back(rows[:, POINT]), normals, checks, exact, held, low)
