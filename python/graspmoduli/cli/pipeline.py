"""From a file to grasps, and to their picture."""

from __future__ import annotations

import dataclasses
import io
import logging
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import _arrays
from .console import number

Camera = Annotated[
    tuple[str, str, str] | None,
    typer.Option(metavar="X Y Z", help="Where the camera was, in a cloud's own coordinates."),
]
ObjectNumber = Annotated[
    str | None, typer.Option("--object", metavar="K", help="Which of several objects, from 1.")
]
KeepTable = Annotated[
    bool, typer.Option("--keep-table", help="The plane of a scan belongs to the object.")
]

Opening = Annotated[
    tuple[str, str] | None,
    typer.Option(metavar="MIN MAX", help="Least and largest distance between any two fingers."),
]
Table = Annotated[
    tuple[str, str, str, str, str, str] | None,
    typer.Option(
        metavar="X Y Z NX NY NZ",
        help="A point of the table and its normal, which points to OBJECT: fingers stay clear.",
    ),
]
Approach = Annotated[
    tuple[str, str, str, str] | None,
    typer.Option(
        metavar="X Y Z A",
        help="No finger presses at more than the angle A, in radians, from this direction.",
    ),
]
Task = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|gravity",
        help="What OBJECT is held for: wrenches on it about its centre of mass, rows of six "
        "numbers; or the weight of one unit of mass in any direction. Ranks by it.",
    ),
]
ConstraintsFile = Annotated[
    Path | None,
    typer.Option(
        "--constraints", metavar="FILE", help="Where fingers may go: TOML, docs/constraints.md."
    ),
]


def constraints_of(
    path: Path | None,
    opening: tuple[str, str] | None,
    table: tuple[str, ...] | None,
    approach: tuple[str, ...] | None,
) -> Any:
    """What the options ask of fingers; they take the place of what the file says."""
    from ..constraints import Constraints

    given: dict[str, Any] = {}
    if opening is not None:
        given["opening"] = tuple(number("opening", text, float) for text in opening)
    if table is not None:
        values = [number("table", text, float) for text in table]
        given["table"] = (values[:3], values[3:])
    if approach is not None:
        values = [number("approach", text, float) for text in approach]
        given["approach"] = (values[:3], values[3])
    if path is None:
        return Constraints(**given)
    return dataclasses.replace(Constraints.load(path), **given)


def task_of(text: str | None) -> Any:
    """The wrenches of a task, if one is asked for."""
    if text is None:
        return None
    from ..tasks import gravity, read_task

    return gravity(1.0) if text == "gravity" else read_task(text)


def scan_options(
    camera: tuple[str, str, str] | None, object_number: str | None, keep_table: bool
) -> dict[str, Any]:
    """How to read an object, with the names that :func:`graspmoduli.fit` has for it."""
    options: dict[str, Any] = {"keep_table": keep_table}
    if camera is not None:
        options["camera"] = [number("camera", text, float) for text in camera]
    if object_number is not None:
        value = number("object_number", object_number, int)
        options["object_number"] = _arrays.count("object_number", value, 1)
    return options


def find_grasps(
    path: str, scan: dict[str, Any], options: dict[str, Any], step: Callable[[str, float], None]
) -> tuple[Any, Any, Any]:
    """What was read, its fit, and its grasps."""
    step("reading", 0.0)
    from ..objects.reading import read

    thing = read(path, **scan)
    step("fitting", 0.1)
    from ..objects.fitting import fit_object

    fit = fit_object(thing, lambda done, total: step("fitting", 0.1 + 0.65 * done / total))
    step("finding grasps", 0.8)
    return thing, fit, fit.synthesize(**options)


def image_of(path: Path, thing: str, found: Any, friction: float, edges: int) -> bytes:
    """The bytes of a picture, in the format of the file's name."""
    from ..viewing.plotting import plot_grasps

    # Dollars would start a formula; what is no character of any language cannot be drawn.
    title = Path(thing).name.replace("$", "\\$").encode("utf-8", "replace").decode()
    figure = plot_grasps(*found, friction=friction, edges=edges, title=title)
    # Characters that no font has are drawn as boxes, without a word.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    buffer = io.BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")
        figure.savefig(buffer, format=path.suffix[1:].lower())
    return buffer.getvalue()
