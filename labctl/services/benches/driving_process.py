"""Which process drives each bench of a database to which several services write, and which bench has lost its own.

A lease that its holder ended in order is gone; one whose holder was killed stays, and says since when it is silent.
"""

from __future__ import annotations

from instruments.clock import WallClock
from labctl.answers.benches import BenchDriver
from labctl.services.benches.lease import driver_of, is_over
from labctl.store import LeaseRow, Store


def driven_benches(store: Store) -> frozenset[str]:
    """Return the names of the benches that a process drives now, as their leases say."""
    now = WallClock().utc()
    return frozenset(lease.bench_name for lease in store.leases.all() if not is_over(lease, now))


def bench_drivers(store: Store) -> dict[str, BenchDriver]:
    """Return by bench the process that has its lease, also one that has gone without releasing it."""
    now = WallClock().utc()
    return {lease.bench_name: _driver(lease, alive=not is_over(lease, now)) for lease in store.leases.all()}


def whereabouts(store: Store, bench: str) -> str:
    """Return where an act on a bench that this process does not drive is to be sent, as the end of a refusal."""
    driver = driver_of(store, bench, WallClock().utc())
    if driver is None:
        return f"no service drives bench {bench} now; start one with `labctl serve --bench FILE`"
    if driver.url is None:
        return f"process {driver.pid} on {driver.host} drives bench {bench}; act at its terminal"
    return f"the service at {driver.url} drives bench {bench}; ask that service"


def _driver(lease: LeaseRow, *, alive: bool) -> BenchDriver:
    who = f"process {lease.pid} on {lease.host}" if lease.url is None else f"the service at {lease.url}"
    sign = f"{lease.beat_at:%Y-%m-%d %H:%M:%S} UTC"
    text = (
        f"{who} drives the bench"
        if alive
        else f"{who} drove the bench and is gone, last sign of life at {sign}; start its service again"
    )
    return BenchDriver(
        url=lease.url, host=lease.host, pid=lease.pid, since=lease.since, last_sign_at=lease.beat_at, alive=alive,
        text=text,
    )  # fmt: skip
