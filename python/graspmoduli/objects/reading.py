"""Reading objects: a mesh or a point cloud from a file, an array or a trimesh object."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, count, finite, numbers
from .._core import GraspModuliError
from .captures import Capture, cameras, from_toml, merged, of_points
from .files import from_file
from .scans import Plane, cleaned, described, parts_of, unknown
from .views import View

#: Fewest points of a cloud from which an axis and a surface can be estimated.
FEWEST_POINTS = 50
#: Parts of a mesh farther apart than this, relative to the size, are objects of their own.
GAP_IN_MESH = 0.03
#: A part that holds less than this share of the points or area is noise, not an object.
SMALLEST_PART = 0.05
#: Noise of more than this share is worth a warning.
MUCH_NOISE = 0.01
#: Extents between which products of several lengths neither overflow nor vanish.
LEAST_EXTENT, GREATEST_EXTENT = 1e-45, 1e45
#: A mesh whose area is more times that of the box around it is no surface but a heap of triangles.
MOST_AREA = 4.0
#: Points whose neighbourhoods are this thick, relative to all of them, are a plane with noise, or,
#: if they are 20 times longer than wide, a line.
THICK_PLANE, THICK_LINE = 0.65, 0.35
#: Points that stand for an object where only its rough shape matters.
SAMPLES = 4000
#: Triangles that are looked at at a time.
AT_A_TIME = 1 << 20
#: Points of a scan that are looked at, and of its object that are used; more add nothing but time.
MOST_OF_SCAN, MOST_POINTS = 100_000, 30_000


@dataclass(frozen=True)
class Object:
    """One object in the coordinates in which it came."""

    #: Vertices of the mesh, or points of the cloud. Shape (n, 3).
    points: Floats
    #: Triangles by vertex, None for a cloud. Shape (k, 3).
    faces: NDArray[np.int64] | None
    #: Points spread over it. Shape (s, 3).
    samples: Floats
    #: Unit normals at the samples, of either sign. Shape (s, 3).
    sample_normals: Floats
    #: Largest extent along the principal axes.
    size: float
    #: From where a scan was seen, where that is known.
    views: tuple[View, ...] = ()
    #: On what the object of a scan stands.
    table: Plane | None = None


def read(
    source: Any,
    camera: Any = None,
    object_number: int | None = None,
    *,
    keep_table: bool = False,
) -> Object:
    """The object in a file, array of points, trimesh mesh or pair (vertices, faces).

    A list of files or arrays is several scans of one object. The other arguments are those of
    :func:`graspmoduli.fit`.
    """
    notes: list[str] = []
    chosen = None if object_number is None else count("object_number", object_number, 1)
    found = _held(source, camera)
    if isinstance(found, Capture):
        thing = _of_cloud(found, chosen, notes, keep_table=keep_table)
    elif camera is not None:
        raise GraspModuliError("camera must be left out for a mesh: nothing of it is unseen")
    else:
        thing = _of_mesh(*found, chosen, notes)
    for note in notes:
        # For who calls what is public and calls this.
        warnings.warn(note, stacklevel=3)
    return thing


def _held(source: Any, camera: Any) -> Capture | tuple[Any, Any]:
    """Points as cameras saw them, or vertices and faces."""
    if _is_several(source):
        ats = cameras(camera, len(source))
        several = [_held(one, at) for one, at in zip(source, ats, strict=True)]
        captures = [one for one in several if isinstance(one, Capture)]
        if len(captures) < len(several):
            raise GraspModuliError(
                "object must be clouds of points where it is several, got a mesh"
            )
        return merged(captures)
    at = camera
    if isinstance(source, (str, os.PathLike)):
        path = Path(source)
        if path.suffix.lower() == ".toml":
            if camera is not None:
                raise GraspModuliError("camera must stand in the TOML file, got one beside it")
            return from_toml(path)
        points, faces, known = from_file(path)
        at = known if camera is None else camera
    elif hasattr(source, "vertices") and hasattr(source, "faces"):
        points, faces = source.vertices, source.faces
    elif hasattr(source, "vertices"):
        points, faces = source.vertices, None
    elif isinstance(source, tuple) and len(source) == 2:
        points, faces = source
    else:
        points, faces = source, None
    if faces is not None:
        return points, faces
    return of_points(numbers("object", points), cameras(at, 1)[0])


def _is_several(source: Any) -> bool:
    """Is this a list of files or arrays, not one of coordinates?"""
    return (
        isinstance(source, list)
        and len(source) > 0
        and all(isinstance(one, (str, os.PathLike, np.ndarray, tuple)) for one in source)
        and all(getattr(one, "ndim", 2) >= 2 for one in source)
    )


def _of_cloud(
    capture: Capture, number: int | None, notes: list[str], *, keep_table: bool
) -> Object:
    points, views, total = capture
    if len(points) < total:
        notes.append(
            f"{total - len(points):,} of {total:,} points are NaN, missing pixels, and left out"
        )
    _check_count(points)
    _check_extent(points)
    _check_solid(points)
    found = cleaned(_some(points, MOST_OF_SCAN), views, number, keep_table=keep_table)
    if found.flying > MUCH_NOISE:
        notes.append(f"{found.flying:.1%} of the points are flying pixels, and left out")
    if found.table is not None:
        notes.append(
            f"a table was found, {found.of_table:.0%} of the points, and left out; contacts keep "
            "clear of it (keep_table if it belongs to the object)"
        )
    if found.parts > 1:
        notes.append(
            f"the object's points are in {found.parts} parts with a narrow or an unseen space "
            "between them; they are taken for one object"
        )
    if found.apart > MUCH_NOISE:
        notes.append(f"{found.apart:.1%} of the object lies apart from the rest and is left out")
    _check_count(found.points)
    array = _some(found.points, MOST_POINTS)
    samples, normals = _cloud_samples(array)
    return Object(array, None, samples, normals, size_of(array, samples), views, found.table)


def _some(points: Floats, most: int) -> Floats:
    """At most so many of the points, the same ones every time."""
    if len(points) <= most:
        return points
    random = np.random.Generator(np.random.Philox(0))
    return points[np.sort(random.choice(len(points), most, replace=False))]


def _check_count(points: Floats) -> None:
    if len(points) < FEWEST_POINTS:
        raise GraspModuliError(
            f"object must have at least {FEWEST_POINTS} points for a fit, got {len(points)}"
        )


def _of_mesh(points: Any, faces: Any, number: int | None, notes: list[str]) -> Object:
    array = numbers("object", points)
    if array.ndim != 2 or array.shape[1] != 3:
        raise GraspModuliError(f"object must have points of shape (n, 3), got {array.shape}")
    finite("object", array)
    triangles = np.asarray(faces)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        raise GraspModuliError(
            f"object must have triangles as whole numbers of shape (k, 3), "
            f"got {triangles.dtype} {triangles.shape}"
        )
    triangles = triangles.astype(np.int64, copy=False)
    if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(array)):
        raise GraspModuliError(
            f"object must have triangles among its {len(array)} vertices, "
            f"got vertex {triangles.max()}"
        )
    array, triangles = _used(array, triangles)
    if len(array) < 4:
        raise GraspModuliError(f"object must have at least 4 points, got {len(array)}")
    _check_extent(array)
    _check_solid(array)
    samples, normals = mesh_samples(array, triangles)
    chosen = _single(array, triangles, samples, number, notes)
    if chosen is not None:
        array, triangles = _used(array, chosen)
        samples, normals = mesh_samples(array, triangles)
    return Object(array, triangles, samples, normals, size_of(array, samples))


def size_of(points: Floats, samples: Floats) -> float:
    """The largest extent along the principal axes of the samples."""
    axes = np.linalg.svd(samples - samples.mean(axis=0), full_matrices=False)[2]
    return float(np.ptp(points @ axes.T, axis=0).max())


def _used(points: Floats, faces: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64]]:
    """Without vertices that no triangle uses."""
    used = np.zeros(len(points), dtype=np.bool_)
    used[faces.ravel()] = True
    if used.all():
        return points, faces
    return points[used], (np.cumsum(used) - 1)[faces]


def _check_extent(points: Floats) -> None:
    with np.errstate(over="ignore"):
        extent = float(np.ptp(points, axis=0).max())
    if extent > 0.0 and not LEAST_EXTENT <= extent <= GREATEST_EXTENT:
        raise GraspModuliError(
            f"object must have an extent between {LEAST_EXTENT:g} and {GREATEST_EXTENT:g} in its "
            f"own unit, got {extent:g}"
        )
    if 0.0 < extent < 1e-10 * float(np.abs(points).max()):
        raise GraspModuliError(
            f"object must be nearer to the origin, got an extent of {extent:g} at a distance of "
            f"{float(np.abs(points).max()):g}"
        )


def _check_solid(points: Floats) -> None:
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[0] == 0.0:
        raise GraspModuliError("object must be solid, got all points in one place")
    if spread[1] < 1e-5 * spread[0]:
        raise GraspModuliError("object must be solid, got all points on a line")
    if spread[2] < 1e-5 * spread[0]:
        raise GraspModuliError("object must be solid, got all points on a plane")


def mesh_samples(
    points: Floats, faces: NDArray[np.int64], count: int = SAMPLES
) -> tuple[Floats, Floats]:
    """Points spread over a mesh by area, the same ones every time."""
    doubled = doubled_areas(points, faces)
    if not doubled.sum() > 0.0:
        raise GraspModuliError("object must have triangles with an area, got none")
    a, b, c = np.ptp(points, axis=0)
    # The area is also how often a line through the box crosses the mesh, on average.
    heap = 0.5 * float(doubled.sum()) / (2.0 * float(a * b + b * c + c * a))
    if heap > MOST_AREA:
        raise GraspModuliError(
            f"object must be a surface, got {len(faces):,} triangles with {heap:.0f} times the "
            "area of the box around them"
        )
    random = np.random.Generator(np.random.Philox(0))
    shares = np.cumsum(doubled) / doubled.sum()
    strata = (np.arange(count) + random.random(count)) / count
    chosen = np.minimum(np.searchsorted(shares, strata), len(faces) - 1)
    a, b = random.random((2, count, 1))
    fold = a + b > 1.0
    a, b = np.where(fold, 1.0 - a, a), np.where(fold, 1.0 - b, b)
    triangle = points[faces[chosen]]
    one, other = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    samples = triangle[:, 0] + a * one
    samples = samples + b * other
    return samples, np.cross(one, other) / np.maximum(doubled[chosen], 1e-300)[:, None]


def some_faces(faces: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """All triangles, so many at a time that millions of them do not need gigabytes."""
    for start in range(0, len(faces), AT_A_TIME):
        yield faces[start : start + AT_A_TIME]


def doubled_areas(points: Floats, faces: NDArray[np.int64]) -> Floats:
    """Twice the area of each triangle. Shape (k,)."""
    areas = []
    for some in some_faces(faces):
        corners = points[some]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas.append(np.sqrt((across * across).sum(axis=1)))
    return np.concatenate(areas) if areas else np.zeros(0)


def _cloud_samples(points: Floats) -> tuple[Floats, Floats]:
    """Some of the points with normals estimated from their neighbours."""
    from scipy.spatial import KDTree

    random = np.random.Generator(np.random.Philox(0))
    count = min(len(points), SAMPLES)
    samples = points[np.sort(random.choice(len(points), count, replace=False))]
    # Neighbourhoods as wide as the noise is deep: more points where there are more.
    neighbours = int(np.clip(len(points) // 150, 12, 60))
    index: Any = KDTree(points).query(samples, k=min(neighbours, len(points)))[1]
    around = points[index] - points[index].mean(axis=1, keepdims=True)
    squares, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
    # A solid looks flat from near by; a plane or a line with noise is as thick there as anywhere.
    near = np.sqrt(np.maximum(squares[:, 0], 0.0) / index.shape[1])
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    limit = THICK_LINE if spread[1] < 0.05 * spread[0] else THICK_PLANE
    if np.median(near) > limit * spread[2] / np.sqrt(len(points)):
        raise GraspModuliError("object must be solid, got points on a plane or a line, with noise")
    return samples, np.ascontiguousarray(vectors[:, :, 0])


def _single(
    points: Floats,
    faces: NDArray[np.int64],
    samples: Floats,
    number: int | None,
    notes: list[str],
) -> NDArray[np.int64] | None:
    """The triangles of the object of this number, where there are several; tells of small parts.

    Objects are large parts with clear space between them: wide beside all, and beside the
    samples' own distances.
    """
    from scipy.spatial import KDTree

    tree = KDTree(samples)
    distances: Any = tree.query(samples, k=2)[0]
    size = size_of(points, samples)
    part = parts_of(tree, max(GAP_IN_MESH * size, 4.0 * float(np.median(distances[:, 1]))))
    shares = np.bincount(part) / len(samples)
    order = np.argsort(-shares, kind="stable")
    objects = [int(k) for k in order if shares[k] > SMALLEST_PART]
    if len(objects) > 1 and number is None:
        raise GraspModuliError(
            described([samples[part == k] for k in objects], "of the area", len(samples))
        )
    if number is not None and number > max(len(objects), 1):
        raise GraspModuliError(unknown(max(len(objects), 1), number))
    if len(objects) > 1 and number is not None:
        # A triangle belongs to the sample that is nearest.
        owner = part[tree.query(points[faces].mean(axis=1))[1]]
        return faces[owner == objects[number - 1]]
    noise = 1.0 - float(shares[order[0]])
    if noise > MUCH_NOISE:
        notes.append(f"{noise:.1%} of the object lies apart from the rest and is taken for noise")
    return None
