"""The readings of a data set, just before its gate, during it and just after: cut to the gate, written, counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from instruments.errors import LinkError
from instruments.interfaces.gyro import Gyro, Readings
from instruments.interfaces.self_checks import KeepingBack, StreamingGyro
from procedures.contracts.errors import NoReadings
from procedures.execution import late_readings
from procedures.execution.context import ExecutionContext, raise_violation
from procedures.execution.waiting import checkpoint
from procedures.monitoring.bench_snapshot import ReadingCounts
from procedures.monitoring.campaign_time import CampaignTime
from procedures.monitoring.event_recorder import warning

#: Before a data set a stream of unknown period is read for at most so long, s of the clock, in slices of so long: that
#: is enough behind an adapter that holds bytes back for 16 ms.
LEARN_S, SLICE_S = 4.0, 0.25
#: One whose arrivals suggest another period than that of the bench file is read further, for at most so long, s, until
#: they exclude it or agree: the times of the first data set would bend.
DOUBT_S = 20.0


def learn_periods(context: ExecutionContext) -> None:
    """Read the units whose periods are not known until they are: the times of the first readings need them.

    Raises InstrumentError, Aborted.
    """
    new = [gyro.name for gyro in context.bench.gyros.values() if _is_period_unknown(gyro)]
    _read_while(context, _is_period_unknown, LEARN_S, SLICE_S)
    # once after each start, and as often as possible: then arrivals say most
    _read_while(context, lambda gyro: gyro.name in new and _is_period_unconfirmed(gyro), DOUBT_S, 0.0)


def _read_while(context: ExecutionContext, is_open: Callable[[Gyro], bool], limit_s: float, slice_s: float) -> None:
    """Read the units for which something is open in turn, for `slice_s` in all, for at most `limit_s` of the clock."""
    until_s = context.clock.now_s() + limit_s
    while context.clock.now_s() < until_s:
        open_ones = {name: gyro for name, gyro in context.bench.gyros.items() if is_open(gyro)}
        if not open_ones:
            return
        for name, gyro in open_ones.items():
            readings = gyro.read(max(slice_s / len(open_ones), 1.5 / gyro.sample_rate_hz))
            if len(readings):
                context.monitor.add_readings(name, gyro, readings)
        checkpoint(context)


def _is_period_unknown(gyro: Gyro) -> bool:
    return isinstance(gyro, StreamingGyro) and gyro.period.measured_s is None


def _is_period_unconfirmed(gyro: Gyro) -> bool:
    return isinstance(gyro, StreamingGyro) and gyro.period.is_unconfirmed


def read_late(
    context: ExecutionContext, number: int, gate: tuple[float, float], counts: dict[str, ReadingCounts], wait_s: float
) -> None:
    """Wait for readings of the gate that are still on their way, until `wait_s` after its end; read once at least."""
    gyros, every_s = context.bench.gyros, late_readings.EVERY_S / len(context.bench.gyros)
    while any(
        late_readings.is_late(gyro)
        or late_readings.pending(gyro, gate, counts[name])
        or missing_of(gyro, gate, counts[name])
        for name, gyro in gyros.items()
    ):
        read_round(context, number, gate, counts, every_s)
        checkpoint(context)
        if context.clock.now_s() >= gate[1] + wait_s:
            return


def missing_of(gyro: Gyro, gate: tuple[float, float], count: ReadingCounts) -> int:
    """Return how many readings of the gate neither came nor were counted as lost."""
    return late_readings.promise_of(gyro, gate[1] - gate[0]).missing(count.valid + count.invalid + count.damaged)


def count_missing(
    context: ExecutionContext, number: int, gate: tuple[float, float], counts: dict[str, ReadingCounts]
) -> None:
    """Count what never came as lost, and say it; too much of it raises GuardTripped."""
    for name, gyro in context.bench.gyros.items():
        at_edges = late_readings.dropped(gyro, gate, counts[name]) + late_readings.pending(gyro, gate, counts[name])
        if missing := max(missing_of(gyro, gate, counts[name]), at_edges):
            _write_lost(context, number, name, gate, counts[name], missing)
    raise_violation(context.monitor.check_guards())


def count_silence(
    context: ExecutionContext, number: int, gate: tuple[float, float], counts: dict[str, ReadingCounts],
    error: BaseException,
) -> None:  # fmt: skip
    """Write down what the driver kept back, and count what a unit promised until now as lost, where its link failed.

    The data set ends without it. Nothing will decide any more whether readings before those that were kept are lost:
    they count as having arrived.
    """
    if not isinstance(error, LinkError) or (gyro := context.bench.gyros.get(error.device)) is None:
        return
    if isinstance(gyro, KeepingBack) and (kept := gyro.kept_back()) is not None:
        _keep(context, number, error.device, kept, gate, counts[error.device])
    passed = gate[0], min(max(context.clock.now_s(), gate[0]), gate[1])
    if missing := missing_of(gyro, passed, counts[error.device]):
        _write_lost(context, number, error.device, passed, counts[error.device], missing)


def _write_lost(
    context: ExecutionContext, number: int, name: str, gate: tuple[float, float], count: ReadingCounts, missing: int
) -> None:
    """Write down, count and say that `missing` readings of a gate, or of its beginning, did not arrive."""
    gyro = context.bench.gyros[name]
    lost = late_readings.lost_readings(gyro, missing)
    count.gaps += late_readings.gaps_at_edges(gyro, gate, count, missing)
    count.add(lost)
    context.recorder.journal.readings(number, name, lost, context.monitor.air_c)
    expected = round(late_readings.promise_of(gyro, gate[1] - gate[0]).readings)
    text = f"{name}: {missing} of {expected} readings of a data set did not arrive; they are counted as lost"
    context.recorder.event(warning("readings_lost", text, name))


def read_round(
    context: ExecutionContext, number: int, gate: tuple[float, float], counts: dict[str, ReadingCounts], slice_s: float
) -> None:
    """Read every unit once and write down what falls into the gate."""
    for name, gyro in context.bench.gyros.items():
        readings = gyro.read(max(slice_s, 1.5 / gyro.sample_rate_hz))
        if len(readings):
            context.monitor.add_readings(name, gyro, readings)
        _keep(context, number, name, readings, gate, counts[name])


def _keep(
    context: ExecutionContext, number: int, name: str, readings: Readings, gate: tuple[float, float],
    count: ReadingCounts,
) -> None:  # fmt: skip
    """Write down and count what of some readings falls into the gate."""
    gyro, kept = context.bench.gyros[name], cut(readings, gate, context.recorder.time)
    if len(readings):
        if count.newest_s < gate[0] or readings.t_s[-1] >= gate[1]:  # some may be lost outside the gate
            room = late_readings.room(gyro, readings, gate, count)
            kept = replace(kept, lost=min(kept.lost, max(room - len(kept), 0)))
        if missing := kept.lost + kept.damaged:
            count.locate(readings.t_s, gate[0], missing, 1.0 / gyro.sample_rate_hz)
        count.note(readings.t_s, gate[0])
    if len(kept) or kept.lost or kept.damaged:
        count.add(kept)
        context.response.add(name, kept)
        beside = context.monitor.references.beside(kept)
        context.recorder.journal.readings(number, name, beside, context.monitor.chamber_c)


def cut(readings: Readings, gate: tuple[float, float], time: CampaignTime) -> Readings:
    """Return the readings inside the gate [from, until) with their times in campaign time; both in clock seconds."""
    t_s = readings.t_s
    if len(t_s) and gate[0] <= t_s[0] and t_s[-1] < gate[1]:
        return time.of_readings(readings)
    return time.of_readings(readings.only((t_s >= gate[0]) & (t_s < gate[1])))


def demand_readings(counts: dict[str, ReadingCounts]) -> None:
    for name, count in counts.items():
        if count.valid + count.invalid == 0:
            raise NoReadings(
                name, f"none of about {count.expected:.0f} expected readings arrived; check cable, power and baud rate"
            )
