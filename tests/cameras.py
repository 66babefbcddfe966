"""What a depth camera would see of a mesh: a model that shares nothing with the package.

Pixels are (row, column); camera coordinates have x to the right, y down and z ahead.
"""

from typing import NamedTuple

import numpy as np

#: Pixels on a side, and how many sizes the camera is away.
PIXELS, AWAY = 110, 3.0


class View(NamedTuple):
    """An organised cloud, and what is known of how it was made."""

    #: Points in camera coordinates, NaN where nothing came back. Shape (n, n, 3).
    points: np.ndarray
    #: From camera coordinates to those of the mesh. Shape (4, 4).
    pose: np.ndarray
    #: Depth without noise, infinite where there is nothing. Shape (n, n).
    depth: np.ndarray
    #: Focal length and middle of the image, in pixels.
    focal: float
    center: float
    #: Which pixels are of the table. Shape (n, n).
    of_table: np.ndarray

    def in_mesh(self):
        """All points that came back, in the coordinates of the mesh. Shape (k, 3)."""
        points = self.points.reshape(-1, 3)
        points = points[np.isfinite(points).all(1)]
        return points @ self.pose[:3, :3].T + self.pose[:3, 3]

    @property
    def camera(self):
        """Where the camera is, in the coordinates of the mesh."""
        return self.pose[:3, 3]


def looking(view, up, target, distance):
    """The pose of a camera that looks at a target from the direction of the view."""
    back = np.asarray(view, float) / np.linalg.norm(view)
    right = np.cross(-back, up)
    right /= np.linalg.norm(right)
    down = np.cross(-back, right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, down, -back], axis=1)
    pose[:3, 3] = target + distance * back
    return pose


def rasterised(vertices, faces, focal, center, pixels):
    """The depth of the nearest triangle in each pixel, infinite where there is none."""
    depth = np.full((pixels, pixels), np.inf)
    flat = vertices[:, :2] / vertices[:, 2:] * focal + center
    for face in faces:
        corners, z = flat[face], vertices[face, 2]
        low = np.maximum(np.ceil(corners.min(0)).astype(int), 0)
        high = np.minimum(np.floor(corners.max(0)).astype(int), pixels - 1)
        if (low > high).any() or (z <= 0).any():
            continue
        a, b, c = corners
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
        u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
        v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
        w = 1 - u - v
        inside = (u >= 0) & (v >= 0) & (w >= 0)
        # One over the depth is linear in the image.
        with np.errstate(divide="ignore", invalid="ignore"):
            found = 1 / (u / z[0] + v / z[1] + w / z[2])
        part = depth[low[1] : high[1] + 1, low[0] : high[0] + 1]
        part[inside] = np.minimum(part[inside], found[inside])
    return depth


def seen(
    mesh,
    view,
    rng,
    up=(0, 0, 1),
    *,
    noise=0.003,
    flying=0.0,
    dropouts=0.2,
    table=False,
    pixels=PIXELS,
) -> View:
    """A mesh as a camera sees it that looks at its middle, three sizes away.

    Noise is a share of the size; flying pixels and dropouts are shares of the pixels; the table, a
    square of two sizes, is below the mesh.
    """
    vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces)
    low, high = vertices.min(0), vertices.max(0)
    middle, size = (low + high) / 2, np.linalg.norm(high - low)
    pose = looking(view, up, middle, AWAY * size)
    focal, center = 0.9 * pixels * AWAY / 1.0, (pixels - 1) / 2
    local = (vertices - pose[:3, 3]) @ pose[:3, :3]
    depth = rasterised(local, faces, focal, center, pixels)
    of_table = np.zeros(depth.shape, bool)
    if table:
        up = np.asarray(up, float) / np.linalg.norm(up)
        side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
        side /= np.linalg.norm(side)
        other = np.cross(up, side)
        foot = middle + up * ((vertices - middle) @ up).min()
        square = [
            foot + size * (a * side + b * other) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        board = (np.array(square) - pose[:3, 3]) @ pose[:3, :3]
        behind = rasterised(board, [[0, 1, 2], [0, 2, 3]], focal, center, pixels)
        of_table = behind < depth
        depth = np.minimum(depth, behind)
    hit = np.isfinite(depth)
    read = np.where(hit, depth, np.nan)
    read = read + noise * size * rng.standard_normal(depth.shape)
    if flying:
        # Between what is in front and what is behind, and where there is nothing.
        wrong = hit & (rng.random(depth.shape) < flying)
        read = np.where(wrong, depth + size * rng.uniform(-0.5, 0.5, depth.shape), read)
    read = np.where(rng.random(depth.shape) < dropouts, np.nan, read)
    row, column = np.mgrid[:pixels, :pixels]
    rays = np.stack(
        [(column - center) / focal, (row - center) / focal, np.ones_like(depth)], axis=-1
    )
    return View(rays * read[..., None], pose, depth, focal, center, of_table)
