"""Grasps of an object to which a surface is fitted, in the coordinates of the object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats, NoGraspLeftError, brief, count, finite, floats, locked, number
from .._batches import Cone, fingers
from .._core import GraspModuliError
from ..constraints import Constraints, a_constraint, raise_for_none
from ..grasps import Grasp
from ..synthesis import (
    APART,
    MOST_CONTACTS,
    MOST_FOLLOWED,
    check_fingers,
    differ,
    many_grasps,
    synthesize,
    with_plain,
)
from ..tasks import one_task, scaled_task
from ..transfers import transfer
from .fitted import Fitted
from .likeness import cells, ways
from .mesh_grasps import Pressed, Search, press, search
from .object_grasps import (
    ObjectGrasp,
    by_errors,
    by_evidence,
    by_round_cones,
    by_task,
    for_task,
    surest_first,
)
from .reading import read
from .touching import TIP, tip
from .walls import CLOSE

#: Grasps of a mesh of lower quality are force closure, but hold nothing.
LEAST = 1e-3


@dataclass(frozen=True, eq=False)
class Fit(Fitted):
    """A surface fitted to an object."""

    def synthesize(
        self,
        *,
        contacts: int = 3,
        torsion: float = 0.0,
        norm: str = "sum",
        top: int = 5,
        friction: ArrayLike = 1.0,
        edges: int = 8,
        seed: int = 0,
        center_of_mass: ArrayLike | None = None,
        tip_radius: float | None = None,
        errors: float | None = None,
        constraints: Constraints | None = None,
        task: ArrayLike | None = None,
    ) -> list[ObjectGrasp]:
        """Different grasps of high quality in the object's own coordinates, best first.

        Of a mesh, fingertips are pressed on the mesh itself, all over it (:func:`contact_map`):
        the best of all subsets of the 100 places that are farthest from each other climb over the
        map and then over the mesh, on pads as flat as four fifths of the best quality allow. What
        is offered is true: a straight finger from outside lands there, and there is force closure
        also with the triangles' own normals and for balls of the tip's radius. The first does not
        lose force closure in 99 of 100 errors of aim of half a tip radius, unless all such grasps
        are less than half as good.

        Of a cloud of points, :func:`graspmoduli.synthesize` on the fitted surface, with contacts
        where it explains the cloud or was not seen, and where fingers must meet what was seen if
        there are such grasps. Contacts on points are then pressed on them.

        The order follows the proven bounds for round friction cones, ``round_quality``, or
        ``low_quality`` if errors are given. Of a cloud the first grasp is that of which most is
        left with half the friction, on the points and on the fitted surface, and most was seen;
        what promises more with less to go by is left out. Qualities do not depend on the object's
        unit.

        Parameters
        ----------
        contacts
            Fingers of a grasp.
        torsion
            Torsional friction coefficient of soft fingers, a length: two hold as soft ones only,
            with :func:`graspmoduli.pad_torsion` of their pads.
        norm
            As in :func:`graspmoduli.quality`.
        top
            How many grasps are wanted. Fewer come back if fewer are found, none if the object is
            too thin for these tips or too slippery: on a mesh, qualities below 0.001 do not count.
        friction, edges
            As in :func:`graspmoduli.quality`; friction positive, a number or one per finger.
        seed
            Of the places on the object.
        center_of_mass
            Shape (3,), in the object's coordinates; :attr:`center_of_mass` if not given. That of
            the paper is ``fit.to_object(fit.surface.center_of_mass)``.
        tip_radius
            Of the fingertips, balls, in the object's unit; 5 % of its size if not given.
        errors
            Errors of aim, a distance, that grasps should stand: they are ranked by the quality
            that nine of ten errors leave.
        constraints
            Where fingers may go and what they must hold.
        task
            Loads that grasps are for, forces and torques on the object about its centre of mass,
            as for :func:`graspmoduli.task_quality`; shape (k, 6). Then grasps climb in task
            quality and are ranked by it.

        Raises
        ------
        NoGraspLeftError
            If the constraints leave none, though there are grasps without one of them.
        """
        size = count("contacts", contacts, 1, MOST_CONTACTS)
        many = count("top", top, 1, MOST_FOLLOWED)
        hand = fingers(friction, edges, size, torsion, norm)
        check_fingers(size, hand)
        loads = one_task(task)
        start = count("seed", seed, 0)
        asked = a_constraint("constraints", constraints)
        center = self._center(asked.center_of_mass if center_of_mass is None else center_of_mass)
        if self.mesh is None:

            def of_cloud(own: Constraints) -> list[ObjectGrasp]:
                return self._of_cloud(
                    size, many, hand, start, center, tip_radius, errors, own, loads
                )

            found = of_cloud(asked)
            if not found and asked.given:
                raise_for_none(asked, of_cloud)
            if loads is not None:
                found = sorted(for_task(found, loads), key=by_task, reverse=True)
            return found[:many]
        radius = tip(self.mesh, tip_radius)
        aim = self._errors(errors, 0.5 * radius * self.mesh.size)
        # Equal ones stay in the order of their Q_l.
        key = by_round_cones if errors is None else by_errors
        if loads is not None:
            key = by_task
        wanted = Search(hand, center, self.length_scale, size, many, aim, asked, loads)
        found = self._of_mesh(radius, start, wanted)
        if not found and asked.given:
            raise_for_none(
                asked,
                lambda own: self._of_mesh(radius, start, wanted._replace(constraints=own, top=1)),
            )
        if loads is not None:
            plain = self._of_mesh(radius, start, wanted._replace(task=None)) if found else []
            found = with_plain(found, plain, APART * self.length_scale)
        ranked = sorted(for_task(found, loads), key=key, reverse=True)
        return (surest_first(ranked, key) if errors is None else ranked)[:many]

    def _of_mesh(self, radius: float, seed: int, wanted: Search) -> list[ObjectGrasp]:
        """Grasps pressed on the mesh that keep all constraints."""
        assert self.mesh is not None
        asked, top = wanted.constraints, wanted.top
        filtered = self.part or asked.after_search
        kept: list[ObjectGrasp] = []
        # From a part, or a region that only Python knows, some climb off: they are left out.
        for polished in (True, False) if asked.after_search else (True,):
            followed = min(4 * top, MOST_FOLLOWED) if filtered else top
            now = wanted._replace(top=followed, polished=polished)
            found = search(self.mesh, radius, seed, now, self._is_on if self.part else None)
            kept += [
                one
                for one in self._touched(found, now)
                if one.quality >= LEAST
                and (not self.part or self._is_on(one.contacts).all())
                and self._keeps(asked, one, radius * self.mesh.size)
                and all(differ(one, other, APART * self.length_scale) for other in kept)
            ]
            if len(kept) >= top:
                break
        return kept

    def _keeps(self, asked: Constraints, grasp: ObjectGrasp, tip_radius: float) -> bool:
        """Is a grasp within what only Python can tell?"""
        return not asked.given or (
            asked.allow(grasp.contacts, grasp.normals, tip_radius=tip_radius) and asked.hold(grasp)
        )

    def _center(self, center_of_mass: ArrayLike | None) -> Floats:
        if center_of_mass is None:
            return self.center_of_mass
        center = finite("center_of_mass", floats("center_of_mass", center_of_mass))
        if center.shape != (3,):
            raise GraspModuliError(f"center_of_mass must have shape (3,), got {center.shape}")
        return center

    def _errors(self, errors: float | None, default: float) -> float:
        if errors is None:
            return default
        wanted = number("errors", errors, positive=True)
        if wanted > 0.25 * self.residual.size:
            raise GraspModuliError(
                f"errors must be at most a quarter of the object's size, "
                f"{0.25 * self.residual.size:.4g}, got {wanted:g}"
            )
        return wanted

    def _of_cloud(
        self,
        size: int,
        top: int,
        hand: Cone,
        seed: int,
        center: Floats,
        tip_radius: float | None,
        errors: float | None,
        asked: Constraints,
        task: Floats | None,
    ) -> list[ObjectGrasp]:
        mu, edges, torsion, each = hand
        if errors is not None:
            raise GraspModuliError(
                f"errors must be left out for a cloud of points, got {errors:g}: they are tried on "
                "meshes only"
            )
        radius = TIP * self.residual.size
        if tip_radius is not None:
            radius = number("tip_radius", tip_radius, positive=True)
        scale = self._surface_radius
        sure = None if self.scanned is None else self.scanned.sure
        middle = (center - self.pose[:3, 3]) @ self.pose[:3, :3] / scale
        # A finger that must meet what was seen is not in thin air, wherever it meets it.
        for allowed in (self.allowed,) if sure is None else (self.allowed & sure, self.allowed):
            if asked.given:
                allowed = asked.cells(self.surface, self.pose, allowed, radius)
            if not allowed.any():
                continue
            if size == 3 and torsion == 0.0 and not each and not asked.given and task is None:
                # Where contacts are not allowed everywhere, more starts find better grasps.
                found = synthesize(
                    self.unit_surface,
                    top=min(2 * top + 2, MOST_FOLLOWED),
                    starts=min(4 * top + 4, MOST_FOLLOWED),
                    friction=mu if len(mu) > 1 else mu[0],
                    edges=edges,
                    seed=seed,
                    allowed=allowed,
                    center_of_mass=middle,
                )
            else:
                pairs = asked.pairs_alone.limits(radius, size=scale)
                x, y, z = middle.tolist()
                unit = (mu, edges, torsion / scale, each)
                many = min(4 * top + 4, MOST_FOLLOWED)
                found = many_grasps(
                    self.unit_surface, (x, y, z), unit, size, many, seed, allowed, pairs,
                    self._turned(task, scale),
                )  # fmt: skip
            # The edges of polygonal cones are laid out in the coordinates' axes, so that Q_l in
            # those of the object differs slightly from the surface's own.
            ranked = []
            for one in found:
                flat = self._placed(one.grasp, hand, center)
                pressed = self._pressed_on_points(flat, hand, center, radius)
                if (
                    pressed is not None
                    and min(flat.quality, pressed.quality) > 0.0
                    and self._keeps(asked, pressed, radius)
                ):
                    ranked.append((by_evidence(flat, pressed), pressed))
            if ranked:
                first = max(ranked, key=lambda pair: pair[0])[1]
                # Others may promise more, but with less to go by.
                rest = [one for _, one in ranked if by_round_cones(one) <= by_round_cones(first)]
                if task is not None:
                    return [one for _, one in ranked]
                return sorted(rest, key=by_round_cones, reverse=True)[:top]
        return []

    def _turned(self, task: Floats | None, scale: float) -> list[list[float]]:
        """Loads in the coordinates of the fitted surface divided by ``scale``."""
        if task is None:
            return []
        turned = (task.reshape(-1, 2, 3) @ self.pose[:3, :3]).reshape(-1, 6)
        return scaled_task(turned, scale)

    def _pressed_on_points(
        self, flat: ObjectGrasp, hand: Cone, center: Floats, radius: float
    ) -> ObjectGrasp | None:
        """A grasp with its contacts where tips meet the points; None if one is blocked."""
        if self.scanned is None:
            return flat
        contacts, normals, checks = flat.contacts.copy(), flat.normals.copy(), []
        for k, (contact, normal) in enumerate(zip(flat.contacts, flat.normals, strict=True)):
            pressed = self.scanned.press(contact, normal, radius)
            if pressed is None:
                return None
            contacts[k], normals[k], check = pressed
            checks.append(check)
        return self._object_grasp(flat.grasp, contacts, normals, hand, center, checks=tuple(checks))

    def on_mesh(
        self, mesh: Any, grasp: Grasp, *, friction: ArrayLike = 1.0, edges: int = 8
    ) -> ObjectGrasp:
        """A grasp as the object's own mesh sees it, not the fitted surface.

        Contacts are the nearest points of the mesh, normals those of its faces there, pointing to
        the side that the surface's do.

        Parameters
        ----------
        mesh
            As for :func:`fit`, with faces.
        grasp
            Contact coordinates on the fitted surface.
        friction, edges
            As in :func:`graspmoduli.quality`.
        """
        thing = read(mesh)
        if thing.faces is None:
            raise GraspModuliError("mesh must have faces, got points only")
        from trimesh.triangles import closest_point

        flat = self.in_object(grasp, friction=friction, edges=edges)
        triangles = thing.points[thing.faces]
        sides = triangles[:, 1:] - triangles[:, :1]
        across = np.cross(sides[:, 0], sides[:, 1])
        area = np.linalg.norm(across, axis=1)
        triangles, across = triangles[area > 0.0], across[area > 0.0] / area[area > 0.0, None]
        contacts, normals = [], []
        for point, normal in zip(flat.contacts, flat.normals, strict=True):
            near = closest_point(triangles, np.broadcast_to(point, (len(triangles), 3)))
            face = int(((near - point) ** 2).sum(axis=1).argmin())
            contacts.append(near[face])
            normals.append(np.where(across[face] @ normal < 0.0, -1.0, 1.0) * across[face])
        hand = fingers(friction, edges, len(grasp))
        return self._object_grasp(
            grasp, np.array(contacts), np.array(normals), hand, self.center_of_mass
        )

    def transfer_to(
        self,
        target: Fit,
        grasp: Grasp | ObjectGrasp,
        method: str = "ascent",
        *,
        friction: ArrayLike | None = None,
        edges: int | None = None,
        constraints: Constraints | None = None,
    ) -> ObjectGrasp:
        """A grasp of this object carried to another one, in that one's own coordinates.

        :func:`graspmoduli.transfer` between the fitted surfaces, each divided by its
        radius about its own centre of mass; the ascent offers contacts only where the target is
        explained by its surface or, of a scan, was not seen. On a target with a mesh the contacts
        are then pressed on the mesh, where a tip of 5 % of its size touches near them, and climb
        there; where that leaves nothing true, an error says so.

        Between parts (:func:`fit_parts`), whose angles have no common origin, one part is laid on
        the other instead, whatever the method, principal axes on principal axes and stretched to
        these; where no grasp that starts there stays on the part, the part's own grasp that is
        nearest is taken.

        Fingers are those of the grasp, with ``friction`` and ``edges`` if they are given; those of
        contact coordinates are hard ones, with 1 and 8. Others than three hard fingers are carried
        naïvely before they climb, and to meshes only. The grasp keeps ``constraints``, in the
        target's coordinates. With these or with other fingers, where none that starts there holds,
        the target's own grasp that is nearest is taken.
        """
        asked = a_constraint("constraints", constraints)
        if not isinstance(target, Fit):
            raise GraspModuliError(f"target must be a Fit, got {brief(target)}")
        torsion, norm, placed = 0.0, "sum", None
        if isinstance(grasp, ObjectGrasp):
            torsion, norm = grasp.torsion, grasp.norm
            friction = grasp.friction if friction is None else friction
            edges = grasp.edges if edges is None else edges
            placed, grasp = grasp, self.on_surface(grasp)
        friction = 1.0 if friction is None else friction
        edges = 8 if edges is None else edges
        if placed is None:
            placed = self.in_object(grasp, friction=friction, edges=edges)
        hand = fingers(friction, edges, len(grasp), torsion, norm)
        other_hand = len(grasp) != 3 or torsion > 0.0 or norm != "sum"
        if other_hand:
            if target.mesh is None:
                raise GraspModuliError(
                    'target must have a mesh for other than three hard fingers with norm "sum", '
                    "got a cloud of points"
                )
            method = "naive"
        if self.part and target.part:
            starts = self._laid_on(target, placed)
        else:
            allowed = target.allowed if method == "ascent" else None
            carried = transfer(
                self.unit_surface, grasp, target.unit_surface, method,
                friction=friction, edges=edges, allowed=allowed,
            )  # fmt: skip
            arrived = target.in_object(carried.grasp, friction=friction, edges=edges)
            starts = [(arrived.contacts, arrived.normals)]
            if target.mesh is None:
                if target._keeps(asked, arrived, 0.0):
                    return arrived
                raise NoGraspLeftError(
                    f"constraints must leave the grasp where it arrives, got one that breaks "
                    f"{' or '.join(asked.given)}"
                )
        assert target.mesh is not None
        aim = 0.5 * TIP * target.mesh.size
        center = target._center(asked.center_of_mass)
        wanted = Search(hand, center, target.length_scale, len(grasp), 1, aim, asked)
        found = []
        for contacts, normals in starts:
            pressed = press(target.mesh, TIP, contacts, normals, wanted)
            if pressed is not None:
                found += target._touched([pressed], wanted)
        radius = TIP * target.mesh.size
        found = [one for one in found if target._keeps(asked, one, radius)]
        if target.part:
            found = [one for one in found if target._is_on(one.contacts).all()]
        if (target.part or asked.given or other_hand) and not found:
            # Where none of these stays on the part, its own grasp that is most like them.
            own = target.synthesize(
                contacts=len(grasp), torsion=torsion, norm=norm, top=10, friction=friction,
                edges=edges, constraints=asked,
            )  # fmt: skip
            found = sorted(own, key=lambda one: _unlike(one.contacts, starts))[:1]
        if not found:
            raise GraspModuliError(
                "grasp must be one that the target's mesh can be grasped with, got contacts that "
                "no tip reaches or that lose force closure there"
            )
        return max(found, key=by_round_cones)

    def _laid_on(self, target: Fit, grasp: ObjectGrasp) -> list[tuple[Floats, Floats]]:
        """Contacts and normals of a grasp with this part laid on another that is like it."""
        here, there = (cells(fit.surface, fit.pose, fit.allowed) for fit in (self, target))
        found = []
        for matrix, offset in ways(here, there):
            normals = np.linalg.solve(matrix.T, grasp.normals.T).T
            normals /= np.sqrt((normals * normals).sum(axis=1, keepdims=True))
            found.append((grasp.contacts @ matrix.T + offset, normals))
        return found

    def _touched(self, found: list[Pressed], wanted: Search) -> list[ObjectGrasp]:
        """Grasps pressed on the mesh, with coordinates on the surface where they lie there."""
        if not found:
            return []
        contacts = np.stack([one.contacts for one in found])
        local = (contacts - self.pose[:3, 3]) @ self.pose[:3, :3]
        us, thetas, distances = self.surface.coordinates(local)
        grasps = []
        for one, u, theta, on in zip(
            found, us, thetas, distances <= CLOSE * self.residual.size, strict=True
        ):
            made = self._object_grasp(
                Grasp(u, theta) if on.all() else None,
                one.contacts,
                one.normals,
                wanted.hand,
                wanted.center_of_mass,
                coordinates=locked(np.where(on[:, None], np.stack([u, theta], axis=1), np.nan)),
                checks=one.checks,
                exact_quality=one.exact_quality,
                held=one.held,
                low_quality=one.low_quality,
            )
            grasps.append(made)
        return grasps


def _unlike(contacts: Floats, starts: list[tuple[Floats, Floats]]) -> float:
    """How far contacts are from the nearest of others, in the best order of the fingers."""
    from scipy.optimize import linear_sum_assignment

    def farthest(others: Floats) -> float:
        away = contacts[:, None] - others
        squares = (away * away).sum(axis=2)
        return float(np.sqrt(squares[linear_sum_assignment(squares)].max()))

    return min(farthest(others) for others, _ in starts)
