"""Computing the pieces that are missing, on a Dask cluster. Needs the extra ``dask``."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from .._core import GraspModuliError
from .engine import Compute, Report, timed
from .settings import Scale
from .store import Piece, Store


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
        from distributed import as_completed
    except ImportError:
        raise GraspModuliError(
            "scheduler and workers need Dask: pip install 'graspmoduli[dask]'"
        ) from None
    with _client(scheduler, workers) as client:
        futures = {
            # A worker may be killed as often as it likes.
            client.submit(timed, compute, piece, scale, key=f"{piece.family}-{piece.number}",
                          pure=False, retries=100): piece
            for piece in pieces
        }  # fmt: skip
        for future in as_completed(list(futures)):
            result, seconds = future.result()
            store.put(futures[future], result, seconds)
            report(futures[future], seconds)


@contextlib.contextmanager
def _client(scheduler: str | None, workers: int | None) -> Iterator[Any]:
    import logging

    import dask
    from distributed import Client, LocalCluster

    # Workers come and go; what cannot be mended is raised.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    # However often the workers around it die, a piece is tried again.
    dask.config.set({"distributed.scheduler.allowed-failures": 100})
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
