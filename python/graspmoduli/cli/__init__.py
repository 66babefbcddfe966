"""The command line: ``graspmoduli grasp OBJECT``, ``reproduce``, ``view``."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import sys
from importlib.metadata import version
from typing import Annotated

import typer

from .. import _signals
from .._arrays import NoGraspLeftError
from .._core import GraspModuliError
from .grasp import grasp
from .reproduce import reproduce
from .view import view

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Grasps for real objects, ranked by exact grasp quality. Exit codes: 0 done, 1 no grasp "
    "found, 2 wrong input or an output that cannot be written, 130 interrupted (Ctrl-C), "
    "143 terminated.",
)


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
        # That there is no grasp is an answer, not a wrong question.
        return _fail(str(error), 1 if isinstance(error, NoGraspLeftError) else 2)
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


def _fail(message: str, code: int = 2) -> int:
    # A file's name may hold ends of lines.
    _signals.say(" ".join(message.splitlines()))
    return code


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


for command in (grasp, reproduce, view):
    app.command()(command)
