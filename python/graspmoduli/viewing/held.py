"""A grasp in hand: where fingertips land that are moved, what the object says of them, and how the
grasp gets better. Nothing here draws.

All is in the object's own coordinates and unit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .._arrays import Floats, locked
from .._batches import batch
from .._batches import fingers as cone_of
from ..grasps import Grasp
from ..objects.fitting import Fit, ObjectGrasp
from ..objects.touching import TIP, ContactCheck, tip
from ..objects.touching import places as places_of
from ..quality import quality
from ..sampling import sample_points
from .pointing import under_pointer

#: Places on the object at which it is asked what a finger would be worth there.
PLACES = 4_000
#: If more than this share of what lies under a pad is turned from what it feels, it is on an edge.
EDGE = 0.6
#: A contact farther than this from the object, over its size, is off it.
OFF = 5e-3
#: With the triangles' own normals this share of the quality must be left, as for grasps on offer.
LEFT = 0.1
NAN = float("nan")


class Hand(NamedTuple):
    """What the quality is computed with; see :func:`graspmoduli.quality`."""

    friction: float = 1.0
    edges: int = 8
    torsion: float = 0.0
    norm: str = "sum"


class Contact(NamedTuple):
    """A fingertip on the object."""

    point: Floats
    #: What the tip feels, into the object.
    normal: Floats
    #: That of the triangle, or of the fitted surface, at the point.
    exact: Floats
    check: ContactCheck
    #: Why no finger touches like this; empty if one does.
    why: str = ""


@dataclass(frozen=True, eq=False)
class Held:
    """A grasp as it is shown."""

    fingers: tuple[Contact, ...]
    #: What it was before it was changed: one of the grasps on offer.
    offered: ObjectGrasp | None = None
    #: Share of errors of aim that leave force closure, and the quality that nine of ten leave,
    #: where they were tried.
    held: float | None = None
    low_quality: float | None = None

    @property
    def contacts(self) -> Floats:
        """Shape (m, 3)."""
        return np.stack([finger.point for finger in self.fingers])

    @property
    def normals(self) -> Floats:
        """Shape (m, 3)."""
        return np.stack([finger.normal for finger in self.fingers])

    @property
    def exact(self) -> Floats:
        """Shape (m, 3)."""
        return np.stack([finger.exact for finger in self.fingers])

    @property
    def whys(self) -> list[tuple[int, str]]:
        """Fingers, counted from 1, that do not touch as they are drawn, and why."""
        return [(k, finger.why) for k, finger in enumerate(self.fingers, 1) if finger.why]

    @property
    def unseen(self) -> list[int]:
        """Fingers, counted from 1, on what was not seen."""
        return [k for k, finger in enumerate(self.fingers, 1) if not finger.check.seen]

    def with_finger(self, index: int, contact: Contact) -> Held:
        """With one finger elsewhere."""
        fingers = [*self.fingers]
        fingers[index] = contact
        return Held(tuple(fingers))


class Places(NamedTuple):
    """Where fingers may press on an object. Shapes (n, 3), (n, 3), (n,), (n,)."""

    contacts: Floats
    normals: Floats
    #: Share of the pad that bears; of a cloud 1 where a finger must meet what was seen, else 0.
    bearing: Floats
    #: Share of what lies under the pad that is turned as it feels. Shape (n,).
    flatness: Floats


class Touch:
    """An object that fingertips are put on.

    Parameters
    ----------
    fit
        The object.
    tip_radius
        In its unit; 5 % of its size if not given.
    center_of_mass
        The object's own if not given.
    """

    def __init__(
        self, fit: Fit, tip_radius: float | None = None, center_of_mass: Floats | None = None
    ) -> None:
        self.fit, self.size, self.scale = fit, fit.residual.size, fit.length_scale
        share = TIP if tip_radius is None else tip_radius / self.size
        self.share = share if fit.mesh is None else tip(fit.mesh, tip_radius)
        self.radius = self.share * self.size
        self.center = fit.center_of_mass if center_of_mass is None else center_of_mass

    # Contacts -----------------------------------------------------------------------------------

    def under(self, eye: Floats, through: Floats) -> tuple[Floats, Floats]:
        """Where the ray from an eye through a point meets the object, or comes nearest, and the
        normal into the object there."""
        if self.fit.mesh is None:
            return self.on_surface(*under_pointer(*self._unit(eye, through)))
        mesh = self.fit.mesh
        start, ray = mesh.local(eye), mesh.local(through) - mesh.local(eye)
        ray = ray / np.linalg.norm(ray)
        hit = mesh.core.rays(start[None], ray[None])[0]
        if math.isnan(hit[0]):
            along = start + np.linspace(0.0, float(np.linalg.norm(start)) + 1.0, 600)[:, None] * ray
            near = mesh.core.nearest(along)
            closest = int(((near - along) ** 2).sum(axis=1).argmin())
            # From the ray to the nearest point: a finger comes that way.
            start, ray = along[closest], near[closest] - along[closest]
            length = float(np.linalg.norm(ray))
            ray = ray / max(length, 1e-12)
            hit = mesh.core.rays(start[None], ray[None])[0]
            if math.isnan(hit[0]):
                return mesh.back(near[closest]), ray
        normal = hit[1:] if hit[1:] @ ray > 0.0 else -hit[1:]
        return mesh.back(start + hit[0] * ray), normal

    def put(self, aim: Floats, way: Floats) -> Contact:
        """A fingertip put on the object, turned to what it feels there; at a place where none may
        press, where it was aimed, with the reason."""
        if self.fit.mesh is None:
            return self._on_points(aim, way)
        mesh = self.fit.mesh
        row = mesh.core.settle(self.share, mesh.local(aim)[None], way[None])[0]
        if math.isnan(row[0]):
            return self.judge(aim, way)
        return self.judge(mesh.back(row[:3]), np.ascontiguousarray(row[3:6]))

    def judge(self, point: Floats, normal: Floats) -> Contact:
        """What the object says of a contact as it is."""
        if self.fit.mesh is None:
            return self._on_points(point, normal, moves=False)
        mesh = self.fit.mesh
        aim, way = mesh.local(point)[None], np.ascontiguousarray(normal)[None]
        pressed = mesh.core.press(self.share, aim, way)[0]
        away = float(np.linalg.norm(mesh.core.nearest(aim)[0] - aim[0]))
        landing, exact, felt = pressed[:3], pressed[3:6], pressed[6:9]
        blocked, bearing = float(pressed[9]), float(pressed[11])
        radius = f"{self.radius:.3g}"
        why = ""
        if away > OFF:
            why = f"it is off the object, by {away * self.size:.3g}"
        elif math.isnan(landing[0]):
            why = "a straight finger misses the object there"
            exact, bearing = normal, 0.0
        elif float(np.linalg.norm(landing - aim[0])) > max(OFF, 0.2 * self.share):
            why = "another side of the object stands in the way of a straight finger"
        elif blocked >= 0.35:
            why = f"a tip of radius {radius} is stopped before its middle touches"
        elif felt @ way[0] < math.cos(math.radians(20.0)):
            turned = math.degrees(math.acos(min(1.0, float(felt @ way[0]))))
            why = f"the tip slips: what it feels is turned by {turned:.0f}° from how it comes"
        elif exact @ way[0] < math.cos(math.radians(30.0)):
            turned = math.degrees(math.acos(float(exact @ way[0])))
            why = f"it is on an edge: the triangle there is turned by {turned:.0f}°"
        elif float(pressed[10]) > EDGE:
            why = f"it is on an edge: {pressed[10]:.0%} of what lies under the pad is turned away"
        check = ContactCheck(
            distance=away * self.size,
            angle=math.acos(max(-1.0, min(1.0, float(exact @ way[0])))),
            seen=True,
            clearance=self._clearance(aim[0], way[0]) * self.size,
            bearing=0.0 if math.isnan(bearing) else bearing,
        )
        return Contact(point, normal, np.ascontiguousarray(exact), check, why)

    def _clearance(self, point: Floats, way: Floats) -> float:
        """Radius about the finger's way within which nothing stands in it, over the size."""
        assert self.fit.mesh is not None
        side = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
        side /= np.linalg.norm(side)
        turns = 2.0 * np.pi * np.arange(12)[:, None] / 12
        ring: Any = np.cos(turns) * side + np.sin(turns) * np.cross(way, side)
        free = 0.0
        for wide in (1.0, 1.5, 2.0, 3.0, 4.0):
            starts: Floats = point + wide * self.share * ring - 2.0 * way
            hits = self.fit.mesh.core.rays(starts, np.broadcast_to(way, (12, 3)).copy())[:, 0]
            if (hits <= 2.0 - self.share).any():
                break
            free = wide * self.share
        return free

    def _on_points(self, point: Floats, normal: Floats, *, moves: bool = True) -> Contact:
        """A fingertip on a cloud of points, or on the fitted surface where nothing was seen."""
        local = (point - self.fit.pose[:3, 3]) @ self.fit.pose[:3, :3]
        us, thetas, _ = self.fit.surface.coordinates(local[None])
        exact = self.fit.directions_to_object(self.fit.surface.normals(us, thetas))[0]
        nothing = ContactCheck(NAN, NAN, False, NAN, NAN)
        pressed = None
        if self.fit.scanned is not None:
            pressed = self.fit.scanned.press(point, exact if moves else normal, self.radius)
            if pressed is None:
                why = "what was seen stands in the way of a straight finger"
                return Contact(point, normal, exact, nothing, why)
        felt, way, check = (point, normal, nothing) if pressed is None else pressed
        if not self._is_allowed(us, thetas)[0] and not check.seen:
            why = "there is no object: the surface was seen to be empty or is not explained there"
            return Contact(point, normal, exact, nothing, why)
        return Contact(felt if moves else point, way if moves else normal, exact, check)

    def _is_allowed(self, u: Floats, theta: Floats) -> Any:
        rows, columns = self.fit.allowed.shape
        row = np.clip((u * rows).astype(np.int64), 0, rows - 1)
        column = np.floor(theta / (2 * np.pi) * columns).astype(np.int64) % columns
        return self.fit.allowed[row, column]

    def _unit(self, eye: Floats, through: Floats) -> tuple[Any, Floats, Floats]:
        turn, origin = self.fit.pose[:3, :3], self.fit.pose[:3, 3]
        surface = (1.0 / self.scale) * self.fit.surface
        return surface, (eye - origin) @ turn / self.scale, (through - origin) @ turn / self.scale

    def on_surface(self, u: float, theta: float) -> tuple[Floats, Floats]:
        """A point of the fitted surface, and its normal into it."""
        surface, us, thetas = self.fit.surface, np.array([u]), np.array([theta])
        point = self.fit.to_object(surface.points(us, thetas))[0]
        return point, self.fit.directions_to_object(surface.normals(us, thetas))[0]

    # Grasps -------------------------------------------------------------------------------------

    def held(self, grasp: ObjectGrasp) -> Held:
        """A grasp on offer, as the object judges it."""
        contacts = [
            self.judge(point, normal)
            for point, normal in zip(grasp.contacts, grasp.normals, strict=True)
        ]
        if grasp.checks is not None and self.fit.mesh is None:
            # What the points say was found out along the way on which the finger came.
            contacts = [
                contact._replace(check=check, why="")
                for contact, check in zip(contacts, grasp.checks, strict=True)
            ]
        return Held(tuple(contacts), grasp, grasp.held, grasp.low_quality)

    def around(self, count: int) -> Held:
        """Fingers evenly around the middle, for want of a grasp."""
        turns = 2.0 * np.pi * np.arange(count) / count
        contacts = []
        for turn in turns:
            out = self.fit.directions_to_object([np.cos(turn), np.sin(turn), 0.0])
            contacts.append(self.put(*self.under(self.center + 4.0 * self.size * out, self.center)))
        return Held(tuple(contacts))

    def quality(self, contacts: Floats, normals: Floats, hand: Hand) -> Any:
        """Q_l of grasps, of shapes (..., m, 3)."""
        return quality(
            contacts, normals, self.center,
            friction=hand.friction, edges=hand.edges, torsion=hand.torsion, norm=hand.norm,
            length_scale=self.scale,
        )  # fmt: skip

    def worth(self, held: Held, hand: Hand) -> float:
        """Q_l of a grasp."""
        return float(self.quality(held.contacts, held.normals, hand))

    def weakest(self, held: Held, hand: Hand) -> tuple[Floats, Floats]:
        """The push and the twist that the grasp resists least, torques over the length scale."""
        grasp = batch(
            held.contacts, held.normals, self.center, hand.friction, hand.edges, hand.torsion,
            self.scale, hand.norm,
        )  # fmt: skip
        direction = -np.array(_core.weakest(grasp.arrays, grasp.cone)[1])
        return direction[:3], direction[3:]

    def untrue(self, held: Held, hand: Hand) -> str:
        """Why a grasp is not what it is taken for, in a sentence; empty if it is."""
        if held.whys:
            return "; ".join(f"finger {k}: {why}" for k, why in held.whys) + "."
        if self.fit.mesh is not None:
            value = self.worth(held, hand)
            exact = float(self.quality(held.contacts, held.exact, hand))
            if value > 0.0 and exact < LEFT * value:
                return (
                    f"with the normals of the triangles that the tips' middles touch, Q is "
                    f"{exact:.4f} only: the pads lie on edges."
                )
        return ""

    # Better places ------------------------------------------------------------------------------

    @cached_property
    def places(self) -> Places:
        """Places all over the object where a fingertip may press."""
        if self.fit.mesh is not None:
            mesh = self.fit.mesh
            rows = places_of(mesh, self.share, 0, PLACES)
            normals = np.ascontiguousarray(rows[:, 3:6])
            return Places(mesh.back(rows[:, :3]), normals, rows[:, 7].copy(), 1.0 - rows[:, 6])
        u, theta = sample_points(self.fit.surface, PLACES, seed=0)
        allowed = self._is_allowed(u, theta)
        u, theta = u[allowed], theta[allowed]
        sure = None if self.fit.scanned is None else self.fit.scanned.sure
        if sure is None:
            bearing = np.ones(len(u))
        else:
            rows, columns = sure.shape
            row = np.clip((u * rows).astype(np.int64), 0, rows - 1)
            column = np.floor(theta / (2 * np.pi) * columns).astype(np.int64) % columns
            bearing = sure[row, column].astype(float)
        return Places(
            self.fit.to_object(self.fit.surface.points(u, theta)),
            self.fit.directions_to_object(self.fit.surface.normals(u, theta)),
            bearing,
            np.ones(len(u)),
        )

    def what_if(self, held: Held, index: int, hand: Hand, some: Any = slice(None)) -> Floats:
        """Q_l with one finger at each of the places, or at some of them, the others where they
        are. Shape (n,)."""
        places = self.places.contacts[some]
        contacts = np.repeat(held.contacts[None], len(places), axis=0)
        normals = np.repeat(held.normals[None], len(places), axis=0)
        contacts[:, index], normals[:, index] = places, self.places.normals[some]
        return np.asarray(self.quality(contacts, normals, hand))

    # Out ----------------------------------------------------------------------------------------

    def as_grasp(self, held: Held, hand: Hand) -> ObjectGrasp:
        """What is shown, as the library has it."""
        cone = cone_of(hand.friction, hand.edges, len(held.fingers), hand.torsion, hand.norm)
        local = (held.contacts - self.fit.pose[:3, 3]) @ self.fit.pose[:3, :3]
        us, thetas, distances = self.fit.surface.coordinates(local)
        on = distances <= 0.02 * self.size
        coordinates = np.where(on[:, None], np.stack([us, thetas], axis=1), np.nan)
        exact = None
        if self.fit.mesh is not None:
            exact = float(self.quality(held.contacts, held.exact, hand))
        return self.fit._object_grasp(
            Grasp(us, thetas) if on.all() else None,
            held.contacts, held.normals, cone, self.center,
            coordinates=locked(coordinates),
            checks=tuple(finger.check for finger in held.fingers),
            exact_quality=exact, held=held.held, low_quality=held.low_quality,
        )  # fmt: skip


def in_order(grasps: Sequence[ObjectGrasp], touch: Touch, hand: Hand) -> list[float]:
    """Q_l of grasps on offer with other friction and edges than they were found with."""
    return [float(touch.quality(one.contacts, one.normals, hand)) for one in grasps]
