"""The one way to say that an optional package is not installed."""

from __future__ import annotations

from ._core import GraspModuliError


class MissingExtraError(GraspModuliError, ImportError):
    """A part of graspmoduli needs a package that is not installed; says how to install it.

    An ImportError to those who import, a GraspModuliError to those who call, so that the command
    line prints it in one line.
    """


def missing(what: str, package: str, extra: str) -> MissingExtraError:
    """``what`` needs ``package``, which comes with ``extra``; to be raised ``from`` the cause."""
    return MissingExtraError(
        f"{what} needs {package}: install it with pip install 'graspmoduli[{extra}]'"
    )
