"""Which unit's readings failed in a data set, and whether stalls of this computer explain it."""

from __future__ import annotations

from collections.abc import Sequence

from instruments.errors import LinkError, NoReply
from instruments.interfaces.gyro import Gyro
from procedures.contracts.errors import BadData, GuardTripped, NoReadings
from procedures.execution.context import UNIT_FAULTS, ExecutionContext
from procedures.monitoring.bench_snapshot import Gap, ReadingCounts
from procedures.monitoring.guards import is_too_many
from procedures.monitoring.host_stalls import Stall


def unit_at_fault(context: ExecutionContext, error: LinkError | BadData | GuardTripped) -> str | None:
    """Return the unit whose readings failed; None when it is something else, or a limit that suspends."""
    if isinstance(error, GuardTripped) and (error.kind not in UNIT_FAULTS or error.action != "fail"):
        return None
    unit = error.gyro if isinstance(error, BadData) else error.device
    return unit if unit in context.bench.gyros else None


def is_by_stalls(
    context: ExecutionContext, unit: str, error: LinkError | BadData | GuardTripped, began_s: float
) -> bool:
    """Return whether stalls since `began_s`, clock time, explain why the readings of a unit failed in a data set.

    They do where they are the greater part of a unit's silence. They explain readings that are missing where and when
    the process was not run, as many as the unit sends in that time; what is missing elsewhere, or beyond, is held to
    the limit of the recipe. A broken link, an output that does not follow the table and readings that are marked bad
    are not explained by stalls.
    """
    stalls = context.monitor.stalls.since(began_s)
    if not stalls:
        return False
    if isinstance(error, NoReply):
        return context.monitor.links.is_silent_by_stalls(unit, context.recorder.t_s())
    if isinstance(error, NoReadings) or (isinstance(error, GuardTripped) and error.kind == "damaged_readings"):
        limit = context.recipe.guards.max_damaged_fraction
        return _explain(context.bench.gyros[unit], context.monitor.ended_counts.get(unit), stalls, limit)
    return False


def _explain(gyro: Gyro, count: ReadingCounts | None, stalls: Sequence[Stall], limit: float) -> bool:
    """Return whether no more readings than the limit are missing beside those that stalls explain."""
    if count is None:
        return False
    if not count.valid + count.invalid:
        missing = count.base - gyro.sample_rate_hz * sum(stall.length_s for stall in stalls)
        return not is_too_many(missing, count.base, limit)
    return not is_too_many(count.damaged - explained(count.gaps, stalls, gyro.sample_rate_hz), count.base, limit)


def explained(gaps: Sequence[Gap], stalls: Sequence[Stall], rate_hz: float) -> float:
    """Return how many of the readings that are missing in gaps stalls explain; each stall explains its length once."""
    left_s = [stall.length_s for stall in stalls]
    total = 0.0
    for gap in sorted(gaps, key=lambda each: each.until_s - each.from_s):  # the narrow ones have the least choice
        open_s = gap.readings / rate_hz
        for k, stall in enumerate(stalls):
            used_s = min(left_s[k], stall.overlap_s(gap.from_s, gap.until_s), open_s)
            left_s[k] -= used_s
            open_s -= used_s
        total += gap.readings - open_s * rate_hz
    return total
