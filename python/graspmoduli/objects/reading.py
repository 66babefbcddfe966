"""Reading objects: a mesh or a point cloud from a file, an array or a trimesh object."""

from __future__ import annotations

import logging
import os
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, finite, numbers
from .._core import GraspModuliError

#: File name endings that can be read.
FORMATS = (".ply", ".obj", ".stl", ".glb", ".gltf", ".off", ".pcd", ".xyz", ".txt", ".npy")

#: Fewest points of a cloud from which an axis and a surface can be estimated.
FEWEST_POINTS = 50
#: Parts farther apart than this, relative to the size, are objects of their own: of a mesh, and of
#: points, in which a gap may be what a camera did not see.
GAP_IN_MESH, GAP_IN_CLOUD = 0.03, 0.08
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
#: A face of an OBJ file with a vertex 0: the first number of a corner such as 3/1/2.
VERTEX_0 = re.compile(rb"^[ \t]*f[ \t](?:[^\r\n]*[ \t])?[+-]?0+(?![^/\s])", re.MULTILINE)
#: Points that stand for an object where only its rough shape matters.
SAMPLES = 4000
#: The level of who calls what is public and calls :func:`read`, from where warnings are given.
TO_CALLER = 5
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
    try:
        folder, exists = path.is_dir(), path.exists()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise GraspModuliError(
            f"object must be a file that exists, got {path} ({reason})"
        ) from None
    if folder:
        raise GraspModuliError(f"object must be a file, got the folder {path}")
    if not exists:
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

            _check_pcd(path)
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
    from trimesh.resolvers import FilePathResolver

    promised = _promised_vertices(path)
    _check_text(path)
    # As it is: vertices are neither merged nor, if not finite, dropped.
    log = logging.getLogger("trimesh")
    level = log.level
    # What it cannot make sense of it would tell with a traceback.
    log.setLevel(logging.CRITICAL)
    try:
        # It names parts after the file, and wants UTF-8 of that.
        resolver = FilePathResolver(str(path))
        resolver.file_name = "object"
        with path.open("rb") as file:
            scene = trimesh.load_scene(file, path.suffix[1:].lower(), resolver, process=False)
    finally:
        log.setLevel(level)
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


def _check_text(path: Path) -> None:
    """Refuses OFF, OBJ and ASCII STL files with zeroed blocks or fewer rows than announced.

    And OBJ faces that count vertices from 0.
    """
    kind = path.suffix.lower()
    if kind not in (".off", ".obj", ".stl"):
        return
    with path.open("rb") as file:
        head = file.read(512)
        if kind == ".stl" and not (head.lstrip().startswith(b"solid") and b"facet" in head):
            return
        text = head + file.read()
    name = kind[1:].upper()
    if b"\0" in text:
        raise GraspModuliError(f"object must be a whole {name} file, got {path} with zeroed bytes")
    if kind == ".obj" and (found := VERTEX_0.search(text)):
        row = text[: found.start()].count(b"\n") + 1
        raise GraspModuliError(
            f"object must have faces that count vertices from 1, as OBJ files do, got {path} with "
            f"vertex 0 in row {row}"
        )
    if kind == ".stl" and b"endsolid" not in text:
        raise GraspModuliError(f"object must be a whole STL file, got {path} without its end")
    if kind == ".stl" and text.count(b"vertex ") != 3 * text.count(b"endfacet"):
        raise GraspModuliError(
            f"object must be a whole STL file, got {path} with {text.count(b'vertex ')} vertices "
            f"for {text.count(b'endfacet')} facets"
        )
    if kind != ".off":
        return
    lines = [line.split(b"#")[0].split() for line in text.splitlines()]
    rows = [line for line in lines if line]
    if rows and rows[0][0].upper().endswith(b"OFF"):
        # The counts may stand in the first row.
        rows[0] = rows[0][1:]
        rows = rows if rows[0] else rows[1:]
    wanted = int(rows[0][0]) + int(rows[0][1])
    if len(rows) - 1 < wanted:
        raise GraspModuliError(
            f"object must be a whole OFF file, got {path} with {len(rows) - 1} of {wanted} "
            "announced rows"
        )


def _check_pcd(path: Path) -> None:
    """Refuses a PCD file with fewer points than its header announces."""
    header: dict[bytes, list[bytes]] = {}
    with path.open("rb") as file:
        for line in file:
            words = line.split()
            if words:
                header[words[0]] = words[1:]
            if words[:1] == [b"DATA"]:
                break
        else:
            raise GraspModuliError(f"object must be a whole PCD file, got {path} without its data")
        wanted = int(header[b"POINTS"][0])
        kind = header[b"DATA"][0]
        if kind == b"ascii":
            found = sum(1 for line in file if line.strip())
        elif kind == b"binary":
            sizes = [int(size) for size in header[b"SIZE"]]
            counts = [int(count) for count in header.get(b"COUNT", [b"1"] * len(sizes))]
            row = sum(size * count for size, count in zip(sizes, counts, strict=True))
            found = len(file.read()) // row
        else:
            # A compressed block knows its own length.
            return
    if found < wanted:
        raise GraspModuliError(
            f"object must be a whole PCD file, got {path} with {found} of {wanted} announced points"
        )


def _without_missing(array: Floats) -> Floats:
    """A cloud as rows, without those that are NaN throughout: pixels of a camera without depth."""
    if array.ndim == 3 and array.shape[2] == 3:
        array = array.reshape(-1, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise GraspModuliError(f"object must have points of shape (n, 3), got {array.shape}")
    missing = np.isnan(array).all(axis=1)
    if missing.any():
        warnings.warn(
            f"{missing.sum():,} of {len(array):,} points are NaN, missing pixels, and left out",
            stacklevel=TO_CALLER,
        )
    return np.ascontiguousarray(array[~missing])


def _checked(points: Any, faces: Any) -> Object:
    array = numbers("object", points)
    if faces is None:
        array = _without_missing(array)
    elif array.ndim != 2 or array.shape[1] != 3:
        raise GraspModuliError(f"object must have points of shape (n, 3), got {array.shape}")
    finite("object", array)
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
    _check_extent(array)
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


def _mesh_samples(points: Floats, faces: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Points spread over a mesh by area, the same ones every time."""
    corners = points[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(cross, axis=1)
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


def _check_single(thing: Object) -> None:
    """Refuses several objects, large parts with clear space between them, and tells of small ones.

    Space is clear if it is wide beside the object and beside the samples' own distances.
    """
    from scipy.spatial import KDTree

    tree = KDTree(thing.samples)
    distances: Any = tree.query(thing.samples, k=2)[0]
    near = 4.0 * float(np.median(distances[:, 1]))

    def shares(gap: float) -> Floats:
        return np.sort(_parts(tree, max(gap * thing.size, near)))[::-1] / len(thing.samples)

    cloud = thing.faces is None
    apart = shares(GAP_IN_CLOUD if cloud else GAP_IN_MESH)
    parts = int((apart > SMALLEST_PART).sum())
    if parts > 1:
        raise GraspModuliError(
            f"object must be a single one, got {parts} parts with space between them; "
            "put each into a file of its own"
        )
    parts = int((shares(GAP_IN_MESH) > SMALLEST_PART).sum())
    if parts > 1:
        warnings.warn(
            f"the object's points are in {parts} parts with a narrow space between them; "
            "they are taken for one object",
            stacklevel=TO_CALLER,
        )
    noise = 1.0 - float(apart[0])
    if noise > MUCH_NOISE:
        warnings.warn(
            f"{noise:.1%} of the object lies apart from the rest and is taken for noise",
            stacklevel=TO_CALLER,
        )


def _parts(tree: Any, reach: float) -> NDArray[np.int64]:
    """Sizes of the sets of points that are connected in steps of at most ``reach``."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = tree.query_pairs(reach, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(tree.n, tree.n))
    return np.bincount(connected_components(graph, directed=False)[1])
