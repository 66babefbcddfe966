"""The command line: ``graspmoduli grasp OBJECT``, ``reproduce``, ``view``."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import logging
import math
import os
import shutil
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from .. import _arrays, _signals
from .._core import GraspModuliError
from .._files import check_output, replacing

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Grasps for real objects, ranked by exact grasp quality. Exit codes: 0 done, 1 no grasp "
    "found, 2 wrong input or an output that cannot be written, 130 interrupted (Ctrl-C), "
    "143 terminated.",
)

#: Pictures by the ending of their file's name.
PICTURES = (".png", ".svg", ".pdf", ".jpg", ".jpeg", ".webp")


def main() -> None:
    """Entry point: errors are one line on standard error; wrong input exits with 2."""
    try:
        _signals.heed()
        for stream in (sys.stdout, sys.stderr):
            # What the output's encoding lacks is written as an escape.
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
        # Pictures are drawn without a window, whatever the environment asks of matplotlib.
        os.environ["MPLBACKEND"] = "agg"
        code = _run(sys.argv[1:])
    except (KeyboardInterrupt, EOFError):
        code = _signals.code(signal.SIGINT)
    except _signals.Terminated as ended:
        code = _signals.code(ended.number)
    sys.exit(code)


def _run(arguments: list[str]) -> int:
    """A command's exit code."""
    try:
        command = typer.main.get_command(app)
        with command.make_context("graspmoduli", arguments) as context:
            command.invoke(context)
        code = 0
    except typer.Exit as end:
        code = end.exit_code
    except GraspModuliError as error:
        return _fail(str(error))
    except MemoryError:
        return _fail("object and options must fit into memory, got too little of it")
    except OSError as error:
        return _no_output(error)
    except Exception as error:
        # Usage errors of the command-line library carry their own sentence.
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        return _fail(" ".join(message().split()))
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError as error:
        return _no_output(error)
    return code


class _Console(Console):
    """Standard output as rich writes to it, but whoever closes it is told of in :func:`_run`."""

    def on_broken_pipe(self) -> None:
        """Called while the error is handled."""
        raise


def _fail(message: str) -> int:
    # A file's name may hold ends of lines.
    _signals.say(" ".join(message.splitlines()))
    return 2


def _no_output(error: OSError) -> int:
    """Standard output was closed by who reads it, or is full."""
    with contextlib.suppress(OSError, ValueError):
        # What it did not take is not tried again at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    where = f" ({error.filename})" if error.filename else ""
    return _fail(f"standard output must take what is written, got {error.strerror}{where}")


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    show_version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if show_version:
        print(version("graspmoduli"))
        raise typer.Exit()
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command()
def grasp(
    thing: Annotated[
        str,
        typer.Argument(
            metavar="OBJECT",
            help="Mesh or point cloud (PLY OBJ STL GLB GLTF OFF PCD XYZ TXT NPY).",
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
        str, typer.Option(metavar="M", help="Fingers of a grasp; for a cloud of points 3.")
    ] = "3",
    torsion: Annotated[
        str, typer.Option(metavar="G", help="Torsional friction of soft fingers, a length.")
    ] = "0",
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
) -> None:
    """Find stable grasps of OBJECT, best first, in its own coordinates.

    On a mesh fingertips are pressed on the mesh itself; a cloud of points is grasped on the surface
    fitted to it.
    """
    mu = _number("friction", friction, float)
    l = _number("edges", edges, int)
    _arrays.cone(mu, l)
    options: dict[str, Any] = {
        "friction": mu,
        "edges": l,
        "top": _arrays.count("top", _number("top", top, int), 1),
        "seed": _arrays.count("seed", _number("seed", seed, int), 0),
        "contacts": _arrays.count("fingers", _number("fingers", fingers, int), 1),
        "torsion": _arrays.coefficient("torsion", _number("torsion", torsion, float)),
    }
    for name, text in (("tip_radius", tip_radius), ("errors", errors)):
        if text is not None:
            value = _number(name, text, float)
            options[name] = _arrays.number(name, value, positive=True)
    if center_of_mass is not None:
        center = [_number("center_of_mass", text, float) for text in center_of_mass]
        options["center_of_mass"] = _arrays.floats("center_of_mass", center)
    # Outputs that cannot be written are found out before the work; all are written at its end.
    _check_outputs(thing, json=json_file, picture=picture)
    image = b""
    with _progress() as step, _warnings():
        found = _find(thing, options, step)
        if picture is not None:
            step("drawing", 0.85)
            image = _image(picture, thing, found, mu, l)
    _, fit, grasps = found
    if json_file is not None:
        report = json.dumps(_report(thing, fit, grasps, mu, l), indent=2) + "\n"
        _write(json_file, report.encode())
    if picture is not None:
        _write(picture, image)
    _print(thing, fit, grasps, l)
    for path in (json_file, picture):
        if path is not None:
            print(f"wrote {path}")
    if not grasps:
        _signals.say(_why_none(fit))
        raise typer.Exit(1)
    if fit.mesh is not None and grasps[0].quality < WORTHLESS:
        _signals.say(
            f"the best grasp has a quality of {grasps[0].quality:.2g} only: the object is too thin "
            "for these tips, or too long for its friction; smaller tips may find a better one"
        )


#: Grasps of lower quality hold, but hardly.
WORTHLESS = 0.05


def _why_none(fit: Any) -> str:
    if fit.mesh is None:
        return "no force-closure grasp found; more friction or a fuller scan may help"
    return (
        "no true force-closure grasp found: the object is too thin for these tips, or too "
        "slippery; a smaller --tip-radius or more friction may help"
    )


@app.command()
def reproduce(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME ...]", help="fig1 ... fig12, table; all if not given."),
    ] = None,
    scale: Annotated[str, typer.Option(help="quick (minutes) or paper (its own sizes).")] = "quick",
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where results and report go.")] = Path(
        "out/reproduction"
    ),
    threads: Annotated[
        str | None, typer.Option(help="Threads; all cores if not given.", metavar="N")
    ] = None,
    workers: Annotated[
        str | None, typer.Option(help="Workers of a local Dask cluster.", metavar="N")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler.", metavar="ADDRESS")
    ] = None,
) -> None:
    """Run the paper's experiments, ours beside the paper's; goes on where it was stopped."""
    from ..experiments import Progress as Step
    from ..experiments import reproduce as run

    console = Console(stderr=True)
    shown = console.is_terminal
    columns = (
        TextColumn("{task.description:<8}"), BarColumn(), MofNCompleteColumn(),
        TimeElapsedColumn(), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console, disable=not shown) as bar:
        tasks: dict[str, Any] = {}

        def report(step: Step) -> None:
            if step.name not in tasks:
                tasks[step.name] = bar.add_task(step.name, total=step.total, completed=step.done)
                if step.done:
                    text = f"{step.name}: going on, {step.done} of {step.total} pieces are there"
                    (bar.console if shown else console).print(text, highlight=False)
            else:
                bar.update(tasks[step.name], completed=step.done)

        outcomes = run(
            names or (),
            scale=scale,
            out=out,
            threads=None if threads is None else _number("threads", threads, int),
            workers=None if workers is None else _number("workers", workers, int),
            scheduler=scheduler,
            progress=report,
        )
    table = Table(box=None, padding=(0, 2), header_style="bold")
    for title in ("", "what", "paper", "ours", "agrees"):
        table.add_column(title)
    for name, outcome in outcomes.items():
        for row in outcome.rows:
            agrees = {True: "yes", False: "no", None: ""}[row.agrees]
            table.add_row(name, row.what, row.paper, row.ours, agrees)
    output = _Console(highlight=False, width=None if _is_terminal(sys.stdout) else 140)
    if table.row_count:
        output.print(table)
    print(f"wrote {out / 'report.html'}, {out / 'report.md'} and {out / 'results.json'}")


@app.command()
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
) -> None:
    """Look at OBJECT, its grasps and their friction cones in a browser, and move them."""
    mu, l = _number("friction", friction, float), _number("edges", edges, int)
    _arrays.cone(mu, l)
    at = _arrays.count("port", _number("port", port, int), 0)
    if at > 65535:
        raise GraspModuliError(f"port must be at most 65535, got {at}")
    saved = html is not None or picture is not None
    if saved and thing is None:
        raise GraspModuliError("OBJECT must be given for html and picture, got none")
    if shapes and thing is None:
        raise GraspModuliError(
            "OBJECT must be given for shapes, got none; without it they are shown"
        )
    if shapes and saved:
        raise GraspModuliError("shapes must be shown in a browser, got html or picture with it")
    if thing is not None:
        _check_outputs(thing, html=html, picture=picture)
    from ..viewing import viewer

    if not saved:
        # A busy port is found out before the work.
        viewer.free_port(at)
    page = image = b""
    if thing is None:
        server = viewer.serve_shapes(at)
    else:
        with _progress() as step, _warnings():
            found = _find(thing, {"friction": mu, "edges": l}, step)
            if html is not None:
                best = found[2][0] if found[2] else None
                page = viewer.page_of(*found[:2], best, mu, l).encode()
            if picture is not None:
                image = _image(picture, thing, found, mu, l)
        for path, data in ((html, page), (picture, image)):
            if path is not None:
                _write(path, data)
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


def _check_outputs(thing: str, **outputs: Path | None) -> None:
    """Each can be written, and none is the object or one of the others."""
    taken = [Path(thing)]
    for name, path in outputs.items():
        if path is None:
            continue
        if name == "picture" and path.suffix.lower() not in PICTURES:
            raise GraspModuliError(
                f"picture must be a file of a known format ({' '.join(PICTURES)}), got {path.name}"
            )
        check_output(name, path, taken)
        taken.append(path)


def _write(path: Path, data: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def _image(path: Path, thing: str, found: Any, friction: float, edges: int) -> bytes:
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


def _find(
    path: str, options: dict[str, Any], step: Callable[[str, float], None]
) -> tuple[Any, Any, Any]:
    step("reading", 0.0)
    from ..objects.reading import read

    thing = read(path)
    step("fitting", 0.1)
    from ..objects.fitting import fit_object

    fit = fit_object(thing, lambda done, total: step("fitting", 0.1 + 0.65 * done / total))
    step("finding grasps", 0.8)
    return thing, fit, fit.synthesize(**options)


#: The version of what ``grasp --json`` writes; docs/object.md describes it.
SCHEMA = 1


def _report(path: str, fit: Any, grasps: Any, friction: float, edges: int) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "object": path,
        "fit": {
            "residual_rms": fit.residual.rms,
            "residual_max": fit.residual.max,
            "size": fit.residual.size,
            "coverage": fit.coverage,
            "unexplained": fit.unexplained,
            "pose": fit.pose.tolist(),
        },
        "friction": friction,
        "edges": edges,
        "length_scale": fit.length_scale,
        "center_of_mass_of": _center_of(fit),
        "note": "contacts, normals and center_of_mass are in the coordinates of the object's "
        "file; quality is that of lengths divided by length_scale",
        "grasps": [_grasp_report(grasp) for grasp in grasps],
    }


def _center_of(fit: Any) -> str:
    """What the centre of mass is that of, if none was given."""
    if fit.mesh is None:
        return "fitted surface"
    return "solid" if fit.mesh.shape.closed else "triangles"


def _grasp_report(grasp: Any) -> dict[str, Any]:
    coordinates = [
        [None if math.isnan(x) else x for x in column] for column in grasp.coordinates.T.tolist()
    ]
    report = {
        "quality": grasp.quality,
        "round_quality": list(grasp.round_quality),
        "contacts": grasp.contacts.tolist(),
        "normals": grasp.normals.tolist(),
        "center_of_mass": grasp.center_of_mass.tolist(),
        "u": coordinates[0],
        "theta": coordinates[1],
    }
    if grasp.checks is not None:
        report["exact_quality"] = grasp.exact_quality
        report["low_quality"] = grasp.low_quality
        report["held"] = grasp.held
        report["checks"] = [
            # The fitted surface is the only part that is known.
            {**dataclasses.asdict(check), "part": None if u is None else 0}
            for check, u in zip(grasp.checks, coordinates[0], strict=True)
        ]
    return report


def _print(path: str, fit: Any, grasps: Any, edges: int) -> None:
    axis = ", ".join(f"{_rounded(x, 2):+.2f}" for x in fit.pose[:3, 2])
    lines = [
        f"{path}: size {fit.residual.size:.4g}, axis ({axis})",
        f"fit: rms {fit.residual.relative_rms:.2%} and max {fit.residual.relative_max:.2%} of the "
        f"size, {fit.coverage:.0%} of the surface seen, "
        f"{fit.unexplained:.1%} of the wall unexplained",
    ]
    digits = max(0, 3 - int(f"{fit.residual.size:e}".split("e")[1]))
    # Wide enough for the table when the output is not a terminal.
    width = shutil.get_terminal_size().columns if _is_terminal(sys.stdout) else 120
    table = _table(grasps, edges, digits, stacked=False)
    if _width(table) > width:
        table = _table(grasps, edges, digits, stacked=True)
    # What is wider still is for the terminal to wrap: no digit is lost.
    console = _Console(highlight=False, width=max(width, _width(table)), height=25)
    for line in lines:
        console.print(line, soft_wrap=True, markup=False)
    if grasps:
        console.print()
        console.print(table)
        said = [
            "",
            "Q: the largest wrench, in any direction, resisted by fingers whose normal forces sum "
            f"to 1, with round friction cones; Q_{edges} with cones of {edges} edges; lengths "
            f"divided by {fit.length_scale:.4g}.",
            *_words(fit, grasps),
        ]
        for line in said:
            console.print(line, soft_wrap=True, markup=False)


#: Qualities closer than this share are a tie: the fingers' own errors are larger.
TIE = 0.05


def _words(fit: Any, grasps: Any) -> list[str]:
    """Which grasps are as good as each other, and how sure their contacts are."""
    words = []
    values = [grasp.round_quality[0] for grasp in grasps]
    equal = sum(value >= (1.0 - TIE) * max(values) for value in values)
    if equal > 1:
        words.append(f"A tie: {equal} of the grasps are within {TIE:.0%} of the best.")
    if fit.mesh is not None:
        checks = [check for grasp in grasps for check in grasp.checks]
        angle = math.degrees(max(check.angle for check in checks))
        bearing = min(check.bearing for check in checks)
        held = min(grasp.held for grasp in grasps)
        share = "all" if held == 1.0 else f"at least {held:.0%}"
        words.append(
            f"Every contact lies on the mesh: the normals felt differ from its triangles' by at "
            f"most {angle:.0f}°, at least {bearing:.0%} of each pad bears, and {share} "
            "of the errors of aim that were tried leave a grasp in force closure."
        )
    return words


def _table(grasps: Any, edges: int, digits: int, *, stacked: bool) -> Table:
    """Grasps by rank: fingers side by side, or one below the other where it is narrow."""
    table = Table(box=None, padding=(0, 1 if stacked else 2), header_style="bold")
    columns = ["#", "Q", f"Q_{edges}"]
    if stacked:
        columns += ["finger", "(x, y, z)"]
    else:
        fingers = range(1, 1 + max(len(grasp.contacts) for grasp in grasps)) if grasps else ()
        columns += [f"finger {finger}  (x, y, z)" for finger in fingers]
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    for rank, grasp in enumerate(grasps, 1):
        points = [
            ", ".join(f"{_rounded(x, digits):.{digits}f}" for x in point)
            for point in grasp.contacts
        ]
        head = [str(rank), f"{grasp.round_quality[0]:.4f}", f"{grasp.quality:.4f}"]
        if stacked:
            for finger, point in enumerate(points, 1):
                table.add_row(*(head if finger == 1 else ["", "", ""]), str(finger), point)
        else:
            table.add_row(*head, *points)
    return table


def _rounded(x: float, digits: int) -> float:
    """Without a zero that is negative."""
    return round(float(x), digits) + 0.0


def _width(table: Table) -> int:
    return Console(width=1000, height=25).measure(table).maximum


def _is_terminal(stream: Any) -> bool:
    return stream is not None and stream.isatty()


def _number(name: str, text: str, kind: type) -> Any:
    try:
        return kind(text)
    except ValueError:
        wanted = "a whole number" if kind is int else "a number"
        shown = text if len(text) <= 60 else text[:57] + "..."
        raise GraspModuliError(f"{name} must be {wanted}, got {shown!r}") from None


@contextlib.contextmanager
def _progress() -> Iterator[Callable[[str, float], None]]:
    """A bar with an estimate on standard error, if that is a terminal; it vanishes at the end."""
    columns = (TextColumn("{task.description:<15}"), BarColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    hidden = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda name, share: bar.update(task, description=name, completed=share)


@contextlib.contextmanager
def _warnings() -> Iterator[None]:
    """Warnings as one line each."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        yield
    for warning in caught:
        if issubclass(warning.category, UserWarning):
            _signals.say(f"warning: {warning.message}")
