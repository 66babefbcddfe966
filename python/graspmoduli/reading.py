"""Reading objects: a mesh or a point cloud from a file, an array or a trimesh object."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, floats
from ._core import GraspModuliError

#: File name endings that can be read.
FORMATS = (".ply", ".obj", ".stl", ".glb", ".gltf", ".off", ".pcd", ".xyz", ".txt", ".npy")

#: Fewest points of a cloud from which an axis and a surface can be estimated.
FEWEST_POINTS = 50
#: Parts farther apart than this, relative to the size, are objects of their own.
GAP = 0.08
#: A part that holds less than this share of the points or area is noise, not an object.
SMALLEST_PART = 0.05
#: Points that stand for an object where only its rough shape matters.
SAMPLES = 4000
#: Points of a cloud that are used; more add nothing but time.
MOST_POINTS = 30_000


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


def read(source: Any) -> Object:
    """The object in a file, array of points (n, 3), trimesh mesh or pair (vertices, faces)."""
    if isinstance(source, (str, os.PathLike)):
        points, faces = _from_file(Path(source))
    elif hasattr(source, "vertices") and hasattr(source, "faces"):
        points, faces = source.vertices, source.faces
    elif hasattr(source, "vertices"):
        points, faces = source.vertices, None
    elif isinstance(source, tuple) and len(source) == 2:
        points, faces = source
    else:
        points, faces = source, None
    return _checked(points, faces)


def _from_file(path: Path) -> tuple[Any, Any]:
    kind = path.suffix.lower()
    if path.is_dir():
        raise GraspModuliError(f"object must be a file, got the folder {path}")
    if not path.exists():
        raise GraspModuliError(f"object must be a file that exists, got {path}")
    if kind not in FORMATS:
        raise GraspModuliError(
            f"object must be a file of a known format ({' '.join(FORMATS)}), got {path.name}"
        )
    if path.stat().st_size == 0:
        raise GraspModuliError(f"object must not be empty, got the empty file {path}")
    try:
        if kind == ".npy":
            return np.load(path, allow_pickle=False), None
        if kind in (".xyz", ".txt"):
            return np.loadtxt(path, ndmin=2, comments=("#", "//"))[:, :3], None
        if kind == ".pcd":
            from pypcd4.pypcd4 import PointCloud

            return PointCloud.from_path(path).numpy(("x", "y", "z")), None
        return _from_mesh_file(path)
    except GraspModuliError:
        raise
    except PermissionError:
        raise GraspModuliError(f"object must be a file that can be read, got {path}") from None
    except Exception as error:
        # Readers raise whatever their parsing ran into.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise GraspModuliError(
            f"object must be a whole {kind[1:].upper()} file, got {path} ({reason[:120]})"
        ) from None


def _from_mesh_file(path: Path) -> tuple[Any, Any]:
    import trimesh

    promised = _promised_vertices(path)
    scene = trimesh.load_scene(path)
    meshes: list[Any] = []
    clouds: list[Any] = []
    for geometry in scene.dump():
        (meshes if isinstance(geometry, trimesh.Trimesh) else clouds).append(geometry)
    if meshes:
        mesh: Any = trimesh.util.concatenate(meshes)
        points, faces = mesh.vertices, mesh.faces
    elif clouds:
        points, faces = np.concatenate([np.asarray(c.vertices) for c in clouds]), None
    else:
        raise GraspModuliError(f"object must hold a mesh or points, got none in {path}")
    if promised is not None and len(points) == 0 < promised:
        raise GraspModuliError(f"object must be a whole file, got {path} without its points")
    return points, faces if faces is not None and len(faces) else None


def _promised_vertices(path: Path) -> int | None:
    """How many vertices a PLY header announces; a truncated ASCII body is found out by it."""
    if path.suffix.lower() != ".ply":
        return None
    announced: dict[str, int] = {}
    ascii_body = False
    with path.open("rb") as file:
        if file.readline().strip() != b"ply":
            raise GraspModuliError(f"object must be a whole PLY file, got {path} without a header")
        for line in file:
            words = line.split()
            if words[:1] == [b"format"]:
                ascii_body = words[1] == b"ascii"
            if words[:1] == [b"element"]:
                announced[words[1].decode()] = int(words[2])
            if words == [b"end_header"]:
                break
        else:
            raise GraspModuliError(f"object must be a whole PLY file, got {path} cut in its header")
        if ascii_body:
            wanted, found = sum(announced.values()), sum(1 for line in file if line.strip())
            if found < wanted:
                raise GraspModuliError(
                    f"object must be a whole PLY file, got {path} "
                    f"with {found} of {wanted} announced rows"
                )
    return announced.get("vertex")


def _checked(points: Any, faces: Any) -> Object:
    array = floats("object", points)
    if array.ndim != 2 or array.shape[1] != 3:
        raise GraspModuliError(f"object must have points of shape (n, 3), got {array.shape}")
    triangles: NDArray[np.int64] | None = None
    if faces is not None:
        triangles = np.asarray(faces)
        if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
            raise GraspModuliError(
                f"object must have triangles as whole numbers of shape (k, 3), "
                f"got {triangles.dtype} {triangles.shape}"
            )
        triangles = triangles.astype(np.int64)
        if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(array)):
            raise GraspModuliError(
                f"object must have triangles among its {len(array)} vertices, "
                f"got vertex {triangles.max()}"
            )
        array, triangles = _used(array, triangles)
    elif len(array) < FEWEST_POINTS:
        raise GraspModuliError(
            f"object must have at least {FEWEST_POINTS} points for a fit, got {len(array)}"
        )
    if len(array) < 4:
        raise GraspModuliError(f"object must have at least 4 points, got {len(array)}")
    _check_solid(array)
    if triangles is None and len(array) > MOST_POINTS:
        random = np.random.Generator(np.random.Philox(0))
        array = array[np.sort(random.choice(len(array), MOST_POINTS, replace=False))]
    if triangles is None:
        samples, normals = _cloud_samples(array)
    else:
        samples, normals = _mesh_samples(array, triangles)
    centered = samples - samples.mean(axis=0)
    axes = np.linalg.svd(centered, full_matrices=False)[2]
    size = float(np.ptp(array @ axes.T, axis=0).max())
    result = Object(array, triangles, samples, normals, size)
    _check_single(result)
    return result


def _used(points: Floats, faces: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64]]:
    """Without vertices that no triangle uses."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return points[used], renumbered.reshape(faces.shape)


def _check_solid(points: Floats) -> None:
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[0] == 0.0:
        raise GraspModuliError("object must be solid, got all points in one place")
    if spread[1] < 1e-5 * spread[0]:
        raise GraspModuliError("object must be solid, got all points on a line")
    if spread[2] < 1e-5 * spread[0]:
        raise GraspModuliError("object must be solid, got all points on a plane")


def _mesh_samples(points: Floats, faces: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Points spread over a mesh by area, the same ones every time."""
    corners = points[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(cross, axis=1)
    if not doubled.sum() > 0.0:
        raise GraspModuliError("object must have triangles with an area, got none")
    random = np.random.Generator(np.random.Philox(0))
    shares = np.cumsum(doubled) / doubled.sum()
    strata = (np.arange(SAMPLES) + random.random(SAMPLES)) / SAMPLES
    chosen = np.minimum(np.searchsorted(shares, strata), len(faces) - 1)
    a, b = random.random((2, SAMPLES, 1))
    fold = a + b > 1.0
    a, b = np.where(fold, 1.0 - a, a), np.where(fold, 1.0 - b, b)
    triangle = corners[chosen]
    samples = triangle[:, 0] + a * (triangle[:, 1] - triangle[:, 0])
    samples = samples + b * (triangle[:, 2] - triangle[:, 0])
    return samples, cross[chosen] / np.maximum(doubled[chosen], 1e-300)[:, None]


def _cloud_samples(points: Floats) -> tuple[Floats, Floats]:
    """Some of the points with normals estimated from their neighbours."""
    from scipy.spatial import KDTree

    random = np.random.Generator(np.random.Philox(0))
    count = min(len(points), SAMPLES)
    samples = points[np.sort(random.choice(len(points), count, replace=False))]
    # Neighbourhoods as wide as the noise is deep: more points where there are more.
    neighbours = int(np.clip(len(points) // 150, 12, 60))
    _, index = KDTree(points).query(samples, k=min(neighbours, len(points)))
    around = points[index] - points[index].mean(axis=1, keepdims=True)
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
    return samples, np.ascontiguousarray(vectors[:, :, 0])


def _check_single(thing: Object) -> None:
    """Refuses several objects: large parts with clear space between them."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    pairs = KDTree(thing.samples).query_pairs(GAP * thing.size, output_type="ndarray")
    count = len(thing.samples)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, labels = connected_components(graph, directed=False)
    parts = int((np.bincount(labels) > SMALLEST_PART * count).sum())
    if parts > 1:
        raise GraspModuliError(
            f"object must be a single one, got {parts} parts with space between them; "
            "put each into a file of its own"
        )
