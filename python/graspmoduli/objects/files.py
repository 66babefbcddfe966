"""Files of meshes and of points: what they hold, and whether it is all there."""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._core import GraspModuliError

#: File name endings that can be read.
FORMATS = (".ply", ".obj", ".stl", ".glb", ".gltf", ".off", ".pcd", ".xyz", ".txt", ".npy")
#: A face of an OBJ file with a vertex 0: the first number of a corner such as 3/1/2.
VERTEX_0 = re.compile(rb"^[ \t]*f[ \t](?:[^\r\n]*[ \t])?[+-]?0+(?![^/\s])", re.MULTILINE)


def check_exists(path: Path) -> None:
    """Refuses what is no file."""
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


class Held(NamedTuple):
    """What a file holds, as it stands there."""

    #: Shape (n, 3), or that of the image (H, W, 3).
    points: Any
    #: Shape (k, 3), None of points alone.
    faces: Any = None
    #: Where the camera was, if the file says so.
    camera: Any = None


def from_file(path: Path) -> Held:
    """Points and triangles of a file."""
    check_exists(path)
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise GraspModuliError(
            f"object must be a file of a known format ({' '.join(FORMATS)}, or .toml for depth "
            f"images), got {path.name}"
        )
    if path.stat().st_size == 0:
        raise GraspModuliError(f"object must not be empty, got the empty file {path}")
    try:
        if kind == ".npy":
            return Held(np.load(path, allow_pickle=False))
        if kind in (".xyz", ".txt"):
            return Held(np.loadtxt(path, ndmin=2, comments=("#", "//"))[:, :3])
        if kind == ".pcd":
            return _from_pcd(path)
        return Held(*_from_mesh_file(path))
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


def _from_pcd(path: Path) -> Held:
    from pypcd4.pypcd4 import PointCloud

    _check_pcd(path)
    cloud = PointCloud.from_path(path)
    points: Any = cloud.numpy(("x", "y", "z"))
    rows, columns = cloud.metadata.height, cloud.metadata.width
    at = np.array(cloud.metadata.viewpoint[:3], dtype=np.float64)
    # The origin stands there also where nobody knows.
    return Held(
        points.reshape(rows, columns, 3) if rows > 1 else points,
        camera=at if at.any() else None,
    )
