"""``graspmoduli grasp OBJECT``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import _arrays, _signals
from .._batches import NORMS, is_each
from .console import check_outputs, number, progress_bar, warnings_said, write
from .pipeline import (
    Approach,
    Camera,
    ConstraintsFile,
    KeepTable,
    ObjectNumber,
    Opening,
    Table,
    Task,
    constraints_of,
    find_grasps,
    image_of,
    scan_options,
    task_of,
)
from .report import report
from .table import show


def grasp(
    thing: Annotated[
        str,
        typer.Argument(
            metavar="OBJECT",
            help="Mesh or point cloud (PLY OBJ STL GLB GLTF OFF PCD XYZ TXT NPY), or a TOML file "
            "that lists depth images or clouds of one object.",
        ),
    ],
    friction: Annotated[str, typer.Option(help="Coulomb friction coefficient μ > 0.")] = "1.0",
    edges: Annotated[str, typer.Option(help="Edges l of the friction cones, at least 3.")] = "8",
    top: Annotated[str, typer.Option(help="How many different grasps.")] = "5",
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write grasps and fit here.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw object and grasps here (PNG SVG PDF JPG)."),
    ] = None,
    seed: Annotated[str, typer.Option(help="Seed of the places that are tried.")] = "0",
    fingers: Annotated[
        str, typer.Option(metavar="M", help="Fingers of a grasp; two need --torsion.")
    ] = "3",
    torsion: Annotated[
        str, typer.Option(metavar="G", help="Torsional friction of soft fingers, a length.")
    ] = "0",
    norm: Annotated[
        str,
        typer.Option(
            metavar="NORM",
            help="sum: the normal forces of all fingers sum to at most 1; each: every one is.",
        ),
    ] = "sum",
    tip_radius: Annotated[
        str | None,
        typer.Option(
            metavar="R", help="Radius of the fingertips, in the object's unit; 5 % of its size."
        ),
    ] = None,
    center_of_mass: Annotated[
        tuple[str, str, str] | None,
        typer.Option(metavar="X Y Z", help="Centre of mass; a closed mesh's own if not given."),
    ] = None,
    errors: Annotated[
        str | None,
        typer.Option(
            metavar="E", help="Errors of aim, a distance: rank by the quality that they leave."
        ),
    ] = None,
    opening: Opening = None,
    table: Table = None,
    approach: Approach = None,
    constraints: ConstraintsFile = None,
    task: Task = None,
    camera: Camera = None,
    object_number: ObjectNumber = None,
    keep_table: KeepTable = False,
) -> None:
    """Find stable grasps of OBJECT, best first, in its own coordinates.

    On a mesh fingertips are pressed on the mesh itself; a cloud of points is grasped where it was
    seen, and on the surface fitted to it where it was not.
    """
    mu = number("friction", friction, float)
    l = number("edges", edges, int)
    _arrays.cone(mu, l)
    options: dict[str, Any] = {
        "friction": mu,
        "edges": l,
        "top": _arrays.count("top", number("top", top, int), 1),
        "seed": _arrays.count("seed", number("seed", seed, int), 0),
        "contacts": _arrays.count("fingers", number("fingers", fingers, int), 1),
        "torsion": _arrays.coefficient("torsion", number("torsion", torsion, float)),
        "norm": NORMS[is_each(norm)],
    }
    for name, text in (("tip_radius", tip_radius), ("errors", errors)):
        if text is not None:
            value = number(name, text, float)
            options[name] = _arrays.number(name, value, positive=True)
    if center_of_mass is not None:
        center = [number("center_of_mass", text, float) for text in center_of_mass]
        options["center_of_mass"] = _arrays.floats("center_of_mass", center)
    options["constraints"] = constraints_of(constraints, opening, table, approach)
    options["task"] = task_of(task)
    scan = scan_options(camera, object_number, keep_table)
    # Outputs that cannot be written are found out before the work; all are written at its end.
    check_outputs(thing, json=json_file, picture=picture)
    image = b""
    with progress_bar() as step, warnings_said():
        found = find_grasps(thing, scan, options, step)
        if picture is not None:
            step("drawing", 0.85)
            image = image_of(picture, thing, found, mu, l)
    read, fit, grasps = found
    if json_file is not None:
        text = json.dumps(report(thing, *found, mu, l, options["norm"]), indent=2) + "\n"
        write(json_file, text.encode())
    if picture is not None:
        write(picture, image)
    show(thing, fit, grasps, l)
    for path in (json_file, picture):
        if path is not None:
            print(f"wrote {path}")
    if not grasps:
        _signals.say(_why_none(fit, read))
        raise typer.Exit(1)
    if fit.mesh is not None and task is None and grasps[0].quality < WORTHLESS:
        _signals.say(
            f"the best grasp has a quality of {grasps[0].quality:.2g} only: the object is too thin "
            "for these tips, or too long for its friction; smaller tips may find a better one"
        )


#: Grasps of lower quality hold, but hardly.
WORTHLESS = 0.05


def _why_none(fit: Any, read: Any) -> str:
    if fit.mesh is None and read.table is not None:
        return (
            "no force-closure grasp found that fingers reach beside the table; more friction or a "
            "view from another side may help, or --keep-table if that plane is no table"
        )
    if fit.mesh is None:
        return "no force-closure grasp found; more friction or a fuller scan may help"
    return (
        "no true force-closure grasp found: the object is too thin for these tips, or too "
        "slippery; a smaller --tip-radius or more friction may help"
    )
