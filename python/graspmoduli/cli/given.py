"""Grasps that ``grasp --json`` or the viewer wrote, read back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from .. import _arrays
from .._core import GraspModuliError
from .report import SCHEMA

#: Contacts farther than this from the object, over its size, are of another one.
FAR = 0.25


def read_report(path: Path) -> dict[str, Any]:
    """The file, if it is one."""
    try:
        found = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise GraspModuliError(
            f"grasps must be a file that can be read, got {path} ({error.strerror})"
        ) from None
    except ValueError as error:
        raise GraspModuliError(f"grasps must be a JSON file, got {path} ({error})") from None
    if not isinstance(found, dict) or not isinstance(found.get("grasps"), list):
        raise GraspModuliError(f"grasps must be what grasp --json wrote, got {path} without grasps")
    if found.get("schema") != SCHEMA:
        raise GraspModuliError(
            f"grasps must have schema {SCHEMA}, got {found.get('schema')!r} in {path}"
        )
    if not found["grasps"]:
        raise GraspModuliError(f"grasps must hold at least one grasp, got none in {path}")
    return found


def grasps_of(report: dict[str, Any], path: Path, fit: Any, hand: Any) -> list[Any]:
    """The grasps of a file on an object, as it judges them, in the file's order."""
    from ..viewing.held import Held, Touch

    found = []
    for rank, one in enumerate(report["grasps"], 1):
        try:
            contacts, normals, center = (
                _arrays.finite(name, _arrays.floats(name, one[name]))
                for name in ("contacts", "normals", "center_of_mass")
            )
            shapes = (contacts.ndim, contacts.shape[-1:], center.shape)
            if shapes != (2, (3,), (3,)) or contacts.shape != normals.shape:
                raise GraspModuliError("contacts and normals must have shape (m, 3)")
            normals = _arrays.unit("normals", normals)
        except (KeyError, TypeError, GraspModuliError) as error:
            raise GraspModuliError(
                f"grasps must have contacts, normals and a center_of_mass, got grasp {rank} of "
                f"{path} ({error})"
            ) from None
        touch = Touch(fit, None, center)
        held = Held(tuple(touch.judge(*pair) for pair in zip(contacts, normals, strict=True)))
        middle = np.sqrt(((contacts - fit.center_of_mass) ** 2).sum(axis=1))
        if float(middle.max()) > (1.0 + FAR) * fit.residual.size:
            raise GraspModuliError(
                f"grasps must be of this object, got a contact of grasp {rank} of {path} that is "
                f"{float(middle.max()) / fit.residual.size:.2g} sizes from its middle"
            )
        found.append(touch.as_grasp(held, hand))
    counts = {len(one.contacts) for one in found}
    if len(counts) > 1:
        raise GraspModuliError(
            f"grasps must all have the same number of fingers, got {sorted(counts)} in {path}"
        )
    return found
