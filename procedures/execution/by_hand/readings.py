"""The readings of a turn by hand, in three data sets without a gap: written down as they come, judged at the end.

A person takes a while to begin, and to say that it is done. The data set of the turn holds the movement with half a
second at rest before and after it, whatever the waiting: what is read at rest makes the rests longer.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Literal

from instruments.interfaces.gyro import Readings
from instruments.positions import Position
from procedures.contracts.journal import DataSetHeader, DataSetState
from procedures.contracts.steps import Turn
from procedures.execution.context import ExecutionContext
from procedures.execution.waiting import checkpoint
from procedures.monitoring.progress import TurnProgress
from procedures.monitoring.turn_check import Stillness, UnitTurn
from procedures.monitoring.turn_course import Course, nominal_outputs

#: Units are read, and the angle so far is shown, this often, s.
BLOCK_S = 0.5
Part = Literal[-1, 0, 1]  #: the rest before, the turn, the rest after
Round = Mapping[str, Readings]  #: one block of each unit


class TurnReadings:
    """The data sets of one attempt, open until `close`. Several units are read in turn while their ports buffer."""

    def __init__(self, context: ExecutionContext, step: Turn, still_dps: float) -> None:
        self._context, self._step, self._still_dps = context, step, still_dps
        self._outputs = {
            name: nominal_outputs(tuple(gyro.channels), gyro.identify().output)
            for name, gyro in context.bench.gyros.items()
        }
        self._numbers: dict[Part, int] = {}
        self._courses: dict[Part, dict[str, Course]] = {}
        self._stillness: dict[str, Stillness] = {}
        self._held: list[Round] = []  #: read at rest: of the turn if it goes on, else of a rest

    def rest_before(self, duration_s: float) -> None:
        """Read the rest before the turn. Raises InstrumentError, GuardTripped, Aborted."""
        for name, gyro in list(self._context.bench.gyros.items()):  # what the ports have buffered is older
            self._context.monitor.add_readings(name, gyro, gyro.read_latest())
        self._rest(-1, self._context.clock.now_s() + duration_s)
        self._stillness = {name: Stillness.of(rest, self._still_dps) for name, rest in self._courses[-1].items()}

    def read_turn(self, shown: TurnProgress) -> None:
        """Read about a second of the turn, and show what has come out so far. Raises as `rest_before`."""
        blocks = self._read()
        moves = any(self._stillness[name].is_left(readings) for name, readings in blocks.items())
        if moves:
            self._keep(0, *self._held, blocks)
            self._held = []
        elif 0 not in self._numbers and self._held:  # the turn has yet to begin
            self._keep(-1, *self._held)
            self._held = [blocks]
        else:
            self._held.append(blocks)
        self._context.recorder.tracker.update(turn=replace(shown, came_deg=self.came_deg))

    def end_turn(self) -> None:
        """End the turn half a second after its last movement; what was read since then is of the rest after it."""
        first = self._held[:1]
        self._keep(0, *first)
        self._keep(1, *self._held[1:])
        self._held = []

    def rest_after(self, duration_s: float) -> None:
        """Read the rest after the turn to its end, as far as it has not been read yet. Raises as `rest_before`."""
        read_s = max((rest.duration_s for rest in self._courses.get(1, {}).values()), default=0.0)
        self._rest(1, self._context.clock.now_s() + max(duration_s - read_s, BLOCK_S))

    def before(self) -> Iterator[Course]:
        """Yield the rest before the turn of each unit that takes part."""
        yield from (self._courses[-1][name] for name in self._context.bench.gyros)

    @property
    def came_deg(self) -> dict[str, float]:
        """What has come out about the axis that points up, unit -> deg, by the bias of the rest before."""
        position = self._step.position
        up = Position.of(position)
        axis, sign = up.axis, up.sign
        return {
            name: sign * course.angle_deg(axis, self._stillness[name].bias_dps[axis])
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

    def _rest(self, part: Part, until_s: float) -> None:
        while self._context.clock.now_s() < until_s:
            self._keep(part, self._read())

    def _read(self) -> Round:
        """Read every unit once; the bench is polled when that is due."""
        context = self._context
        gyros, found = list(context.bench.gyros.items()), {}
        for name, gyro in gyros:
            found[name] = gyro.read(max(BLOCK_S / len(gyros), 1.5 / gyro.sample_rate_hz))
            if len(found[name]):
                context.monitor.add_readings(name, gyro, found[name])
        if context.monitor.is_due(within_s=BLOCK_S):
            context.poll(read_latest=False)
        checkpoint(context)
        return found

    def _keep(self, part: Part, *rounds: Round) -> None:
        """Take readings in as part of the attempt, and write them down."""
        recorder = self._context.recorder
        for blocks in rounds:
            if part not in self._numbers:
                self._open(part, min((float(each.t_s[0]) for each in blocks.values() if len(each)), default=None))
            for name, readings in blocks.items():
                self._courses[part][name].add(readings)
                if len(readings) or readings.lost or readings.damaged:
                    in_time = recorder.time.of_readings(readings)
                    beside = self._context.monitor.references.beside(in_time)
                    recorder.journal.readings(self._numbers[part], name, beside, self._context.monitor.air_c)

    def _open(self, part: Part, from_s: float | None) -> None:
        context, step = self._context, self._step
        self._courses[part] = {
            name: Course(self._outputs[name], gyro.sample_rate_hz) for name, gyro in context.full_bench.gyros.items()
        }
        header = DataSetHeader(
            step=step,
            rate_dps=0.0,
            asked_dps=0.0,
            gate_from_s=context.recorder.t_s() if from_s is None else context.recorder.time.of(from_s),
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
