"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ._core import GraspModuliError


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path``, renamed to it if the block succeeds."""
    try:
        handle, name = tempfile.mkstemp(
            prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent
        )
        os.close(handle)
    except OSError as error:
        raise GraspModuliError(
            f"output must be a file that can be written, got {path} ({error.strerror})"
        ) from None
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes private files; give them the usual permissions.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        try:
            temporary.replace(path)
        except OSError as error:
            raise GraspModuliError(
                f"output must be a file that can be written, got {path} ({error.strerror})"
            ) from None
    finally:
        temporary.unlink(missing_ok=True)
