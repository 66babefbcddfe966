"""Files that people write by hand."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from ._core import GraspModuliError


def read_toml(name: str, path: Path) -> dict[str, Any]:
    """What a TOML file holds; ``name`` is what the caller calls it."""
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    if not path.is_file():
        raise GraspModuliError(f"{name} must be a TOML file, got no file {path}")
    try:
        with path.open("rb") as file:
            return tomllib.load(file)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        reason = " ".join(str(error).split())
        raise GraspModuliError(
            f"{name} must be a whole TOML file, got {path} ({reason[:120]})"
        ) from None
