"""Fleet jobs: cost per unit at 200 and 2,000 units from means, at 50 from readings, here and on a cluster of Dask."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from benchmarks.machine import describe
from instruments.clock import SystemClock
from labctl.answers.fleet import FleetJobRequest
from labctl.services.fleet.engines import DaskEngine, Engine
from labctl.services.fleet.foreground import run_with
from labctl.services.fleet.processes import ProcessEngine
from labctl.services.fleet.source import Source
from labctl.store import Store, open_store
from tests.helpers.fleets import AT, add_units
from tests.helpers.simulated_recordings import single_axis

#: Units of the two fleets of which the cost per unit is compared, and workers of each engine.
SMALL, LARGE, WORKERS = 200, int(os.environ.get("LABCTL_BENCH_UNITS", "2000")), 2
#: Units of which the readings are there, not means only.
READ = int(os.environ.get("LABCTL_BENCH_READ_UNITS", "50"))
KINDS = ("fit", "criticise")
#: A worker of the cluster is killed so long after the last job of the large fleet has begun, s.
KILL_AFTER_S = 20.0
MODEL = "bias_scale"
ADDRESS = "127.0.0.1:18742"


def run() -> dict[str, float | str]:
    """Fit and criticise fleets on processes of this computer, and on a cluster over TCP that loses a worker."""
    figures: dict[str, float] = {}
    for name, units, add in (
        (f"{SMALL}", SMALL, add_units), (f"{LARGE}", LARGE, add_units), (f"{READ}_with_readings", READ, _add_readings),
    ):  # fmt: skip
        with tempfile.TemporaryDirectory() as folder, open_store(str(Path(folder) / "lab.sqlite"), write=True) as store:
            add(store, units)
            for kind in KINDS:
                figures |= _measured(
                    store, f"local_{kind}_{name}", kind, lambda s=store: ProcessEngine(s.address, WORKERS)
                )
            with _cluster() as workers:
                source = Source(store.address)
                for kind in KINDS:
                    figures |= _measured(
                        store, f"dask_{kind}_{name}", kind, lambda s=source: DaskEngine(f"dask://{ADDRESS}", s),
                        workers.pop().kill if units == LARGE and kind == KINDS[-1] else None,
                    )  # fmt: skip
            _compare(store)
        for kind in KINDS:
            figures[f"{kind}_{name}_time_of_dask_over_local"] = (
                figures[f"dask_{kind}_{name}_ms_per_unit"] / figures[f"local_{kind}_{name}_ms_per_unit"]
            )
    for kind in KINDS:
        figures[f"{kind}_cost_of_{LARGE}_over_{SMALL}"] = (
            figures[f"local_{kind}_{LARGE}_processor_s_per_unit"]
            / figures[f"local_{kind}_{SMALL}_processor_s_per_unit"]
        )
    return {**describe("numpy", "scipy", "distributed"), **figures}


def _add_readings(store: Store, count: int) -> None:
    """Import recordings with their readings of so many simulated units."""
    for number in range(count):
        made = single_axis(100 + number)
        info = made.info.model_copy(update={"serial": f"U{number:05d}"})
        store.recordings.add_import(replace(made, info=info), AT)


def _measured(
    store: Store, name: str, kind: str, make_engine: Callable[[], Engine], kill: Callable[[], object] | None = None
) -> dict[str, float]:
    """Do a job; `kill` ends one of its workers after `KILL_AFTER_S`."""
    request = FleetJobRequest.model_validate(
        {"kind": kind, "model": MODEL if kind == "fit" else "", "again": True}
    )  # fmt: skip
    engine = make_engine()
    timer = threading.Timer(KILL_AFTER_S, kill or (lambda: None))
    timer.start()
    begun_s = time.perf_counter()
    try:
        answer = run_with(store, SystemClock(), request, lambda: engine)
    finally:
        timer.cancel()
        engine.close()
    took_s = time.perf_counter() - begun_s
    assert (answer.state, answer.failed) == ("done", 0), answer
    assert answer.processor_s_per_unit is not None
    return {
        f"{name}_processor_s_per_unit": answer.processor_s_per_unit, f"{name}_ms_per_unit": 1000 * took_s / answer.units
    }  # fmt: skip


def _compare(store: Store) -> None:
    """Stop where an engine gave other coefficients than the other, or a unit has a version too many or too few."""
    for unit in store.units.all():
        by_cluster, by_process = store.calibrations.of_unit(unit.serial)
        assert by_cluster.answer["axes"] == by_process.answer["axes"]


@contextlib.contextmanager
def _cluster() -> Iterator[list[subprocess.Popen[bytes]]]:
    """Start a scheduler and workers over TCP; yields the workers."""
    host, port = ADDRESS.split(":")
    words = [["scheduler", "--host", host, "--port", port, "--no-dashboard"]]
    words += [["worker", f"tcp://{ADDRESS}", "--nthreads", "1", "--no-nanny", "--no-dashboard"]] * WORKERS
    started = [subprocess.Popen([sys.executable, "-m", "dask", *each], stderr=subprocess.DEVNULL) for each in words]
    try:
        yield started[1:]
    finally:
        for process in started:
            process.kill()
            process.wait()
