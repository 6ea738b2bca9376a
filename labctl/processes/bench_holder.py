"""The bench process that outlived its service, as a new one finds it."""

from __future__ import annotations

from instruments.clock import WallClock
from labctl.processes.settings import ServeRequest
from labctl.services.benches.lease import driver_of, this_machine
from labctl.services.planning.loading import load_bench
from labctl.store import Holder, holder_of, is_url, open_store


def bench_process_of(request: ServeRequest) -> Holder | None:
    """Return who holds the database; of one that several processes hold: who drives the bench from this machine.

    Raises BadBench, StoreError.
    """
    if not is_url(request.location):
        return holder_of(request.location)
    if request.bench_name is None:
        return None
    with open_store(request.location, write=False) as store:
        driver = driver_of(store, load_bench(request.bench_name).name, WallClock().utc())
    if driver is None or driver.machine != this_machine():
        return None
    return Holder(driver.pid, driver.url, calls=driver.calls)
