"""Outputs: files that appear whole or not at all, and never in the place of something precious."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from ._core import GraspModuliError

#: Temporary files that are being written.
_unfinished: set[Path] = set()


def check_output(name: str, path: Path, others: Iterable[Path] = ()) -> None:
    """Finds out before the work whether ``path`` can be written and is none of the others.

    What is no regular file, such as a device, may stand for several outputs.
    """
    for other in others:
        if _same(path, other):
            raise GraspModuliError(
                f"{name} must be a file of its own, got {path}, which is {other}"
            )
    try:
        target = _target(path)
        if target is None:
            return
        if target.exists() and not os.access(target, os.W_OK):
            raise PermissionError(13, "it is read-only")
        handle, probe = tempfile.mkstemp(prefix=".graspmoduli-", dir=target.parent)
        os.close(handle)
        Path(probe).unlink()
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from None


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path whose file takes the place of ``path`` if the block succeeds.

    It lies beside the file and is renamed to it; what is no regular file is written through.
    """
    try:
        target = _target(path)
        folder = None if target is None else target.parent
        handle, name = tempfile.mkstemp(prefix=".graspmoduli-", suffix=path.suffix[:8], dir=folder)
        os.close(handle)
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from None
    temporary = Path(name)
    _unfinished.add(temporary)
    try:
        yield temporary
        if target is None:
            _write_through(path, temporary.read_bytes())
        else:
            temporary.chmod(_mode(target))
            temporary.replace(target)
    except OSError as error:
        raise _unwritable(path, error) from None
    finally:
        temporary.unlink(missing_ok=True)
        _unfinished.discard(temporary)


def discard_unfinished() -> None:
    """Removes temporary files, where the process ends without unwinding."""
    for temporary in list(_unfinished):
        temporary.unlink(missing_ok=True)


def _unwritable(path: Path, error: Exception) -> GraspModuliError:
    reason = getattr(error, "strerror", None) or error
    return GraspModuliError(f"output must be a file that can be written, got {path} ({reason})")


def _target(path: Path) -> Path | None:
    """The file to replace, behind links; None if ``path`` is no regular file."""
    target = Path(os.path.realpath(path))
    try:
        found = path.stat()
    except FileNotFoundError:
        return target
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(21, "it is a folder")
    if not stat.S_ISREG(found.st_mode) or _open_stream(found) is not None:
        return None
    return target


def _open_stream(found: os.stat_result) -> int | None:
    """The number of standard output or error, if that is the file."""
    for number in (1, 2):
        try:
            if os.path.samestat(found, os.fstat(number)):
                return number
        except OSError:
            # Closed.
            continue
    return None


def _write_through(path: Path, data: bytes) -> None:
    stream = _open_stream(path.stat())
    if stream is None:
        path.write_bytes(data)
        return
    for standard in (sys.stdout, sys.stderr):
        if standard is not None:
            standard.flush()
    # Where the stream is, not at the start of the file behind it.
    with os.fdopen(os.dup(stream), "wb") as file:
        file.write(data)


def _same(path: Path, other: Path) -> bool:
    """Are both names of one regular file, or of one that is not there yet?"""
    try:
        if path.exists() and other.exists():
            return path.samefile(other) and stat.S_ISREG(path.stat().st_mode)
        return os.path.realpath(path) == os.path.realpath(other)
    except (OSError, ValueError):
        return False


def _mode(target: Path) -> int:
    """Permissions of the file that is replaced, or those of a new one."""
    try:
        return stat.S_IMODE(target.stat().st_mode)
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
