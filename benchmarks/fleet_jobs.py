"""Fleet jobs: processor time per unit at 200 and 2,000 units from means, and this computer beside a cluster of Dask."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.machine import describe
from instruments.clock import SystemClock
from labctl.answers.fleet import FleetJobRequest
from labctl.services.fleet.engines import DaskEngine, Engine
from labctl.services.fleet.foreground import run_with
from labctl.services.fleet.processes import ProcessEngine
from labctl.services.fleet.source import Source
from labctl.store import Store, open_store
from tests.helpers.fleets import add_units

#: Units of the two fleets of which the cost per unit is compared, and workers of each engine.
SMALL, LARGE, WORKERS = 200, int(os.environ.get("LABCTL_BENCH_UNITS", "2000")), 2
MODEL = "bias_scale"
ADDRESS = "127.0.0.1:18742"


def run() -> dict[str, float | str]:
    """Fit and criticise two fleets on processes of this computer, and the small one on a cluster over TCP."""
    figures: dict[str, float] = {}
    for units in (SMALL, LARGE):
        with tempfile.TemporaryDirectory() as folder, open_store(str(Path(folder) / "lab.sqlite"), write=True) as store:
            add_units(store, units)
            for kind in ("fit", "criticise"):
                figures |= _measured(
                    store, f"local_{kind}_{units}", kind, lambda s=store: ProcessEngine(s.address, WORKERS)
                )
            if units == SMALL:
                with _cluster():
                    source = Source(store.address)
                    for kind in ("fit", "criticise"):
                        figures |= _measured(
                            store, f"dask_{kind}_{units}", kind, lambda s=source: DaskEngine(f"dask://{ADDRESS}", s)
                        )
                _compare(store)
    for kind in ("fit", "criticise"):
        figures[f"{kind}_cost_of_{LARGE}_over_{SMALL}"] = (
            figures[f"local_{kind}_{LARGE}_processor_s_per_unit"]
            / figures[f"local_{kind}_{SMALL}_processor_s_per_unit"]
        )
        figures[f"{kind}_time_of_dask_over_local"] = (
            figures[f"dask_{kind}_{SMALL}_ms_per_unit"] / figures[f"local_{kind}_{SMALL}_ms_per_unit"]
        )
    return {**describe("numpy", "scipy", "distributed"), **figures}


def _measured(store: Store, name: str, kind: str, make_engine: Callable[[], Engine]) -> dict[str, float]:
    request = FleetJobRequest.model_validate(
        {"kind": kind, "model": MODEL if kind == "fit" else "", "again": True}
    )  # fmt: skip
    engine = make_engine()
    begun_s = time.perf_counter()
    try:
        answer = run_with(store, SystemClock(), request, lambda: engine)
    finally:
        engine.close()
    took_s = time.perf_counter() - begun_s
    assert (answer.state, answer.failed) == ("done", 0), answer
    assert answer.processor_s_per_unit is not None
    return {
        f"{name}_processor_s_per_unit": answer.processor_s_per_unit, f"{name}_ms_per_unit": 1000 * took_s / answer.units
    }  # fmt: skip


def _compare(store: Store) -> None:
    """Stop where an engine gave other coefficients than the other."""
    for number in range(SMALL):
        by_cluster, by_process = store.calibrations.of_unit(f"U{number:05d}")
        assert by_cluster.answer["axes"] == by_process.answer["axes"]


@contextlib.contextmanager
def _cluster() -> Iterator[None]:
    """Start a scheduler and workers over TCP."""
    host, port = ADDRESS.split(":")
    words = [["scheduler", "--host", host, "--port", port, "--no-dashboard"]]
    words += [["worker", f"tcp://{ADDRESS}", "--nthreads", "1", "--no-nanny", "--no-dashboard"]] * WORKERS
    started = [subprocess.Popen([sys.executable, "-m", "dask", *each], stderr=subprocess.DEVNULL) for each in words]
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()
