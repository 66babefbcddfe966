"""What the commands share: the terminal, numbers on the command line, files that are written."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from .. import _signals
from .._core import GraspModuliError
from .._files import check_output, replacing

#: Pictures by the ending of their file's name.
PICTURES = (".png", ".svg", ".pdf", ".jpg", ".jpeg", ".webp")


class Output(Console):
    """Standard output as rich writes to it, but whoever closes it is told of where commands run."""

    def on_broken_pipe(self) -> None:
        """Called while the error is handled."""
        raise


def is_terminal(stream: Any) -> bool:
    """Does a person see it?"""
    return stream is not None and stream.isatty()


def number(name: str, text: str, kind: type) -> Any:
    """An option's value, or the library's sentence of what was wanted instead."""
    try:
        return kind(text)
    except ValueError:
        wanted = "a whole number" if kind is int else "a number"
        shown = text if len(text) <= 60 else text[:57] + "..."
        raise GraspModuliError(f"{name} must be {wanted}, got {shown!r}") from None


@contextlib.contextmanager
def progress_bar() -> Iterator[Callable[[str, float], None]]:
    """A bar with an estimate on standard error, if that is a terminal; it vanishes at the end."""
    columns = (TextColumn("{task.description:<15}"), BarColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    hidden = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda name, share: bar.update(task, description=name, completed=share)


@contextlib.contextmanager
def warnings_said() -> Iterator[None]:
    """Warnings as one line each."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        yield
    for warning in caught:
        if issubclass(warning.category, UserWarning):
            _signals.say(f"warning: {warning.message}")


def check_outputs(thing: str, **outputs: Path | None) -> None:
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


def write(path: Path, data: bytes) -> None:
    """Whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)
