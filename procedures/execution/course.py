"""One data set of a course: the table's rate changes while every unit is read, and its encoder says how."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from instruments.errors import InstrumentError
from instruments.interfaces.table import CourseRun, CourseTable
from procedures.contracts.errors import StepFailed
from procedures.contracts.journal import DataSetHeader, DataSetState, TableAngles
from procedures.contracts.steps import Acquire
from procedures.execution import late_readings
from procedures.execution.context import ExecutionContext, raise_violation
from procedures.execution.record_readings import count_missing, count_silence, demand_readings, read_late, read_round
from procedures.execution.waiting import checkpoint
from procedures.monitoring.bench_snapshot import ReadingCounts
from procedures.monitoring.course_reference import CourseLog, course_event

#: From angle to angle, s; the units are read in between.
READ_EVERY_S = 0.1
#: Readings count from this long after a course began, s: until then the streams are cleared of what came before.
LEAD_S = 0.5


def take_course(context: ExecutionContext, step: Acquire) -> dict[str, float]:
    """Take one data set of a course; the table is at rest before and after.

    Raises StepFailed, InstrumentError, GuardTripped, Aborted.
    """
    table = context.bench.table
    if step.course is None or not isinstance(table, CourseTable):
        raise StepFailed(f"{table.name}: runs constant rates only; remove [[profiles]] from the recipe")
    if context.monitor.is_due(within_s=step.settle_s):
        context.poll()
    log = CourseLog(table, table.name, context.clock)
    run = table.begin_course(step.course)
    try:
        for name, gyro in context.bench.gyros.items():  # what the streams have buffered before
            context.monitor.add_readings(name, gyro, gyro.read_latest())
        return _follow(context, step, table, run, log)
    except InstrumentError:
        table.stop()
        raise


def _follow(
    context: ExecutionContext, step: Acquire, table: CourseTable, run: CourseRun, log: CourseLog
) -> dict[str, float]:
    gate = run.began_s + LEAD_S, run.ends_s
    counts = {
        name: ReadingCounts(gyro.sample_rate_hz * (gate[1] - gate[0])) for name, gyro in context.bench.gyros.items()
    }
    with context.monitor.taking_readings(counts=counts):
        number = context.recorder.journal.dataset_opened(_header(context, step, run, gate))
        try:
            run = _read(context, table, run, log, number, gate, counts)
            table.end_course(run)
            context.poll(read_latest=False)  # a chamber that others changed in the gate ends the data set
            read_late(context, number, gate, counts, late_readings.WAIT_S)
            demand_readings(counts)
            count_missing(context, number, gate, counts)
            angles = _note_course(context, run, log, number)
        except BaseException as error:
            reason = str(error) or type(error).__name__
            count_silence(context, number, gate, counts, error)
            context.recorder.journal.dataset_closed(number, DataSetState.PARTIAL, reason)
            raise
    context.recorder.journal.dataset_closed(number, DataSetState.COMPLETE)
    reading_counts = {f"readings.{name}": float(count.valid + count.invalid) for name, count in counts.items()}
    figures = {"encoder_dps": angles.rate_dps, "encoder_u_dps": angles.rate_u_dps, "angles": float(len(angles.t_s))}
    return {"gate_s": gate[1] - gate[0], **figures, **reading_counts}


def _read(
    context: ExecutionContext,
    table: CourseTable,
    run: CourseRun,
    log: CourseLog,
    number: int,
    gate: tuple[float, float],
    counts: dict[str, ReadingCounts],
) -> CourseRun:
    """Read table and units in turn until the course is over; returns it as it was commanded."""
    gyros = context.bench.gyros
    while (left_s := gate[1] - context.clock.now_s()) > 0:
        run = table.continue_course(run)
        log.read(run)
        read_round(context, number, gate, counts, min(READ_EVERY_S, left_s) / len(gyros))
        if context.monitor.is_due():
            context.poll(read_latest=False)
        else:
            raise_violation(context.monitor.check_guards())
        checkpoint(context)
    log.read(run)
    return run


def _note_course(context: ExecutionContext, run: CourseRun, log: CourseLog, number: int) -> TableAngles:
    """Record the course as the encoder measured it, and say where it is not as commanded."""
    table = context.bench.table
    is_reference = table.limits.reference == "measured"
    angles = log.result(run, context.recorder.time, is_reference=is_reference)
    context.recorder.journal.table_angles(number, angles)
    assert angles.course is not None
    event = course_event(table, angles, angles.course, run.course.duration_s)
    if event is not None:
        context.recorder.event(replace(event, message=f"data set {number}: {event.message}"))
    return angles


def _header(context: ExecutionContext, step: Acquire, run: CourseRun, gate: tuple[float, float]) -> DataSetHeader:
    turned_deg = float(run.course.angle_deg(np.array([run.course.duration_s]))[0])
    mean_dps = turned_deg / run.course.duration_s
    return DataSetHeader(
        step=step,
        rate_dps=mean_dps,
        asked_dps=mean_dps,
        gate_from_s=context.recorder.time.of(gate[0]),
        gate_until_s=context.recorder.time.of(gate[1]),
        angle_from_deg=None,
        setpoint_c=context.monitor.setpoint_c,
        run=step.run + context.added_runs,
        gyros=tuple(context.bench.gyros),
    )
