"""What ``graspmoduli grasp`` prints."""

from __future__ import annotations

import math
import shutil
import sys
from typing import Any

from rich.console import Console
from rich.table import Table

from .console import Output, is_terminal


def show(path: str, fit: Any, grasps: Any, edges: int) -> None:
    """The fit in two lines, the grasps as a table, and what they mean in words."""
    axis = ", ".join(f"{_rounded(x, 2):+.2f}" for x in fit.pose[:3, 2])
    lines = [
        f"{path}: size {fit.residual.size:.4g}, axis ({axis})",
        f"fit: rms {fit.residual.relative_rms:.2%} and max {fit.residual.relative_max:.2%} of the "
        f"size from the surface, {_shares(fit)}",
    ]
    digits = max(0, 3 - int(f"{fit.residual.size:e}".split("e")[1]))
    # Wide enough for the table when the output is not a terminal.
    width = shutil.get_terminal_size().columns if is_terminal(sys.stdout) else 120
    table = table_of(grasps, edges, digits, stacked=False)
    if _width(table) > width:
        table = table_of(grasps, edges, digits, stacked=True)
    # What is wider still is for the terminal to wrap: no digit is lost.
    console = Output(highlight=False, width=max(width, _width(table)), height=25)
    for line in lines:
        console.print(line, soft_wrap=True, markup=False)
    if grasps:
        console.print()
        console.print(table)
        limit = "are at most 1 each" if grasps[0].norm == "each" else "sum to 1"
        name = _name(grasps, edges)
        said = [
            "",
            "Q: the largest wrench, in any direction, resisted by fingers whose normal forces "
            f"{limit}, with round friction cones; {name} with cones of {edges} edges; lengths "
            f"divided by {fit.length_scale:.4g}.",
            *_words(fit, grasps),
        ]
        for line in said:
            console.print(line, soft_wrap=True, markup=False)


def _shares(fit: Any) -> str:
    """How much of the object is explained, and how much of the surface is there."""
    if fit.mesh is None:
        return (
            f"{fit.unexplained:.1%} of the wall unexplained; {fit.coverage:.0%} of the surface "
            f"seen, {fit.phantom:.0%} of it seen to be empty"
        )
    return (
        f"{fit.unexplained:.1%} of the object unexplained; {fit.phantom:.1%} of the surface with "
        "no object near it"
    )


#: Qualities closer than this share are a tie: the fingers' own errors are larger.
TIE = 0.05


def _words(fit: Any, grasps: Any) -> list[str]:
    """Which grasps are as good as each other, and how sure their contacts are."""
    words = []
    task = grasps[0].task_quality is not None
    if task:
        words.append("task: the multiple of all of the task's wrenches that such forces resist.")
    values = [grasp.task_quality if task else grasp.round_quality[0] for grasp in grasps]
    equal = sum(value >= (1.0 - TIE) * max(values) for value in values)
    if equal > 1:
        words.append(f"A tie: {equal} of the grasps are within {TIE:.0%} of the best.")
    if fit.mesh is not None:
        checks = [check for grasp in grasps for check in grasp.checks]
        angle = math.degrees(max(check.angle for check in checks))
        bearing = min(check.bearing for check in checks)
        held = min(grasp.held for grasp in grasps)
        share = "all" if held == 1.0 else f"at least {held:.0%}"
        words.append(
            f"Every contact lies on the mesh: the normals felt differ from its triangles' by at "
            f"most {angle:.0f}°, at least {bearing:.0%} of each pad bears, and {share} "
            "of the errors of aim that were tried leave a grasp in force closure."
        )
    elif fit.scanned is not None:
        seen = [sum(check.seen for check in grasp.checks) for grasp in grasps]
        total = sum(len(grasp.checks) for grasp in grasps)
        words.append(
            f"{sum(seen)} of {total} contacts were seen, {seen[0]} of them of the first grasp; the "
            "others lie on the fitted surface, where the object may be otherwise."
        )
    return words


def table_of(grasps: Any, edges: int, digits: int, *, stacked: bool) -> Table:
    """Grasps by rank: fingers side by side, or one below the other where it is narrow."""
    table = Table(box=None, padding=(0, 1 if stacked else 2), header_style="bold")
    task = bool(grasps) and grasps[0].task_quality is not None
    columns = ["#", *(["task"] if task else []), "Q", _name(grasps, edges)]
    if stacked:
        columns += ["finger", "(x, y, z)"]
    else:
        fingers = range(1, 1 + max(len(grasp.contacts) for grasp in grasps)) if grasps else ()
        columns += [f"finger {finger}  (x, y, z)" for finger in fingers]
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    for rank, grasp in enumerate(grasps, 1):
        points = [
            ", ".join(f"{_rounded(x, digits):.{digits}f}" for x in point)
            for point in grasp.contacts
        ]
        head = [str(rank), f"{grasp.round_quality[0]:.4f}", f"{grasp.quality:.4f}"]
        if task:
            head.insert(1, f"{grasp.task_quality:.4g}")
        if stacked:
            for finger, point in enumerate(points, 1):
                table.add_row(*(head if finger == 1 else [""] * len(head)), str(finger), point)
        else:
            table.add_row(*head, *points)
    return table


def _name(grasps: Any, edges: int) -> str:
    """Q_l, or Q'_l of fingers with a limit each."""
    return f"Q'_{edges}" if grasps and grasps[0].norm == "each" else f"Q_{edges}"


def _rounded(x: float, digits: int) -> float:
    """Without a zero that is negative."""
    return round(float(x), digits) + 0.0


def _width(table: Table) -> int:
    return Console(width=1000, height=25).measure(table).maximum
