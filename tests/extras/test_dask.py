"""The experiments on a Dask cluster, with a worker killed in the middle."""

import os
import signal
import threading
import time
from dataclasses import replace

import pytest

import graspmoduli as gm
from graspmoduli.experiments import cluster as cluster_module
from graspmoduli.experiments import reproduce
from graspmoduli.experiments.store import Piece, Store
from test_experiments import SCALES, TINY

NAMES = ["fig5", "fig10", "fig11"]


def test_a_cluster_gives_the_same_bits_whatever_becomes_of_its_workers(tmp_path, monkeypatch):
    import dask
    from distributed import LocalCluster

    reproduce(NAMES, out=tmp_path / "threads", threads=2)
    wanted = (tmp_path / "threads" / "results.json").read_bytes()
    reproduce(NAMES, out=tmp_path / "local", workers=2)
    assert (tmp_path / "local" / "results.json").read_bytes() == wanted

    # A scheduler of somebody else's, which gives a piece up at the first death around it.
    dask.config.set({"distributed.scheduler.allowed-failures": 0})
    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        killed = threading.Event()

        def kill(step):
            # In the middle of the work, the process of a worker.
            if step.name == "fig5" and step.done == 3 and not killed.is_set():
                killed.set()
                os.kill(next(iter(cluster.workers.values())).process.pid, signal.SIGKILL)

        out = tmp_path / "killed"
        reproduce(NAMES, out=out, scheduler=cluster.scheduler_address, progress=kill)
        assert killed.is_set()
        assert (out / "results.json").read_bytes() == wanted
        # Another run on the same scheduler gets pieces of its own.
        other = replace(TINY, seed=1)
        for kind, options in (
            ("alone", {"threads": 2}),
            ("beside", {"scheduler": cluster.scheduler_address}),
        ):
            monkeypatch.setitem(SCALES, "quick", other)
            reproduce(["fig5"], out=tmp_path / kind, **options)
        texts = [(tmp_path / kind / "results.json").read_bytes() for kind in ("alone", "beside")]
        assert texts[0] == texts[1] != wanted


def test_a_piece_that_ends_every_worker_is_given_up(tmp_path, monkeypatch):
    import dask
    from distributed import LocalCluster

    dask.config.set({"distributed.scheduler.allowed-failures": 0})
    monkeypatch.setattr(cluster_module, "MOST_DEATHS", 2)
    with (
        LocalCluster(
            n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
        ) as cluster,
        Store(tmp_path, {}) as store,
    ):
        with pytest.raises(gm.GraspModuliError, match="workers must survive a piece, got fig8 0"):
            cluster_module.run_on_dask(
                [Piece("fig8", 0)], dies, TINY, store, print, cluster.scheduler_address, None
            )
        assert store.done() == set()


def dies(piece, scale):
    os._exit(1)


@pytest.fixture(autouse=True)
def tiny(monkeypatch):
    # Workers get the scale with each piece, so that the small one need not be known to them.
    monkeypatch.setitem(SCALES, "quick", TINY)


def test_no_scheduler_is_one_sentence(tmp_path):
    begin = time.monotonic()
    with pytest.raises(gm.GraspModuliError, match="scheduler must be the address of a Dask"):
        reproduce(["fig12"], out=tmp_path, scheduler="tcp://127.0.0.1:1")
    assert time.monotonic() - begin < 60


def test_public_objects_travel_to_workers_and_back():
    from distributed import Client, LocalCluster

    surface, other = gm.shapes.MODELS["e"], gm.shapes.MODELS["f"]
    best = gm.synthesize(surface, top=1)[0]
    things = [
        surface,
        best,
        best.grasp,
        gm.place(surface, best.grasp),
        gm.transfer(surface, best.grasp, other),
        gm.surface_distance(surface, other),
        gm.distance((surface, best.grasp), (other, best.grasp)),
        best.wrench_space(),
        gm.sample_combinations([surface, other], 2),
    ]
    with (
        LocalCluster(
            n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
        ) as cluster,
        Client(cluster) as client,
    ):
        for thing in things:
            back, text = client.submit(lambda x: (x, repr(x)), thing, pure=False).result()
            assert back == thing
            assert type(back) is type(thing)
            assert text == repr(thing)
