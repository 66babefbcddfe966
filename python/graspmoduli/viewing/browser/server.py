"""The server on loopback that the pages come from, and a page that needs none."""

from __future__ import annotations

import contextlib
import errno
import io
import socket
from collections.abc import Sequence
from typing import Any

import numpy as np
import viser

from ..._core import GraspModuliError
from ...objects.fitting import Fit, ObjectGrasp
from ...objects.reading import Object
from ...surfaces import Surface
from ..drawing import FINGERS, azimuth_across
from .grasp_page import GraspPage
from .scene import draw_finger, draw_net, draw_object, rgb
from .shapes_page import ShapePage


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
