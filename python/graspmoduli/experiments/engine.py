"""Computing the pieces that are missing, on threads."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any

from .settings import Scale
from .store import Piece, Store

#: Computes a piece: what of (family, index) results at a scale.
Compute = Callable[[Piece, Scale], Any]
#: Called with a piece that is done and the seconds that it took.
Report = Callable[[Piece, float], None]


def run_on_threads(
    pieces: list[Piece], compute: Compute, scale: Scale, store: Store, report: Report, threads: int
) -> None:
    """Computes pieces and stores each as soon as it is there; Ctrl-C ends after those at hand."""
    waiting = iter(pieces)
    pool = ThreadPoolExecutor(threads)
    running: dict[Future[tuple[Any, float]], Piece] = {}

    def start() -> None:
        for piece in waiting:
            running[pool.submit(timed, compute, piece, scale)] = piece
            return

    try:
        for _ in range(2 * threads):
            start()
        while running:
            # Signals are seen between waits.
            finished, _ = wait(running, timeout=0.2, return_when=FIRST_COMPLETED)
            for future in finished:
                piece = running.pop(future)
                result, seconds = future.result()
                store.put(piece, result, seconds)
                report(piece, seconds)
                start()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def timed(compute: Compute, piece: Piece, scale: Scale) -> tuple[Any, float]:
    """A piece's result and the seconds it took."""
    start = time.perf_counter()
    result = compute(piece, scale)
    return result, time.perf_counter() - start
