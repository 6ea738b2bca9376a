"""The tri-axial campaign at 125 readings per second: bytes, drivers, parsers, database, and the fit of its data."""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

from benchmarks.machine import describe
from labctl.answers.campaigns import StartRequest
from labctl.fitting import fit
from labctl.services.campaigns.execution import run_here
from labctl.store import open_store

#: Limits that the project has set itself.
LIMITS = {"campaign_s": 90.0, "memory_gib": 1.0, "bytes_per_reading": 9.0, "database_to_yang2018_s": 5.0}


def run() -> dict[str, float | str]:
    """Run one campaign and one fit; returns seconds, memory and size."""
    with tempfile.TemporaryDirectory() as folder:
        location = Path(folder) / "lab.sqlite"
        start = time.perf_counter()
        answer = run_here(str(location), StartRequest(recipe="table1-x-table2"))
        elapsed = time.perf_counter() - start
        size = sum(path.stat().st_size for path in location.parent.glob("lab.sqlite*"))
        start = time.perf_counter()
        with open_store(str(location), write=False) as store:
            recording = next(iter(answer.recordings.values()))
            readings = store.recordings.get(recording).readings
            fit(store.recordings.points(recording), "yang2018")
        fitted = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return {
        **describe("numpy", "sqlalchemy", "pymodbus", "pyserial", "blosc2"),
        "state": answer.state,
        "readings": float(readings),
        "campaign_s": elapsed,
        "memory_gib": peak,
        "bytes_per_reading": size / readings,
        "database_to_yang2018_s": fitted,
    }
