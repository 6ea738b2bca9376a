"""A turn by hand: a rest, the turn, a rest, read without a gap; checked at once, and asked again until it is good."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from instruments.interfaces.gyro import Readings
from instruments.positions import Position
from procedures.contracts.errors import StepFailed
from procedures.contracts.journal import DataSetHeader, DataSetState, Event
from procedures.contracts.operator import Prompt
from procedures.contracts.steps import Turn
from procedures.execution.context import ExecutionContext
from procedures.execution.prompting import ask
from procedures.execution.waiting import checkpoint
from procedures.monitoring.progress import TurnProgress
from procedures.monitoring.turn_check import Stillness, TurnResult, UnitTurn, check_turn, moved
from procedures.monitoring.turn_course import Course, nominal_outputs
from procedures.recipe.turns import TurnRules

# The readings of a turn by hand, in three data sets without a gap: written down as they come, judged at the end.
#
# A person takes a while to begin, and to say that it is done. The data set of the turn holds the movement with half a
# second at rest before and after it, whatever the waiting: what is read at rest makes the rests longer.

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

    def read_turn(self, progress: TurnProgress) -> None:
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
        self._context.recorder.tracker.update(turn=replace(progress, came_deg=self.came_deg))

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
        before, during, after = (self._courses[part] for part in (-1, 0, 1))
        return [
            UnitTurn(name, before[name], during[name], after[name], gyro.limits.max_rate_dps)
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
        gyros, samples = list(context.bench.gyros.items()), {}
        for name, gyro in gyros:
            samples[name] = gyro.read(max(BLOCK_S / len(gyros), 1.5 / gyro.sample_rate_hz))
            if len(samples[name]):
                context.monitor.add_readings(name, gyro, samples[name])
        if context.monitor.is_due(within_s=BLOCK_S):
            context.poll(read_latest=False)
        checkpoint(context)
        return samples

    def _keep(self, part: Part, *rounds: Round) -> None:
        """Take readings in as part of the attempt, and write them down."""
        recorder = self._context.recorder
        for blocks in rounds:
            if part not in self._numbers:
                self._open(part, min((float(block.t_s[0]) for block in blocks.values() if len(block)), default=None))
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


def turn(context: ExecutionContext, step: Turn) -> dict[str, float]:
    """Ask for a turn by hand until one is good; returns its result, by unit.

    Raises StepFailed after as many refused attempts as the recipe allows, and for an answer that does not come, or is
    no; InstrumentError, Aborted.
    """
    rules = context.recipe.turns
    assert rules is not None
    refused = ""
    try:
        for attempt in range(1, rules.attempts + 1):
            shown = TurnProgress(step.position, step.turn_deg, "rest", attempt, refused=refused)
            context.recorder.tracker.update(turn=shown)
            outcome = _attempt(context, step, rules, shown)
            if not outcome.refused:
                return {"attempts": float(attempt), **outcome.figures}
            refused = outcome.refused
    finally:
        context.recorder.tracker.update(turn=None)
    raise StepFailed(
        f"the turn by {step.turn_deg:g} deg, {step.position} up, was refused {rules.attempts} times, the last time "
        f"because: {refused}; inspect unit and readings, then resume the campaign"
    )


@dataclass(frozen=True)
class _Found:
    """Result of one attempt."""

    refused: str  #: why; empty for a good one
    figures: dict[str, float]  #: what came out of each unit


def _attempt(context: ExecutionContext, step: Turn, rules: TurnRules, progress: TurnProgress) -> _Found:
    readings = TurnReadings(context, step, rules.still_dps)
    try:
        refused, again = _rest(readings, step, rules), False
        if not refused:
            context.recorder.tracker.update(turn=(progress := replace(progress, phase="turn")))
            answer = ask(context, _question(context, step, rules, progress), lambda: readings.read_turn(progress))
            readings.read_turn(progress)  # what came with the answer
            readings.end_turn()
            again = answer.again
            refused = (answer.reason or f"{answer.by} requested the turn again") if again else ""
        else:
            readings.close(refused)
            _ask_for_rest(context, step, rules, refused)
            return _record(context, step, refused, {})
        results: dict[str, TurnResult] = {}
        if not again:
            context.recorder.tracker.update(turn=replace(progress, phase="rest", came_deg=readings.came_deg))
            readings.rest_after(step.rest_s)
            results = {unit.name: check_turn(step, rules, unit) for unit in readings.units()}
            named = len(results) > 1
            refused = next((f"{n}: {r.refused}" if named else r.refused for n, r in results.items() if r.refused), "")
    except BaseException as error:
        readings.close(str(error) or type(error).__name__)
        raise
    readings.close(refused)
    return _record(context, step, refused, results)


def _rest(readings: TurnReadings, step: Turn, rules: TurnRules) -> str:
    """Take the rest before the turn; returns what moved in it, empty when nothing did."""
    readings.rest_before(step.rest_s)
    return next((text for course in readings.before() if (text := moved(course, rules.still_dps, "before"))), "")


def _question(context: ExecutionContext, step: Turn, rules: TurnRules, progress: TurnProgress) -> Prompt:
    text = rules.ask.of(rules.ask.turn, step.position, step.turn_deg)
    text = f"{progress.refused}: turn again; {text}" if progress.refused else text
    return Prompt(context.new_prompt_id(), "turn", text, step.position, step.turn_deg, step.within_s)


def _ask_for_rest(context: ExecutionContext, step: Turn, rules: TurnRules, refused: str) -> None:
    text = f"{refused}: {rules.ask.of(rules.ask.keep_still, step.position)}"
    ask(context, Prompt(context.new_prompt_id(), "mount", text, step.position, within_s=step.within_s))


def _record(context: ExecutionContext, step: Turn, refused: str, results: dict[str, TurnResult]) -> _Found:
    """Write down what came out, of every unit that measures the axis, and whether it was refused."""
    instruction = f"turn by {step.turn_deg:g} deg, {step.position} up"
    figures = {f"came_deg.{name}": result.came_deg for name, result in results.items() if result.came_deg is not None}
    if refused:
        value = next(iter(figures.values()), None)
        event = Event(
            "turn.refused", f"{instruction}: {refused}: turn again", "warning", None, value, step.turn_deg, "deg"
        )
        context.recorder.event(event)
    else:
        for name, result in results.items():
            came = result.came_deg
            text = (
                f"{instruction}: the unit turned by {came:.1f} deg"
                if came is not None
                else f"{instruction}: {name} has no such axis"
            )
            context.recorder.event(Event("turn.taken", text, "info", name, came, step.turn_deg, "deg"))
    return _Found(refused, figures)
