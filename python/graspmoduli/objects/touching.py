"""Fingertips pressed on the mesh of a real object: where they may press, and the best grasps there.

The kernels are in ``crates/graspmoduli/src/touch``; they see the mesh at size 1 about the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import Floats, count, floats, locked, number
from .._core import GraspModuliError
from .._values import Value
from .reading import Object, doubled_areas, read, some_faces

#: The radius of a fingertip over the size of the object, if none is given.
TIP = 0.05
#: Tips larger than this, over the object's size, touch an object rather than a place on it.
LARGEST_TIP, SMALLEST_TIP = 0.25, 1e-4
#: Samples of a mesh at which tips are pressed.
SAMPLES = 1_000
#: Rows of the kernels: a place's point, normal, share of the pad that is off, that bears, steady.
POINT, NORMAL, OFF, BEARING, STEADY = slice(0, 3), slice(3, 6), 6, 7, 8


class Shape(NamedTuple):
    """Where the middle of a mesh's mass is, and whether that is known."""

    center_of_mass: Floats
    #: Is the mesh closed, and the centre that of the solid? Else it is that of the surface.
    closed: bool


class TriangleMesh:
    """The triangles of an object in its own coordinates, to be touched from outside.

    Parameters
    ----------
    vertices
        Shape (n, 3).
    faces
        Shape (k, 3).
    size
        The object's largest extent.
    """

    def __init__(self, vertices: Floats, faces: NDArray[np.int64], size: float) -> None:
        self.vertices = locked(np.ascontiguousarray(vertices, dtype=np.float64).copy())
        self.faces = np.ascontiguousarray(faces, dtype=np.int64).copy()
        self.faces.setflags(write=False)
        self.size = float(size)
        self.middle = locked((self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2)

    @classmethod
    def of(cls, thing: Object) -> TriangleMesh | None:
        """The mesh of an object that has been read, if it has one."""
        return None if thing.faces is None else cls(thing.points, thing.faces, thing.size)

    def saved(self) -> dict[str, Any]:
        """Arrays for a file."""
        return {"vertices": self.vertices, "faces": self.faces}

    @classmethod
    def loaded(cls, data: Any, size: float) -> TriangleMesh | None:
        """From the arrays of a file, if they are there."""
        if "vertices" not in data:
            return None
        vertices = floats("vertices", data["vertices"]).reshape(-1, 3)
        faces = data["faces"].astype(np.int64, casting="no").reshape(-1, 3)
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise GraspModuliError("faces must be among the vertices")
        return cls(vertices, faces, size)

    def __reduce__(self) -> tuple[Any, ...]:
        return TriangleMesh, (self.vertices, self.faces, self.size)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TriangleMesh):
            return NotImplemented
        return (
            self.size == other.size
            and np.array_equal(self.vertices, other.vertices)
            and np.array_equal(self.faces, other.faces)
        )

    def __hash__(self) -> int:
        return hash((self.size, (self.vertices + 0.0).tobytes(), self.faces.tobytes()))

    def __repr__(self) -> str:
        return f"TriangleMesh({len(self.faces)} triangles, size {self.size:.4g})"

    @cached_property
    def core(self) -> _core.Mesh:
        """The mesh as the kernels see it."""
        return _core.Mesh(self.local(self.vertices), self.faces)

    def local(self, points: Floats) -> Floats:
        """Points in the kernels' coordinates."""
        return np.ascontiguousarray((points - self.middle) / self.size)

    def back(self, points: Floats) -> Floats:
        """Points in the object's own coordinates."""
        return self.middle + self.size * points

    @cached_property
    def shape(self) -> Shape:
        """Centre of mass: of the solid, its density uniform, if the mesh is closed."""
        points = self.local(self.vertices)
        volume = area = 0.0
        of_solid, of_area = np.zeros(3), np.zeros(3)
        for some in some_faces(self.faces):
            corners = points[some]
            a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
            across, middles = np.cross(b - a, c - a), a + b + c
            areas = np.sqrt((across * across).sum(axis=1))
            volumes = (a * np.cross(b, c)).sum(axis=1)
            volume += float(volumes.sum())
            area += float(areas.sum())
            of_solid += (middles * volumes[:, None]).sum(axis=0)
            of_area += (middles * areas[:, None]).sum(axis=0)
        if abs(volume) > 1e-6 and _is_closed(self.vertices, self.faces):
            center = of_solid / (4.0 * volume)
            # Of parts that are wound against each other the sum is no centre.
            if (np.abs(center) <= 0.5 * np.ptp(points, axis=0)).all():
                return Shape(locked(self.back(center)), True)
        return Shape(locked(self.back(of_area / (3.0 * area))), False)

    @cached_property
    def area(self) -> float:
        """Of all triangles, in the object's unit, squared."""
        doubled = doubled_areas(self.local(self.vertices), self.faces)
        return float(0.5 * doubled.sum() * self.size**2)

    @cached_property
    def radius(self) -> float:
        """The largest distance of a vertex from the centre of mass."""
        away = self.vertices - self.shape.center_of_mass
        return float(np.sqrt((away * away).sum(axis=1).max()))


def _is_closed(vertices: Floats, faces: NDArray[np.int64]) -> bool:
    """Has every edge two triangles, which run through it in opposite directions?

    Corners in the same place are the same, as in files that repeat them.
    """
    if _is_paired(faces, len(vertices)):
        return True
    order = np.lexsort(vertices.T)
    new = np.append(False, (np.diff(vertices[order], axis=0) != 0.0).any(axis=1))
    number = np.empty(len(vertices), dtype=np.int64)
    number[order] = np.cumsum(new)
    return not new[1:].all() and _is_paired(number[faces], len(vertices))


def _is_paired(faces: NDArray[np.int64], count: int) -> bool:
    """Is every directed edge there as often as its reverse?"""
    rising, falling = [], []
    for k in range(3):
        one, other = faces[:, k], faces[:, (k + 1) % 3]
        up, down = one < other, one > other
        rising.append(one[up] * count + other[up])
        falling.append(other[down] * count + one[down])
    if sum(map(len, rising)) != sum(map(len, falling)):
        return False
    one, other = (np.sort(np.concatenate(edges)) for edges in (rising, falling))
    return bool(np.array_equal(one, other))


@dataclass(frozen=True, eq=False)
class ContactMap(Value):
    """Where fingertips may press on an object, in its own coordinates.

    Any of these contacts may be combined: ``gm.quality(map.contacts[k], map.normals[k], z)``.
    """

    #: Where the middle of the tip touches. Shape (n, 3).
    contacts: Floats
    #: The normals that the tip feels, into the object, along which it comes. Shape (n, 3).
    normals: Floats
    #: Share of what lies under the pad whose normal is within 30° of the one felt. Shape (n,).
    flatness: Floats
    #: Share of the whole pad that bears: it lies on the object and is within 30°. Shape (n,).
    bearing: Floats
    #: Does the tip touch, and like here, if it aims half a radius beside? Shape (n,).
    steady: NDArray[np.bool_]
    #: Radius of the tip, in the unit of the object.
    tip_radius: float

    def __len__(self) -> int:
        return len(self.contacts)


def contact_map(
    mesh_or_path: Any, tip_radius: float | None = None, seed: int = 0, *, samples: int = SAMPLES
) -> ContactMap:
    """Where a fingertip may press on a mesh, all over it.

    A tip, a ball, comes straight from outside. It touches what it meets first, on either side of a
    triangle; it feels the mean of the normals under its pad, weighted by how deep it is pressed
    there; it is turned to that twice. It may press where it is not stopped before its middle
    touches and the normal that it feels is within 20° of the way it comes.

    Parameters
    ----------
    mesh_or_path
        As for :func:`graspmoduli.fit`, with faces.
    tip_radius
        In the unit of the object; 5 % of its size if not given.
    seed
        Of the samples, which are spread evenly over the area.
    samples
        How many there are. Places that no tip reaches are left out.

    Returns
    -------
    ContactMap
        The same bits for any number of threads.

    Raises
    ------
    GraspModuliError
        If the object cannot be read or has no faces.
    """
    if isinstance(mesh_or_path, TriangleMesh):
        mesh = mesh_or_path
    else:
        found = TriangleMesh.of(read(mesh_or_path))
        if found is None:
            raise GraspModuliError("mesh_or_path must have faces, got points only")
        mesh = found
    radius = tip(mesh, tip_radius)
    start = count("seed", seed, 0)
    rows = places(mesh, radius, start, count("samples", samples, 1, 10_000_000))
    return ContactMap(
        contacts=locked(mesh.back(rows[:, POINT])),
        normals=locked(rows[:, NORMAL].copy()),
        flatness=locked(1.0 - rows[:, OFF]),
        bearing=locked(rows[:, BEARING].copy()),
        steady=rows[:, STEADY] > 0.0,
        tip_radius=radius * mesh.size,
    )


def tip(mesh: TriangleMesh, tip_radius: float | None) -> float:
    """The radius of a tip over the object's size."""
    if tip_radius is None:
        return TIP
    radius = number("tip_radius", tip_radius, positive=True) / mesh.size
    if not SMALLEST_TIP <= radius <= LARGEST_TIP:
        raise GraspModuliError(
            f"tip_radius must be from {SMALLEST_TIP * mesh.size:.3g} to "
            f"{LARGEST_TIP * mesh.size:.3g} for an object of size {mesh.size:.4g}, "
            f"got {tip_radius:g}"
        )
    return radius


def places(mesh: TriangleMesh, radius: float, seed: int, samples: int = SAMPLES) -> Floats:
    """Rows of places, see :data:`POINT`, in the kernels' coordinates. Shape (n, 9)."""
    random = np.random.Generator(np.random.Philox(seed))
    return mesh.core.map(radius, random.random((samples, 3)))


@dataclass(frozen=True, eq=False)
class ContactCheck(Value):
    """What the mesh, or the points of a scan, say of a contact of a grasp."""

    #: From the nearest point of the object, in its unit; 0 where points lie under the tip.
    distance: float
    #: Between the normal felt and that of the triangle at the contact, or of the surface fitted to
    #: a scan [rad]; NaN where no points lie under the tip.
    angle: float
    #: Was the object seen there? Of a mesh, everywhere; of a scan, where points lie under most of
    #: the pad, and what they say of the normal is sure to 6° and within 15° of the fitted surface.
    seen: bool
    #: Radius, in the object's unit, about the way of the finger within which nothing stands in it:
    #: up to four tip radii are looked at.
    clearance: float
    #: Share of the pad that bears, or that has points under it; NaN where there are none.
    bearing: float
