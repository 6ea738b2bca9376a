"""GET of a calibration in force by serial number: 1,000,000 units on PostgreSQL, two read-only processes, open loop.

The load is that of `benchmarks.open_load`, in a process of its own. Generator, both processes of the service and the
server share the cores of this machine, so the processor time of each request in each of the three stands beside the
times.
Smaller by LABCTL_BENCH_UNITS and LABCTL_BENCH_SECONDS; a database that was filled before is taken from
LABCTL_BENCH_DATABASE.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from benchmarks import many_units
from benchmarks.machine import describe
from benchmarks.served import TICKS_PER_S, serve
from labctl.client import Client
from labctl.store import Store, open_store
from labctl.store.paging import PageRequest
from labctl.store.repositories.fleet_filter import FleetFilter
from labctl.store.repositories.units import UnitFilter
from studies import postgresql_cluster

UNITS = int(os.environ.get("LABCTL_BENCH_UNITS", "1000000"))
RATES, SECONDS, PROCESSES = (200, 500, 1000, 2000), float(os.environ.get("LABCTL_BENCH_SECONDS", "10")), 2
#: Searches for units: a part of a serial number that one has, a type, a batch, and what no unit has.
SEARCHES = ("G-0012345", "FOG-07", "B-123", "absent")


@contextmanager
def database() -> Iterator[str]:
    """Give the URL of a database of so many units."""
    if filled := os.environ.get("LABCTL_BENCH_DATABASE"):
        yield filled
        return
    programs = postgresql_cluster.programs()
    assert programs is not None, "no PostgreSQL server on this machine (on Debian: apt-get install postgresql)"
    with postgresql_cluster.running_cluster(programs) as cluster:
        url = cluster.new_database()
        many_units.fill(url, UNITS)
        yield url


def run() -> dict[str, float | str]:
    """Return percentiles of the times by rate, processor time per request, and the times of lists of many units."""
    figures: dict[str, float | str] = {"units": float(UNITS), "load_of_the_machine": os.getloadavg()[0]}
    with database() as url, serve(url, "--read-only", "--processes", str(PROCESSES)) as service:
        with Client(service.url) as client:  # a copied row is what labctl writes: its hashes fit
            serial = many_units.serial_of(UNITS // 3)
            assert client.calibration(serial).calibration.serial == serial
        _load(service.port, RATES[0])  # warms up
        for rate in RATES:
            before_s = _processor_s(service.web), _processor_s(_backends())
            found = _load(service.port, rate)
            spent_s = {
                "service": _processor_s(service.web) - before_s[0],
                "server": _processor_s(_backends()) - before_s[1],
                "generator": found.pop("processor_s"),
            }
            figures |= {f"at_{rate}_per_s_{name}": value for name, value in found.items()}
            figures |= {f"at_{rate}_per_s_{name}_ms": 1e3 * s / found["answered"] for name, s in spent_s.items()}
        with open_store(url, write=False, read_only=True) as store:
            figures |= _lists(store)
    return {**describe("fastapi", "uvicorn", "uvloop", "psycopg", "sqlalchemy"), **figures}


def _load(port: int, rate: float) -> dict[str, float]:
    words = [sys.executable, "-m", "benchmarks.open_load", *map(str, (port, rate, SECONDS, UNITS))]
    found: dict[str, float] = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    return found


def _backends() -> tuple[int, ...]:
    """Return the processes of PostgreSQL servers that answer labctl; each lasts as long as its connection."""
    found = []
    for each in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            if each.read_text().startswith(f"postgres: {postgresql_cluster.USER}"):
                found.append(int(each.parent.name))
    return tuple(found)


def _processor_s(processes: tuple[int, ...]) -> float:
    fields = [Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split() for pid in processes]
    return sum(int(each[11]) + int(each[12]) for each in fields) / TICKS_PER_S


def _lists(store: Store) -> dict[str, float]:
    """Return the times of the first page of searches for units, and of the figures of all types, ms and s."""
    times: dict[str, float] = {}
    for search in SEARCHES:
        start = time.perf_counter()
        store.units.page(PageRequest(search, 50), UnitFilter(many_units.AT))
        times[f"search_{search}_ms"] = 1e3 * (time.perf_counter() - start)
    start = time.perf_counter()
    types = store.fleet_reports.types(FleetFilter("", "", "", ""), many_units.AT)
    assert sum(each.units for each in types) == UNITS
    return {**times, "figures_of_types_s": time.perf_counter() - start}
