"""Objects, grasps and shapes in a browser: ``graspmoduli view``. Needs the extra ``view`` (viser).

Every browser has a page of its own: what one does is not seen in another. Coordinates in the scene
are those of the fitted surface, divided by its length scale.
"""

from __future__ import annotations

import contextlib
import errno
import io
import socket
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .._arrays import Floats
from .._core import GraspModuliError
from ..grasps import Grasp, place
from ..objects.fitting import Fit, ObjectGrasp
from ..objects.reading import Object
from ..quality import quality
from ..sampling import sample_points
from ..shapes import MODELS, NAMES
from ..surfaces import Surface, combine
from ..synthesis import synthesize
from ..transfers import transfer
from ..wrench_space import WrenchSpace
from .drawing import BODY, FILLED, FINGERS, NET, SEEN, azimuth_across, azimuth_of

try:
    import trimesh
    import viser
    from viser import uplot
except ImportError:
    raise GraspModuliError("view needs viser: pip install 'graspmoduli[view]'") from None

#: Friction cones are drawn this long.
CONE = 0.3
#: Contacts whose triples tell how good a place is.
PLACES = 100
#: The triangle of shapes, in the plane that the first look is at: its corners.
TRIANGLE = np.array([[1.5, 0.0, -0.75], [3.1, 0.0, -0.75], [2.3, 0.0, 0.64]])
#: From the middle of a path's surfaces to the corner: how finely a path is drawn.
PATH = 40
WAYS = ("naive", "gradient", "ascent")
#: What the sliders offer of friction and edges; they reach farther where a command asks for more.
FRICTIONS, EDGES = (0.1, 2.0), (3, 32)


def rgb(color: str) -> tuple[int, int, int]:
    """Of ``"#rrggbb"``."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


# What is drawn ------------------------------------------------------------------------------------


def surface_mesh(surface: Surface, rows: int = 48, columns: int = 72) -> tuple[Floats, Any]:
    """Vertices (n, 3) and faces (k, 3) of a grid on a surface."""
    u, theta = np.meshgrid(
        np.linspace(0.0, 1.0, rows + 1), 2 * np.pi * np.arange(columns) / columns, indexing="ij"
    )
    vertices = surface.points(u, theta).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    here, right = i * columns + j, i * columns + (j + 1) % columns
    above, corner = here + columns, right + columns
    faces = np.concatenate(
        [np.stack([here, right, corner], -1), np.stack([here, corner, above], -1)]
    )
    return vertices, faces.reshape(-1, 3)


def net_segments(surface: Surface) -> Floats:
    """Lines of constant u and θ, a hair outside. Shape (n, 2, 3)."""
    lines = []
    around, upward = np.linspace(0.0, 2 * np.pi, 73), np.linspace(0.0, 1.0, 49)
    for u in np.linspace(0.0, 1.0, 9):
        lines.append((np.full_like(around, u), around))
    for theta in np.linspace(0.0, 2 * np.pi, 17)[:-1]:
        lines.append((upward, np.full_like(upward, theta)))
    segments = []
    for u, theta in lines:
        points = surface.points(u, theta) - 0.003 * surface.normals(u, theta)
        segments.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate(segments)


def cone_mesh(point: Floats, normal: Floats, friction: float, edges: int) -> tuple[Floats, Any]:
    """The friction cone on the finger's side, apex first."""
    axis = -normal
    side = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    angles = 2 * np.pi * np.arange(edges) / edges
    # Wide cones are cut shorter, so that all are of a size.
    height = CONE / np.hypot(1.0, friction)
    rim = point + height * (
        axis + friction * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other)
    )
    k = np.arange(edges)
    faces = np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % edges], axis=1)
    return np.concatenate([point[None], rim]), faces


def draw_object(scene: Any, thing: Object, fit: Fit) -> Any:
    """The object itself, mesh or points, in the surface's coordinates."""
    local = (thing.points - fit.pose[:3, 3]) @ fit.pose[:3, :3] / fit.length_scale
    if thing.faces is None:
        shown = local[:: max(1, len(local) // 30_000)]
        return scene.add_point_cloud(
            "/object", shown, rgb(SEEN), point_size=0.012, point_shape="circle"
        )
    return scene.add_mesh_simple(
        "/object", local, thing.faces, color=rgb(BODY), side="double", flat_shading=False
    )


def draw_net(scene: Any, surface: Surface) -> Any:
    """The fitted surface as a net."""
    return scene.add_line_segments(
        "/fit", net_segments(surface), rgb(NET), thickness=1.0, thickness_units="screen"
    )


def draw_finger(
    scene: Any, index: int, point: Floats, normal: Floats, friction: float, edges: int
) -> None:
    """Cone and normal of a contact."""
    color = rgb(FINGERS[index % len(FINGERS)])
    vertices, faces = cone_mesh(point, normal, friction, edges)
    scene.add_mesh_simple(
        f"/finger {index + 1}/cone", vertices, faces, color=color, opacity=0.45, side="double",
        flat_shading=True, cast_shadow=False,
    )  # fmt: skip
    scene.add_arrows(
        f"/finger {index + 1}/normal", np.stack([point - 1.2 * CONE * normal, point])[None], color,
        shaft_radius=0.008, head_radius=0.025, head_length=0.06,
    )  # fmt: skip


def good_places(surface: Surface, friction: float, edges: int) -> tuple[Floats, Floats, Floats]:
    """(u, θ) of sampled contacts, and the best Q_l of a triple with each of them."""
    u, theta = sample_points(surface, PLACES, seed=0)
    points, normals = surface.points(u, theta), surface.normals(u, theta)
    triples = np.array(
        [(i, j, k) for i in range(PLACES) for j in range(i) for k in range(j)], dtype=np.intp
    )
    values = quality(
        points[triples], normals[triples], surface.center_of_mass, friction=friction, edges=edges
    )
    best = np.zeros(PLACES)
    for column in range(3):
        np.maximum.at(best, triples[:, column], values)
    return u, theta, best


def place_colors(surface: Surface, friction: float, edges: int) -> Any:
    """The surface coloured by how good the best grasp with a contact there is, as a mesh."""
    from matplotlib import colormaps

    u, theta, best = good_places(surface, friction, edges)
    vertices, faces = surface_mesh(surface)
    apart = np.linalg.norm(vertices[:, None] - surface.points(u, theta), axis=2)
    weights = 1.0 / (apart + 0.02) ** 4
    values = (weights @ best) / weights.sum(axis=1)
    low, high = float(best.min()), float(best.max())
    colors = colormaps["cividis"]((values - low) / max(high - low, 1e-12))
    mesh = trimesh.Trimesh(vertices, faces, vertex_colors=(255 * colors).astype(np.uint8))
    return mesh, low, high


# Where a pointer is -------------------------------------------------------------------------------


def under_pointer(surface: Surface, eye: Floats, through: Floats) -> tuple[float, float]:
    """(u, θ) where the ray from the eye through a point meets the surface, or comes nearest."""
    ray = through - eye
    ray = ray / np.linalg.norm(ray)
    reach = float(np.linalg.norm(eye)) + 3.0
    points = eye + np.linspace(0.05, reach, 1500)[:, None] * ray
    span = surface.top - surface.bottom
    u = (points[:, 2] - surface.bottom) / span
    theta = np.arctan2(points[:, 1], points[:, 0])
    outside = np.hypot(points[:, 0], points[:, 1]) - surface.radius(np.clip(u, 0.0, 1.0), theta)
    # Beyond the ends it is the way to them that counts.
    beyond = np.maximum(np.maximum(-u, u - 1.0), 0.0) * span
    distance = np.hypot(np.maximum(outside, 0.0), beyond)
    # Through an open end one sees the inside of the far wall; the near wall is meant.
    enters = np.flatnonzero((outside[1:] <= 0.0) & (outside[:-1] > 0.0) & (beyond[1:] == 0.0))
    at = int(enters[0]) + 1 if enters.size else int(distance.argmin())
    return float(np.clip(u[at], 0.0, 1.0)), float(theta[at])


def barycentric(point: Floats) -> Floats:
    """Weights of the corners of the triangle, at the nearest point of it. Shape (3,)."""
    a, b, c = TRIANGLE
    sides = np.stack([b - a, c - a], axis=1)
    s, t = np.linalg.lstsq(sides, point - a, rcond=None)[0]
    weights = np.array([1.0 - s - t, s, t])
    if (weights >= 0.0).all():
        return weights
    best, nearest = weights, np.inf
    for i, k in ((0, 1), (1, 2), (2, 0)):
        along = TRIANGLE[k] - TRIANGLE[i]
        share = float(np.clip((point - TRIANGLE[i]) @ along / (along @ along), 0.0, 1.0))
        edge = np.zeros(3)
        edge[i], edge[k] = 1.0 - share, share
        far = float(np.linalg.norm(edge @ TRIANGLE - point))
        if far < nearest:
            best, nearest = edge, far
    return best


# Pages --------------------------------------------------------------------------------------------


class GraspPage:
    """An object, its fit and a grasp to play with, in one browser."""

    def __init__(
        self,
        client: Any,
        thing: Object,
        fit: Fit,
        grasps: Sequence[ObjectGrasp],
        friction: float,
        edges: int,
        name: str,
    ) -> None:
        self.client, self.fit, self.grasps = client, fit, grasps
        self.surface = (1.0 / fit.length_scale) * fit.surface
        self.grasp = fit.on_surface(grasps[0]) if grasps else Grasp([0.5] * 3, [0.0, 2.1, 4.2])
        #: The grasp as it was offered, with its contacts on the object; None once it was changed.
        self.offered = grasps[0] if grasps else None
        self.lock = threading.RLock()
        self.climbing = False
        scene, gui = client.scene, client.gui
        look(client, 0.0, 2.3, azimuth_of(self.surface, self.grasp))
        self.object = draw_object(scene, thing, fit)
        self.net = draw_net(scene, self.surface)
        self.colors: Any = None
        gui.add_markdown(f"**{name}**")
        self.text = gui.add_html("")
        steps = max(len(grasps), 1)
        self.rank = gui.add_slider("ranked grasp", 1, max(steps, 2), 1, 1, disabled=steps < 2)
        low, high = min(FRICTIONS[0], friction), max(FRICTIONS[1], friction)
        # A step that meets what was asked for, from an end of the range that was widened or not.
        step = 0.05 if abs((friction - low) / 0.05 % 1.0 - 0.5) > 0.499 else 1e-3 * high
        self.friction = gui.add_slider("friction μ", low, high, step, friction)
        self.edges = gui.add_slider("cone edges l", EDGES[0], max(EDGES[1], edges), 1, edges)
        climb = gui.add_button("Improve this grasp (gradient ascent)")
        shown = gui.add_checkbox("object", True)
        netted = gui.add_checkbox("fitted surface", True)
        colored = gui.add_checkbox("colour: best grasp with a contact here", False)
        self.legend = gui.add_html("", visible=False)
        gui.add_html(
            "<div style='padding:0 12px;font-size:0.85em;opacity:0.8'>Drag a ball to move its "
            "finger along the surface. The black arrow is the push that the grasp resists least."
            "</div>"
        )
        self.spheres = []
        for index in range(3):
            sphere = scene.add_icosphere(
                f"/ball {index + 1}", 0.05, rgb(FINGERS[index]), subdivisions=2
            )
            sphere.on_drag(self._dragger(index))
            self.spheres.append(sphere)

        def choose(_: Any) -> None:
            if self.grasps:
                chosen = self.grasps[min(int(self.rank.value), len(self.grasps)) - 1]
                self.show(fit.on_surface(chosen), chosen)

        self.rank.on_update(choose)
        self.friction.on_update(lambda _: self.show(self.grasp, self.offered))
        self.edges.on_update(lambda _: self.show(self.grasp, self.offered))
        climb.on_click(lambda _: self.climb())

        @shown.on_update
        def _(_: Any) -> None:
            self.object.visible = shown.value and not colored.value

        @netted.on_update
        def _(_: Any) -> None:
            self.net.visible = netted.value

        @colored.on_update
        def _(_: Any) -> None:
            self.object.visible = shown.value and not colored.value
            self.paint(colored.value)

        self.show(self.grasp, self.offered)

    def _dragger(self, index: int) -> Callable[[Any], None]:
        def dragged(event: Any) -> None:
            eye = np.asarray(event.client.camera.position)
            u, theta = under_pointer(self.surface, eye, np.asarray(event.end_position))
            with self.lock:
                us, thetas = self.grasp.u.copy(), self.grasp.theta.copy()
                us[index], thetas[index] = u, theta
                self.show(Grasp(us, thetas))

        return dragged

    def show(self, grasp: Grasp, offered: ObjectGrasp | None = None) -> None:
        """Draws a grasp and says what it is worth: as it was offered, or on the fitted surface."""
        with self.lock, self.client.atomic():
            self.grasp, self.offered = grasp, offered
            mu, l = float(self.friction.value), int(self.edges.value)
            real = offered or self.fit.in_object(grasp, friction=mu, edges=l)
            turn, middle = self.fit.pose[:3, :3], self.fit.pose[:3, 3]
            contacts = (real.contacts - middle) @ turn / self.fit.length_scale
            normals = real.normals @ turn
            for index, sphere in enumerate(self.spheres):
                point, normal = contacts[index], normals[index]
                sphere.position = point
                draw_finger(self.client.scene, index, point, normal, mu, l)
            scale = real.length_scale
            weakest = WrenchSpace(
                real.contacts / scale, real.normals, real.center_of_mass / scale,
                friction=mu, edges=l,
            ).weakest  # fmt: skip
            push, twist = weakest[:3] @ turn, weakest[3:] @ turn
            center = (real.center_of_mass - middle) @ turn / self.fit.length_scale
            length = float(np.linalg.norm(push))
            # Long enough to come out of the object; a pure torque has no arrow.
            tip = center + 1.2 * push / max(length, 1e-9)
            self.client.scene.add_arrows(
                "/weakest", np.stack([center, tip])[None], (20, 20, 20),
                shaft_radius=0.012, head_radius=0.035, head_length=0.08, visible=length > 0.05,
            )  # fmt: skip
            worth = self._worth(grasp, offered)
            self.text.content = numbers(worth, l, scale, push, twist)

    def _worth(self, grasp: Grasp, offered: ObjectGrasp | None = None) -> float:
        """Q_l that is shown of a grasp."""
        mu, l = float(self.friction.value), int(self.edges.value)
        if offered is not None:
            return quality(offered, friction=mu, edges=l)
        return self.fit.in_object(grasp, friction=mu, edges=l).quality

    def climb(self) -> None:
        """Gradient ascent that can be watched."""
        with self.lock:
            if self.climbing:
                return
            self.climbing = True
        try:
            best = self._worth(self.grasp, self.offered)
            for _ in range(120):
                mu, l = float(self.friction.value), int(self.edges.value)
                moved = transfer(
                    self.surface, self.grasp, self.surface, "gradient", friction=mu, edges=l,
                    surfaces=1, steps=4, step_length=2e-3,
                )  # fmt: skip
                value = self._worth(moved.grasp)
                if value <= best + 1e-7:
                    break
                best = value
                self.show(moved.grasp)
                time.sleep(0.03)
            # Steps of fixed length zigzag at a maximum; the last bit is by all facets at once.
            last = transfer(
                self.surface, self.grasp, self.surface, "ascent",
                friction=float(self.friction.value), edges=int(self.edges.value),
            )  # fmt: skip
            # Never worse than the start, in the object's own coordinates, which are what is shown.
            if self._worth(last.grasp) > best:
                self.show(last.grasp)
        finally:
            self.climbing = False

    def paint(self, on: bool) -> None:
        """Colours the surface by the best grasp with a contact there."""
        if self.colors is not None:
            self.colors.remove()
            self.colors = None
        self.legend.visible = on
        if not on:
            return
        mesh, low, high = place_colors(
            self.surface, float(self.friction.value), int(self.edges.value)
        )
        self.colors = self.client.scene.add_mesh_trimesh("/places", mesh)
        self.legend.content = (
            "<div style='padding:0 12px;font-size:0.85em'><div style='height:10px;background:"
            "linear-gradient(to right,#00224e,#575d6d,#a59c74,#fee838)'></div>"
            f"<span>Q = {low:.3f}</span><span style='float:right'>Q = {high:.3f}</span></div>"
        )


class ShapePage:
    """Three shapes as the corners of a triangle, and a grasp carried through it."""

    def __init__(self, client: Any, own: dict[str, Surface]) -> None:
        self.client = client
        self.shapes = {f"{key}: {NAMES[key]}": surface for key, surface in MODELS.items()}
        self.shapes |= own
        names = list(self.shapes)
        gui, scene = client.gui, client.scene
        look(client, 1.25, 4.0, -1.45)
        self.weights = np.array([0.5, 0.25, 0.25])
        self.lock = threading.RLock()
        first = next(iter(own), names[0])
        chosen = (first, names[5], names[10])
        gui.add_markdown("**Shapes between three**")
        self.text = gui.add_html("")
        self.corners = [
            gui.add_dropdown(f"corner {'ABC'[k]}", names, initial_value=name)
            for k, name in enumerate(chosen)
        ]
        self.way = gui.add_dropdown("carry the grasp", WAYS, initial_value="naive")
        self.chart = gui.add_uplot(
            (np.array([0.0, 1.0]), np.zeros(2), np.array([np.nan, np.nan])),
            (
                uplot.Series(label="t"),
                uplot.Series(label="Q along the way", stroke="#0072B2", width=2),
                uplot.Series(
                    label="here", stroke="#D55E00", width=0,
                    points=uplot.Series_Points(show=True, size=12, fill="#D55E00"),
                ),
            ),
            title="from A through the point to the far side",
            scales={"x": uplot.Scale(time=False, auto=False, range=(0.0, 1.0)),
                    "y": uplot.Scale(auto=False, range=(0.0, 0.5))},
            aspect=1.6,
        )  # fmt: skip
        gui.add_html(
            "<div style='padding:0 12px;font-size:0.85em;opacity:0.8'>Drag the orange ball in the "
            "triangle. The best grasp of shape A is carried to the shape at the ball.</div>"
        )
        edges = np.stack([TRIANGLE, TRIANGLE[[1, 2, 0]]], axis=1)
        scene.add_line_segments(
            "/triangle", edges, (120, 130, 140), thickness=2.0, thickness_units="screen"
        )
        for k, corner in enumerate(TRIANGLE):
            out = 1.12 * (corner - TRIANGLE.mean(axis=0)) + TRIANGLE.mean(axis=0)
            scene.add_label(f"/corner {'ABC'[k]}", "ABC"[k], position=out, anchor="center-center")
        self.ball = scene.add_icosphere("/point", 0.07, rgb("#D55E00"), subdivisions=2)
        self.ball.on_drag(self._dragged)
        for corner in self.corners:
            corner.on_update(lambda _: self.start())
        self.way.on_update(lambda _: self.show())
        self.start()

    def _dragged(self, event: Any) -> None:
        eye = np.asarray(event.client.camera.position)
        ray = np.asarray(event.end_position) - eye
        # Where the ray meets the triangle's plane, y = 0.
        if abs(ray[1]) > 1e-9:
            self.move(barycentric(eye - eye[1] / ray[1] * ray))

    def move(self, weights: Floats) -> None:
        """To another point of the triangle."""
        with self.lock:
            self.weights = weights / weights.sum()
            self.show()

    def start(self) -> None:
        """With other corners."""
        with self.lock:
            self.ends = [self.shapes[corner.value] for corner in self.corners]
            found = synthesize(self.ends[0], top=1)
            self.grasp = found[0].grasp if found else Grasp([0.5] * 3, [0.0, 2.1, 4.2])
            self.show()

    def _carried(self, target: Surface, method: str) -> Any:
        finer = {"steps": 10, "step_length": 2e-3} if method == "gradient" else {}
        return transfer(self.ends[0], self.grasp, target, method, surfaces=PATH, **finer)

    def show(self) -> None:
        """The shape at the point, the grasp on it, and its quality on the way there and beyond."""
        with self.lock, self.client.atomic():
            w = self.weights
            rest = w[1] + w[2]
            side = w[1:] / rest if rest > 1e-9 else np.array([0.5, 0.5])
            far = combine(self.ends[1:], side / side.sum())
            t = float(np.clip(1.0 - w[0], 0.0, 1.0))
            method = str(self.way.value)
            path = self._carried(far, method)
            here, carried = self.ends[0], self.grasp
            if t > 1e-9:
                here = combine([self.ends[0], far], [1.0 - t, t])
                carried = self._carried(here, method).grasp
            value = quality(place(here, carried))
            marks = np.full(len(path.t), np.nan)
            nearest = int(np.abs(path.t - t).argmin())
            marks[nearest] = value
            self.chart.data = (path.t.copy(), path.path.copy(), marks)
            vertices, faces = surface_mesh(here)
            self.client.scene.add_mesh_simple(
                "/shape", vertices, faces, color=rgb(FILLED), side="double"
            )
            self.client.scene.add_line_segments(
                "/net", net_segments(here), rgb(NET), thickness=1.0, thickness_units="screen"
            )
            placed = place(here, carried)
            for index in range(3):
                draw_finger(
                    self.client.scene, index, placed.contacts[index], placed.normals[index], 1.0, 8
                )
            self.ball.position = w @ TRIANGLE
            state = "force closure" if value > 0.0 else "lost"
            self.text.content = (
                "<div style='padding:0 12px'><span style='font-size:1.5em'>Q<sub>8</sub> = "
                f"<b data-quality>{value:.4f}</b></span> {state}<br><small>weights "
                f"{w[0]:.2f} A + {w[1]:.2f} B + {w[2]:.2f} C; μ = 1; lengths as in the models"
                "</small></div>"
            )


def numbers(value: float, edges: int, scale: float, push: Floats, twist: Floats) -> str:
    """What the page says of a grasp."""
    if value > 0.0:
        color, state = "#00664b", "force closure"
        meaning = (
            f"With normal forces of 1 N in sum it resists any push of {value:.3f} N and any torque "
            f"of {value:.3f} N × {scale:.3g} (the object's radius in its own unit)."
        )
    else:
        color, state = "#b04a00", "not force closure"
        meaning = "Some push or torque cannot be resisted, however small."
    against = ", ".join(f"{x:+.2f}" for x in push)
    about = ", ".join(f"{x:+.2f}" for x in twist)
    return (
        f"<div style='padding:0 12px'><span style='font-size:1.5em'>Q<sub>{edges}</sub> = "
        f"<b data-quality>{value:.4f}</b></span> <b style='color:{color}'>{state}</b><br>"
        f"<small>{meaning}<br>Weakest against the push ({against}) with the torque ({about}), "
        "a unit wrench in the fit's axes.</small></div>"
    )


def look(client: Any, at: float, far: float, azimuth: float) -> None:
    """From an azimuth, a little above, at a point of the first axis."""
    away = np.array([np.cos(azimuth), np.sin(azimuth), 0.35])
    # Moving the camera takes what it looks at along, so that comes last.
    client.camera.position = far * away + [at, 0.0, 0.0]
    client.camera.look_at = (at, 0.0, 0.0)


# Serving ------------------------------------------------------------------------------------------


def free_port(port: int) -> int:
    """The port, or any free one for 0; refuses one that is in use."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise GraspModuliError(
                    f"port must be one that can be opened, got {port} ({error.strerror})"
                ) from None
            raise GraspModuliError(
                f"port must be free, got {port} in use; name another with --port, or 0 for any"
            ) from None
        return int(probe.getsockname()[1])


def open_server(port: int) -> Any:
    """A viewer's server on loopback; 0 takes any free port."""
    free = free_port(port)
    # Its banner on standard output would not say how to end it.
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer("127.0.0.1", free, label="graspmoduli", verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
    server.gui.main_panel.dock_right()
    return server


def serve_object(
    port: int, thing: Object, fit: Fit, grasps: Sequence[ObjectGrasp], friction: float, edges: int,
    name: str,
) -> Any:  # fmt: skip
    """A page for every browser that comes; the server, which runs until it is stopped."""
    server = open_server(port)
    server.scene.set_up_direction("+z")

    @server.on_client_connect
    def _(client: Any) -> None:
        tabs = client.gui.add_tab_group()
        with tabs.add_tab("Grasp"):
            GraspPage(client, thing, fit, grasps, friction, edges, name)

    return server


def serve_shapes(port: int, own: dict[str, Surface] | None = None) -> Any:
    """The moduli space to play with."""
    server = open_server(port)
    server.scene.set_up_direction("+z")

    @server.on_client_connect
    def _(client: Any) -> None:
        ShapePage(client, own or {})

    return server


def page_of(thing: Object, fit: Fit, grasp: ObjectGrasp | None, friction: float, edges: int) -> str:
    """The scene as one page that opens without a server or a network."""
    server = open_server(0)
    try:
        scene = server.scene
        turn = 0.0
        scene.set_up_direction("+z")
        surface = (1.0 / fit.length_scale) * fit.surface
        draw_object(scene, thing, fit)
        draw_net(scene, surface)
        if grasp is not None:
            turned, origin = fit.pose[:3, :3], fit.pose[:3, 3]
            contacts = (grasp.contacts - origin) @ turned / fit.length_scale
            normals = grasp.normals @ turned
            turn = azimuth_across(contacts)
            for index, (point, normal) in enumerate(zip(contacts, normals, strict=True)):
                draw_finger(scene, index, point, normal, friction, edges)
                scene.add_icosphere(f"/ball {index + 1}", 0.04, rgb(FINGERS[index]), position=point)
            scene.add_label(
                "/quality", f"Q_{edges} = {grasp.quality:.4f} (μ = {friction:g})",
                position=(0.0, 0.0, 1.25 * surface.top), anchor="bottom-center",
            )  # fmt: skip
        server.initial_camera.position = (2.3 * np.cos(turn), 2.3 * np.sin(turn), 0.8)
        server.initial_camera.look_at = (0.0, 0.0, 0.0)
        return server.scene.as_html()
    finally:
        server.stop()
