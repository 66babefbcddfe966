"""Is an offered grasp there? Straight fingers and balls that land on a mesh, slowly, by all its
triangles: shares nothing with the package.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog


class Verdict(NamedTuple):
    """What became of the fingers of one grasp."""

    #: Distance of the contacts from the mesh, over its size.
    distance: float
    #: How far the first hits of rays along the normals from outside are from them, over the size.
    miss: float
    #: Force closure with the faces' normals where the rays land.
    holds: bool
    #: The same where a ball of 5 % of the size first touches, with the directions to there.
    ball_holds: bool

    def is_true(self, tolerance=0.01):
        return self.distance < tolerance and self.miss < tolerance and self.holds


class Mesh:
    """Triangles of size 1 about the origin, and the way there."""

    def __init__(self, vertices, faces):
        vertices = np.asarray(vertices, float)
        used = vertices[np.unique(faces)]
        self.middle = (used.min(0) + used.max(0)) / 2
        _, _, axes = np.linalg.svd(used - used.mean(0), full_matrices=False)
        self.size = np.ptp(used @ axes.T, axis=0).max()
        self.triangles = (vertices[faces] - self.middle) / self.size
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        across = np.cross(b - a, c - a)
        area = np.linalg.norm(across, axis=1)
        # Those without an area are neither hit by rays nor have they normals.
        kept = area > 1e-14
        self.triangles, self.normals = self.triangles[kept], across[kept] / area[kept, None]

    def local(self, points):
        return (np.asarray(points) - self.middle) / self.size

    def ray(self, start, way):
        """Distance to the first hit and the face, or inf and -1 (T. Möller, B. Trumbore, 1997)."""
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        one, two = b - a, c - a
        p = np.cross(way, two)
        det = (one * p).sum(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = start - a
            u = (s * p).sum(1) / det
            q = np.cross(s, one)
            v = q @ way / det
            t = (two * q).sum(1) / det
            hit = (u >= -1e-12) & (v >= -1e-12) & (u + v <= 1 + 1e-12) & (t > 0)
        if not hit.any():
            return np.inf, -1
        t = np.where(hit, t, np.inf)
        return t.min(), int(t.argmin())

    def nearest(self, point):
        """The nearest point of the mesh (C. Ericson, Real-Time Collision Detection, 5.1.5, by the
        plane and the three sides)."""
        corners = self.triangles
        best, where = np.inf, None
        for k in range(3):
            a, b = corners[:, k], corners[:, (k + 1) % 3]
            along = b - a
            length = (along**2).sum(1)
            share = np.clip(((point - a) * along).sum(1) / np.maximum(length, 1e-300), 0, 1)
            near = a + share[:, None] * along
            away = np.linalg.norm(point - near, axis=1)
            if away.min() < best:
                best, where = away.min(), near[away.argmin()]
        height = ((point - corners[:, 0]) * self.normals).sum(1)
        foot = point - height[:, None] * self.normals
        inside = np.ones(len(corners), bool)
        for k in range(3):
            a, b = corners[:, k], corners[:, (k + 1) % 3]
            inside &= (np.cross(b - a, foot - a) * self.normals).sum(1) >= 0
        if inside.any():
            away = np.where(inside, np.abs(height), np.inf)
            if away.min() < best:
                best, where = away.min(), foot[away.argmin()]
        return best, where

    @np.errstate(all="ignore")
    def ball(self, start, way, radius):
        """Where a ball that comes along a way first touches: how far its centre goes, and the
        point; inf and None if it passes. By faces, sides and corners in closed form."""
        corners = self.triangles
        best, where = np.inf, None
        # The side of each face that looks at the ball.
        normals = np.where((self.normals @ way)[:, None] > 0, -self.normals, self.normals)
        slope = normals @ way
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (((corners[:, 0] - start) * normals).sum(1) + radius) / slope
        foot = start + t[:, None] * way - radius * normals
        inside = np.isfinite(t) & (t > 0)
        for k in range(3):
            a, b = corners[:, k], corners[:, (k + 1) % 3]
            inside &= (np.cross(b - a, foot - a) * self.normals).sum(1) >= 0
        if inside.any():
            t = np.where(inside, t, np.inf)
            best, where = t.min(), foot[t.argmin()]
        for k in range(3):
            a, b = corners[:, k], corners[:, (k + 1) % 3]
            along = b - a
            long = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
            along = along / long[:, None]
            off = start - a
            across = way - (along @ way)[:, None] * along
            off_across = off - (off * along).sum(1)[:, None] * along
            for way_part, off_part, limited in (
                (across, off_across, True),
                (np.broadcast_to(way, off.shape), off, False),
            ):
                p = (way_part**2).sum(1)
                q = (way_part * off_part).sum(1)
                r = (off_part**2).sum(1) - radius**2
                with np.errstate(divide="ignore", invalid="ignore"):
                    t = (-q - np.sqrt(q * q - p * r)) / p
                touch = a
                good = np.isfinite(t) & (t > 0)
                if limited:
                    at = ((start + t[:, None] * way - a) * along).sum(1)
                    good &= (at >= 0) & (at <= long)
                    touch = a + at[:, None] * along
                t = np.where(good, t, np.inf)
                if t.min() < best:
                    best, where = t.min(), touch[t.argmin()]
        return best, where

    def verdict(self, contacts, normals, center, friction=1.0, radius=0.05):
        """The verdict on a grasp given in the coordinates of the file."""
        points, landed, faces, touched, felt = self.local(contacts), [], [], [], []
        distance = miss = 0.0
        for point, way in zip(points, normals, strict=True):
            distance = max(distance, self.nearest(point)[0])
            start = point - 3 * way
            t, face = self.ray(start, way)
            miss = max(miss, abs(t - 3))
            if face >= 0:
                landed.append(start + t * way)
                normal = self.normals[face]
                faces.append(normal * np.sign(normal @ way))
            t, where = self.ball(start, way, radius)
            if where is not None:
                touched.append(where)
                felt.append((where - (start + t * way)) / radius)
        center = self.local(center)
        return Verdict(
            distance,
            miss,
            len(faces) == len(points) and force_closure(landed, faces, center, friction),
            len(felt) == len(points) and force_closure(touched, felt, center, friction),
        )


def force_closure(points, normals, center, friction, edges=8):
    """Is the origin in the interior of the wrenches' hull? By a linear program: the largest t such
    that the origin is a combination of all with weights of at least t, and they span R⁶."""
    wrenches = []
    for point, normal in zip(points, normals, strict=True):
        side = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        side /= np.linalg.norm(side)
        other = np.cross(normal, side)
        for angle in 2 * np.pi * np.arange(edges) / edges:
            force = normal + friction * (np.cos(angle) * side + np.sin(angle) * other)
            wrenches.append([*force, *np.cross(point - center, force)])
    w = np.array(wrenches)
    if np.linalg.matrix_rank(w, tol=1e-6) < 6:
        return False
    count = len(w)
    equal = np.vstack([np.hstack([w.T, np.zeros((6, 1))]), [*np.ones(count), 0.0]])
    above = np.hstack([-np.eye(count), np.ones((count, 1))])
    solved = linprog([*np.zeros(count), -1.0], above, np.zeros(count), equal, [*np.zeros(6), 1.0])
    return bool(solved.status == 0 and -solved.fun > 1e-9)
