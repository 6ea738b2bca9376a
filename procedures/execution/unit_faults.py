"""Which unit's readings failed in a data set, and whether stalls of this computer explain it."""

from __future__ import annotations

from instruments.errors import LinkError, NoReply
from instruments.interfaces.gyro import Gyro
from procedures.contracts.errors import BadData, GuardTripped, NoReadings
from procedures.execution.context import UNIT_FAULTS, ExecutionContext
from procedures.monitoring.bench_snapshot import ReadingCounts
from procedures.monitoring.guards import is_too_many


def unit_at_fault(context: ExecutionContext, error: LinkError | BadData | GuardTripped) -> str | None:
    """Return the unit whose readings failed; None when it is something else, or a limit that suspends."""
    if isinstance(error, GuardTripped) and (error.kind not in UNIT_FAULTS or error.action != "fail"):
        return None
    unit = error.gyro if isinstance(error, BadData) else error.device
    return unit if unit in context.bench.gyros else None


def is_by_stalls(
    context: ExecutionContext, unit: str, error: LinkError | BadData | GuardTripped, stalled_s: float
) -> bool:
    """Return whether stalls of `stalled_s` s of real time explain why the readings of a unit failed in a data set.

    They do where they are the greater part of a unit's silence, and where no more readings are missing than the unit
    sends in that time and the recipe allows. A broken link, an output that does not follow the table and readings that
    are marked bad are not explained by stalls.
    """
    if stalled_s <= 0:
        return False
    if isinstance(error, NoReply):
        return context.monitor.links.is_silent_by_stalls(unit, context.recorder.t_s())
    if isinstance(error, NoReadings) or (isinstance(error, GuardTripped) and error.kind == "damaged_readings"):
        stalled_clock_s = stalled_s * context.monitor.stalls.speed
        limit = context.recipe.guards.max_damaged_fraction
        return _explain(context.bench.gyros[unit], context.monitor.ended_counts.get(unit), stalled_clock_s, limit)
    return False


def _explain(gyro: Gyro, count: ReadingCounts | None, stalled_s: float, limit: float) -> bool:
    """Return whether no more readings than the limit are missing beside those of `stalled_s` s."""
    if count is None:
        return False
    missing = count.damaged if count.valid + count.invalid else count.base
    return not is_too_many(missing - stalled_s * gyro.sample_rate_hz, count.base, limit)
