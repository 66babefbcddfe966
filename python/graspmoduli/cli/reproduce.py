"""``graspmoduli reproduce``: the paper's experiments."""

from __future__ import annotations

import sys
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

from .console import Output, is_terminal, number


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
            threads=None if threads is None else number("threads", threads, int),
            workers=None if workers is None else number("workers", workers, int),
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
    output = Output(highlight=False, width=None if is_terminal(sys.stdout) else 140)
    if table.row_count:
        output.print(table)
    print(f"wrote {out / 'report.html'}, {out / 'report.md'} and {out / 'results.json'}")
