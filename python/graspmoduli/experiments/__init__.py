"""The paper's experiments, every figure and number of Sec. IV beside ours.

:func:`reproduce` divides them into pieces, computes those that are not in the folder yet on threads
or on a Dask cluster, and writes the report.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from .._arrays import cores, count
from .._core import GraspModuliError
from ..shapes import MODELS
from . import fig1_to_4, fig5, fig6, fig7, fig8, fig9, fig10, fig11, fig12, random_grasps
from .cluster import run_on_dask
from .engine import run_on_threads
from .report import Outcome, Row, write
from .settings import SCALES, Scale
from .store import Piece, Store


class Family(NamedTuple):
    """Pieces of the same kind of work."""

    #: How many there are.
    pieces: Callable[[Scale], int]
    #: The result of one of them, from its index: numbers, strings, lists and dictionaries.
    compute: Callable[[int, Scale], Any]


class Experiment(NamedTuple):
    """A figure of the paper."""

    title: str
    #: The families whose pieces it is made of.
    families: tuple[str, ...]
    #: From their results, in order, and the seconds they took.
    finish: Callable[[dict[str, list[Any]], dict[str, list[float]], Scale], Outcome]


def _near(delta: float) -> Callable[[int, Scale], Any]:
    return lambda index, scale: random_grasps.near(delta, index, scale)


def _worst(delta: float) -> Callable[[int, Scale], Any]:
    return lambda index, scale: random_grasps.worst(delta, index, scale)


FAMILIES: dict[str, Family] = {
    "survey": Family(lambda s: s.survey_pieces, random_grasps.survey),
    "near05": Family(lambda s: s.near05_pieces, _near(0.05)),
    "near20": Family(lambda s: s.near20_pieces, _near(0.2)),
    "worst05": Family(lambda s: random_grasps.worst_pieces(0.05), _worst(0.05)),
    "worst20": Family(lambda s: random_grasps.worst_pieces(0.2), _worst(0.2)),
    "poles": Family(lambda s: 1, random_grasps.poles),
    "fig8": Family(lambda s: s.seeds, fig8.fig8_piece),
    "fig9": Family(lambda s: s.seeds * len(s.fig9_sources), fig9.fig9_piece),
    "fig10": Family(lambda s: s.seeds * len(MODELS), fig10.fig10_piece),
    "axis": Family(lambda s: s.seeds * len(fig11.ROUND_MODELS), fig11.axis_piece),
    "fig11": Family(lambda s: s.seeds * fig11.ROUND // fig11.ROUND_PIECE, fig11.fig11_piece),
    "fig12": Family(lambda s: len(fig12.UNEVEN), fig12.fig12_piece),
    "search12": Family(lambda s: s.seeds * len(fig12.UNEVEN), fig12.search_piece),
}

EXPERIMENTS: dict[str, Experiment] = {
    "fig1": Experiment("a simplex of shapes", (), fig1_to_4.fig1),
    "fig2": Experiment("the twelve models", (), fig1_to_4.fig2),
    "fig3": Experiment("random shapes between them", (), fig1_to_4.fig3),
    "fig4": Experiment("a curve in the Grasp Moduli Space", (), fig1_to_4.fig4),
    "fig5": Experiment("uniform grasps in D(1)", ("survey",), fig5.fig5),
    "fig6": Experiment("a neighbourhood of a grasp", (), fig6.fig6),
    "fig7": Experiment(
        "the smallest quality near good grasps",
        ("near05", "near20", "worst05", "worst20"),
        fig7.fig7,
    ),
    "fig8": Experiment("small deformations of one grasp", ("fig8",), fig8.fig8),
    "fig9": Experiment("quality along transfers", ("fig9", "poles"), fig9.fig9),
    "fig10": Experiment("144 transfers", ("fig10",), fig10.fig10),
    "fig11": Experiment("surfaces of revolution", ("axis", "fig11"), fig11.fig11),
    "fig12": Experiment("synthesis by deformation", ("fig12", "search12"), fig12.fig12),
}

#: Every number of the text in one table, without pictures.
TABLE = "table"
NAMES = (*EXPERIMENTS, TABLE)


class Progress(NamedTuple):
    """What :func:`reproduce` tells of its work."""

    #: Which experiment a piece belongs to.
    name: str
    done: int
    total: int


def compute(piece: Piece, scale: Scale) -> Any:
    """The result of a piece: the same bits wherever it is computed."""
    return FAMILIES[piece.family].compute(piece.number, scale)


def reproduce(
    names: Iterable[str] = (),
    *,
    scale: str = "quick",
    out: str | Path = "reproduction",
    threads: int | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> dict[str, Outcome]:
    """Runs the paper's experiments and writes results.json, report.md and report.html.

    Parameters
    ----------
    names
        Of fig1 … fig12 and table; all if empty.
    scale
        ``"quick"``: under a minute on two cores. ``"paper"``: the paper's own sizes, Figs. 8 to
        12 with ten seeds.
    out
        The folder. Pieces that are there already are not computed again.
    threads
        Number of threads, all cores if not given. The results do not depend on it.
    scheduler, workers
        The address of a Dask scheduler, or the number of workers of a local Dask cluster; needs the
        extra ``dask``.
    progress
        Called with each experiment at the start and after every piece.
    """
    chosen = list(dict.fromkeys(names)) or list(NAMES)
    for name in chosen:
        if name not in NAMES:
            raise GraspModuliError(f"name must be one of {', '.join(NAMES)}, got {name!r}")
    if scale not in SCALES:
        raise GraspModuliError(f"scale must be one of {', '.join(SCALES)}, got {scale!r}")
    if scheduler is not None and workers is not None:
        raise GraspModuliError("scheduler and workers exclude each other, got both")
    hands = cores() if threads is None else count("threads", threads, 1)
    local = None if workers is None else count("workers", workers, 1)
    size = SCALES[scale]
    folder = Path(out)
    # The table needs the pieces of all experiments that have rows.
    experiments = list(EXPERIMENTS) if TABLE in chosen else chosen
    with Store(folder, asdict(size)) as store:
        done = store.done()
        owner = {
            family: name for name in reversed(experiments) for family in EXPERIMENTS[name].families
        }
        pieces = [
            Piece(family, index)
            for family in FAMILIES
            if family in owner
            for index in range(FAMILIES[family].pieces(size))
        ]
        numbers: dict[str, list[int]] = {}
        for piece in pieces:
            number = numbers.setdefault(owner[piece.family], [0, 0])
            number[0] += piece in done
            number[1] += 1

        def report(name: str) -> None:
            if progress is not None:
                progress(Progress(name, *numbers[name]))

        for name in numbers:
            report(name)

        def finished(piece: Piece, seconds: float) -> None:
            numbers[owner[piece.family]][0] += 1
            report(owner[piece.family])

        missing = [piece for piece in pieces if piece not in done]
        if missing and (scheduler is not None or local is not None):
            run_on_dask(missing, compute, size, store, finished, scheduler, local)
        elif missing:
            run_on_threads(missing, compute, size, store, finished, hands)
        outcomes: dict[str, tuple[str, Outcome]] = {}
        spent = 0.0
        for name in experiments:
            experiment = EXPERIMENTS[name]
            results: dict[str, list[Any]] = {}
            seconds: dict[str, list[float]] = {}
            for family in experiment.families:
                results[family], seconds[family] = store.get(family, FAMILIES[family].pieces(size))
                spent += sum(seconds[family])
            outcome = experiment.finish(results, seconds, size)
            if name in chosen or outcome.rows:
                outcomes[name] = (experiment.title, outcome)
    if chosen == [TABLE]:
        for _, outcome in outcomes.values():
            outcome.pictures = {}
    write(folder, asdict(size), outcomes, spent)
    return {name: outcome for name, (_, outcome) in outcomes.items()}


__all__ = ["NAMES", "Outcome", "Progress", "Row", "reproduce"]
