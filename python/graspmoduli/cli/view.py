"""``graspmoduli view``: the viewer in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .. import _arrays
from .._core import GraspModuliError
from .console import check_outputs, number, progress_bar, warnings_said, write
from .pipeline import Camera, KeepTable, ObjectNumber, find_grasps, image_of, scan_options


def view(
    thing: Annotated[
        str | None,
        typer.Argument(
            metavar="[OBJECT]", help="Mesh or point cloud; the space of model shapes if not given."
        ),
    ] = None,
    port: Annotated[str, typer.Option(metavar="P", help="Port on loopback; 0 takes any.")] = "8080",
    shapes: Annotated[
        bool, typer.Option("--shapes", help="The space of shapes, with OBJECT as a corner.")
    ] = False,
    html: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the scene as one page that needs no server."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw it here without a screen.")
    ] = None,
    friction: Annotated[str, typer.Option(help="Coulomb friction coefficient μ > 0.")] = "1.0",
    edges: Annotated[str, typer.Option(help="Edges l of the friction cones, at least 3.")] = "8",
    camera: Camera = None,
    object_number: ObjectNumber = None,
    keep_table: KeepTable = False,
) -> None:
    """Look at OBJECT, its grasps and their friction cones in a browser, and move them."""
    mu, l = number("friction", friction, float), number("edges", edges, int)
    _arrays.cone(mu, l)
    at = _arrays.count("port", number("port", port, int), 0)
    if at > 65535:
        raise GraspModuliError(f"port must be at most 65535, got {at}")
    saved = html is not None or picture is not None
    if saved and thing is None:
        raise GraspModuliError("OBJECT must be given for html and picture, got none")
    if thing is None and (camera is not None or object_number is not None):
        raise GraspModuliError("OBJECT must be given for camera and object, got none")
    if shapes and thing is None:
        raise GraspModuliError(
            "OBJECT must be given for shapes, got none; without it they are shown"
        )
    if shapes and saved:
        raise GraspModuliError("shapes must be shown in a browser, got html or picture with it")
    scan = scan_options(camera, object_number, keep_table)
    if thing is not None:
        check_outputs(thing, html=html, picture=picture)
    from ..viewing.browser import server as viewer

    if not saved:
        # A busy port is found out before the work.
        viewer.free_port(at)
    page = image = b""
    if thing is None:
        server = viewer.serve_shapes(at)
    else:
        with progress_bar() as step, warnings_said():
            found = find_grasps(thing, scan, {"friction": mu, "edges": l}, step)
            if html is not None:
                best = found[2][0] if found[2] else None
                page = viewer.page_of(*found[:2], best, mu, l).encode()
            if picture is not None:
                image = image_of(picture, thing, found, mu, l)
        for path, data in ((html, page), (picture, image)):
            if path is not None:
                write(path, data)
                print(f"wrote {path}")
        if saved:
            return
        if shapes:
            fit = found[1]
            unit = (1.0 / fit.length_scale) * fit.surface
            server = viewer.serve_shapes(at, {Path(thing).name: unit})
        else:
            server = viewer.serve_object(at, *found, mu, l, Path(thing).name)
    print(f"open http://127.0.0.1:{server.get_port()} in a browser; Ctrl-C ends", flush=True)
    server.sleep_forever()
