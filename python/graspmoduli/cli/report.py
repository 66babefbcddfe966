"""What ``graspmoduli grasp --json`` writes."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

#: The version of what ``grasp --json`` writes; docs/object.md describes it.
SCHEMA = 1


def report(
    path: str, thing: Any, fit: Any, grasps: Any, friction: float, edges: int, norm: str
) -> dict[str, Any]:
    """The whole file, as docs/object.md describes it."""
    return {
        "schema": SCHEMA,
        "object": path,
        "fit": {
            "residual_rms": fit.residual.rms,
            "residual_max": fit.residual.max,
            "size": fit.residual.size,
            "coverage": fit.coverage,
            "unexplained": fit.unexplained,
            "phantom": fit.phantom,
            "pose": fit.pose.tolist(),
        },
        "scan": _scan(thing),
        "friction": friction,
        "edges": edges,
        "norm": norm,
        "torsion": grasps[0].torsion if grasps else 0.0,
        "length_scale": fit.length_scale,
        "center_of_mass_of": _center_of(fit),
        "note": "contacts, normals and center_of_mass are in the coordinates of the object's "
        "file; quality is that of lengths divided by length_scale",
        "grasps": [_grasp_report(grasp) for grasp in grasps],
    }


def _scan(thing: Any) -> dict[str, Any] | None:
    """From where a cloud of points was seen, and the table under it."""
    if thing.faces is not None:
        return None
    table = thing.table
    return {
        "cameras": [(view.camera + 0.0).tolist() for view in thing.views],
        "table": None
        if table is None
        else {"point": table.point.tolist(), "normal": table.normal.tolist()},
    }


def _center_of(fit: Any) -> str:
    """What the centre of mass is that of, if none was given."""
    if fit.mesh is None:
        return "fitted surface"
    return "solid" if fit.mesh.shape.closed else "triangles"


def _grasp_report(grasp: Any) -> dict[str, Any]:
    coordinates = [
        [None if math.isnan(x) else x for x in column] for column in grasp.coordinates.T.tolist()
    ]
    report = {
        "quality": grasp.quality,
        "round_quality": list(grasp.round_quality),
        "contacts": grasp.contacts.tolist(),
        "normals": grasp.normals.tolist(),
        "center_of_mass": grasp.center_of_mass.tolist(),
        "u": coordinates[0],
        "theta": coordinates[1],
    }
    if grasp.exact_quality is not None:
        report["exact_quality"] = grasp.exact_quality
        report["low_quality"] = grasp.low_quality
        report["held"] = grasp.held
    if grasp.task_quality is not None:
        report["task_quality"] = grasp.task_quality
    if grasp.checks is not None:
        report["checks"] = [
            # The fitted surface is the only part that is known.
            {**_known(dataclasses.asdict(check)), "part": None if u is None else 0}
            for check, u in zip(grasp.checks, coordinates[0], strict=True)
        ]
    return report


def _known(values: dict[str, Any]) -> dict[str, Any]:
    """Numbers that nobody knows as JSON has them."""
    return {
        name: None if isinstance(value, float) and math.isnan(value) else value
        for name, value in values.items()
    }
