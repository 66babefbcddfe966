"""The command line: ``graspmoduli grasp OBJECT``, ``reproduce``, ``view``."""

from __future__ import annotations

import contextlib
import json
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

from . import _arrays
from ._core import GraspModuliError
from ._files import replacing

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Grasps for real objects, ranked by exact grasp quality.",
)

#: Pictures by the ending of their file's name.
PICTURES = (".png", ".svg", ".pdf", ".jpg", ".jpeg", ".webp")


def main() -> None:
    """Entry point: errors are one line on standard error; wrong input exits with 2."""
    code = None
    try:
        code = app(standalone_mode=False)
    except GraspModuliError as error:
        _fail(str(error))
    except (KeyboardInterrupt, EOFError):
        print("graspmoduli: interrupted", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(1)
    except Exception as error:
        # Usage errors of the command-line library carry their own sentence.
        message = getattr(error, "format_message", None)
        if message is None:
            if type(error).__name__ == "Abort":
                sys.exit(130)
            raise
        _fail(" ".join(message().split()))
    sys.exit(code if isinstance(code, int) else 0)


def _fail(message: str) -> None:
    print(f"graspmoduli: {message}", file=sys.stderr)
    sys.exit(2)


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
        typer.Argument(metavar="OBJECT", help="Mesh or point cloud (PLY OBJ STL GLB PCD XYZ NPY)."),
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
    seed: Annotated[str, typer.Option(help="Seed of sampled contacts.")] = "0",
) -> None:
    """Find stable three-finger grasps of OBJECT, best first, in its own coordinates."""
    mu = _number("friction", friction, float)
    l = _number("edges", edges, int)
    _arrays.cone(mu, l)
    count = _arrays.count("top", _number("top", top, int), 1)
    start = _arrays.count("seed", _number("seed", seed, int), 0)
    if picture is not None and picture.suffix.lower() not in PICTURES:
        raise GraspModuliError(
            f"picture must be a file of a known format ({' '.join(PICTURES)}), got {picture.name}"
        )
    # Outputs that cannot be written are found out before the work; both appear at the end.
    with contextlib.ExitStack() as outputs:
        json_path = outputs.enter_context(replacing(json_file)) if json_file else None
        picture_path = outputs.enter_context(replacing(picture)) if picture else None
        with _progress() as step, _warnings():
            found = _find(thing, mu, l, count, start, step)
            if json_path is not None:
                json_path.write_text(json.dumps(_report(thing, *found[1:], mu, l), indent=2) + "\n")
            if picture_path is not None:
                step("drawing", 0.85)
                from .plotting import plot_grasps

                figure = plot_grasps(*found, friction=mu, edges=l, title=Path(thing).name)
                figure.savefig(picture_path)
    _, fit, grasps = found
    _print(thing, fit, grasps, l)
    for path in (json_file, picture):
        if path is not None:
            print(f"wrote {path}")
    if not grasps:
        print(
            "graspmoduli: no force-closure grasp found; more friction or a fuller scan may help",
            file=sys.stderr,
        )
        raise typer.Exit(1)


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
    from .experiments import Progress as Step
    from .experiments import reproduce as run

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
    output = Console(highlight=False, width=None if sys.stdout.isatty() else 140)
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
    if picture is not None and picture.suffix.lower() not in PICTURES:
        raise GraspModuliError(
            f"picture must be a file of a known format ({' '.join(PICTURES)}), got {picture.name}"
        )
    if shapes and thing is None:
        raise GraspModuliError(
            "OBJECT must be given for shapes, got none; without it they are shown"
        )
    from . import viewer

    if not saved:
        # A busy port is found out before the work.
        viewer.free_port(at)
    with contextlib.ExitStack() as outputs:
        page = outputs.enter_context(replacing(html)) if html else None
        image = outputs.enter_context(replacing(picture)) if picture else None
        server = None
        if thing is None:
            server = viewer.serve_shapes(at)
        else:
            with _progress() as step, _warnings():
                found = _find(thing, mu, l, 5, 0, step)
                if page is not None:
                    best = found[2][0] if found[2] else None
                    page.write_text(viewer.page_of(*found[:2], best, mu, l))
                if image is not None:
                    from .plotting import plot_grasps

                    figure = plot_grasps(*found, friction=mu, edges=l, title=Path(thing).name)
                    figure.savefig(image)
            if shapes and not saved:
                fit = found[1]
                unit = (1.0 / fit.length_scale) * fit.surface
                server = viewer.serve_shapes(at, {Path(thing).name: unit})
            elif not saved:
                server = viewer.serve_object(at, *found, mu, l, Path(thing).name)
    for path in (html, picture):
        if path is not None:
            print(f"wrote {path}")
    if server is not None:
        print(f"open http://127.0.0.1:{server.get_port()} in a browser; Ctrl-C ends", flush=True)
        server.sleep_forever()


def _find(
    path: str, friction: float, edges: int, top: int, seed: int, step: Callable[[str, float], None]
) -> tuple[Any, Any, Any]:
    step("reading", 0.0)
    from .reading import read

    thing = read(path)
    step("fitting", 0.1)
    from .fitting import fit_object

    fit = fit_object(thing, lambda done, total: step("fitting", 0.1 + 0.65 * done / total))
    step("finding grasps", 0.8)
    return thing, fit, fit.synthesize(top=top, friction=friction, edges=edges, seed=seed)


def _report(path: str, fit: Any, grasps: Any, friction: float, edges: int) -> dict[str, Any]:
    return {
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
        "note": "contacts, normals and center_of_mass are in the coordinates of the object's "
        "file; quality is that of lengths divided by length_scale",
        "grasps": [
            {
                "quality": grasp.quality,
                "contacts": grasp.contacts.tolist(),
                "normals": grasp.normals.tolist(),
                "center_of_mass": grasp.center_of_mass.tolist(),
                "u": grasp.grasp.u.tolist(),
                "theta": grasp.grasp.theta.tolist(),
            }
            for grasp in grasps
        ],
    }


def _print(path: str, fit: Any, grasps: Any, edges: int) -> None:
    axis = ", ".join(f"{x:+.2f}" for x in fit.pose[:3, 2])
    lines = [
        f"{path}: size {fit.residual.size:.4g}, axis ({axis})",
        f"fit: rms {fit.residual.relative_rms:.2%} and max {fit.residual.relative_max:.2%} of the "
        f"size, {fit.coverage:.0%} of the surface seen, "
        f"{fit.unexplained:.1%} of the wall unexplained",
    ]
    table = Table(box=None, padding=(0, 2), header_style="bold")
    table.add_column("#", justify="right")
    table.add_column(f"Q_{edges}", justify="right")
    for finger in (1, 2, 3):
        table.add_column(f"finger {finger}  (x, y, z)", justify="right")
    digits = max(0, 3 - int(f"{fit.residual.size:e}".split("e")[1]))
    for rank, grasp in enumerate(grasps, 1):
        points = [", ".join(f"{x:.{digits}f}" for x in point) for point in grasp.contacts]
        table.add_row(str(rank), f"{grasp.quality:.4f}", *points)
    # Wide enough for the table when the output is not a terminal.
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 120)
    for line in lines:
        console.print(line, soft_wrap=True, markup=False)
    if grasps:
        console.print()
        console.print(table)
        console.print(
            f"\nQ_{edges}: the largest wrench, in any direction, resisted by fingers whose normal "
            f"forces sum to 1; lengths divided by {fit.length_scale:.4g}.",
            soft_wrap=True,
            markup=False,
        )


def _number(name: str, text: str, kind: type) -> Any:
    try:
        return kind(text)
    except ValueError:
        wanted = "a whole number" if kind is int else "a number"
        raise GraspModuliError(f"{name} must be {wanted}, got {text!r}") from None


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
            print(f"graspmoduli: warning: {warning.message}", file=sys.stderr)
