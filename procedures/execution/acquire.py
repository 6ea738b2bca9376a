"""One data set: spin up, settle, read every unit inside the gate, let the table come to rest."""

from __future__ import annotations

import numpy as np

from instruments.clock import latency_s
from instruments.errors import LinkError
from instruments.interfaces.table import Spin
from instruments.positions import Position
from procedures.contracts.errors import BadData, GuardTripped, NotFollowing, StepFailed
from procedures.contracts.journal import DataSetHeader, DataSetState
from procedures.contracts.steps import Acquire
from procedures.execution import late_readings
from procedures.execution.context import ExecutionContext, raise_violation
from procedures.execution.course import take_course
from procedures.execution.record_readings import (
    count_missing,
    count_silence,
    demand_readings,
    learn_periods,
    read_late,
    read_round,
)
from procedures.execution.table_checks import follow_clock
from procedures.execution.unit_faults import is_by_stalls, unit_at_fault
from procedures.execution.waiting import checkpoint, pass_time
from procedures.monitoring.bench_snapshot import ReadingCounts
from procedures.monitoring.event_recorder import warning
from procedures.monitoring.host_stalls import not_run
from procedures.monitoring.table_reference import EncoderLog, rate_event
from procedures.monitoring.table_watch import TableWatch

LEAD_S = 0.5  #: streams are cleared this long before the gate opens
BLOCK_S = 1.0  #: readings are written down this often
#: So often is a data set taken again because this computer did not run labctl, beside the attempts of the recipe.
STALLED_ATTEMPTS = 5
#: With several units each is read in turn while the others' ports buffer; half a second of the fastest stream fits.
SHARED_BLOCK_S = 0.5


def acquire(context: ExecutionContext, step: Acquire) -> dict[str, float]:
    """Take one data set, again where a unit's readings failed and the recipe allows another attempt.

    Raises StepFailed, InstrumentError, Aborted.
    """
    attempt = stalled = 0
    while True:
        attempt += 1
        stalled_s, began_s = context.monitor.stalls.total_s(), context.clock.now_s()
        try:
            learn_periods(context)
            return _take(context, step) if step.course is None else take_course(context, step)
        except (LinkError, BadData, GuardTripped) as error:
            unit = unit_at_fault(context, error)
            if unit is None:
                raise
            why = str(error)
            stalled_s = context.monitor.stalls.total_s() - stalled_s
            if is_by_stalls(context, unit, error, began_s):
                why = f"{not_run(stalled_s)} while it was taken, and readings of {unit} are missing"
                stalled += 1
                attempt -= stalled <= STALLED_ATTEMPTS  # no fault of the unit
            if attempt >= context.recipe.on_failure.acquire_attempts:
                if isinstance(error, NotFollowing):
                    _withdraw_unconfirmed(context, unit, why)
                if not context.can_drop(unit):
                    raise
                context.drop(unit, str(error))
                attempt = 0  # the others had no fault of their own yet
            context.recorder.event(warning("data_set_repeated", f"data set {step.dataset} is taken again: {why}"))
            tracker = context.recorder.tracker
            tracker.update(repeated=tracker.progress.repeated + 1)
            context.bench.table.stop()
            reopen(context)


def _withdraw_unconfirmed(context: ExecutionContext, unit: str, why: str) -> None:
    """Withdraw what a unit sent in this mounting before: nothing shows that it followed the table then."""
    for number in context.response.unconfirmed(unit):
        context.recorder.journal.dataset_withdrawn(number, unit, why)
        text = f"data set {number} of {unit} does not count: {why}"
        context.recorder.event(warning("data_set_withdrawn", text, unit))


def reopen(context: ExecutionContext) -> None:
    """Open every unit's stream anew; a unit that cannot be reached drops out where others go on."""
    for name, gyro in list(context.bench.gyros.items()):
        try:
            gyro.stop()
            gyro.start()
        except LinkError as error:
            if not context.can_drop(name):
                raise
            context.drop(name, str(error))


def _take(context: ExecutionContext, step: Acquire) -> dict[str, float]:
    ramp_s = abs(step.rate_dps) / context.bench.table.limits.max_acceleration_dps2
    if context.monitor.is_due(within_s=ramp_s):
        context.poll()
    follow_clock(context)
    spin = context.bench.table.spin(step.rate_dps, _steady_s(context, step))
    watch = TableWatch(context.bench.table, context.clock, spin)
    encoder = EncoderLog(context.bench.table, context.clock)
    gate = _gate(spin, step)
    counts = {
        name: ReadingCounts(gyro.sample_rate_hz * (gate[1] - gate[0])) for name, gyro in context.bench.gyros.items()
    }
    context.response.begin((step.mounting, step.run))
    with context.monitor.taking_readings(spin, counts):
        context.poll(units_until_s=gate[0] - LEAD_S)  # a chamber that is late to answer costs no reading of the gate
        _wait_for_gate(context, watch, gate[0])
        number = context.recorder.journal.dataset_opened(_header(context, step, spin, gate))
        try:
            _read_gate(context, watch, encoder, number, gate, counts)
            context.poll(read_latest=False)  # a chamber that others changed in the gate ends the data set
            read_late(context, number, gate, counts, late_readings.STEADY_S)
            context.bench.table.settle(spin)  # a run that does not end as computed was not the run it was taken for
            read_late(context, number, gate, counts, late_readings.WAIT_S)
            demand_readings(counts)
            count_missing(context, number, gate, counts)
            _demand_answer(context, step, spin)
            rates = _note_angles(context, encoder, spin, gate, number)
        except BaseException as error:
            reason = str(error) or type(error).__name__
            count_silence(context, number, gate, counts, error)
            context.recorder.journal.dataset_closed(number, DataSetState.PARTIAL, reason)
            raise
    context.recorder.journal.dataset_closed(number, DataSetState.COMPLETE)
    context.unchecked.append(number)
    context.response.keep(counts, number)
    reading_counts = {f"readings.{name}": float(count.valid + count.invalid) for name, count in counts.items()}
    return {"rate_dps": spin.rate_dps, "gate_s": gate[1] - gate[0], **rates, **reading_counts}


def _demand_answer(context: ExecutionContext, step: Acquire, spin: Spin) -> None:
    """Raise NotFollowing for a unit whose output does not follow the rate of the table."""
    position = Position.of(step.position)
    for name, gyro in context.bench.gyros.items():
        if complaint := context.response.complaint(name, spin.rate_dps, position, gyro.limits.max_rate_dps):
            raise NotFollowing(name, complaint)


def _note_angles(
    context: ExecutionContext, encoder: EncoderLog, spin: Spin, gate: tuple[float, float], number: int
) -> dict[str, float]:
    """Record what the table's encoder said, and warn once where the table does not turn as commanded."""
    angles = encoder.result(spin, gate[0], context.recorder.time)
    if angles is None:
        return {}
    context.recorder.journal.table_angles(number, angles)
    event = rate_event(context.bench.table, angles)
    if event is not None and not context.warned_of_rate:
        context.warned_of_rate = True
        context.recorder.event(event)
    return {"encoder_dps": angles.rate_dps, "encoder_u_dps": angles.rate_u_dps}


def _steady_s(context: ExecutionContext, step: Acquire) -> float:
    """Return how long the table has to be steady: settling, the gate rounded up to step edges, and the last block."""
    step_deg = context.bench.table.limits.step_deg
    edges_s = 2 * step_deg / abs(step.rate_dps) if step.rate_dps else 0.0
    last_block_s = LEAD_S + sum(3 / gyro.sample_rate_hz for gyro in context.bench.gyros.values())
    return step.settle_s + step.duration_s + edges_s + last_block_s


def _gate(spin: Spin, step: Acquire) -> tuple[float, float]:
    """Return when readings count, clock time, on step edges. Raises StepFailed when the steady part is too short."""
    from_s, until_s = spin.gate(spin.steady_from_s + step.settle_s, step.duration_s)
    if until_s - from_s < step.duration_s - 1e-6:
        raise StepFailed(
            f"the table is steady at {spin.rate_dps:g} deg/s for only {until_s - from_s:.3f} s after settling, "
            f"not for the {step.duration_s:g} s of the data set; check the rate of the table, or shorten "
            "duration_s in the recipe"
        )
    return from_s, until_s


def _wait_for_gate(context: ExecutionContext, watch: TableWatch, from_s: float) -> None:
    """Wait until the table settles, then drop what the streams have buffered, unless the gate is open already."""
    clear_s = from_s - LEAD_S - latency_s(context.clock)
    while watch.next_s < clear_s:
        pass_time(context, watch.next_s - context.clock.now_s(), pausing=False)
        watch.ask()
    pass_time(context, clear_s - context.clock.now_s(), pausing=False)
    if context.clock.now_s() >= from_s:
        return
    for name, gyro in context.bench.gyros.items():
        context.monitor.add_readings(name, gyro, gyro.read_latest())


def _header(context: ExecutionContext, step: Acquire, spin: Spin, gate: tuple[float, float]) -> DataSetHeader:
    return DataSetHeader(
        step=step,
        rate_dps=spin.rate_dps,
        asked_dps=spin.asked_dps,
        gate_from_s=context.recorder.time.of(gate[0]),
        gate_until_s=context.recorder.time.of(gate[1]),
        angle_from_deg=float(spin.angle_deg(np.array([gate[0]]))[0]),
        setpoint_c=context.monitor.setpoint_c,
        run=step.run + context.added_runs,
        gyros=tuple(context.bench.gyros),
    )


def _read_gate(
    context: ExecutionContext,
    watch: TableWatch,
    encoder: EncoderLog,
    number: int,
    gate: tuple[float, float],
    counts: dict[str, ReadingCounts],
) -> None:
    gyros = context.bench.gyros
    block_s = BLOCK_S if len(gyros) == 1 else SHARED_BLOCK_S
    while (left_s := gate[1] - context.clock.now_s()) > 0:
        watch.ask()
        encoder.read()
        read_round(context, number, gate, counts, min(block_s, left_s) / len(gyros))
        if context.monitor.is_due(within_s=block_s):
            context.poll(read_latest=False)
        else:
            raise_violation(context.monitor.check_guards())
        checkpoint(context)
    if len(gyros) > 1:  # the unit read first in the last round still has the end of the gate in its buffer
        read_round(context, number, gate, counts, 0.0)
        raise_violation(context.monitor.check_guards())
    encoder.read(now=True)
