"""What a depth camera saw: the rays that came back, and the space that it saw to be free."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats

#: Farther than this from every pixel that came back, in pixels, the camera saw nothing at all.
REACH = 2.2
#: Space is free if it is nearer to the camera than what was seen, by this share of the size.
BEFORE = 0.03
#: How far before and behind a contact a finger's way is followed, and in which steps, by the size.
AROUND_CONTACT, THROUGH, STEP = 0.05, 1.0, 0.01
#: An organised cloud is the image of a pinhole if its points lie this close to their pixels.
PINHOLE = 0.25
#: Most pixels from which a projection is found.
MOST_PIXELS = 4_000
#: Pixels around the image of a cloud that is not organised: what is beyond, nobody knows.
MARGIN = 200

Booleans = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class View:
    """A depth image from a known place."""

    #: Where the camera was, in the object's coordinates. Shape (3,).
    camera: Floats
    #: Takes (x, y, z, 1) to (column · depth, row · depth, depth). Shape (3, 4).
    projection: Floats
    #: Smallest depth seen near each pixel, infinite where nothing came back near it and -infinite
    #: where that says nothing. Shape (rows, columns).
    depth: Floats = field(repr=False)

    def is_free(self, points: Floats, size: float) -> Booleans:
        """Was the place of each point seen to be empty? Shape (..., 3) to (...)."""
        shape = points.shape[:-1]
        column, row, depth = _projected(self.projection, points.reshape(-1, 3))
        rows, columns = self.depth.shape
        seen = (depth > 0.0) & (column > -0.5) & (column < columns - 0.5)
        seen &= (row > -0.5) & (row < rows - 0.5)
        nearest = np.full(len(depth), -np.inf)
        at = np.rint(row[seen]).astype(np.int64), np.rint(column[seen]).astype(np.int64)
        nearest[seen] = self.depth[at]
        return (depth < nearest - BEFORE * size).reshape(shape)

    def behind(self, points: Floats) -> Floats:
        """How far behind what was seen points are; NaN beside that. Shape (..., 3) to (...)."""
        column, row, depth = _projected(self.projection, points.reshape(-1, 3))
        rows, columns = self.depth.shape
        within = (depth > 0.0) & (column > -0.5) & (column < columns - 0.5)
        within &= (row > -0.5) & (row < rows - 0.5)
        nearest = np.full(len(depth), np.nan)
        at = np.rint(row[within]).astype(np.int64), np.rint(column[within]).astype(np.int64)
        nearest[within] = np.where(np.isfinite(self.depth[at]), self.depth[at], np.nan)
        return (depth - nearest).reshape(points.shape[:-1])


def is_free(views: tuple[View, ...], points: Floats, size: float) -> Booleans:
    """Did any of the views see the place of each point to be empty? Shape (..., 3) to (...)."""
    free = np.zeros(points.shape[:-1], dtype=bool)
    for view in views:
        free |= view.is_free(points, size)
    return free


def meet(views: tuple[View, ...], points: Floats, ways: Floats, size: float) -> Booleans:
    """Must a straight finger that goes on from each point along its way meet what was seen?

    It does where it would come out of the object through a surface that a camera saw.
    """
    along = np.arange(-AROUND_CONTACT, THROUGH, STEP)
    steps = points[..., None, :] + size * along[:, None] * ways[..., None, :]
    met = np.zeros(points.shape[:-1], dtype=bool)
    for view in views:
        behind = view.behind(steps) / size
        one, next_one = behind[..., :-1], behind[..., 1:]
        with np.errstate(invalid="ignore"):
            through = (one < 0.0) != (next_one < 0.0)
            # At the edge of what is in front the depth jumps.
            through &= (np.abs(one) < BEFORE) & (np.abs(next_one) < BEFORE)
        met |= through.any(axis=-1)
    return met


def hidden(views: tuple[View, ...], points: Floats, inward: Floats, size: float) -> float:
    """Share of what of a surface faces a camera that lies behind what it saw."""
    facing = behind = 0
    for view in views:
        front = ((points - view.camera) * inward).sum(axis=-1) > 0.0
        facing += int(front.sum())
        with np.errstate(invalid="ignore"):
            behind += int((view.behind(points[front]) > BEFORE * size).sum())
    return behind / max(facing, 1)


def _projected(projection: Floats, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Column, row and depth of points. Shapes (n,)."""
    ahead = points @ projection[:, :3].T + projection[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        return ahead[:, 0] / ahead[:, 2], ahead[:, 1] / ahead[:, 2], ahead[:, 2]


def of_image(points: Floats) -> View | None:
    """The view of an organised cloud (rows, columns, 3), NaN where nothing came back.

    Where the camera was follows from the points: they lie on the rays of their pixels. None if
    they do not, or if there are too few to tell.
    """
    valid = np.isfinite(points).all(axis=2)
    pixels = np.argwhere(valid)
    if len(pixels) < 12 or min(points.shape[:2]) < 4:
        return None
    chosen = pixels[:: max(1, len(pixels) // MOST_PIXELS)]
    found = points[chosen[:, 0], chosen[:, 1]]
    flat = chosen[:, ::-1].astype(np.float64)
    projection = _pinhole_at_origin(found, flat)
    if projection is None:
        projection = _pinhole(found, flat)
    if projection is None:
        return None
    depth = np.full(valid.shape, np.inf)
    depth[valid] = _projected(projection, points[valid])[2]
    return _view(projection, depth)


def of_depth(depth: Floats, intrinsics: tuple[float, float, float, float], pose: Floats) -> View:
    """The view of a depth image, NaN where nothing came back.

    Pixels are counted from 0 at their middles; the camera looks along its z, x to the right and y
    down; the pose takes its coordinates to those of the object.
    """
    fx, fy, cx, cy = intrinsics
    to_pixels = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    turn = pose[:3, :3].T
    projection = to_pixels @ np.concatenate([turn, -(turn @ pose[:3, 3])[:, None]], axis=1)
    return _view(projection, np.where(np.isnan(depth), np.inf, depth))


def of_camera(points: Floats, camera: Floats) -> View | None:
    """The view of points that were seen from a place, without their pixels."""
    from scipy.spatial import KDTree

    away = points - camera
    ahead = away.mean(axis=0)
    length = np.linalg.norm(ahead)
    if not length > 0.0:
        return None
    ahead = ahead / length
    side = np.cross(ahead, np.eye(3)[np.argmin(np.abs(ahead))])
    side /= np.linalg.norm(side)
    frame = np.stack([side, np.cross(ahead, side), ahead])
    local = away @ frame.T
    if (local[:, 2] <= 0.0).any():
        return None
    flat = local[:, :2] / local[:, 2:]
    distances: NDArray[np.float64] = np.asarray(KDTree(flat).query(flat, k=5)[0])
    # As far as the fourth: holes in the image do not count as free.
    pitch = float(np.median(distances[:, 4]))
    pitch = max(pitch, float(np.ptp(flat, axis=0).max()) / 1_000)
    if not pitch > 0.0:
        return None
    low = flat.min(axis=0) - MARGIN * pitch
    columns, rows = np.ceil((flat.max(axis=0) + MARGIN * pitch - low) / pitch).astype(int) + 1
    to_pixels = np.array(
        [[1.0 / pitch, 0.0, -low[0] / pitch], [0.0, 1.0 / pitch, -low[1] / pitch], [0.0, 0.0, 1.0]]
    )
    turned = to_pixels @ frame
    projection = np.concatenate([turned, -(turned @ camera)[:, None]], axis=1)
    column, row, away_by = _projected(projection, points)
    depth = np.full((rows, columns), np.inf)
    at = np.rint(row).astype(np.int64), np.rint(column).astype(np.int64)
    np.minimum.at(depth, at, away_by)
    return _view(projection, depth)


def _view(projection: Floats, depth: Floats) -> View:
    from scipy.ndimage import label, minimum_filter

    reach = int(REACH)
    around = np.hypot(*np.mgrid[-reach : reach + 1, -reach : reach + 1]) <= REACH
    nearest = minimum_filter(depth, footprint=around, mode="constant", cval=np.inf)
    # Nothing came back from the void, nor from what is dark or shines; only the void is known to
    # reach the edge of the image.
    found: Any = label(np.isinf(nearest))
    areas = found[0]
    edge = np.concatenate([areas[0], areas[-1], areas[:, 0], areas[:, -1]])
    nearest[(areas > 0) & ~np.isin(areas, edge)] = -np.inf
    camera = -np.linalg.solve(projection[:, :3], projection[:, 3]).astype(np.float64)
    return View(camera, projection, nearest)


def _pinhole_at_origin(points: Floats, flat: Floats) -> Floats | None:
    """The projection of a camera at the origin that looks along the third axis."""
    if not ((points[:, 2] > 0.0).all() or (points[:, 2] < 0.0).all()):
        return None
    projection = np.zeros((3, 4))
    sign = np.sign(points[0, 2])
    for k in range(2):
        ratio = sign * points[:, k] / points[:, 2]
        spread = ratio - ratio.mean()
        if not (spread @ spread) > 0.0:
            return None
        focal = float(spread @ flat[:, k] / (spread @ spread))
        projection[k, k] = focal
        projection[k, 2] = float(flat[:, k].mean() - focal * ratio.mean()) * sign
    projection[2, 2] = sign
    return projection if _fits(projection, points, flat) else None


def _pinhole(points: Floats, flat: Floats) -> Floats | None:
    """The projection of a camera anywhere: the direct linear transform (R. Hartley, A. Zisserman,
    Multiple View Geometry in Computer Vision, 2003, 7.1)."""
    middle, spread = points.mean(axis=0), points.std()
    if not spread > 0.0:
        return None
    local = (points - middle) / spread
    center, pitch = flat.mean(axis=0), flat.std()
    image = (flat - center) / pitch
    one = np.concatenate([local, np.ones((len(local), 1))], axis=1)
    none = np.zeros_like(one)
    equations = np.concatenate(
        [
            np.concatenate([one, none, -image[:, :1] * one], axis=1),
            np.concatenate([none, one, -image[:, 1:] * one], axis=1),
        ]
    )
    _, values, vectors = np.linalg.svd(equations, full_matrices=False)
    # A second solution: the points lie on a plane.
    if values[-2] < 1e-3 * values[0]:
        return None
    found = vectors[-1].reshape(3, 4)
    found[:, :3] /= spread
    found[:, 3] -= found[:, :3] @ middle
    found = np.array([[pitch, 0.0, center[0]], [0.0, pitch, center[1]], [0.0, 0.0, 1.0]]) @ found
    length = np.linalg.norm(found[2, :3])
    if not length > 0.0:
        return None
    found = found / length
    depth = points @ found[2, :3] + found[2, 3]
    found = found * np.sign(depth.mean())
    return found if _fits(found, points, flat) else None


def _fits(projection: Floats, points: Floats, flat: Floats) -> bool:
    column, row, depth = _projected(projection, points)
    if not (depth > 0.0).all():
        return False
    error = np.hypot(column - flat[:, 0], row - flat[:, 1])
    return bool(np.median(error) < PINHOLE)
