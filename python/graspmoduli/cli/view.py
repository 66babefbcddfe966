"""``graspmoduli view``: the viewer in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .. import _arrays
from .._batches import NORMS, is_each
from .._core import GraspModuliError
from .console import check_outputs, number, progress_bar, warnings_said, write
from .given import grasps_of, read_report
from .pipeline import Camera, KeepTable, ObjectNumber, find_grasps, image_of, scan_options
from .report import report

#: Where the viewer is, if nothing else is said.
PORT = "8080"


def view(
    thing: Annotated[
        str | None,
        typer.Argument(
            metavar="[OBJECT]", help="Mesh or point cloud; the space of model shapes if not given."
        ),
    ] = None,
    port: Annotated[
        str | None, typer.Option(metavar="P", help="Port on loopback; 0 takes any. [8080]")
    ] = None,
    shapes: Annotated[
        bool, typer.Option("--shapes", help="The space of shapes, with OBJECT as a corner.")
    ] = False,
    grasps: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Show the grasps that grasp --json or the viewer wrote."),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the grasps as one page that needs no server."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw it here without a screen.")
    ] = None,
    friction: Annotated[
        str | None, typer.Option(help="Coulomb friction coefficient μ > 0. [1.0]")
    ] = None,
    edges: Annotated[
        str | None, typer.Option(help="Edges l of the friction cones, at least 3. [8]")
    ] = None,
    top: Annotated[str | None, typer.Option(help="How many different grasps. [5]")] = None,
    fingers: Annotated[
        str | None,
        typer.Option(metavar="M", help="Fingers of a grasp; for a cloud of points 3. [3]"),
    ] = None,
    torsion: Annotated[
        str | None,
        typer.Option(metavar="G", help="Torsional friction of soft fingers, a length. [0]"),
    ] = None,
    norm: Annotated[
        str | None,
        typer.Option(
            metavar="NORM",
            help="sum: the normal forces of all fingers sum to at most 1; each: every one. [sum]",
        ),
    ] = None,
    tip_radius: Annotated[
        str | None,
        typer.Option(
            metavar="R", help="Radius of the fingertips, in the object's unit; 5 % of its size."
        ),
    ] = None,
    camera: Camera = None,
    object_number: ObjectNumber = None,
    keep_table: KeepTable = False,
) -> None:
    """Look at OBJECT, its grasps and their friction cones in a browser, and move them."""
    of_object = {
        "grasps": grasps, "html": html, "picture": picture, "fingers": fingers, "top": top,
        "torsion": torsion, "norm": norm, "tip_radius": tip_radius,
    }  # fmt: skip
    of_reading = {"camera": camera, "object": object_number, "keep_table": keep_table or None}
    _refuse(thing, shapes, of_object, of_reading)
    saved = html is not None or picture is not None
    if saved and port is not None:
        raise GraspModuliError(f"port must be left out for html and picture, got {port}")
    if grasps is not None and (top is not None or fingers is not None):
        raise GraspModuliError(
            f"fingers and top must be left out for grasps, got {grasps}, which has its own"
        )
    given = None if grasps is None else read_report(grasps)
    own: dict[str, Any] = given or {}
    mu = own.get("friction", 1.0) if friction is None else number("friction", friction, float)
    l = own.get("edges", 8) if edges is None else number("edges", edges, int)
    _arrays.cone(mu, l)
    gamma = own.get("torsion", 0.0) if torsion is None else number("torsion", torsion, float)
    options: dict[str, Any] = {
        "friction": mu,
        "edges": l,
        "top": _arrays.count("top", number("top", top or "5", int), 1),
        "contacts": _arrays.count("fingers", number("fingers", fingers or "3", int), 1),
        "torsion": _arrays.coefficient("torsion", gamma),
        "norm": NORMS[is_each(norm or own.get("norm", "sum"))],
    }  # fmt: skip
    if tip_radius is not None:
        value = number("tip_radius", tip_radius, float)
        options["tip_radius"] = _arrays.number("tip_radius", value, positive=True)
    at = _arrays.count("port", number("port", port or PORT, int), 0)
    if at > 65535:
        raise GraspModuliError(f"port must be at most 65535, got {at}")
    scan = scan_options(camera, object_number, keep_table)
    if thing is not None:
        check_outputs(thing, html=html, picture=picture)
    if thing is not None and saved:
        _save(thing, scan, options, given, grasps, html, picture)
        return
    from ..viewing.browser import server as viewer

    # A busy port is found out before the work.
    viewer.free_port(at)
    if thing is None:
        server = viewer.serve_shapes(at, None, mu, l)
    else:
        with progress_bar() as step, warnings_said():
            found, hand = _found(thing, scan, options, given, grasps, step)
        read, fit, chosen = found
        name = Path(thing).name
        if shapes:
            unit = (1.0 / fit.length_scale) * fit.surface
            server = viewer.serve_shapes(at, {name: unit}, mu, l)
        else:
            from ..viewing.browser.grasp_page import Shown

            def as_saved(some: list[Any], how: Any) -> dict[str, Any]:
                return report(thing, read, fit, some, how.friction, how.edges, how.norm)

            shown = Shown(
                read, fit, chosen, hand, name, options["contacts"],
                options.get("tip_radius"), report=as_saved,
            )  # fmt: skip
            server = viewer.serve_object(at, shown)
    print(f"open http://127.0.0.1:{server.get_port()} in a browser; Ctrl-C ends", flush=True)
    server.sleep_forever()


def _refuse(
    thing: str | None, shapes: bool, of_object: dict[str, Any], of_reading: dict[str, Any]
) -> None:
    """What would be left unheeded."""
    if shapes and thing is None:
        raise GraspModuliError(
            "OBJECT must be given for shapes, got none; without it they are shown"
        )
    for name, value in (of_object | of_reading).items():
        if value is not None and thing is None:
            raise GraspModuliError(f"OBJECT must be given for {name}, got none")
    for name, value in of_object.items():
        if value is not None and shapes:
            raise GraspModuliError(
                f"{name} must be left out for shapes, got {value}: the space of shapes is shown in "
                "a browser, with three hard fingers"
            )


def _found(
    thing: str, scan: dict[str, Any], options: dict[str, Any], given: dict[str, Any] | None,
    path: Path | None, step: Any,
) -> tuple[tuple[Any, Any, Any], Any]:  # fmt: skip
    """What was read, its fit and the grasps that are shown, and with what hand."""
    from ..viewing.held import Hand

    hand = Hand(*(options[name] for name in Hand._fields))
    if given is None or path is None:
        return find_grasps(thing, scan, options, step), hand
    # The grasps are there: one that is found beside them is not looked at.
    read, fit, _ = find_grasps(thing, scan, {"top": 1}, step)
    return (read, fit, grasps_of(given, path, fit, hand)), hand


def _save(
    thing: str, scan: dict[str, Any], options: dict[str, Any], given: dict[str, Any] | None,
    path: Path | None, html: Path | None, picture: Path | None,
) -> None:  # fmt: skip
    """The files that were asked for, all at the end."""
    page = image = b""
    with progress_bar() as step, warnings_said():
        found, hand = _found(thing, scan, options, given, path, step)
        if html is not None:
            from ..viewing.page import page_of

            page = page_of(*found, hand, Path(thing).name).encode()
        if picture is not None:
            image = image_of(picture, thing, found, hand.friction, hand.edges)
    for file, data in ((html, page), (picture, image)):
        if file is not None:
            write(file, data)
            print(f"wrote {file}")
