"""The readings of a turn by hand, in three data sets without a gap: written down as they come, judged at the end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

from instruments.interfaces.gyro import Readings
from procedures.contracts.journal import DataSetHeader, DataSetState
from procedures.contracts.steps import Turn
from procedures.execution.context import ExecutionContext
from procedures.execution.waiting import checkpoint
from procedures.monitoring.progress import TurnProgress
from procedures.monitoring.turn_check import UnitTurn
from procedures.monitoring.turn_course import Course, nominal_outputs

#: Readings are written down, and the angle so far is shown, this often, s.
BLOCK_S = 0.5
Part = Literal[-1, 0, 1]  #: the rest before, the turn, the rest after


class TurnReadings:
    """The data sets of one attempt, open until `close`. Several units are read in turn while their ports buffer."""

    def __init__(self, context: ExecutionContext, step: Turn) -> None:
        self._context, self._step = context, step
        self._outputs = {
            name: nominal_outputs(tuple(gyro.channels), gyro.identify().output)
            for name, gyro in context.bench.gyros.items()
        }
        self._numbers: dict[Part, int] = {}
        self._courses: dict[Part, dict[str, Course]] = {}

    def rest_before(self, duration_s: float) -> None:
        """Read the rest before the turn. Raises InstrumentError, GuardTripped, Aborted."""
        for name, gyro in list(self._context.bench.gyros.items()):  # what the ports have buffered is older
            self._context.monitor.add_readings(name, gyro, gyro.read_latest())
        self._read_for(-1, duration_s)

    def rest_after(self, duration_s: float) -> None:
        """Read the rest after the turn. Raises as `rest_before`."""
        self._read_for(1, duration_s)

    def read_turn(self, shown: TurnProgress) -> None:
        """Read about a second of the turn, and show what has come out so far. Raises as `rest_before`."""
        self._read(0)
        self._context.recorder.tracker.update(turn=replace(shown, came_deg=self.came_deg))

    def before(self) -> Iterator[Course]:
        """Yield the rest before the turn of each unit that takes part."""
        yield from (self._courses[-1][name] for name in self._context.bench.gyros)

    @property
    def came_deg(self) -> dict[str, float]:
        """What has come out about the axis that points up, unit -> deg, by the bias of the rest before."""
        position = self._step.position
        axis, sign = position.lstrip("-"), -1.0 if position.startswith("-") else 1.0
        return {
            name: sign * course.angle_deg(axis, self._courses[-1][name].mean_dps(axis))
            for name, course in self._courses.get(0, {}).items()
            if axis in course.outputs
        }

    def units(self) -> list[UnitTurn]:
        """Return what each unit that takes part said in the whole attempt."""
        before, turned, after = (self._courses[part] for part in (-1, 0, 1))
        return [
            UnitTurn(name, before[name], turned[name], after[name], gyro.limits.max_rate_dps)
            for name, gyro in self._context.bench.gyros.items()
        ]

    def close(self, refused: str) -> None:
        """End the data sets: complete, or kept out of the recording with the reason.

        The turn is the last: a step whose turn is complete is done, whenever the process ends.
        """
        state = DataSetState.PARTIAL if refused else DataSetState.COMPLETE
        for part in sorted(self._numbers, key=abs, reverse=True):
            self._context.recorder.journal.dataset_closed(self._numbers[part], state, refused)
        self._numbers = {}

    def _read_for(self, part: Part, duration_s: float) -> None:
        until_s = self._context.clock.now_s() + duration_s
        while self._context.clock.now_s() < until_s:
            self._read(part)

    def _read(self, part: Part) -> None:
        """Read every unit once and write it down; the bench is polled when that is due."""
        context = self._context
        if part not in self._numbers:
            self._open(part)
        gyros = list(context.bench.gyros.items())
        for name, gyro in gyros:
            readings = gyro.read(max(BLOCK_S / len(gyros), 1.5 / gyro.sample_rate_hz))
            if len(readings):
                context.monitor.add_readings(name, gyro, readings)
            self._courses[part][name].add(readings)
            in_time = Readings(
                context.recorder.time.of(readings.t_s), readings.raw, readings.valid, readings.lost, readings.damaged
            )
            if len(readings) or readings.lost or readings.damaged:
                context.recorder.journal.readings(self._numbers[part], name, in_time, context.monitor.air_c)
        if context.monitor.is_due(within_s=BLOCK_S):
            context.poll(read_latest=False)
        checkpoint(context)

    def _open(self, part: Part) -> None:
        context, step = self._context, self._step
        self._courses[part] = {
            name: Course(self._outputs[name], gyro.sample_rate_hz) for name, gyro in context.bench.gyros.items()
        }
        header = DataSetHeader(
            step=step,
            rate_dps=0.0,
            asked_dps=0.0,
            gate_from_s=context.recorder.t_s(),
            gate_until_s=None,
            angle_from_deg=None,
            setpoint_c=context.monitor.air_setpoint_c,
            run=step.run + context.added_runs,
            gyros=tuple(context.bench.gyros),
            turn_deg=step.turn_deg if part == 0 else 0.0,
            turn_u_deg=step.turn_u_deg if part == 0 else 0.0,
            part=part,
        )
        self._numbers[part] = context.recorder.journal.dataset_opened(header)
