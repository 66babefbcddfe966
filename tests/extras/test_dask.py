"""The experiments on a Dask cluster, with a worker killed in the middle."""

import os
import signal
import threading
import time

import pytest

import graspmoduli as gm
from graspmoduli.experiments import reproduce
from test_experiments import SCALES, TINY

NAMES = ["fig5", "fig10", "fig11"]


def test_a_cluster_gives_the_same_bits_whatever_becomes_of_its_workers(tmp_path, monkeypatch):
    from distributed import LocalCluster

    reproduce(NAMES, out=tmp_path / "threads", threads=2)
    wanted = (tmp_path / "threads" / "results.json").read_bytes()
    reproduce(NAMES, out=tmp_path / "local", workers=2)
    assert (tmp_path / "local" / "results.json").read_bytes() == wanted

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


@pytest.fixture(autouse=True)
def tiny(monkeypatch):
    # Workers get the scale with each piece, so that the small one need not be known to them.
    monkeypatch.setitem(SCALES, "quick", TINY)


def test_no_scheduler_is_one_sentence(tmp_path):
    begin = time.monotonic()
    with pytest.raises(gm.GraspModuliError, match="scheduler must be the address of a Dask"):
        reproduce(["fig12"], out=tmp_path, scheduler="tcp://127.0.0.1:1")
    assert time.monotonic() - begin < 60
