"""The status of benches: what their last safe state could not confirm, and campaigns left on them."""

from __future__ import annotations

from dataclasses import asdict
from datetime import datetime

from labctl.answers.benches import BenchStatus, ClearRequest
from labctl.errors import Conflict
from labctl.services.benches.driving_process import bench_drivers
from labctl.services.benches.stops import BenchStops
from labctl.services.campaigns.status import abandoned_campaigns, describe_interrupted, outlives_its_process
from labctl.store import BenchRow, Store


def bench_status(store: Store, row: BenchRow) -> BenchStatus:
    """Return a bench as the services report it."""
    return BenchStatus(**asdict(row), stop=BenchStops(store, row.name).describe())


def clear_bench(store: Store, name: str, request: ClearRequest, at: datetime) -> BenchStatus:
    """Record that a person has inspected a bench, and lets it move again after a stop.

    Raises NotFound, and Conflict when there is nothing to clear, or while a stop is not carried out.
    """
    stops, row = BenchStops(store, name), store.benches.get(name)
    if row is not None and stops.state.open:
        raise Conflict(
            f"bench {name}: the stop ({stops.state.open[-1].reason}) is not carried out yet; start the service of the "
            "bench, which makes the bench safe first, then clear the bench"
        )
    stopped = row is not None and stops.take_back(request.by)
    if row is not None and stopped and not row.unconfirmed:
        detail = {"reason": request.reason, "was": "stopped"}
        store.audit.record(at, "bench clear", f"bench {name}", detail, who=request.by)
        return bench_status(store, row)
    return bench_status(store, store.benches.clear(name, request.by, request.reason, at))


def bench_statuses(store: Store) -> list[BenchStatus]:
    """Return every bench that was used or that a process has reserved, by name.

    Each has the campaigns that were left on it by a process that is gone. Those of simulated benches are left out: such
    a bench ended with its process.
    """
    campaigns_left: dict[str, list[str]] = {}
    for answer in abandoned_campaigns(store):
        if outlives_its_process(store.campaigns.get(answer.id)):
            campaigns_left.setdefault(answer.bench, []).append(describe_interrupted(answer))
    drivers = bench_drivers(store)
    known = {row.name: bench_status(store, row) for row in store.benches.all()}
    return [
        (known.get(name) or _of_unused(store, name)).model_copy(
            update={"left": campaigns_left.get(name, []), "driver": drivers.get(name)}
        )
        for name in sorted(known.keys() | drivers.keys())
    ]


def _of_unused(store: Store, name: str) -> BenchStatus:
    """Return a bench that no campaign was ever begun on."""
    return BenchStatus(name=name, last_used_at=None, stop=BenchStops(store, name).describe())
