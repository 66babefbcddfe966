"""Pictures of objects and grasps. Needs matplotlib; not imported by the package itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ._arrays import Floats
from .fitting import Fit, ObjectGrasp
from .reading import Object

#: Colours of the three fingers, told apart by the colour-blind too (Okabe & Ito).
FINGERS = ("#D55E00", "#0072B2", "#009E73")
BODY = "#d9cfc1"
NET = "#37506b"
#: The fitted surface under a cloud of points.
FILLED = "#e9edf2"
#: The points.
SEEN = "#a8763e"
#: Cones are drawn this long, relative to the object's radius.
CONE = 0.30


class _Scene:
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


class _Camera:
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


def plot_grasps(
    thing: Object,
    fit: Fit,
    grasps: Sequence[ObjectGrasp],
    *,
    friction: float = 1.0,
    edges: int = 8,
    title: str = "",
) -> Figure:
    """The object with its best grasp from two sides, and the next grasps smaller below.

    The object is drawn solid, the fitted surface as a net over it, and each friction cone on the
    side of the finger, with its apex at the contact and the inward normal as an arrow.
    """
    others = list(grasps[1:5])
    figure = Figure(figsize=(10.0, 7.6 if others else 5.6), dpi=150, facecolor="white")
    heights = [3.2, 1.5] if others else [1.0]
    rows = figure.add_gridspec(
        len(heights), 1, height_ratios=heights, hspace=0.06,
        left=0.02, right=0.98, top=0.90, bottom=0.07,
    )  # fmt: skip
    upper = rows[0].subgridspec(1, 2, wspace=0.02)
    if grasps:
        azimuth = _azimuth(fit, grasps[0])
        for column, turn in enumerate((0.0, np.pi)):
            axes = figure.add_subplot(upper[column])
            _draw(axes, thing, fit, grasps[0], azimuth + turn, friction, edges, labels=True)
            axes.set_title(
                "from the other side" if turn else "", fontsize=10, color="0.35", y=-0.04
            )
    if others:
        lower = rows[1].subgridspec(1, len(others), wspace=0.05)
        for column, grasp in enumerate(others):
            axes = figure.add_subplot(lower[column])
            _draw(axes, thing, fit, grasp, _azimuth(fit, grasp), friction, edges, labels=False)
            axes.set_title(f"{column + 2}   Q = {grasp.quality:.3f}", fontsize=10, y=-0.12)
    best = f"best grasp: $Q_{{{edges}}}$ = {grasps[0].quality:.4f}" if grasps else "no grasp found"
    figure.suptitle(f"{title}    {best}    (μ = {friction:g})".strip(), fontsize=13, y=0.965)
    handles = [
        Line2D([], [], marker="o", linestyle="", color=color, label=f"finger {i + 1}")
        for i, color in enumerate(FINGERS)
    ]
    handles.append(Line2D([], [], color=NET, linewidth=1.0, label="fitted surface"))
    if thing.faces is None:
        handles.append(Line2D([], [], marker="s", linestyle="", color=SEEN, label="points seen"))
    figure.legend(
        handles=handles, loc="lower center", ncols=len(handles), frameon=False, fontsize=9,
        bbox_to_anchor=(0.5, 0.0),
    )  # fmt: skip
    return figure


def _azimuth(fit: Fit, grasp: ObjectGrasp) -> float:
    """Across the plane of the contacts, so that all three are seen."""
    points = fit.surface.points(grasp.grasp.u, grasp.grasp.theta)
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    if np.hypot(normal[0], normal[1]) < 0.3 * np.linalg.norm(normal):
        # A level grasp: any direction shows it.
        return float(grasp.grasp.theta[0]) + 0.9
    return float(np.arctan2(normal[1], normal[0])) + 0.35


def _draw(
    axes: Any,
    thing: Object,
    fit: Fit,
    grasp: ObjectGrasp,
    azimuth: float,
    friction: float,
    edges: int,
    *,
    labels: bool,
) -> None:
    """One view, in the coordinates of the fitted surface: its axis points up."""
    camera = _Camera(azimuth, 0.32)
    scene = _Scene()
    scale = fit.length_scale
    _add_object(scene, camera, thing, fit)
    _add_net(scene, camera, fit)
    points = fit.surface.points(grasp.grasp.u, grasp.grasp.theta)
    normals = fit.surface.normals(grasp.grasp.u, grasp.grasp.theta)
    for i in range(3):
        _add_cone(scene, camera, points[i], normals[i], FINGERS[i], friction, edges, CONE * scale)
    scene.draw(axes)
    for i in range(3):
        _add_contact(axes, camera, points[i], normals[i], i, scale, labels)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.margins(0.04)
    axes.axis("off")


def _add_object(scene: _Scene, camera: _Camera, thing: Object, fit: Fit) -> None:
    rotation, origin = fit.pose[:3, :3], fit.pose[:3, 3]
    local = (thing.points - origin) @ rotation
    if thing.faces is None:
        _add_body(scene, camera, fit)
        # Points as small squares of two triangles each.
        shown = local[:: max(1, len(local) // 6000)]
        flat, depth = camera.project(shown)
        half = 0.004 * thing.size
        fill = to_rgba(SEEN, 0.9)
        for corner in (1.0, -1.0):
            square = half * np.array([[-1.0, -1.0], [1.0, 1.0], [corner, -corner]])
            scene.add(flat[:, None, :] + square, depth, fill, (0, 0, 0, 0))
        return
    triangles = local[thing.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    keep = lengths > 0.0
    triangles, normals = triangles[keep], normals[keep] / lengths[keep, None]
    flat, depth = camera.project(triangles)
    colors = camera.shade(BODY, normals)
    # Edges in the faces' own colours close the seams between them.
    scene.add(flat, depth.mean(axis=1), colors, colors, 0.3)


def _add_body(scene: _Scene, camera: _Camera, fit: Fit) -> None:
    """The fitted surface itself, where there is no mesh to draw."""
    u, theta = np.meshgrid(np.linspace(0.0, 1.0, 49), np.linspace(0, 2 * np.pi, 73), indexing="ij")
    points, normals = fit.surface.points(u, theta), fit.surface.normals(u, theta)
    for corners in (((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1))):
        grid = [points[i : i + 48, k : k + 72].reshape(-1, 3) for i, k in corners]
        flat, depth = camera.project(np.stack(grid, axis=1))
        colors = camera.shade(FILLED, normals[:48, :72].reshape(-1, 3))
        # Behind the points that lie on it.
        scene.add(flat, depth.mean(axis=1) - 0.02 * fit.residual.size, colors, colors, 0.3)


def _add_net(scene: _Scene, camera: _Camera, fit: Fit) -> None:
    """Lines of constant u and θ on the visible side of the fitted surface."""
    surface = fit.surface
    lift = 0.012 * fit.residual.size
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


def _add_cone(
    scene: _Scene,
    camera: _Camera,
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


def _add_contact(
    axes: Any,
    camera: _Camera,
    point: Floats,
    normal: Floats,
    index: int,
    scale: float,
    labels: bool,
) -> None:
    """A dot at the contact, the normal from outside to it, and the finger's number."""
    color = FINGERS[index]
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
