"""The page of the space of shapes."""

from __future__ import annotations

import contextlib
import threading
from typing import Any

import numpy as np
from matplotlib import colormaps
from viser import uplot

from ..._arrays import Floats
from ...grasps import Grasp, place
from ...quality import quality
from ...shapes import MODELS, NAMES
from ...surfaces import Surface, combine
from ...synthesis import synthesize
from ...transfers import transfer
from .. import words
from ..drawing import FILLED, NET
from ..forms import DARK, net_segments, rgb, surface_mesh
from ..held import Hand
from ..look import framed
from .cameras import COVERED, PHONE, SHEET
from .scene import draw_finger, draw_label
from .script import page_script
from .triangle import TRIANGLE, barycentric

#: How many surfaces there are on a path.
PATH = 40
#: Methods of transfer by what they do.
WAYS = {
    "by keeping its coordinates (naive)": "naive",
    "following the gradient on the way": "gradient",
    "climbing where it arrives (ascent)": "ascent",
}
#: Rows of places in the triangle that are coloured.
ROWS = 10
#: From where one looks: azimuth and height above the horizon.
AZIMUTH, RISE = -1.45, 0.35
#: Of the shapes at the corners, over their own size.
SMALL = 0.2
LOST = (150, 0, 0)


class ShapePage:
    """Three shapes as the corners of a triangle, and a grasp carried through it."""

    def __init__(
        self, client: Any, own: dict[str, Surface], friction: float = 1.0, edges: int = 8
    ) -> None:
        self.client = client
        self.hand = Hand(friction, edges)
        self.shapes = {f"{key}: {NAMES[key]}": surface for key, surface in MODELS.items()}
        self.shapes |= own
        names = list(self.shapes)
        gui, scene = client.gui, client.scene
        self.weights = np.array([0.5, 0.25, 0.25])
        self.lock = threading.RLock()
        self.painting = 0
        first = next(iter(own), names[0])
        chosen = (first, names[5], names[10])
        gui.add_html(page_script("the space of shapes"))
        gui.add_html(
            words.block(
                "<h1 style='font-size:1.1em;margin:4px 0'>Shapes between three</h1>Drag the black "
                "ball in the triangle: the shape beside it is a mixture of the three at the "
                "corners, and the best grasp of A is carried to it."
            )
        )
        self.text = gui.add_html("")
        self.corners = [
            gui.add_dropdown(f"corner {'ABC'[k]}", names, initial_value=name)
            for k, name in enumerate(chosen)
        ]
        ways = list(WAYS)
        self.way = gui.add_dropdown("carry the grasp", ways, initial_value=ways[0])
        self.chart = gui.add_uplot(
            (np.array([0.0, 1.0]), np.zeros(2), np.array([np.nan, np.nan])),
            (
                uplot.Series(label="share of the way"),
                uplot.Series(label="Q along the way", stroke="#0072B2", width=2),
                uplot.Series(
                    label="here", stroke="#191919", width=0,
                    points=uplot.Series_Points(show=True, size=12, fill="#191919"),
                ),
            ),
            title="from A through the ball to the far side",
            scales={"x": uplot.Scale(time=False, auto=False, range=(0.0, 1.0))},
            aspect=1.6,
        )  # fmt: skip
        self.key = gui.add_html("")
        edges_of = np.stack([TRIANGLE, TRIANGLE[[1, 2, 0]]], axis=1)
        scene.add_line_segments(
            "/triangle", edges_of, (90, 100, 110), thickness=2.0, thickness_units="screen"
        )
        self.ball = scene.add_icosphere("/point", 0.07, DARK, subdivisions=3)
        self.ball.on_drag(self._dragged)
        for corner in self.corners:
            corner.on_update(lambda _: self.start())
        self.way.on_update(lambda _: self.restart())
        self.aspect = 0.0
        self.start()
        client.camera.on_update(lambda _: self._reshaped())
        self._reshaped()

    def _reshaped(self) -> None:
        """All is in the window, whatever its shape."""
        camera = self.client.camera
        if abs(float(camera.aspect) - self.aspect) < 0.02:
            return
        self.aspect = float(camera.aspect)
        way = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), RISE])
        corners = np.array([[x, y, z] for x in (-0.9, 0.9) for y in (-0.9, 0.9) for z in (-1, 1)])
        points = np.concatenate([corners, 1.5 * TRIANGLE - 0.5 * TRIANGLE.mean(axis=0)])
        bottom = SHEET if self.aspect < PHONE else 0.0
        eye, target = framed(
            points, way / np.linalg.norm(way), camera.fov, self.aspect, top=COVERED, bottom=bottom
        )
        # Moving the camera takes what it looks at along, so that comes last.
        camera.position = eye
        camera.look_at = target

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
            hand = self.hand
            found = synthesize(self.ends[0], top=1, friction=hand.friction, edges=hand.edges)
            self.grasp = found[0].grasp if found else Grasp([0.5] * 3, [0.0, 2.1, 4.2])
            for k, (corner, surface) in enumerate(zip(TRIANGLE, self.ends, strict=True)):
                out = 1.35 * corner - 0.35 * TRIANGLE.mean(axis=0)
                vertices, faces = surface_mesh(surface, 24, 36)
                self.client.scene.add_mesh_simple(
                    f"/corner {'ABC'[k]}", SMALL * vertices, faces, color=rgb(FILLED),
                    side="double", position=out,
                )  # fmt: skip
                name = str(self.corners[k].value).split(": ")[-1]
                below = out - [0.0, 0.0, 0.34]
                draw_label(self.client.scene, f"/words/{'ABC'[k]}", f"{'ABC'[k]}: {name}", below)
            self.restart()

    def restart(self) -> None:
        """Carried in another way."""
        with self.lock:
            self.painting += 1
            self.show()
            threading.Thread(target=self._paint, args=(self.painting,), daemon=True).start()

    def _paint(self, number: int) -> None:
        """The triangle in the colours of what the grasp is worth there."""
        weights = np.array(
            [(i, k, ROWS - i - k) for i in range(ROWS + 1) for k in range(ROWS + 1 - i)]
        )
        values = []
        for one in weights / ROWS:
            with self.lock:
                # There are other corners now, or another way.
                if number != self.painting:
                    return
                values.append(self._at(one)[2])
        high = max(*values, 1e-9)
        shades = (255 * colormaps["cividis"](np.array(values) / high)[:, :3]).astype(np.uint8)
        shades[np.array(values) <= 0.0] = LOST
        with self.lock, contextlib.suppress(UserWarning):
            if number != self.painting:
                return
            # A little behind the ball.
            self.client.scene.add_point_cloud(
                "/values", weights / ROWS @ TRIANGLE + [0.0, 0.03, 0.0], shades, point_size=0.05,
                point_shape="circle",
            )  # fmt: skip
            key = words.colors(0.0, high, "In the triangle: Q of the grasp carried there")
            self.key.content = key + words.block(
                "<span style='color:#960000'>●</span> the grasp is lost: no force closure"
            )

    def _carried(self, target: Surface) -> Any:
        method = WAYS[str(self.way.value)]
        finer: dict[str, Any] = {}
        if method == "gradient":
            finer = {"steps": 10, "step_length": 2e-3}
        return transfer(
            self.ends[0], self.grasp, target, method, surfaces=PATH,
            friction=self.hand.friction, edges=self.hand.edges, **finer,
        )  # fmt: skip

    def _at(self, w: Floats) -> tuple[Surface, Any, float]:
        """The shape at weights, the grasp on it, and its quality."""
        here, carried = self.ends[0], self.grasp
        if w[0] < 1.0:
            here = combine(self.ends, w / w.sum())
            carried = self._carried(here).grasp
        placed = place(here, carried)
        value = quality(placed, friction=self.hand.friction, edges=self.hand.edges)
        return here, placed, float(value)

    def show(self) -> None:
        """The shape at the point, the grasp on it, and its quality on the way there and beyond."""
        with self.lock, self.client.atomic():
            w, scene = self.weights, self.client.scene
            rest = w[1] + w[2]
            side = w[1:] / rest if rest > 1e-9 else np.array([0.5, 0.5])
            path = self._carried(combine(self.ends[1:], side / side.sum()))
            here, placed, value = self._at(w)
            marks = np.full(len(path.t), np.nan)
            marks[int(np.abs(path.t - (1.0 - w[0])).argmin())] = value
            self.chart.data = (path.t.copy(), path.path.copy(), marks)
            high = 1.1 * max(float(path.path.max()), value, 0.05)
            self.chart.scales = {
                "x": uplot.Scale(time=False, auto=False, range=(0.0, 1.0)),
                "y": uplot.Scale(auto=False, range=(0.0, high)),
            }
            vertices, faces = surface_mesh(here)
            scene.add_mesh_simple("/shape", vertices, faces, color=rgb(FILLED), side="double")
            scene.add_line_segments(
                "/net", net_segments(here), rgb(NET), thickness=1.0, thickness_units="screen"
            )
            for index, (point, normal) in enumerate(
                zip(placed.contacts, placed.normals, strict=True)
            ):
                draw_finger(
                    scene, index, point, normal, self.hand.friction, self.hand.edges,
                    number=str(index + 1),
                )  # fmt: skip
            self.ball.position = w @ TRIANGLE
            closed = value > 0.0
            self.text.content = words.block(
                f"<span style='font-size:1.5em'>{words.name_of(self.hand)} = "
                f"<b data-quality>{value:.4f}</b></span> <b data-closure "
                f"class='gm-{'good' if closed else 'bad'}'>"
                f"{'force closure' if closed else 'lost: not force closure'}</b><br>"
                f"{w[0]:.0%} A, {w[1]:.0%} B, {w[2]:.0%} C; μ = {self.hand.friction:g}; lengths as "
                "in the models"
            )
