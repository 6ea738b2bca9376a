"""The bench of a diagnosis: that of the unit's last campaign, or the one that is named, and the day of a round."""

from __future__ import annotations

from datetime import datetime, time, timedelta

from instruments.bench_config import BenchFile
from labctl.errors import BadInput, Conflict
from labctl.natural_order import natural_key
from labctl.services.benches.driving_process import whereabouts
from labctl.services.campaigns.resume import with_original_simulation
from labctl.store import CampaignRow, Store

#: Time of the day, UTC, at which a round begins on a simulated bench: each on a day of its own, with its own noise.
SIMULATED_DAY = time(8, 0)


def bench_of_unit(store: Store, serial: str, named: BenchFile | None) -> BenchFile:
    """Return the bench on which a unit is diagnosed: the one that is named, else that of its last campaign.

    Simulated units are those of that campaign, with the effects that were hidden in them. Raises BadInput where the
    unit was not measured on a bench and none is named, Conflict where the named bench does not carry the unit.
    """
    last = store.campaigns.newest_of_unit(serial)
    bench = _same_simulation(last, named) if named is not None else _bench_of(last, serial)
    serials = sorted((gyro.serial for gyro in bench.gyros if gyro.serial is not None), key=natural_key)
    if serials and serial not in serials:
        advice = "name the bench that carries the unit with --bench FILE"
        if store.is_shared and last is not None and last.bench_name != bench.name:
            advice = whereabouts(store, last.bench_name)
        raise Conflict(f"bench {bench.name} carries the units {', '.join(serials)}, not {serial}; {advice}")
    return bench


def _bench_of(last: CampaignRow | None, serial: str) -> BenchFile:
    if last is None:
        raise BadInput(
            f"unit {serial} was not measured on a bench of this database (its recordings were imported), so it is not "
            "known where experiments are to run; give --bench FILE"
        )
    return BenchFile.model_validate(dict(last.bench))


def _same_simulation(last: CampaignRow | None, bench: BenchFile) -> BenchFile:
    """Return a simulated bench with the units of the last campaign on it; any other bench unchanged."""
    return bench if last is None or last.bench_name != bench.name else with_original_simulation(last, bench)


def simulated_day(store: Store, bench: BenchFile) -> datetime | None:
    """Return when a campaign begins on a simulated bench: on the day after the last one. None for a real bench, and
    where there was none.
    """
    last = store.campaigns.last_on_bench(bench.name) if bench.is_simulated else None
    return None if last is None else datetime.combine(last.date() + timedelta(days=1), SIMULATED_DAY, last.tzinfo)
