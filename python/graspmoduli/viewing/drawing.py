"""Surfaces, nets, friction cones and contacts drawn in perspective-free views by matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb, to_rgba

from .._arrays import Floats
from ..grasps import Grasp
from ..surfaces import Surface

#: Colours of the fingers, told apart by the colour-blind too (Okabe & Ito).
FINGERS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00")
BODY = "#d9cfc1"
NET = "#37506b"
#: The fitted surface under a cloud of points.
FILLED = "#e9edf2"
#: The points.
SEEN = "#a8763e"
#: Cones are drawn this long, relative to the object's radius.
CONE = 0.30


class Scene:
    """Triangles and lines in space, painted from the farthest to the nearest."""

    def __init__(self) -> None:
        self.parts: list[tuple[Floats, Floats, Floats, Floats, Floats]] = []

    def add(
        self, polygons: Floats, depth: Floats, fill: Any, edge: Any, width: float = 0.0
    ) -> None:
        """Projected triangles (n, 3, 2) or lines (n, 2, 2), with one colour for all or one each."""
        count = len(polygons)
        if polygons.shape[1] == 2:
            # A line is a triangle without an area: all are drawn at once.
            polygons = polygons[:, [0, 1, 1]]
        fills = np.broadcast_to(np.asarray(fill, dtype=float), (count, 4))
        edges = np.broadcast_to(np.asarray(edge, dtype=float), (count, 4))
        self.parts.append((polygons, depth, fills, edges, np.full(count, width)))

    def draw(self, axes: Any) -> None:
        """Paints what was added."""
        polygons, depths, fills, edges, widths = (
            np.concatenate(column) for column in zip(*self.parts, strict=True)
        )
        order = np.argsort(depths, kind="stable")
        axes.add_collection(
            PolyCollection(
                list(polygons[order]),
                facecolors=fills[order],
                edgecolors=edges[order],
                linewidths=widths[order],
                capstyle="round",
            )
        )


class Camera:
    """Orthographic view from an azimuth and elevation [rad], with the third axis up."""

    def __init__(self, azimuth: float, elevation: float) -> None:
        ca, sa, ce, se = (
            np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation),
        )  # fmt: skip
        self.towards = np.array([ca * ce, sa * ce, se])
        self.right = np.array([-sa, ca, 0.0])
        self.up = np.cross(self.towards, self.right)
        light = self.towards + 0.6 * self.up - 0.5 * self.right
        self.light = light / np.linalg.norm(light)

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Picture coordinates (..., 2) and nearness (...)."""
        return np.stack([points @ self.right, points @ self.up], axis=-1), points @ self.towards

    def shade(self, color: str, normals: Floats, alpha: float = 1.0) -> Floats:
        """Colours (n, 4) of faces lit from above the viewer; either side of a face is lit."""
        facing = normals * np.sign(normals @ self.towards)[:, None]
        light = 0.52 + 0.48 * np.clip(facing @ self.light, 0.0, 1.0)
        rgb = np.clip(np.array(to_rgb(color)) * light[:, None] * 1.08, 0.0, 1.0)
        return np.concatenate([rgb, np.full((len(rgb), 1), alpha)], axis=1)


def azimuth_of(surface: Surface, grasp: Grasp) -> float:
    """Across the plane of the contacts of a grasp on a surface, so that all are seen."""
    return azimuth_across(surface.points(grasp.u, grasp.theta))


def azimuth_across(points: Floats) -> float:
    """Across the plane that is nearest to contacts, so that all are seen."""
    normal = np.linalg.svd(points - points.mean(axis=0), full_matrices=True)[2][-1]
    if np.hypot(normal[0], normal[1]) < 0.3:
        # A level grasp: any direction shows it.
        return float(np.arctan2(points[0, 1], points[0, 0]) % (2 * np.pi)) + 0.9
    # Either side of the plane will do; the sign is fixed, so that pictures do not jump.
    side = np.sign(normal[0]) if abs(normal[0]) > 1e-6 else np.sign(normal[1])
    return float(np.arctan2(side * normal[1], side * normal[0])) + 0.35


def add_grasp(
    axes: Any,
    scene: Scene,
    camera: Camera,
    surface: Surface,
    grasp: Grasp,
    *,
    friction: float,
    edges: int,
    labels: bool,
) -> None:
    """Cones and contacts of a grasp on a surface; paints the scene between the two."""
    scale = surface.radius_about(surface.center_of_mass)
    points = surface.points(grasp.u, grasp.theta)
    normals = surface.normals(grasp.u, grasp.theta)
    add_fingers(axes, scene, camera, points, normals, scale, friction, edges, labels=labels)


def add_fingers(
    axes: Any,
    scene: Scene,
    camera: Camera,
    points: Floats,
    normals: Floats,
    scale: float,
    friction: float,
    edges: int,
    *,
    labels: bool,
) -> None:
    """Cones at contacts, their size by the object's; paints the scene, and the contacts over it."""
    for i, (point, normal) in enumerate(zip(points, normals, strict=True)):
        color = FINGERS[i % len(FINGERS)]
        add_cone(scene, camera, point, normal, color, friction, edges, CONE * scale)
    scene.draw(axes)
    for i, (point, normal) in enumerate(zip(points, normals, strict=True)):
        add_contact(axes, camera, point, normal, i, scale, labels)


def finish(axes: Any) -> None:
    """Equal scales and no frame."""
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.margins(0.04)
    axes.axis("off")


def add_body(
    scene: Scene, camera: Camera, surface: Surface, color: str = BODY, detail: int = 48
) -> None:
    """The surface itself, ``detail`` faces high and half as many again around."""
    rows, columns = detail, 3 * detail // 2
    u, theta = np.meshgrid(
        np.linspace(0.0, 1.0, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij"
    )
    points, normals = surface.points(u, theta), surface.normals(u, theta)
    for corners in (((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1))):
        grid = [points[i : i + rows, k : k + columns].reshape(-1, 3) for i, k in corners]
        flat, depth = camera.project(np.stack(grid, axis=1))
        colors = camera.shade(color, normals[:rows, :columns].reshape(-1, 3))
        # Behind the net and the points that lie on it.
        nearness = depth.mean(axis=1) - 0.02 * (surface.top - surface.bottom)
        scene.add(flat, nearness, colors, colors, 0.3)


def add_net(scene: Scene, camera: Camera, surface: Surface) -> None:
    """Lines of constant u and θ on the visible side of a surface."""
    lift = 0.012 * max(surface.top - surface.bottom, 2.0 * float(surface.coefficients.max()))
    around = np.linspace(0.0, 2 * np.pi, 97)
    upward = np.linspace(0.0, 1.0, 97)
    for values, rings in ((np.linspace(0.0, 1.0, 13), True), (around[:-1:4], False)):
        for value in values:
            u, theta = (value, around) if rings else (upward, value)
            points, normals = surface.points(u, theta), surface.normals(u, theta)
            visible = (normals @ camera.towards) < 0.0
            segments = np.stack([points[:-1], points[1:]], axis=1)[visible[:-1]]
            if len(segments):
                flat, depth = camera.project(segments)
                line = to_rgba(NET, 0.45)
                scene.add(flat, depth.mean(axis=1) + lift, (0, 0, 0, 0), line, 0.55)


def add_cone(
    scene: Scene,
    camera: Camera,
    point: Floats,
    normal: Floats,
    color: str,
    friction: float,
    edges: int,
    length: float,
) -> None:
    """The friction cone mirrored to the finger's side, as faces between its edges."""
    axis = -normal
    side = np.cross(axis, [0.0, 0.0, 1.0])
    if np.linalg.norm(side) < 1e-6:
        side = np.array([1.0, 0.0, 0.0])
    side = side / np.linalg.norm(side)
    other = np.cross(axis, side)
    angles = 2 * np.pi * np.arange(edges + 1) / edges
    # Wide cones are cut shorter, so that all are of a size.
    height = length / np.hypot(1.0, friction)
    rim = point + height * (
        axis + friction * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other)
    )
    apex = np.broadcast_to(point, (edges, 3))
    faces = np.stack([apex, rim[:-1], rim[1:]], axis=1)
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    flat, depth = camera.project(faces)
    scene.add(
        flat, depth.mean(axis=1), camera.shade(color, normals, 0.42), to_rgba(color, 0.9), 0.6
    )


def add_contact(
    axes: Any,
    camera: Camera,
    point: Floats,
    normal: Floats,
    index: int,
    scale: float,
    labels: bool,
) -> None:
    """A dot at the contact, the normal from outside to it, and the finger's number."""
    color = FINGERS[index % len(FINGERS)]
    hidden = float(normal @ camera.towards) > 0.0
    alpha = 0.5 if hidden else 1.0
    flat, _ = camera.project(point)
    tail, _ = camera.project(point - normal * CONE * 1.25 * scale)
    axes.annotate(
        "", flat, tail,
        arrowprops={"arrowstyle": "-|>", "color": color, "lw": 1.4, "alpha": alpha},
    )  # fmt: skip
    # A contact behind the object is drawn as a ring.
    axes.plot(
        *flat, "o", markersize=6 if labels else 4, markeredgecolor=color, markeredgewidth=1.3,
        color="white" if hidden else color,
    )  # fmt: skip
    if labels:
        away = tail - flat
        length = np.linalg.norm(away)
        place = tail + (away / length if length > 0.0 else np.array([0.0, 1.0])) * 0.09 * scale
        axes.text(
            *place, str(index + 1), color=color, fontsize=12, fontweight="bold",
            ha="center", va="center",
        )  # fmt: skip
