"""Where the pieces of a long run are kept: an SQLite file that survives being killed."""

from __future__ import annotations

import functools
import hashlib
import json
import sqlite3
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

from .. import _core
from .._core import GraspModuliError


class Piece(NamedTuple):
    """A part of the work: any worker computes the same of it."""

    #: Which work.
    family: str
    #: Which part of it, from 0.
    number: int


@functools.cache
def code_version() -> str:
    """Names the code that computes: the package's version, its sources and its compiled core.

    No number that somebody must remember to raise: whatever changes a result changes this.
    """
    package = Path(_core.__file__).parent
    digest = hashlib.sha256(version("graspmoduli").encode())
    for path in sorted([*package.rglob("*.py"), Path(_core.__file__)]):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


class Store:
    """Results of pieces, each committed by itself: what is killed loses the piece at hand, no more.

    Pieces are kept by the version of the code that computed them; those of another are not used.

    Parameters
    ----------
    folder
        Made if it does not exist.
    configuration
        Whatever the results depend on. A folder with results of another one is refused.
    """

    def __init__(self, folder: Path, configuration: dict[str, Any]) -> None:
        self.path = folder / "pieces.sqlite"
        wanted = json.dumps(configuration, sort_keys=True)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._connection = sqlite3.connect(self.path)
            self._connection.execute("PRAGMA synchronous = FULL")
            with self._connection as connection:
                connection.execute(
                    "CREATE TABLE IF NOT EXISTS configuration (only_row INTEGER PRIMARY KEY "
                    "CHECK (only_row = 1), text TEXT NOT NULL)"
                )
                connection.execute(
                    "CREATE TABLE IF NOT EXISTS results (code TEXT, family TEXT, number INTEGER, "
                    "result TEXT NOT NULL, seconds REAL NOT NULL, "
                    "PRIMARY KEY (code, family, number))"
                )
                connection.execute("INSERT OR IGNORE INTO configuration VALUES (1, ?)", (wanted,))
            (found,) = self._connection.execute("SELECT text FROM configuration").fetchone()
        except (OSError, ValueError, sqlite3.Error) as error:
            raise self._unusable(error) from None
        if found != wanted:
            self._connection.close()
            raise GraspModuliError(
                f"out must be a folder of the same configuration, got {folder} with another one "
                f"({_difference(json.loads(found), configuration)}); give another folder"
            )

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._connection.close()

    def done(self) -> set[Piece]:
        """The pieces that are there."""
        rows = self._connection.execute(
            "SELECT family, number FROM results WHERE code = ?", (code_version(),)
        )
        return {Piece(*row) for row in rows}

    def put(self, piece: Piece, result: Any, seconds: float) -> None:
        """Keeps a piece's result, which JSON can hold, and the time it took."""
        try:
            with self._connection as connection:
                connection.execute(
                    "INSERT OR REPLACE INTO results VALUES (?, ?, ?, ?, ?)",
                    (code_version(), *piece, json.dumps(result), seconds),
                )
        except sqlite3.Error as error:
            raise self._unusable(error) from None

    def get(self, family: str, count: int) -> tuple[list[Any], list[float]]:
        """Results and seconds of the first pieces of a family, in order."""
        rows = self._connection.execute(
            "SELECT result, seconds FROM results WHERE code = ? AND family = ? AND number < ? "
            "ORDER BY number",
            (code_version(), family, count),
        ).fetchall()
        return [json.loads(result) for result, _ in rows], [seconds for _, seconds in rows]

    def _unusable(self, error: Exception) -> GraspModuliError:
        return GraspModuliError(
            f"out must be a folder that results can be written to, got {self.path.parent} ({error})"
        )


def _difference(found: dict[str, Any], wanted: dict[str, Any]) -> str:
    """The first entry in which two configurations differ."""
    for key in sorted({*found, *wanted}):
        if found.get(key) != wanted.get(key):
            return f"{key} {found.get(key)} there, {wanted.get(key)} asked for"
    return "different"
