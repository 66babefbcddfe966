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

#: In the place of a criterion where the paper has no such number.
BEYOND = "beyond the paper"


@dataclass(frozen=True)
class Row:
    """A number of the paper and ours."""

    what: str
    section: str
    #: As the paper states it; "–" where it has none.
    paper: str
    ours: str
    #: What must hold for the number to agree with the paper's: it can fail. Or :data:`BEYOND`.
    criterion: str
    #: Whether it holds; None where there is nothing to compare.
    agrees: bool | None = None
    #: What there is to know.
    why: str = ""


@dataclass
class Outcome:
    """What a figure of the paper came to."""

    rows: list[Row] = field(default_factory=list)
    #: Numbers behind the pictures. The same bits for the same configuration.
    series: dict[str, Any] = field(default_factory=dict)
    #: Makes a picture each, by name.
    pictures: dict[str, Callable[[], Figure]] = field(default_factory=dict)
    #: What each picture shows, with its seed, distances and qualities.
    captions: dict[str, str] = field(default_factory=dict)
    #: Times, beside the paper's: they differ from run to run, so they are in the report only.
    times: list[tuple[str, str, str]] = field(default_factory=list)


#: Files, their contents and captions, by experiment.
Images = dict[str, list[tuple[str, bytes, str]]]


def write(
    folder: Path,
    configuration: dict[str, Any],
    outcomes: dict[str, tuple[str, Outcome]],
    seconds: float,
) -> list[Path]:
    """Writes results.json, report.md with its pictures, and report.html; all appear whole."""
    images: Images = {}
    for name, (_, outcome) in outcomes.items():
        images[name] = [
            (f"{name}{label}.png", _png(make()), outcome.captions.get(label, ""))
            for label, make in outcome.pictures.items()
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
        files |= {file: data for file, data, _ in pictures}
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


#: What is said before all numbers, once.
SURFACES = (
    "The paper's own twelve surfaces are not public. Ours are modelled on its Fig. 2, so absolute "
    "numbers of Secs. IV.B to IV.E cannot be expected to equal the paper's: there, rows compare "
    "what it says about them. Those of Sec. IV.A depend on no surface and are compared as they "
    "are. M^cyl is represented by splines with positive coefficients, which makes every radius "
    "positive, every surface smooth but for its rims, and sums of surfaces exact."
)
#: How the tables are to be read.
READING = (
    "Each row says what must hold for the paper and us to agree; where the paper has no such "
    "number, nothing is compared. “a ± b, from c to d” is the mean over the seeds, its standard "
    "error, and the least and the greatest seed."
)


def _head(configuration: dict[str, Any], seconds: float) -> list[str]:
    """The paragraphs at the top."""
    sizes = ", ".join(f"{key} {value}" for key, value in configuration.items())
    return [
        f"Ours beside the paper's (Pokorny, Hang, Kragic: Grasp Moduli Spaces, RSS 2013), at the "
        f"scale “{configuration['name']}”. Computing took {seconds:,.0f} s of one core. "
        f"Configuration: {sizes}.",
        SURFACES,
        READING,
    ]


HEADERS = ("what", "section", "paper", "ours", "agrees if", "agrees", "remark")


def _cells(row: Row) -> tuple[str, ...]:
    return (
        row.what, row.section, row.paper, row.ours, row.criterion, _agrees(row), row.why,
    )  # fmt: skip


def _markdown(
    configuration: dict[str, Any],
    outcomes: dict[str, tuple[str, Outcome]],
    images: Images,
    seconds: float,
) -> str:
    lines = ["# The paper's experiments"]
    for paragraph in _head(configuration, seconds):
        lines += ["", paragraph]
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
        for file, _, caption in images[name]:
            lines += ["", f"![{name}]({file})"]
            if caption:
                lines += ["", f"*{caption}*"]
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
figure { margin: 1.5rem 0; }
figcaption { color: #4a5763; font-size: 0.9rem; }
.scroll { overflow-x: auto; }
"""


def _page(
    configuration: dict[str, Any],
    outcomes: dict[str, tuple[str, Outcome]],
    images: Images,
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
        "<h1>The paper's experiments</h1>"
    ]
    parts += [f"<p>{html.escape(text)}</p>" for text in _head(configuration, seconds)]
    for name, (title, outcome) in outcomes.items():
        parts.append(f"<h2>{html.escape(f'{name}: {title}')}</h2>")
        if outcome.rows:
            parts.append(table(HEADERS, [_cells(row) for row in outcome.rows]))
        if outcome.times:
            parts.append(table(("time", "paper", "ours"), outcome.times))
        for file, data, caption in images[name]:
            encoded = base64.b64encode(data).decode()
            parts.append(
                f'<figure><img alt="{html.escape(file)}" src="data:image/png;base64,{encoded}">'
                f"<figcaption>{html.escape(caption)}</figcaption></figure>"
            )
    parts.append("</body></html>\n")
    return "\n".join(parts)
