"""Pulling at the object: the forces of the fingers that answer, and when the object slips."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...wrench_space import WrenchSpace
from .. import words
from ..forms import finger_color, local
from .scene import draw_label

if TYPE_CHECKING:
    from .grasp_page import GraspPage

#: The handle, and the forces of the fingers, are drawn with so much length for each newton that the
#: fingers squeeze with.
LONG = 0.9
YELLOW = (240, 228, 66)


class Pull:
    """A handle at the object's centre of mass."""

    def __init__(self, page: GraspPage) -> None:
        self.page, self.vector = page, np.array([0.0, 0.0, 0.0])
        gui = page.client.gui
        gui.add_html(
            words.block(
                "Drag the yellow ball: a force at the centre of mass, or a twist. The arrows on "
                "the fingers are the contact forces that answer."
            )
        )
        self.shown = gui.add_checkbox("pull the object", False)
        self.twist = gui.add_checkbox("as a twist", False)
        self.squeeze = gui.add_slider("squeeze, N", 1.0, 100.0, 1.0, 20.0)
        self.payload = gui.add_slider("payload, kg", 0.0, 5.0, 0.05, 0.2)
        self.text = gui.add_html("")
        self.ball: Any = None
        for control in (self.shown, self.twist, self.squeeze, self.payload):
            control.on_update(lambda _: page.redraw())

    @property
    def on(self) -> bool:
        """Is the object pulled at?"""
        return bool(self.shown.value)

    def _dragged(self, event: Any) -> None:
        center = local(self.page.fit, self.page.touch.center)
        with self.page.lock:
            self.vector = np.asarray(event.end_position) - center
            self.page.show(self.page.held)

    def show(self) -> None:
        """The handle, the forces that answer, and what is asked of the fingers."""
        page = self.page
        scene, fit, hand = page.client.scene, page.fit, page.hand
        center = local(fit, page.touch.center)
        if self.ball is None:
            if not self.on:
                return
            self.vector = np.array([0.0, 0.0, 0.5])
            self.ball = scene.add_icosphere("/pull", 0.06, YELLOW, subdivisions=3)
            self.ball.on_drag(self._dragged)
        self.ball.visible = self.on
        squeeze = float(self.squeeze.value)
        self.ball.position = center + self.vector
        scene.add_arrows(
            "/pull arrow", np.stack([center, center + self.vector])[None], YELLOW,
            shaft_radius=0.016, head_radius=0.045, head_length=0.1, visible=self.on,
        )  # fmt: skip
        # As long as LONG: what the fingers squeeze with.
        newtons = squeeze * fit.directions_to_object(self.vector / LONG)
        down = -9.80665 * float(self.payload.value) * fit.pose[:3, 2]
        wrench = np.concatenate([down, np.zeros(3)])
        if self.twist.value:
            wrench[3:] += newtons * page.touch.scale
        else:
            wrench[:3] += newtons
        space = WrenchSpace(
            page.held.contacts, page.held.normals, page.touch.center,
            friction=hand.friction, edges=hand.edges, torsion=hand.torsion,
            length_scale=page.touch.scale,
        )  # fmt: skip
        found = space.resist(wrench, norm=hand.norm)
        for index in range(len(page.held.fingers)):
            force = np.zeros(3) if found.forces is None else found.forces[index]
            point = local(fit, page.held.contacts[index])
            along = force @ fit.pose[:3, :3] * LONG / squeeze
            size = float(np.linalg.norm(force))
            seen = self.on and found.forces is not None and size > 0.01 * squeeze
            # The force of a finger ends where it presses.
            scene.add_arrows(
                f"/finger {index + 1}/force", np.stack([point - along, point])[None],
                finger_color(index), shaft_radius=0.02, head_radius=0.05, head_length=0.09,
                visible=seen,
            )  # fmt: skip
            draw_label(
                scene,
                f"/words/force {index + 1}",
                f"{size:.1f} N",
                point - 1.1 * along,
                visible=seen,
            )
        if not self.on:
            self.text.content = ""
            return
        each = "largest normal force" if hand.norm == "each" else "sum of normal forces"
        pulled = float(np.linalg.norm(newtons))
        unit = "N × the unit of length" if self.twist.value else "N"
        size = pulled * page.touch.scale if self.twist.value else pulled
        if found.forces is None:
            said = "It slips, however hard the fingers press: no forces in the cones balance it."
        elif found.normal_force > squeeze:
            said = (
                f"It slips: a {each} of {found.normal_force:.3g} N is needed, the fingers squeeze "
                f"with {squeeze:.3g} N."
            )
        else:
            said = f"It holds: a {each} of {found.normal_force:.3g} N of {squeeze:.3g} N is needed."
        holds = found.forces is not None and found.normal_force <= squeeze
        what = "Twist" if self.twist.value else "Push"
        self.text.content = words.block(
            f"<b>{what} of {size:.3g} {unit}</b>, and "
            f"{9.80665 * float(self.payload.value):.3g} N of weight along the axis, downwards.<br>"
            f"<b data-pull class='gm-{'good' if holds else 'bad'}'>{said}</b>"
        )
