"""What is drawn: objects, surfaces, fingers and their friction cones, arrows, places in colours."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._arrays import Floats
from ...objects.fitting import Fit
from ...objects.reading import Object
from ...surfaces import Surface
from ..drawing import BODY, NET, SEEN
from ..forms import (
    CONE,
    DARK,
    cone_mesh,
    disc_mesh,
    exits,
    fewer,
    finger_color,
    local,
    net_segments,
    rgb,
    turned_to,
    twist_end,
    twist_mesh,
)

#: A contact that no finger makes.
BAD = (150, 0, 0)


def draw_object(scene: Any, thing: Object, fit: Fit) -> Any:
    """The object itself, mesh or points, in the surface's coordinates."""
    if thing.faces is None:
        shown = local(fit, thing.points[:: max(1, len(thing.points) // 30_000)])
        return scene.add_point_cloud(
            "/object", shown, rgb(SEEN), point_size=0.012, point_shape="circle"
        )
    vertices, faces = fewer(local(fit, thing.points), thing.faces)
    return scene.add_mesh_simple(
        "/object", vertices, faces, color=rgb(BODY), side="double", flat_shading=False
    )


def draw_net(scene: Any, surface: Surface) -> Any:
    """The fitted surface as a net."""
    return scene.add_line_segments(
        "/fit", net_segments(surface), rgb(NET), thickness=1.0, thickness_units="screen"
    )


def draw_finger(
    scene: Any, index: int, point: Floats, normal: Floats, friction: float, edges: int,
    *, pad: float = 0.0, number: str = "", cones: bool = True,
) -> None:  # fmt: skip
    """Cone, normal and number of a contact; a soft one's pad."""
    color = finger_color(index)
    vertices, faces = cone_mesh(point, normal, friction, edges)
    scene.add_mesh_simple(
        f"/finger {index + 1}/cone", vertices, faces, color=color, opacity=0.55, side="double",
        flat_shading=True, cast_shadow=False, visible=cones,
    )  # fmt: skip
    # The rim tells a cone from a white background.
    rim = np.stack([vertices[1:], np.roll(vertices[1:], -1, axis=0)], axis=1)
    scene.add_line_segments(
        f"/finger {index + 1}/rim", rim, color, thickness=2.0, thickness_units="screen",
        visible=cones,
    )  # fmt: skip
    tail = point - 1.2 * CONE * normal
    scene.add_arrows(
        f"/finger {index + 1}/normal", np.stack([tail, point])[None], color,
        shaft_radius=0.008, head_radius=0.025, head_length=0.06,
    )  # fmt: skip
    if pad > 0.0:
        vertices, faces = disc_mesh(pad, 24)
        scene.add_mesh_simple(
            f"/finger {index + 1}/pad", vertices, faces, color=color, side="double",
            flat_shading=True, position=point - 0.012 * normal, wxyz=turned_to(normal[None])[0],
        )  # fmt: skip
    if number:
        draw_label(
            scene, f"/words/finger {index + 1}", number, point - 1.45 * CONE * normal, scale=1.4
        )


def draw_label(
    scene: Any, name: str, text: str, place: Floats, *, visible: bool = True, scale: float = 1.0
) -> None:
    """Words at a place; a label that is there is moved, since a new one takes a while to appear."""
    label = scene.get_handle_by_name(name)
    if label is None:
        scene.add_label(
            name, text, position=place, anchor="center-center", font_screen_scale=scale,
            visible=visible,
        )  # fmt: skip
        return
    label.position, label.visible = place, visible
    if label.text != text:
        label.text = text


def draw_weakest(
    scene: Any,
    center: Floats,
    push: Floats,
    twist: Floats,
    outline: Floats,
    towards: Floats,
    *,
    shown: bool,
) -> list[Floats]:
    """The push that a grasp resists least as an arrow from the centre of mass, the twist as a
    curved one about its axis. Their points."""
    force, torque = float(np.linalg.norm(push)), float(np.linalg.norm(twist))
    push = push / force if force > 1e-9 else np.array([1.0, 0.0, 0.0])
    axis = twist / torque if torque > 1e-9 else np.array([0.0, 0.0, 1.0])
    # They come out of the object; what is hardly there has no arrow.
    tip = center + (exits(center, push, outline) + 0.3) * push
    is_push, is_twist = shown and force > 0.15, shown and torque > 0.15
    scene.add_arrows(
        "/weakest push", np.stack([center, tip])[None], DARK,
        shaft_radius=0.012, head_radius=0.035, head_length=0.08, visible=is_push,
    )  # fmt: skip
    draw_label(scene, "/words/weakest push", "weakest push", tip + 0.07 * push, visible=is_push)
    end = twist_end(center, axis, outline, towards)
    beyond = end + 0.1 * axis * np.sign(axis @ (end - center))
    vertices, faces, point = twist_mesh(end, axis, 0.2)
    scene.add_mesh_simple(
        "/weakest twist", vertices, faces, color=DARK, side="double", visible=is_twist,
        cast_shadow=False,
    )  # fmt: skip
    scene.add_line_segments(
        "/weakest twist/axis", np.stack([center, beyond])[None],
        DARK, thickness=1.5, thickness_units="screen", visible=is_twist,
    )  # fmt: skip
    draw_label(
        scene, "/words/weakest twist", "weakest twist", point + 0.09 * axis, visible=is_twist
    )
    points = [tip[None] + 0.1 * push] if is_push else []
    return [*points, vertices] if is_twist else points
