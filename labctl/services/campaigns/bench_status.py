"""The status of benches: what their last safe state could not confirm, and campaigns left on them."""

from __future__ import annotations

from dataclasses import asdict

from labctl.services.campaigns.status import abandoned_campaigns, describe_interrupted, outlives_its_process
from labctl.services.schemas.benches import BenchStatus
from labctl.store import BenchRow, Store


def bench_status(row: BenchRow) -> BenchStatus:
    """Return a bench as the services report it."""
    return BenchStatus(**asdict(row))


def bench_statuses(store: Store) -> list[BenchStatus]:
    """Return every bench that was used, with the campaigns that were left on it by a process that is gone.

    Those of simulated benches are left out: such a bench ended with its process.
    """
    left: dict[str, list[str]] = {}
    for answer in abandoned_campaigns(store):
        if outlives_its_process(store.campaigns.get(answer.id)):
            left.setdefault(answer.bench, []).append(describe_interrupted(answer))
    return [bench_status(row).model_copy(update={"left": left.get(row.name, [])}) for row in store.benches.all()]
