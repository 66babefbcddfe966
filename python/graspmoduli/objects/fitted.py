"""A surface fitted to an object: between its coordinates and those of the object, on disk."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Floats, a_path, brief, finite, floats, locked, vectors
from .._batches import Cone, evaluated_with, fingers
from .._core import GraspModuliError, arctan2
from .._files import replacing
from .._values import Value
from ..grasps import Grasp, PlacedGrasp, a_grasp
from ..quality import circular_quality, quality
from ..surfaces import Surface
from .agreement import Residual, distances
from .object_grasps import ObjectGrasp
from .scanned import Scanned
from .touching import TriangleMesh
from .walls import CLOSE, Booleans

if TYPE_CHECKING:
    from typing_extensions import Self

#: The version of the files that Fit.save writes.
FILE_VERSION = 3


@dataclass(frozen=True, eq=False)
class Fitted(Value):
    """A surface fitted to an object, and where it lies; :class:`Fit` adds grasps."""

    #: The surface, about its own axis, in the unit of the object.
    surface: Surface
    #: Rigid motion from the surface's coordinates to the object's. Shape (4, 4).
    pose: Floats
    residual: Residual
    #: Share of the surface's area where there is an object: of a mesh, within 2 % of its size; of a
    #: cloud, where it was seen, as the rest is filled in smoothly.
    coverage: float
    #: Share of the object farther than 2 % of its size from the surface: of a mesh, of the area
    #: visible from outside, the surface being closed by lids; of a cloud, of its outer wall's.
    unexplained: float
    #: Share of the surface's area that no object is near: of a mesh, all that is not covered; of a
    #: cloud, where a camera saw that there is nothing, or what is too far from all that was seen.
    phantom: float
    #: Where contacts may lie: cells over u and θ that are explained or, of a scan, unseen.
    #: Shape (k, n).
    allowed: Booleans = field(repr=False)
    #: Is it one part of several (:func:`fit_parts`)? Its grasps then lie on its surface.
    part: bool = False
    #: The object's mesh, where it came as one: grasps are pressed on it.
    mesh: TriangleMesh | None = None
    #: The object's points, where it came as a cloud: contacts that were seen are pressed on them.
    scanned: Scanned | None = None

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

    def _is_on(self, points: Floats) -> Booleans:
        """Do points, in the object's coordinates, lie on the part?"""
        near = distances(points, self.surface, self.pose) <= CLOSE * self.residual.size
        local = (points - self.pose[:3, 3]) @ self.pose[:3, :3]
        rows, columns = self.allowed.shape
        u = (local[:, 2] - self.surface.bottom) / (self.surface.top - self.surface.bottom)
        angle = arctan2(np.ascontiguousarray(local[:, 1]), np.ascontiguousarray(local[:, 0]))
        row = np.clip((u * rows).astype(np.int64), 0, rows - 1)
        column = np.floor(angle / (2 * np.pi) * columns).astype(np.int64) % columns
        return near & self.allowed[row, column]

    def contains(self, points: ArrayLike) -> Booleans:
        """Which points, (n, 3) in the object's coordinates, lie on the surface where it explains
        the object: to within 2 % of the object's size. Shape (n,)."""
        given = finite("points", vectors("points", points, "(n, 3)"))
        return self._is_on(given.reshape(-1, 3))

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
        options: dict[str, Any] = evaluated_with(hand) | {"length_scale": self.length_scale}
        rest = {name: value for name, value in options.items() if name != "edges"}
        bounds = circular_quality(made, **rest)
        if grasp is not None and "coordinates" not in others:
            others["coordinates"] = locked(np.stack([grasp.u, grasp.theta], axis=1))
        return ObjectGrasp(
            made.contacts,
            made.normals,
            made.center_of_mass,
            grasp=grasp,
            surface=self.surface,
            quality=quality(made, **options),
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
                shares=[self.coverage, self.unexplained, self.phantom],
                allowed=self.allowed,
                part=self.part,
                **({} if self.mesh is None else self.mesh.saved()),
                **({} if self.scanned is None else self.scanned.saved()),
            )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Reads what :meth:`save` wrote."""
        file = a_path(path)
        try:
            with file.open("rb") as handle, np.load(handle) as data:
                version = int(data["graspmoduli_fit"])
                if version == FILE_VERSION:
                    bottom, top = data["heights"].tolist()
                    residual = Residual(*data["residual"].tolist())
                    coverage, unexplained, phantom = data["shares"].tolist()
                    return cls(
                        surface=Surface.from_coefficients(data["coefficients"], bottom, top),
                        pose=locked(floats("pose", data["pose"]).reshape(4, 4)),
                        residual=residual,
                        coverage=coverage,
                        unexplained=unexplained,
                        phantom=phantom,
                        allowed=data["allowed"].astype(bool, casting="no"),
                        part="part" in data and bool(data["part"]),
                        mesh=TriangleMesh.loaded(data, residual.size),
                        scanned=Scanned.loaded(data, residual.size),
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
