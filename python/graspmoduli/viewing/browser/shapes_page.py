"""The page of the space of shapes."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from viser import uplot

from ..._arrays import Floats
from ...grasps import Grasp, place
from ...quality import quality
from ...shapes import MODELS, NAMES
from ...surfaces import Surface, combine
from ...synthesis import synthesize
from ...transfers import transfer
from ..drawing import FILLED, NET
from ..forms import net_segments, rgb, surface_mesh
from .scene import draw_finger, look
from .triangle import TRIANGLE, barycentric

#: From the middle of a path's surfaces to the corner: how finely a path is drawn.
PATH = 40
WAYS = ("naive", "gradient", "ascent")


class ShapePage:
    """Three shapes as the corners of a triangle, and a grasp carried through it."""

    def __init__(
        self, client: Any, own: dict[str, Surface], friction: float = 1.0, edges: int = 8
    ) -> None:
        self.client = client
        self.hand = {"friction": friction, "edges": edges}
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
            found = synthesize(self.ends[0], top=1, **self.hand)
            self.grasp = found[0].grasp if found else Grasp([0.5] * 3, [0.0, 2.1, 4.2])
            self.show()

    def _carried(self, target: Surface, method: str) -> Any:
        finer = {"steps": 10, "step_length": 2e-3} if method == "gradient" else {}
        return transfer(
            self.ends[0], self.grasp, target, method, surfaces=PATH, **self.hand, **finer
        )

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
            value = quality(place(here, carried), **self.hand)
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
                    self.client.scene,
                    index,
                    placed.contacts[index],
                    placed.normals[index],
                    **self.hand,
                )
            self.ball.position = w @ TRIANGLE
            state = "force closure" if value > 0.0 else "lost"
            self.text.content = (
                "<div style='padding:0 12px'><span style='font-size:1.5em'>Q<sub>8</sub> = "
                f"<b data-quality>{value:.4f}</b></span> {state}<br><small>weights "
                f"{w[0]:.2f} A + {w[1]:.2f} B + {w[2]:.2f} C; μ = 1; lengths as in the models"
                "</small></div>"
            )
