"""Fitting a surface with cylindrical coordinates to a real object (Sec. III of the paper).

The paper proposes regression in cylindrical coordinates about the most dominant axis. Here the
axis is chosen among candidates by how well the outer wall about it is such a surface, and the
regression is that of penalised splines (Eilers & Marx 1996) with robust weights.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import (
    Floats,
    a_callback,
    a_path,
    brief,
    coefficient,
    count,
    finite,
    floats,
    locked,
    number,
    vectors,
)
from .._batches import Cone, carried, fingers
from .._core import GraspModuliError
from .._files import replacing
from .._values import Value
from ..grasps import Grasp, PlacedGrasp, a_grasp
from ..quality import circular_quality, quality
from ..surfaces import Surface
from ..synthesis import MOST_CONTACTS, MOST_FOLLOWED, synthesize
from ..transfers import transfer
from .agreement import phantom_area, unexplained_area
from .axes import candidate_axes, refined, same_axis, score
from .reading import Object, read
from .touching import (
    TIP,
    ContactCheck,
    Pressed,
    Search,
    TriangleMesh,
    press,
    search,
    tip,
)
from .walls import CLOSE, FOR_MESHES, FOR_SCANS, Axis, Booleans, fine_hits, regress

#: The version of the files that Fit.save writes.
FILE_VERSION = 2
#: Grasps of a mesh of lower quality are force closure, but hold nothing.
LEAST = 1e-3
#: More unexplained than this is refused, of a cloud of points.
MOST_UNEXPLAINED = 0.4
#: Axes whose scores, numbers of order 1, are this close are equally good.
TIE = 1e-6
#: More unexplained than this is worth a warning.
WORTH_A_WARNING = 0.005
#: So is more of a mesh's visible area, and less of the surface with the mesh near it.
WORTH_A_WARNING_OF_MESH, LEAST_COVERAGE = 0.05, 0.9


@dataclass(frozen=True)
class Residual:
    """Distance of the object's outer wall from the fitted surface, where it explains the wall."""

    #: Root mean square, in the unit of the object.
    rms: float
    #: Largest, in the unit of the object.
    max: float
    #: The object's largest extent, in its unit.
    size: float

    @property
    def relative_rms(self) -> float:
        """rms / size."""
        return self.rms / self.size

    @property
    def relative_max(self) -> float:
        """max / size."""
        return self.max / self.size


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
    #: Proven lower and upper bound of the quality with round friction cones, which does not depend
    #: on the axes of the file.
    round_quality: tuple[float, float] | None = None
    #: Coordinates of each contact on the fitted surface, NaN where it is not on it. Shape (m, 2).
    coordinates: Floats | None = field(default=None, repr=False)
    #: What the mesh says of each contact, where there is one.
    checks: tuple[ContactCheck, ...] | None = field(default=None, repr=False)
    #: Q_l with the normals of the mesh's own triangles where the contacts are.
    exact_quality: float | None = None
    #: Share of combinations of errors of aim under which the grasp is force closure; of half a tip
    #: radius, or what was asked for.
    held: float | None = None
    #: Q_l that nine of ten of these errors leave.
    low_quality: float | None = None


@dataclass(frozen=True, eq=False)
class Fit(Value):
    """A surface fitted to an object."""

    #: The surface, about its own axis, in the unit of the object.
    surface: Surface
    #: Rigid motion from the surface's coordinates to the object's. Shape (4, 4).
    pose: Floats
    residual: Residual
    #: Share of the surface's area where there is an object: of a mesh, within 2 % of its size; of a
    #: cloud, where it was seen, as the rest is filled in smoothly.
    coverage: float
    #: Share of the object farther than 2 % of its size from the surface: of a mesh, of the area
    #: visible from outside, the surface being closed by lids; of a cloud, of its outer wall.
    unexplained: float
    #: Where contacts may lie: cells over u and θ that are explained or, of a scan, unseen.
    #: Shape (k, n).
    allowed: Booleans = field(repr=False)
    #: The object's mesh, where it came as one: grasps are pressed on it.
    mesh: TriangleMesh | None = None

    @property
    def center_of_mass(self) -> Floats:
        """The object's centre of mass, in its own coordinates. Shape (3,).

        Of a closed mesh that of the solid, its density uniform; of an open one that of its
        triangles' area; of a cloud of points the fitted surface's z_S.
        """
        if self.mesh is not None:
            return self.mesh.shape.center_of_mass
        return locked(self.to_object(self.surface.center_of_mass))

    @property
    def length_scale(self) -> float:
        """The object's radius about its centre of mass: torques are divided by it for Q_l.

        Of a mesh the largest distance of a vertex; of a cloud of points that of the surface.
        """
        return self._surface_radius if self.mesh is None else self.mesh.radius

    @property
    def _surface_radius(self) -> float:
        return self.surface.radius_about(self.surface.center_of_mass)

    @property
    def unit_surface(self) -> Surface:
        """The surface divided by its radius about its own centre of mass: to compare shapes."""
        return (1.0 / self._surface_radius) * self.surface

    def synthesize(
        self,
        *,
        contacts: int = 3,
        torsion: float = 0.0,
        top: int = 5,
        friction: ArrayLike = 1.0,
        edges: int = 8,
        seed: int = 0,
        center_of_mass: ArrayLike | None = None,
        tip_radius: float | None = None,
        errors: float | None = None,
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
        where it explains the cloud or was not seen.

        The order follows the proven bounds for round friction cones, ``round_quality``, or
        ``low_quality`` if errors are given. Qualities do not depend on the object's unit.

        Parameters
        ----------
        contacts
            Fingers of a grasp; of a cloud of points three.
        torsion
            Torsional friction coefficient of soft fingers, a length; of a cloud of points 0.
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
        """
        size = count("contacts", contacts, 1, MOST_CONTACTS)
        many = count("top", top, 1, MOST_FOLLOWED)
        hand = (*fingers(friction, edges, size)[:2], coefficient("torsion", torsion))
        start = count("seed", seed, 0)
        center = self._center(center_of_mass)
        if self.mesh is None:
            return self._of_cloud(size, many, hand, start, center, tip_radius, errors)
        radius = tip(self.mesh, tip_radius)
        aim = self._errors(errors, 0.5 * radius * self.mesh.size)
        wanted = Search(hand, center, self.length_scale, size, many, aim)
        found = search(self.mesh, radius, start, wanted)
        grasps = [one for one in self._touched(found, wanted) if one.quality >= LEAST]
        # Equal ones stay in the order of their Q_l.
        key = _round if errors is None else _low
        return sorted(grasps, key=key, reverse=True)[:many]

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
    ) -> list[ObjectGrasp]:
        mu, edges, torsion = hand
        if size != 3 or torsion > 0.0:
            raise GraspModuliError(
                "contacts must be 3 and torsion 0 for a cloud of points, "
                f"got {size} and {torsion:g}; a mesh takes others"
            )
        for name, value in (("tip_radius", tip_radius), ("errors", errors)):
            if value is not None:
                raise GraspModuliError(
                    f"{name} must be left out for a cloud of points, got {value:g}: fingertips are "
                    "pressed on meshes only"
                )
        scale = self._surface_radius
        # Where contacts are not allowed everywhere, more starts find better grasps.
        found = synthesize(
            self.unit_surface,
            top=top,
            starts=min(2 * top + 6, MOST_FOLLOWED),
            friction=mu if len(mu) > 1 else mu[0],
            edges=edges,
            seed=seed,
            allowed=self.allowed,
            center_of_mass=(center - self.pose[:3, 3]) @ self.pose[:3, :3] / scale,
        )
        # The edges of polygonal cones are laid out in the coordinates' axes, so that Q_l in those
        # of the object differs slightly from the surface's own.
        grasps = [self._placed(ranked.grasp, hand, center) for ranked in found]
        return sorted((g for g in grasps if g.quality > 0.0), key=_round, reverse=True)

    def in_object(self, grasp: Grasp, *, friction: ArrayLike = 1.0, edges: int = 8) -> ObjectGrasp:
        """A grasp on the fitted surface, in the object's own coordinates."""
        a_grasp("grasp", grasp)
        return self._placed(grasp, fingers(friction, edges, len(grasp)), self.center_of_mass)

    def _placed(self, grasp: Grasp, hand: Cone, center: Floats) -> ObjectGrasp:
        contacts = self.to_object(self.surface.points(grasp.u, grasp.theta))
        normals = self.directions_to_object(self.surface.normals(grasp.u, grasp.theta))
        return self._object_grasp(grasp, contacts, normals, hand, center)

    def on_surface(self, grasp: ObjectGrasp) -> Grasp:
        """The grasp's place in G^cyl: contact coordinates of its contacts on the fitted surface.

        Of contacts that are not on it, those of the nearest points of the surface.
        """
        if not isinstance(grasp, ObjectGrasp):
            raise GraspModuliError(f"grasp must be an ObjectGrasp, got {brief(grasp)}")
        if grasp.grasp is not None:
            return grasp.grasp
        local = (grasp.contacts - self.pose[:3, 3]) @ self.pose[:3, :3]
        u, theta, _ = self.surface.coordinates(local)
        return Grasp(u, theta)

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
        friction: ArrayLike = 1.0,
        edges: int = 8,
    ) -> ObjectGrasp:
        """A grasp of this object carried to another one, in that one's own coordinates.

        :func:`graspmoduli.transfer` between the fitted surfaces, each divided by its
        radius about its own centre of mass; the ascent offers contacts only where the target is
        explained by its surface or, of a scan, was not seen. On a target with a mesh the contacts
        are then pressed on the mesh, where a tip of 5 % of its size touches near them, and climb
        there; where that leaves nothing true, an error says so.
        """
        if not isinstance(target, Fit):
            raise GraspModuliError(f"target must be a Fit, got {brief(target)}")
        if isinstance(grasp, ObjectGrasp):
            grasp = self.on_surface(grasp)
        start, end = self.unit_surface, target.unit_surface
        allowed = target.allowed if method == "ascent" else None
        carried = transfer(
            start, grasp, end, method, friction=friction, edges=edges, allowed=allowed
        )
        arrived = target.in_object(carried.grasp, friction=friction, edges=edges)
        if target.mesh is None:
            return arrived
        hand = fingers(friction, edges, len(grasp))
        aim = 0.5 * TIP * target.mesh.size
        wanted = Search(hand, target.center_of_mass, target.length_scale, len(grasp), 1, aim)
        pressed = press(target.mesh, TIP, arrived.contacts, arrived.normals, wanted)
        if pressed is None:
            raise GraspModuliError(
                "grasp must be one that the target's mesh can be grasped with, got contacts that "
                f"no tip reaches or that lose force closure there (on its surface Q is "
                f"{arrived.quality:.3g})"
            )
        return target._touched([pressed], wanted)[0]

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

    def _object_grasp(
        self,
        grasp: Grasp | None,
        contacts: Floats,
        normals: Floats,
        hand: Cone,
        center: Floats,
        **others: Any,
    ) -> ObjectGrasp:
        made = PlacedGrasp(contacts, normals, center)
        options = {
            "friction": carried(hand),
            "edges": hand[1],
            "length_scale": self.length_scale,
        }
        bounds = circular_quality(
            made, friction=options["friction"], length_scale=options["length_scale"]
        )
        if grasp is not None and "coordinates" not in others:
            others["coordinates"] = locked(np.stack([grasp.u, grasp.theta], axis=1))
        return ObjectGrasp(
            made.contacts,
            made.normals,
            made.center_of_mass,
            grasp=grasp,
            surface=self.surface,
            quality=quality(made, torsion=hand[2], **options),
            torsion=hand[2],
            round_quality=(bounds.lower, bounds.upper),
            **options,
            **others,
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the fit as a NumPy ``.npz`` file, whole or not at all."""
        with replacing(a_path(path)) as temporary, temporary.open("wb") as file:
            np.savez(
                file,
                graspmoduli_fit=FILE_VERSION,
                coefficients=self.surface.coefficients,
                heights=[self.surface.bottom, self.surface.top],
                pose=self.pose,
                residual=[self.residual.rms, self.residual.max, self.residual.size],
                shares=[self.coverage, self.unexplained],
                allowed=self.allowed,
                **(
                    {}
                    if self.mesh is None
                    else {
                        "vertices": self.mesh.vertices,
                        "faces": self.mesh.faces,
                    }
                ),
            )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Fit:
        """Reads what :meth:`save` wrote."""
        file = a_path(path)
        try:
            with file.open("rb") as handle, np.load(handle) as data:
                version = int(data["graspmoduli_fit"])
                if version == FILE_VERSION:
                    bottom, top = data["heights"].tolist()
                    coverage, unexplained = data["shares"].tolist()
                    return cls(
                        surface=Surface.from_coefficients(data["coefficients"], bottom, top),
                        pose=locked(floats("pose", data["pose"]).reshape(4, 4)),
                        residual=Residual(*data["residual"].tolist()),
                        coverage=coverage,
                        unexplained=unexplained,
                        allowed=data["allowed"].astype(bool, casting="no"),
                        mesh=_saved_mesh(data),
                    )
        except FileNotFoundError:
            raise GraspModuliError(f"path must be a fit's file, got no file {path}") from None
        # NumPy and zipfile raise what they like on files of other kinds.
        except Exception as error:
            raise GraspModuliError(
                f"path must be a file that Fit.save wrote, got {path} ({brief(str(error))})"
            ) from None
        raise GraspModuliError(
            f"path must be a fit's file of version {FILE_VERSION}, got version {version} in {path}"
        )

    def to_object(self, points: ArrayLike) -> Floats:
        """Points from the surface's to the object's coordinates. Shape (..., 3)."""
        given = finite("points", vectors("points", points, "(..., 3)"))
        return given @ self.pose[:3, :3].T + self.pose[:3, 3]

    def directions_to_object(self, directions: ArrayLike) -> Floats:
        """Normals from the surface's to the object's coordinates. Shape (..., 3)."""
        given = finite("directions", vectors("directions", directions, "(..., 3)"))
        return given @ self.pose[:3, :3].T


def _saved_mesh(data: Any) -> TriangleMesh | None:
    if "vertices" not in data:
        return None
    size = float(data["residual"][2])
    vertices = floats("vertices", data["vertices"]).reshape(-1, 3)
    faces = data["faces"].astype(np.int64, casting="no").reshape(-1, 3)
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise GraspModuliError("faces must be among the vertices")
    return TriangleMesh(vertices, faces, size)


def _round(grasp: ObjectGrasp) -> float:
    """What ranks a grasp: what is proven for round cones, or Q_l of soft fingers."""
    if grasp.torsion > 0.0 or grasp.round_quality is None:
        return grasp.quality
    return grasp.round_quality[0]


def _low(grasp: ObjectGrasp) -> float:
    """What ranks a grasp under errors of aim."""
    return 0.0 if grasp.low_quality is None else grasp.low_quality


def fit(
    points_or_mesh_or_path: Any, *, progress: Callable[[int, int], object] | None = None
) -> Fit:
    """The surface with cylindrical coordinates that is closest to a real object.

    Parameters
    ----------
    points_or_mesh_or_path
        Points of shape (n, 3), a trimesh mesh, a pair (vertices, faces), or the path of a PLY,
        OBJ, STL, GLB, OFF, PCD, XYZ or NPY file. Any unit, any pose; a scan may be noisy and see
        the object from one side only.
    progress
        Called as ``progress(done, total)`` after each axis tried.

    Returns
    -------
    Fit
        Where a ray from the axis crosses several walls, the surface is the outer one; parts that
        stick out of it, such as a handle, are left unexplained, and a warning says how much.

    Raises
    ------
    GraspModuliError
        If the file cannot be read, holds several objects (parts farther apart than 3 % of the size
        in a mesh, 8 % in a cloud of points), or the object is no such surface.
    """
    return _fitted(read(points_or_mesh_or_path), progress, stacklevel=3)


def fit_object(thing: Object, progress: Callable[[int, int], object] | None = None) -> Fit:
    """As :func:`fit`, of an object that has been read."""
    return _fitted(thing, progress, stacklevel=3)


def _fitted(thing: Object, progress: Callable[[int, int], object] | None, stacklevel: int) -> Fit:
    """The fit; ``stacklevel``, from here, is that of whom warnings are for."""
    a_callback("progress", progress)
    candidates = candidate_axes(thing)
    scored: list[tuple[float, Axis]] = []
    for done, candidate in enumerate(candidates):
        for axis in (candidate, refined(thing, candidate)):
            # Several candidates often refine to the same axis.
            if not any(same_axis(thing, axis, other) for _, other in scored):
                scored.append((score(thing, axis), axis))
        if progress is not None:
            progress(done + 1, len(candidates))
    lowest = min(value for value, _ in scored)
    # The first among equals: a symmetric object must not get another axis by a last bit.
    axis = next(axis for value, axis in scored if value <= lowest + TIE)
    if not np.isfinite(lowest):
        raise GraspModuliError(
            "object must have an outer wall around some axis, got too little of one"
        )
    return _fit_about(thing, axis, stacklevel + 1)


def _fit_about(thing: Object, axis: Axis, stacklevel: int) -> Fit:
    mesh = thing.faces is not None
    hits, grid = fine_hits(thing, axis)
    coarse, _ = regress(thing, hits, grid, intervals=10, columns=8)
    intervals, columns, smoothing = (40, 32, FOR_MESHES) if mesh else (20, 24, FOR_SCANS)
    shape, wall = regress(thing, hits, grid, intervals, columns, smoothing, coarse)
    # Rows at the very ends cut lids and rims, not the wall.
    middle = (grid.low + grid.high) / 2
    surface = Surface.from_coefficients(shape.coefficients, grid.low - middle, grid.high - middle)
    u = (hits.height - grid.low) / (grid.high - grid.low)
    normals = surface.normals(np.clip(u, 0.0, 1.0), hits.angle)
    slant = np.hypot(normals[:, 0], normals[:, 1])
    distance = (hits.radius - shape.at(hits, grid)) * slant
    close = CLOSE * thing.size
    explained = wall & (np.abs(distance) <= close)
    outside = distance > close

    cells = grid.rows * grid.columns
    seen = np.bincount(hits.cell[wall], minlength=cells) > 0
    good = np.bincount(hits.cell[explained], minlength=cells) > 0
    sticking = np.bincount(hits.cell[outside], minlength=cells) > (0 if mesh else 2)
    pose, body = _pose(axis, middle), TriangleMesh.of(thing)
    if body is not None:
        unexplained = unexplained_area(thing, body, surface, pose)
        coverage = 1.0 - phantom_area(body, surface, pose)
        if unexplained > WORTH_A_WARNING_OF_MESH or coverage < LEAST_COVERAGE:
            warnings.warn(
                f"{unexplained:.0%} of the object's visible area is not explained by the fitted "
                f"surface, and {1.0 - coverage:.0%} of the surface has no object near it; grasps "
                "are true all the same, but have no contact coordinates off the surface",
                stacklevel=stacklevel,
            )
    else:
        unexplained = float((seen & (~good | sticking)).sum() / max(seen.sum(), 1))
        coverage = _coverage(surface, good.reshape(grid.rows, grid.columns))
        if unexplained > MOST_UNEXPLAINED:
            raise GraspModuliError(
                "object must be close to a surface in cylindrical coordinates about some axis, "
                f"got one whose outer wall is not for {unexplained:.0%}; a mesh of it could be "
                "grasped all the same"
            )
        if unexplained > WORTH_A_WARNING:
            warnings.warn(
                f"{unexplained:.1%} of the object's outer wall is not explained by the fitted "
                "surface; no grasp is offered there",
                stacklevel=stacklevel,
            )
    # A wall that leans more than the surface, such as a lid's rim, is not what a finger meets.
    crooked = np.abs(np.abs(normals[:, 2]) - hits.tilt) > 0.5
    rough = mesh & (np.bincount(hits.cell[explained & crooked], minlength=cells) > 0)
    bad = (sticking | rough | (seen & ~good)).reshape(grid.rows, grid.columns)
    # A fingertip's width away from it.
    allowed = ~_dilated(bad, 4 if mesh else 2)
    if mesh:
        # Where no ray hits a mesh there is nothing to touch.
        allowed &= seen.reshape(grid.rows, grid.columns)
    rim = max(1, round(0.03 * grid.rows))
    allowed[:rim] = allowed[-rim:] = False

    used = distance[explained]
    residual = Residual(
        rms=float(np.sqrt((used**2).mean())), max=float(np.abs(used).max()), size=thing.size
    )
    return Fit(
        surface=surface,
        pose=pose,
        residual=residual,
        coverage=coverage,
        unexplained=unexplained,
        allowed=allowed,
        mesh=body,
    )


def _pose(axis: Axis, middle: float) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = axis.rotation
    pose[:3, 3] = axis.origin + axis.rotation[:, 2] * middle
    return locked(pose)


def _coverage(surface: Surface, good: Booleans) -> float:
    """Share of the area in cells where a cloud was seen, small holes between its points aside."""
    rows, columns = good.shape
    u, theta = np.meshgrid(
        (np.arange(rows) + 0.5) / rows,
        (np.arange(columns) + 0.5) * 2 * np.pi / columns,
        indexing="ij",
    )
    first, second = surface.tangents(u, theta)
    area = np.linalg.norm(np.cross(first, second), axis=-1)
    covered = ~_dilated(~_dilated(good, 1), 1)
    return float(area[covered].sum() / area.sum())


def _dilated(cells: Booleans, reach: int) -> Booleans:
    """Cells and their neighbours; columns wrap around."""
    out = cells.copy()
    for _ in range(reach):
        grown = out | np.roll(out, 1, axis=1) | np.roll(out, -1, axis=1)
        grown[1:] |= out[:-1]
        grown[:-1] |= out[1:]
        out = grown
    return out
