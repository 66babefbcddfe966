"""What depth cameras write: organised clouds, depth images, several of them from known places."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._arrays import Floats, brief, finite, floats, number
from .._core import GraspModuliError
from .._toml import read_toml
from .files import check_exists, from_file
from .views import View, of_camera, of_depth, of_image

#: What a table of a TOML file may hold beside a cloud, or a depth image.
OF_CLOUD = ("camera", "pose")
OF_DEPTH = ("fx", "fy", "cx", "cy", "unit", "mask", "pose")


class Capture(NamedTuple):
    """Points, and from where they were seen."""

    #: Those that came back. Shape (n, 3).
    points: Floats
    views: tuple[View, ...]
    #: How many there were with those that did not.
    total: int


def of_points(array: Floats, camera: Floats | None) -> Capture:
    """From points (n, 3), or an image of them (rows, columns, 3), NaN where nothing came back.

    Where the camera was is found from an image, and has to be given for points.
    """
    shape = array.shape
    if array.ndim == 3 and shape[2] == 3:
        # Some cameras write 0 where nothing came back: no point is where the camera is.
        array = array.copy()
        array[~array.any(axis=2)] = np.nan
    flat = array.reshape(-1, 3) if array.ndim == 3 and shape[2] == 3 else array
    if flat.ndim != 2 or flat.shape[1] != 3:
        raise GraspModuliError(f"object must have points of shape (n, 3), got {shape}")
    points = np.ascontiguousarray(flat[~np.isnan(flat).all(axis=1)])
    finite("object", points)
    view = of_image(array) if array.ndim == 3 else None
    if view is None and camera is not None and len(points):
        view = of_camera(points, camera)
        if view is None:
            raise GraspModuliError(
                "camera must be where all points are before it, got one among them"
            )
    return Capture(points, () if view is None else (view,), len(flat))


def merged(captures: list[Capture]) -> Capture:
    """Several captures of one object in the same coordinates."""
    return Capture(
        np.concatenate([one.points for one in captures]),
        tuple(view for one in captures for view in one.views),
        sum(one.total for one in captures),
    )


def from_toml(path: Path) -> Capture:
    """The views that a TOML file lists: one, or a ``[[view]]`` each; docs/object.md says how."""
    check_exists(path)
    data = read_toml("object", path)
    views = data.get("view", [data])
    if not isinstance(views, list) or not views or not all(isinstance(v, dict) for v in views):
        raise GraspModuliError(f"object must list its views as [[view]], got {brief(views)}")
    return merged([_view_of(path.parent, view) for view in views])


def _view_of(folder: Path, table: dict[str, Any]) -> Capture:
    if ("depth" in table) == ("cloud" in table):
        raise GraspModuliError(
            "each view of the object must have a depth image or a cloud, "
            f"got {', '.join(sorted(table)) or 'nothing'}"
        )
    kind, others = ("depth", OF_DEPTH) if "depth" in table else ("cloud", OF_CLOUD)
    unknown = sorted(set(table) - {kind, *others})
    if unknown:
        raise GraspModuliError(
            f"a view with a {kind} must hold only {' '.join((kind, *others))}, got {unknown[0]}"
        )
    pose = _pose(table.get("pose"))
    if kind == "depth":
        return _of_depth(folder, table, pose)
    held = from_file(folder / _name(table, "cloud"))
    if held.faces is not None:
        raise GraspModuliError(f"cloud must hold points alone, got a mesh in {table['cloud']}")
    array = floats("object", held.points)
    camera = cameras(table.get("camera", held.camera), 1)[0]
    if array.ndim >= 2 and array.shape[-1] == 3:
        array = array @ pose[:3, :3].T + pose[:3, 3]
    return of_points(array, None if camera is None else pose[:3, :3] @ camera + pose[:3, 3])


def _of_depth(folder: Path, table: dict[str, Any], pose: Floats) -> Capture:
    missing = [name for name in ("fx", "fy", "cx", "cy") if name not in table]
    if missing:
        raise GraspModuliError(f"a view with a depth must have fx fy cx cy, got no {missing[0]}")
    fx, fy = (number(name, table[name], positive=True) for name in ("fx", "fy"))
    cx, cy = (number(name, table[name]) for name in ("cx", "cy"))
    unit = number("unit", table.get("unit", 1.0), positive=True)
    depth = _image(folder / _name(table, "depth"), "depth").astype(np.float64)
    depth = np.where(np.isfinite(depth) & (depth > 0.0), unit * depth, np.nan)
    came_back = np.isfinite(depth)
    chosen = came_back
    if "mask" in table:
        mask = _image(folder / _name(table, "mask"), "mask")
        if mask.shape != depth.shape:
            raise GraspModuliError(
                f"mask must have the shape {depth.shape} of its depth, got {mask.shape}"
            )
        chosen = came_back & (mask != 0)
    row, column = np.nonzero(chosen)
    ahead = depth[chosen]
    local = np.stack([(column - cx) / fx * ahead, (row - cy) / fy * ahead, ahead], axis=1)
    view = of_depth(depth, (fx, fy, cx, cy), pose)
    # Pixels without a depth are no news in a depth image.
    return Capture(local @ pose[:3, :3].T + pose[:3, 3], (view,), len(local))


def _image(path: Path, name: str) -> Any:
    """A picture of one channel, or an array of two dimensions."""
    check_exists(path)
    try:
        if path.suffix.lower() == ".npy":
            array: Any = np.load(path, allow_pickle=False)
        else:
            from PIL import Image

            with Image.open(path) as image:
                array = np.asarray(image)
    except Exception as error:
        # Readers raise whatever their parsing ran into.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise GraspModuliError(
            f"{name} must be a whole image or NPY file, got {path} ({reason[:120]})"
        ) from None
    if array.ndim != 2 or array.dtype.kind not in "biuf" or min(array.shape) < 4:
        raise GraspModuliError(
            f"{name} must be an image of one channel, got {array.dtype} {array.shape} in {path}"
        )
    return array


def _name(table: dict[str, Any], key: str) -> str:
    if not isinstance(table[key], str):
        raise GraspModuliError(f"{key} must be the name of a file, got {brief(table[key])}")
    return table[key]


def _pose(value: Any) -> Floats:
    if value is None:
        return np.eye(4)
    pose = finite("pose", floats("pose", value))
    rigid = pose.shape == (4, 4) and np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0])
    if not rigid or np.abs(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)).max() > 1e-3:
        raise GraspModuliError(
            f"pose must be a rigid motion, rows of a (4, 4) matrix, got {brief(value)}"
        )
    if np.linalg.det(pose[:3, :3]) < 0.0:
        raise GraspModuliError("pose must be a rigid motion, got one that mirrors")
    return pose


def cameras(value: Any, count: int) -> list[Floats | None]:
    """Where the camera was for each of the clouds: one place for all, or one each."""
    if value is None:
        return [None] * count
    places = finite("camera", floats("camera", value))
    if places.shape not in ((3,), (count, 3)):
        raise GraspModuliError(
            f"camera must have shape (3,) or, one per cloud, ({count}, 3), got {places.shape}"
        )
    return list(np.broadcast_to(places, (count, 3)))
