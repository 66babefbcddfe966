"""The page of an object and its grasps."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..._arrays import Floats
from ...grasps import Grasp
from ...objects.fitting import Fit, ObjectGrasp
from ...objects.reading import Object
from ...quality import quality
from ...transfers import transfer
from ...wrench_space import WrenchSpace
from ..drawing import FINGERS, azimuth_of
from .pointing import under_pointer
from .scene import draw_finger, draw_net, draw_object, look, place_colors, rgb

#: What the sliders offer of friction and edges; they reach farther where a command asks for more.
FRICTIONS, EDGES = (0.1, 2.0), (3, 32)


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
