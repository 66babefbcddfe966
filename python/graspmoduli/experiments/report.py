"""Rows of the paper's numbers beside ours, as JSON, Markdown and a page that opens by itself."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from .._files import replacing

#: How a number must agree with the paper's.
EXACTLY, STATISTICALLY, IN_KIND, BEYOND = (
    "exactly", "statistically", "in kind", "beyond the paper",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """A number of the paper and ours."""

    what: str
    section: str
    #: As the paper states it; "–" where it has none.
    paper: str
    ours: str
    #: "exactly", "statistically", "in kind", or "beyond the paper" where it has no such number.
    must: str
    agrees: bool | None
    #: If it does not agree, why; else what there is to know.
    why: str = ""


@dataclass
class Outcome:
    """What a figure of the paper came to."""

    rows: list[Row] = field(default_factory=list)
    #: Numbers behind the pictures. The same bits for the same configuration.
    series: dict[str, Any] = field(default_factory=dict)
    #: Makes a picture each, by name.
    pictures: dict[str, Callable[[], Figure]] = field(default_factory=dict)
    #: Times, beside the paper's: they differ from run to run, so they are in the report only.
    times: list[tuple[str, str, str]] = field(default_factory=list)


def write(
    folder: Path,
    configuration: dict[str, Any],
    outcomes: dict[str, tuple[str, Outcome]],
    seconds: float,
) -> list[Path]:
    """Writes results.json, report.md with its pictures, and report.html; all appear whole."""
    images: dict[str, list[tuple[str, bytes]]] = {}
    for name, (_, outcome) in outcomes.items():
        images[name] = [
            (f"{name}{label}.png", _png(make())) for label, make in outcome.pictures.items()
        ]
    results = {
        "configuration": configuration,
        "experiments": {
            name: {
                "title": title,
                "rows": [asdict(row) for row in outcome.rows],
                "series": outcome.series,
            }
            for name, (title, outcome) in outcomes.items()
        },
    }
    files = {
        "results.json": (json.dumps(results, indent=1) + "\n").encode(),
        "report.md": _markdown(configuration, outcomes, images, seconds).encode(),
        "report.html": _page(configuration, outcomes, images, seconds).encode(),
    }
    for pictures in images.values():
        files |= dict(pictures)
    paths = []
    for name, data in files.items():
        with replacing(folder / name) as temporary:
            temporary.write_bytes(data)
        paths.append(folder / name)
    return paths


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _agrees(row: Row) -> str:
    return {True: "yes", False: "no", None: ""}[row.agrees]


def _head(configuration: dict[str, Any], seconds: float) -> str:
    sizes = ", ".join(f"{key} {value}" for key, value in configuration.items())
    return (
        f"Ours beside the paper's (Pokorny, Hang, Kragic: Grasp Moduli Spaces, RSS 2013), at the "
        f"scale “{configuration['name']}”. Computing took {seconds:,.0f} s of one core. "
        f"Configuration: {sizes}. A number agrees statistically if it is within the paper's "
        "rounding and four standard errors of it; in kind, if it supports the same statement, by "
        "a threshold in the code; where there is no criterion, nothing is said."
    )


HEADERS = ("what", "section", "paper", "ours", "must agree", "agrees", "remark")


def _cells(row: Row) -> tuple[str, ...]:
    return (
        row.what, row.section, row.paper, row.ours, row.must, _agrees(row), row.why,
    )  # fmt: skip


def _markdown(
    configuration: dict[str, Any],
    outcomes: dict[str, tuple[str, Outcome]],
    images: dict[str, list[tuple[str, bytes]]],
    seconds: float,
) -> str:
    lines = ["# The paper's experiments", "", _head(configuration, seconds)]
    for name, (title, outcome) in outcomes.items():
        lines += ["", f"## {name}: {title}"]
        if outcome.rows:
            lines += ["", "| " + " | ".join(HEADERS) + " |", "|" + "---|" * len(HEADERS)]
            for row in outcome.rows:
                cells = (cell.replace("|", "\\|") for cell in _cells(row))
                lines.append("| " + " | ".join(cells) + " |")
        if outcome.times:
            lines += ["", "| time | paper | ours |", "|---|---|---|"]
            lines += [f"| {what} | {paper} | {ours} |" for what, paper, ours in outcome.times]
        for file, _ in images[name]:
            lines += ["", f"![{name}]({file})"]
    return "\n".join(lines) + "\n"


STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem;
  color: #1c2733; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0; font-size: 0.9rem; }
th, td { text-align: left; padding: 0.35rem 0.6rem; border-bottom: 1px solid #dde3ea;
  vertical-align: top; }
th { background: #f3f6f9; }
.no { color: #b04a00; font-weight: 600; }
.yes { color: #00664b; font-weight: 600; }
img { max-width: 100%; height: auto; }
.scroll { overflow-x: auto; }
"""


def _page(
    configuration: dict[str, Any],
    outcomes: dict[str, tuple[str, Outcome]],
    images: dict[str, list[tuple[str, bytes]]],
    seconds: float,
) -> str:
    def table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
        def cell(text: str) -> str:
            kind = f' class="{text}"' if text in ("yes", "no") else ""
            return f"<td{kind}>{html.escape(text)}</td>"

        top = "".join(f"<th>{html.escape(text)}</th>" for text in header)
        body = "".join(f"<tr>{''.join(map(cell, row))}</tr>" for row in rows)
        return f'<div class="scroll"><table><tr>{top}</tr>{body}</table></div>'

    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>The paper's experiments</title><style>{STYLE}</style></head><body>"
        f"<h1>The paper's experiments</h1><p>{html.escape(_head(configuration, seconds))}</p>"
    ]
    for name, (title, outcome) in outcomes.items():
        parts.append(f"<h2>{html.escape(f'{name}: {title}')}</h2>")
        if outcome.rows:
            parts.append(table(HEADERS, [_cells(row) for row in outcome.rows]))
        if outcome.times:
            parts.append(table(("time", "paper", "ours"), outcome.times))
        for file, data in images[name]:
            encoded = base64.b64encode(data).decode()
            parts.append(f'<img alt="{html.escape(file)}" src="data:image/png;base64,{encoded}">')
    parts.append("</body></html>\n")
    return "\n".join(parts)
