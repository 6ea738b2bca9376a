"""Many units on processes of this computer and on a cluster of Dask over TCP: equal results, and a worker killed."""

from __future__ import annotations

import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from instruments.clock import SystemClock
from labctl.answers.fleet import FleetJobRequest, FleetJobResponse, FleetPublishRequest
from labctl.services.fleet.engines import DaskEngine, Engine
from labctl.services.fleet.foreground import run_with
from labctl.services.fleet.processes import ProcessEngine
from labctl.services.fleet.publishing import publish
from labctl.services.fleet.source import Source
from labctl.store import Store, open_store
from tests.helpers.fleets import add_units
from tests.helpers.processes import begin, kill

UNITS = 6
FIT = FleetJobRequest(kind="fit", effects=["bias", "scale_factor"], again=True)


def free_port() -> int:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Cluster:
    """A scheduler and two workers, each a process of its own."""

    def __init__(self, log: Path) -> None:
        self.address = f"127.0.0.1:{free_port()}"
        host, port = self.address.split(":")
        # ended by signals, not by a nanny that would start a killed worker again
        words = (
            ["scheduler", "--host", host, "--port", port, "--no-dashboard"],
            *[["worker", f"tcp://{self.address}", "--nthreads", "1", "--no-nanny", "--no-dashboard"]] * 2,
        )
        self.scheduler, *self.workers = [begin([sys.executable, "-m", "dask", *each], log) for each in words]

    def close(self) -> None:
        """End all of it."""
        for process in (*self.workers, self.scheduler):
            kill(process)


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    made = Cluster(tmp_path / "dask.log")
    yield made
    made.close()


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        add_units(opened, UNITS)
        yield opened


def fit_all(store: Store, engine: Engine, worker: Callable[[], int], source: str = "") -> None:
    """Fit every unit on an engine of which a worker is killed on the way; each gets one version."""
    request = FIT.model_copy(update={"source": source})
    before = [len(store.calibrations.versions(f"U{number:05d}")) for number in range(UNITS)]
    killed: list[int] = []

    def kill_worker(answer: FleetJobResponse) -> None:
        if answer.done == 2 and not killed:
            killed.append(worker())
            os.kill(killed[0], signal.SIGKILL)

    job = run_with(store, SystemClock(), request, lambda: engine, kill_worker)
    assert killed
    assert (job.state, job.done, job.failed) == ("done", UNITS, 0)
    after = [len(store.calibrations.versions(f"U{number:05d}")) for number in range(UNITS)]
    assert after == [versions + 1 for versions in before]


@pytest.mark.slow
def test_a_cluster_and_processes_of_this_computer_give_the_same_coefficients_though_a_worker_is_killed(
    store: Store, cluster: Cluster, tmp_path: Path
) -> None:
    published = f"file://{tmp_path}/published"  # the workers of the cluster read there, the processes the database
    assert publish(store, FleetPublishRequest(url=published)).written == UNITS
    on_cluster = DaskEngine(f"dask://{cluster.address}", Source(store.address))
    fit_all(store, on_cluster, lambda: cluster.workers[0].pid, published)
    engine = ProcessEngine(store.address, 2)
    fit_all(store, engine, lambda: next(iter(engine._pool._processes)))
    for number in range(UNITS):
        by_process, by_cluster = store.calibrations.of_unit(f"U{number:05d}")
        assert by_process.answer["axes"] == by_cluster.answer["axes"]
