"""Computing the pieces that are missing, on a Dask cluster. Needs the extra ``dask``."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterator
from typing import Any

from .._core import GraspModuliError
from .engine import Compute, Report, timed
from .settings import Scale
from .store import Piece, Store, code_version

#: A scheduler gives a piece up when several workers have died with it; so often it is asked again.
MOST_DEATHS = 25


def run_on_dask(
    pieces: list[Piece],
    compute: Compute,
    scale: Scale,
    store: Store,
    report: Report,
    scheduler: str | None,
    workers: int | None,
) -> None:
    """Computes pieces on a cluster that runs or on a local one; a lost worker's piece is repeated.

    Each is stored as soon as it is there.
    """
    try:
        from distributed import CancelledError, KilledWorker, as_completed
    except ImportError:
        raise GraspModuliError(
            "scheduler and workers need Dask: pip install 'graspmoduli[dask]'"
        ) from None
    # Two runs on one scheduler share a piece only if it is the same one.
    run = hashlib.sha256(f"{code_version()} {scale}".encode()).hexdigest()[:16]
    deaths = dict.fromkeys(pieces, 0)
    with _client(scheduler, workers) as client:

        def submit(piece: Piece) -> Any:
            key = f"{piece.family}-{piece.number}-{run}-{deaths[piece]}"
            return client.submit(_computed, compute, piece, scale, key=key, pure=False)

        futures = {submit(piece): piece for piece in pieces}
        queue = as_completed(list(futures))
        for future in queue:
            piece = futures.pop(future)
            try:
                code, result, seconds = future.result()
            except KilledWorker:
                # The scheduler gives a piece up after a few deaths around it; we go on.
                deaths[piece] += 1
                if deaths[piece] == MOST_DEATHS:
                    raise GraspModuliError(
                        f"workers must survive a piece, got {piece.family} {piece.number} that "
                        f"ended those that computed it {MOST_DEATHS} times over"
                    ) from None
                again = submit(piece)
                futures[again] = piece
                queue.add(again)
                continue
            except (OSError, CancelledError) as error:
                raise GraspModuliError(
                    f"scheduler must stay until the run is over, got {type(error).__name__}"
                ) from None
            if code != code_version():
                raise GraspModuliError(
                    "workers must run the same build of graspmoduli as this machine, got another"
                )
            store.put(piece, result, seconds)
            report(piece, seconds)


def _computed(compute: Compute, piece: Piece, scale: Scale) -> tuple[str, Any, float]:
    """On a worker: the version of its code, a piece's result, and the seconds it took."""
    return code_version(), *timed(compute, piece, scale)


@contextlib.contextmanager
def _client(scheduler: str | None, workers: int | None) -> Iterator[Any]:
    import logging

    from distributed import Client, LocalCluster

    # Workers come and go; what cannot be mended is raised.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    if scheduler is None:
        with (
            LocalCluster(
                n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = Client(scheduler, timeout="10s")
    except (OSError, ValueError, TimeoutError) as error:
        raise GraspModuliError(
            f"scheduler must be the address of a Dask scheduler, got {scheduler!r} ({error})"
        ) from None
    with client:
        yield client
