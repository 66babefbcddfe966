"""Pictures of surfaces, grasps and paths. Needs matplotlib; not imported by the package itself.

Every function returns a :class:`matplotlib.figure.Figure`: ``plot_surface(S).savefig("s.png")``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from .._arrays import Floats, count, floats
from .._core import GraspModuliError
from ..grasps import Grasp, place
from ..moduli import Point, interpolate, sample_weights
from ..objects.fitting import Fit, ObjectGrasp
from ..objects.reading import Object
from ..quality import quality
from ..surfaces import Surface, combine
from ..transfers import QualityAlong, Transfer
from .drawing import (
    BODY,
    FILLED,
    FINGERS,
    NET,
    SEEN,
    Camera,
    Scene,
    add_body,
    add_fingers,
    add_grasp,
    add_net,
    azimuth_across,
    azimuth_of,
    finish,
)

#: Lines, told apart by the colour-blind too and by their dashes (Okabe & Ito).
LINES = (
    ("#0072B2", "-"),
    ("#D55E00", "--"),
    ("#009E73", "-."),
    ("#CC79A7", (0, (1, 1))),
    ("#56B4E9", (0, (5, 1, 1, 1, 1, 1))),
    ("#000000", (0, (6, 3))),
)
#: Of the window of a surface with a grasp on it, in :func:`plot_simplex`.
HELD = 0.19
#: Elevation of the eye above the horizon [rad].
ELEVATION = 0.32


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

    The object is drawn solid, with the fitted surface as a net over it where the grasp lies on it,
    and each friction cone on the side of the finger, with its apex at the contact and the inward
    normal as an arrow.
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
        azimuth = azimuth_across(_local(fit, grasps[0])[0])
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
            _draw(
                axes,
                thing,
                fit,
                grasp,
                azimuth_across(_local(fit, grasp)[0]),
                friction,
                edges,
                labels=False,
            )
            axes.set_title(f"{column + 2}   Q = {grasp.quality:.3f}", fontsize=10, y=-0.12)
    best = "no grasp found"
    if grasps:
        prime = "'" if grasps[0].norm == "each" else ""
        best = f"best grasp: $Q{prime}_{{{edges}}}$ = {grasps[0].quality:.4f}"
    figure.suptitle(f"{title}    {best}    (μ = {friction:g})".strip(), fontsize=13, y=0.965)
    handles = [
        Line2D([], [], marker="o", linestyle="", color=color, label=name)
        for color, name in zip(FINGERS, _finger_names(grasps), strict=False)
    ]
    handles.append(
        Line2D([], [], marker="o", linestyle="", markeredgecolor="0.3", color="white",
               label="contact behind")
    )  # fmt: skip
    if any(_has_net(fit, grasp) for grasp in grasps):
        handles.append(Line2D([], [], color=NET, linewidth=1.0, label="fitted surface"))
    if thing.faces is None:
        handles.append(Line2D([], [], marker="s", linestyle="", color=SEEN, label="points seen"))
    figure.legend(
        handles=handles, loc="lower center", ncols=len(handles), frameon=False, fontsize=9,
        bbox_to_anchor=(0.5, 0.0),
    )  # fmt: skip
    return figure


def _finger_names(grasps: Sequence[ObjectGrasp]) -> list[str]:
    """Names of the fingers of the first grasp, with what is not known from a scan."""
    if not grasps:
        return []
    best = grasps[0]
    seen = [check.seen for check in best.checks or ()] or [True] * len(best.contacts)
    return [f"finger {i + 1}{'' if known else ', unseen'}" for i, known in enumerate(seen)]


def plot_surface(
    surface: Surface,
    grasp: Grasp | None = None,
    *,
    friction: float = 1.0,
    edges: int = 8,
    title: str = "",
) -> Figure:
    """A surface, and a grasp on it with its friction cones, seen from two sides.

    The title gives Q_l, with lengths as they are.
    """
    figure = Figure(figsize=(8.4, 5.0), dpi=150, facecolor="white")
    turn = 0.6 if grasp is None else azimuth_of(surface, grasp)
    for column, offset in enumerate((0.0, np.pi)):
        axes = figure.add_axes((0.5 * column, 0.05, 0.5, 0.85))
        _draw_surface(axes, surface, grasp, turn + offset, friction, edges, labels=True)
        if column:
            axes.set_title("from the other side", fontsize=10, color="0.35", y=-0.05)
    if grasp is not None:
        value = quality(place(surface, grasp), friction=friction, edges=edges)
        title = f"{title}    $Q_{{{edges}}}$ = {value:.4f}    (μ = {friction:g})".strip()
        _dots(figure)
    figure.suptitle(title, fontsize=13, y=0.97)
    return figure


def plot_path(
    start: Point,
    end: Point,
    *,
    steps: int = 6,
    friction: float = 1.0,
    edges: int = 8,
    title: str = "",
) -> Figure:
    """A row of surfaces and grasps along the curve of Eq. (III.1), as in Fig. 4 of the paper."""
    shares = np.linspace(0.0, 1.0, count("steps", steps, 2))
    return plot_row(
        [interpolate(start, end, float(t)) for t in shares],
        [f"t = {t:.2g}" for t in shares],
        friction=friction,
        edges=edges,
        title=title,
    )


def plot_row(
    points: Sequence[Point],
    labels: Sequence[str],
    *,
    friction: float = 1.0,
    edges: int = 8,
    title: str = "",
) -> Figure:
    """Surfaces and grasps side by side, at one scale and from one side, with their Q_l."""
    return plot_rows(points, labels, friction=friction, edges=edges, title=title, turn=False)


def plot_rows(
    points: Sequence[Point],
    labels: Sequence[str],
    *,
    columns: int | None = None,
    friction: float = 1.0,
    edges: int = 8,
    title: str = "",
    turn: bool = True,
) -> Figure:
    """Surfaces and grasps in rows, at one scale, with their labels and Q_l below.

    Parameters
    ----------
    points, labels
        Surface and grasp of each, and what is written below it.
    columns
        How many in a row, all if not given.
    turn
        Each is seen from the side that shows its grasp; if false, all from the side of the first.
    """
    n = len(points) if columns is None else count("columns", columns, 1)
    rows = -(-len(points) // n)
    lines = 1 + max(label.count("\n") + 1 for label in labels)
    # Inches: text below each, the legend and the title once.
    text, picture, foot, head = 0.19 * lines + 0.1, 2.3, 0.35, 0.35 if title else 0.1
    high = rows * (picture + text) + foot + head
    figure = Figure(figsize=(max(2.0 * n, 4.0), high), dpi=150, facecolor="white")
    azimuth = azimuth_of(*points[0])
    bounds = []
    for index, ((surface, grasp), label) in enumerate(zip(points, labels, strict=True)):
        row, column = divmod(index, n)
        bottom = foot + (rows - 1 - row) * (picture + text) + text
        axes = figure.add_axes((column / n, bottom / high, 1.0 / n, picture / high))
        seen_from = azimuth_of(surface, grasp) if turn else azimuth
        _draw_surface(axes, surface, grasp, seen_from, friction, edges, labels=False)
        value = quality(place(surface, grasp), friction=friction, edges=edges)
        # Lost is said in words and in colour.
        told, color = (f"Q = {value:.3f}", "0.15") if value > 0.0 else ("lost", "#D55E00")
        axes.set_title(f"{label}\n{told}", fontsize=10, color=color, y=0.0, va="top", pad=0.0)
        bounds.append((*axes.get_xlim(), *axes.get_ylim()))
    low_x, high_x, low_y, high_y = np.array(bounds).T
    # Room for the arrows.
    edge = 0.06 * float((high_y - low_y).max())
    for axes in figure.axes:
        axes.set_xlim(low_x.min() - edge, high_x.max() + edge)
        axes.set_ylim(low_y.min() - edge, high_y.max() + edge)
    figure.suptitle(title, fontsize=12, y=0.98)
    _dots(figure)
    return figure


def _dots(figure: Figure) -> None:
    """Says what filled dots and rings are."""
    handles = [
        Line2D([], [], marker="o", linestyle="", markersize=5, markeredgecolor="0.3",
               color=fill, label=label)
        for fill, label in (("0.3", "contact in front"), ("white", "contact behind"))
    ]  # fmt: skip
    figure.legend(
        handles=handles, loc="lower center", ncols=2, frameon=False, fontsize=8,
        bbox_to_anchor=(0.5, 0.0),
    )  # fmt: skip


def plot_simplex(
    corners: Sequence[Surface],
    labels: Sequence[str] = ("", "", ""),
    *,
    weights: ArrayLike | None = None,
    grasps: Sequence[Grasp | None] | None = None,
    samples: int = 10,
    seed: int = 0,
    title: str = "",
) -> Figure:
    """Conv(X) of three surfaces, with samples where they lie in the triangle (Fig. 1 of the paper).

    ``weights`` are barycentric coordinates, shape (n, 3); if not given, ``samples`` of them are
    drawn uniformly. ``grasps`` are drawn on the surfaces of the weights, one for each, or None.
    """
    if len(corners) != 3 or len(labels) != 3:
        raise GraspModuliError(
            f"corners and labels must be three each, got {len(corners)} and {len(labels)}"
        )
    if weights is None:
        inside = sample_weights(3, samples, seed)
    else:
        inside = floats("weights", weights)
        if inside.ndim != 2 or inside.shape[1] != 3:
            raise GraspModuliError(f"weights must have shape (n, 3), got {inside.shape}")
    held: list[Grasp | None] = [None] * len(inside) if grasps is None else list(grasps)
    if len(held) != len(inside):
        raise GraspModuliError(
            f"grasps must be one or None for each of {len(inside)} weights, got {len(held)}"
        )
    # Those below are drawn over those above.
    order = np.argsort(-inside[:, 2], kind="stable")
    inside = inside[order]
    held = [None, None, None, *(held[k] for k in order)]
    figure = Figure(figsize=(8.0, 7.2), dpi=150, facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 0.95))
    triangle = np.array([[0.14, 0.19], [0.86, 0.19], [0.5, 0.83]])
    axes.plot(*triangle[[0, 1, 2, 0]].T, color="0.75", linewidth=1.2, zorder=0)
    places = inside @ triangle
    axes.plot(*places.T, "o", color=NET, markersize=3, zorder=1)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    axes.axis("off")
    shapes = [*corners, *(combine(corners, w) for w in inside)]
    # All at one scale: a window of the same size around each.
    reach = max(s.radius_about((0.0, 0.0, 0.5 * (s.bottom + s.top))) for s in shapes)
    for index, (surface, (x, y)) in enumerate(zip(shapes, [*triangle, *places], strict=True)):
        corner = index < 3
        grasp = held[index]
        size = 0.24 if corner else 0.115 if grasp is None else HELD
        window = figure.add_axes((x - 0.5 * size, 0.95 * y - 0.5 * size, size, size))
        scene = Scene()
        # A grasp is seen from its own side.
        camera = Camera(0.6 if grasp is None else azimuth_of(surface, grasp), ELEVATION)
        detail = 20 if grasp is None and not corner else 32
        add_body(scene, camera, surface, "#8fb0c9" if corner else BODY, detail)
        if grasp is None:
            scene.draw(window)
        else:
            add_grasp(window, scene, camera, surface, grasp, friction=1.0, edges=8, labels=False)
        window.set_aspect("equal")
        middle = 0.5 * (surface.bottom + surface.top) * np.cos(ELEVATION)
        window.set_xlim(-reach, reach)
        window.set_ylim(middle - reach, middle + reach)
        window.axis("off")
        if corner and labels[index]:
            above = -0.15 if index < 2 else 0.135
            axes.text(x, y + above, labels[index], ha="center", va="center", fontsize=12)
    if any(grasp is not None for grasp in held):
        _dots(figure)
    figure.suptitle(title, fontsize=13, y=0.98)
    return figure


def plot_quality(
    paths: Mapping[str, QualityAlong | Transfer], *, edges: int = 8, title: str = ""
) -> Figure:
    """Q_l along paths, each with its lowest point marked (Fig. 9 of the paper)."""
    figure = Figure(figsize=(7.2, 4.2), dpi=150, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    for (label, path), (color, dashes) in zip(paths.items(), cycle(LINES)):
        if isinstance(path, QualityAlong):
            values, (at, least) = path.quality, (path.worst_t, path.worst_quality)
        else:
            values, lowest = path.path, int(path.path.argmin())
            at, least = path.t[lowest], path.path[lowest]
        axes.plot(path.t, values, color=color, linestyle=dashes, linewidth=1.8, label=label)
        axes.plot(at, least, "v", color=color, markersize=7, clip_on=False, zorder=3)
    axes.plot([], [], "v", color="0.3", label="lowest")
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("t along the path")
    axes.set_ylabel(f"grasp quality $Q_{{{edges}}}$")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.92")
    axes.legend(frameon=False, fontsize=9)
    axes.set_title(title, fontsize=12)
    return figure


def _draw_surface(
    axes: Any,
    surface: Surface,
    grasp: Grasp | None,
    azimuth: float,
    friction: float,
    edges: int,
    *,
    labels: bool,
) -> None:
    camera = Camera(azimuth, ELEVATION)
    scene = Scene()
    add_body(scene, camera, surface)
    add_net(scene, camera, surface)
    if grasp is None:
        scene.draw(axes)
    else:
        add_grasp(
            axes, scene, camera, surface, grasp, friction=friction, edges=edges, labels=labels
        )
    finish(axes)


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
    camera = Camera(azimuth, ELEVATION)
    scene = Scene()
    _add_object(scene, camera, thing, fit)
    if _has_net(fit, grasp):
        add_net(scene, camera, fit.surface)
    points, normals = _local(fit, grasp)
    scale = fit.length_scale
    add_fingers(axes, scene, camera, points, normals, scale, friction, edges, labels=labels)
    finish(axes)


def _has_net(fit: Fit, grasp: ObjectGrasp) -> bool:
    """Does the grasp lie on the fitted surface, so that it belongs into the picture?"""
    return fit.mesh is None or grasp.grasp is not None


def _local(fit: Fit, grasp: ObjectGrasp) -> tuple[Floats, Floats]:
    """Contacts and normals in the coordinates of the fitted surface."""
    rotation, origin = fit.pose[:3, :3], fit.pose[:3, 3]
    return (grasp.contacts - origin) @ rotation, grasp.normals @ rotation


def _add_object(scene: Scene, camera: Camera, thing: Object, fit: Fit) -> None:
    rotation, origin = fit.pose[:3, :3], fit.pose[:3, 3]
    local = (thing.points - origin) @ rotation
    if thing.faces is None:
        add_body(scene, camera, fit.surface, FILLED)
        # Points as small squares of two triangles each.
        shown = local[:: max(1, len(local) // 6000)]
        flat, depth = camera.project(shown)
        half = 0.004 * thing.size
        fill = to_rgba(SEEN, 0.9)
        for corner in (1.0, -1.0):
            square = half * np.array([[-1.0, -1.0], [1.0, 1.0], [corner, -corner]])
            scene.add(flat[:, None, :] + square, depth, fill, (0, 0, 0, 0))
        return
    add_triangles(scene, camera, local[thing.faces])


def add_triangles(scene: Scene, camera: Camera, triangles: Floats) -> None:
    """A solid of triangles. Shape (n, 3, 3)."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    keep = lengths > 0.0
    triangles, normals = triangles[keep], normals[keep] / lengths[keep, None]
    flat, depth = camera.project(triangles)
    colors = camera.shade(BODY, normals)
    # Edges in the faces' own colours close the seams between them.
    scene.add(flat, depth.mean(axis=1), colors, colors, 0.3)
