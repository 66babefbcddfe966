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

from ._arrays import Floats, a_callback, a_path, brief, count, finite, floats, locked, vectors
from ._batches import carried, fingers
from ._core import GraspModuliError
from ._files import replacing
from ._values import Value
from .axes import candidate_axes, refined, same_axis, score
from .grasps import Grasp, PlacedGrasp, RankedGrasp, a_grasp
from .quality import quality
from .reading import Object, read
from .surfaces import Surface
from .synthesis import synthesize
from .transfers import transfer
from .walls import CLOSE, FOR_MESHES, FOR_SCANS, Axis, Booleans, fine_hits, regress

#: The version of the files that Fit.save writes.
FILE_VERSION = 1
#: More unexplained than this is refused.
MOST_UNEXPLAINED = 0.4
#: Axes whose scores, numbers of order 1, are this close are equally good.
TIE = 1e-6
#: More unexplained than this is worth a warning.
WORTH_A_WARNING = 0.005


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
class ObjectGrasp(RankedGrasp):
    """A grasp in the coordinates of a real object.

    Contacts, normals and centre of mass are in the object's coordinates and unit, ``surface`` is
    the fitted one in its own, and the quality is that of torques divided by ``length_scale``, the
    object's radius about its centre of mass. ``gm.quality(best)`` is ``best.quality``, and
    ``best.wrench_space()`` tells which forces hold against which disturbances.
    """


@dataclass(frozen=True, eq=False)
class Fit(Value):
    """A surface fitted to an object."""

    #: The surface, about its own axis, in the unit of the object.
    surface: Surface
    #: Rigid motion from the surface's coordinates to the object's. Shape (4, 4).
    pose: Floats
    residual: Residual
    #: Share of the surface's area where the object was seen; the rest is filled in smoothly.
    coverage: float
    #: Share of the object's outer wall that is not within 2 % of its size of the surface.
    unexplained: float
    #: Where contacts may lie: cells over u and θ that are explained or, of a scan, unseen.
    #: Shape (k, n).
    allowed: Booleans = field(repr=False)

    @property
    def length_scale(self) -> float:
        """The surface's radius about its centre of mass: torques are divided by it for Q_l."""
        return self.surface.radius_about(self.surface.center_of_mass)

    @property
    def unit_surface(self) -> Surface:
        """The surface divided by :attr:`length_scale`: to compare shapes and not sizes."""
        return (1.0 / self.length_scale) * self.surface

    def synthesize(
        self, *, top: int = 5, friction: ArrayLike = 1.0, edges: int = 8, seed: int = 0
    ) -> list[ObjectGrasp]:
        """Different grasps of high quality in the object's own coordinates, best first.

        :func:`graspmoduli.synthesize` on the fitted surface, with contacts only where the object
        is explained by it or, of a scan, was not seen. Torques are divided by
        :attr:`length_scale` for the quality, which therefore does not depend on the object's unit.
        """
        # Where contacts are not allowed everywhere, more starts find better grasps.
        found = synthesize(
            self.unit_surface,
            top=top,
            starts=2 * count("top", top, 1, 1_000) + 6,
            friction=friction,
            edges=edges,
            seed=seed,
            allowed=self.allowed,
        )
        # The edges of polygonal cones are laid out in the coordinates' axes, so that Q_l in those
        # of the object differs slightly from the surface's own.
        grasps = [self.in_object(ranked.grasp, friction=friction, edges=edges) for ranked in found]
        return sorted((g for g in grasps if g.quality > 0.0), key=lambda grasp: -grasp.quality)

    def in_object(self, grasp: Grasp, *, friction: ArrayLike = 1.0, edges: int = 8) -> ObjectGrasp:
        """A grasp on the fitted surface, in the object's own coordinates."""
        a_grasp("grasp", grasp)
        contacts = self.to_object(self.surface.points(grasp.u, grasp.theta))
        normals = self.directions_to_object(self.surface.normals(grasp.u, grasp.theta))
        return self._object_grasp(grasp, contacts, normals, friction, edges)

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
        return self._object_grasp(grasp, np.array(contacts), np.array(normals), friction, edges)

    def transfer_to(
        self,
        target: Fit,
        grasp: Grasp,
        method: str = "ascent",
        *,
        friction: ArrayLike = 1.0,
        edges: int = 8,
    ) -> ObjectGrasp:
        """A grasp of this object carried to another one, in that one's own coordinates.

        :func:`graspmoduli.transfer` between the fitted surfaces, each divided by its
        :attr:`length_scale`; the ascent offers contacts only where the target is explained by its
        surface or, of a scan, was not seen.
        """
        if not isinstance(target, Fit):
            raise GraspModuliError(f"target must be a Fit, got {brief(target)}")
        start, end = self.unit_surface, target.unit_surface
        allowed = target.allowed if method == "ascent" else None
        carried = transfer(
            start, grasp, end, method, friction=friction, edges=edges, allowed=allowed
        )
        return target.in_object(carried.grasp, friction=friction, edges=edges)

    def _object_grasp(
        self, grasp: Grasp, contacts: Floats, normals: Floats, friction: ArrayLike, edges: int
    ) -> ObjectGrasp:
        hand = fingers(friction, edges, len(grasp))
        made = PlacedGrasp(contacts, normals, self.to_object(self.surface.center_of_mass))
        options = {
            "friction": carried(hand),
            "edges": hand[1],
            "length_scale": self.length_scale,
        }
        return ObjectGrasp(
            made.contacts,
            made.normals,
            made.center_of_mass,
            grasp=grasp,
            surface=self.surface,
            quality=quality(made, **options),
            **options,
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
    unexplained = float((seen & (~good | sticking)).sum() / max(seen.sum(), 1))
    if unexplained > MOST_UNEXPLAINED:
        raise GraspModuliError(
            "object must be close to a surface in cylindrical coordinates about some axis, "
            f"got one whose outer wall is not for {unexplained:.0%}"
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
        pose=_pose(axis, middle),
        residual=residual,
        coverage=_coverage(surface, good.reshape(grid.rows, grid.columns), mesh),
        unexplained=unexplained,
        allowed=allowed,
    )


def _pose(axis: Axis, middle: float) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = axis.rotation
    pose[:3, 3] = axis.origin + axis.rotation[:, 2] * middle
    return locked(pose)


def _coverage(surface: Surface, good: Booleans, mesh: bool) -> float:
    """Share of the area in cells that were seen; a cloud may leave small holes between points."""
    rows, columns = good.shape
    u, theta = np.meshgrid(
        (np.arange(rows) + 0.5) / rows,
        (np.arange(columns) + 0.5) * 2 * np.pi / columns,
        indexing="ij",
    )
    first, second = surface.tangents(u, theta)
    area = np.linalg.norm(np.cross(first, second), axis=-1)
    covered = good if mesh else ~_dilated(~_dilated(good, 1), 1)
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
