"""The server on loopback that the pages come from."""

from __future__ import annotations

import contextlib
import errno
import io
import socket
import warnings
from typing import Any

import viser

from ..._core import GraspModuliError
from ...surfaces import Surface
from .grasp_page import GraspPage, Shown, first_look
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
    # A browser that has gone needs no word.
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection")
    # Its banner on standard output would not say how to end it.
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer("127.0.0.1", free, label="graspmoduli", verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
    server.gui.main_panel.dock_right()
    return server


def serve_object(port: int, shown: Shown) -> Any:
    """The server, which runs until it is stopped."""
    server = open_server(port)
    add_pages(server, shown)
    return server


def add_pages(server: Any, shown: Shown) -> list[GraspPage]:
    """A page for every browser that comes, in a list that grows."""
    pages: list[GraspPage] = []
    server.scene.set_up_direction("+z")
    if shown.grasps:
        # viser's own button for it looks from there, in every browser.
        position, target = first_look(shown)
        server.initial_camera.position = position
        server.initial_camera.look_at = target

    @server.on_client_connect
    def _(client: Any) -> None:
        pages.append(GraspPage(client, shown))

    @server.on_client_disconnect
    def _(client: Any) -> None:
        for page in pages:
            if page.client is client:
                page.eye.stop()

    return pages


def serve_shapes(
    port: int, own: dict[str, Surface] | None = None, friction: float = 1.0, edges: int = 8
) -> Any:
    """The moduli space to play with."""
    server = open_server(port)
    server.scene.set_up_direction("+z")

    @server.on_client_connect
    def _(client: Any) -> None:
        ShapePage(client, own or {}, friction, edges)

    return server
