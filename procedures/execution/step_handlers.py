"""What each kind of step does. A handler returns the figures that say how it went, or raises."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping

import numpy as np

from instruments.errors import LinkError
from instruments.interfaces.gyro import Gyro
from instruments.positions import Position
from procedures.contracts.errors import GuardTripped, SoakFailed, StepFailed
from procedures.contracts.journal import Event
from procedures.contracts.operator import Prompt
from procedures.contracts.steps import (
    Home,
    Mount,
    MoveChamber,
    PowerOff,
    PowerOn,
    Rest,
    SafeState,
    Soak,
)
from procedures.execution.acquire import acquire
from procedures.execution.by_hand import turn
from procedures.execution.context import ExecutionContext
from procedures.execution.prompting import ask
from procedures.execution.safe_state import make_safe
from procedures.execution.table_checks import check_home, measure_clock
from procedures.execution.waiting import pass_time, polls, record_for
from procedures.monitoring.turn_course import nominal_outputs


class SoakCriterion:
    """Decides from the polls of the bench when the units have taken the temperature, and says why not yet.

    The chamber's air is compared with the band; leaving it starts the count again. What ends a soak is the unit: the
    change of its own thermometer over the last `drift_window_s`, as the slope of a straight line through that window
    times its length. A line instead of two readings, so that the thermometer's noise does not keep a soak open.
    A unit without a thermometer cannot be judged; for it the time inside the band has to do.
    """

    def __init__(self, step: Soak) -> None:
        self.step = step
        self.held_s = 0.0
        self.restarts = 0  #: how often the air left the band after it had been inside
        self._last: tuple[float, bool] | None = None  #: time of the last poll, and whether it was inside
        self._gyro_c: dict[str, deque[tuple[float, float]]] = {}

    def add(self, t_s: float, chamber_c: float, gyro_c: Mapping[str, float]) -> None:
        """Take in one poll of the bench: time in s, air and unit temperatures in deg C."""
        inside = abs(chamber_c - self.step.temperature_c) <= self.step.band_c
        if self._last is not None:
            last_s, was_inside = self._last
            if inside and was_inside:
                self.held_s += t_s - last_s
            elif was_inside:
                self.held_s = 0.0
                self.restarts += 1
        self._last = (t_s, inside)
        for name, temperature_c in gyro_c.items():
            window = self._gyro_c.setdefault(name, deque())
            window.append((t_s, temperature_c))
            while len(window) > 2 and window[1][0] <= t_s - self.step.drift_window_s:
                window.popleft()

    def drift_c(self) -> dict[str, float | None]:
        """Return each unit's change over the window, deg C; None while the window is not full yet."""
        return {name: self._line_change_c(window) for name, window in self._gyro_c.items()}

    def _line_change_c(self, window: deque[tuple[float, float]]) -> float | None:
        t_s, temperature_c = np.array(window).T
        if t_s[-1] - t_s[0] < self.step.drift_window_s or len(t_s) < 2:
            return None
        centred_s = t_s - t_s.mean()
        slope_c_per_s = float(centred_s @ temperature_c / (centred_s @ centred_s))
        return slope_c_per_s * self.step.drift_window_s

    def settled(self) -> bool:
        """Return whether the soak is over."""
        if self.held_s < self.step.hold_s:
            return False
        drifts_c = self.drift_c().values()
        return all(drift_c is not None and abs(drift_c) <= self.step.max_drift_c for drift_c in drifts_c)

    def why_not(self) -> str:
        """Return in words what is still missing."""
        step = self.step
        reasons = []
        if self.held_s < step.hold_s:
            reasons.append(
                f"the air was within {step.band_c:g} deg C of {step.temperature_c:g} deg C for {self.held_s:.0f} s"
                f" of {step.hold_s:g} s" + (f", leaving the band {self.restarts} times" if self.restarts else "")
            )
        for name, drift_c in self.drift_c().items():
            if drift_c is None:
                reasons.append(f"{name} has not been monitored for {step.drift_window_s:g} s yet")
            elif abs(drift_c) > step.max_drift_c:
                reasons.append(
                    f"{name} still changes by {drift_c:+.2f} deg C in {step.drift_window_s:g} s,"
                    f" more than {step.max_drift_c:g} deg C"
                )
        return "; ".join(reasons)

    def figures(self) -> dict[str, float]:
        """Return the result as numbers: time held, band, restarts, drift per unit."""
        drifts_c = {f"drift_c.{name}": drift_c for name, drift_c in self.drift_c().items() if drift_c is not None}
        return {
            "held_s": self.held_s,
            "band_c": self.step.band_c,
            "drift_window_s": self.step.drift_window_s,
            "restarts": float(self.restarts),
            **drifts_c,
        }


Figures = dict[str, float]
#: A unit that is silent when its stream is opened is asked again after these.
STARTING_PAUSES_S = (1.0, 2.0, 4.0)


def home(context: ExecutionContext, _step: Home) -> Figures:
    """Make sure the right instruments answer, and let the table find its home switch."""
    context.bench.table.identify()
    context.bench.chamber.identify()
    context.bench.table.home()
    return {"angle_deg": context.bench.table.angle_deg()}


def power_on(context: ExecutionContext, step: PowerOn) -> Figures:
    """Have the units switched on, check that they are those of the bench file, open their streams, warm up."""
    context.soaked = None
    run = step.run + context.added_runs
    ask(context, Prompt(context.new_prompt_id(), "power_on", f"switch the units on (session {run})"))
    context.recorder.journal.session_began(run, context.recorder.t_s())
    open_streams(context, run)
    record_for(context, step.wait_s)
    return {"run": float(run)}


def open_streams(context: ExecutionContext, run: int, *, dropping: bool = True) -> None:
    """Open every unit's stream and begin to watch it. A unit may take a while to start up.

    One that stays silent drops out where others go on. Raises InstrumentError.
    """
    for name in list(context.bench.gyros):
        try:
            _open_stream(context, context.bench.gyros[name])
        except LinkError as error:
            if not dropping or not context.can_drop(name):
                raise
            context.drop(name, str(error))
    context.monitor.units_powered(run)


def _open_stream(context: ExecutionContext, gyro: Gyro) -> None:
    for pause_s in (*STARTING_PAUSES_S, None):
        try:
            identity = gyro.identify()
            context.require_same_settings(gyro.name, identity.reported)
            context.response.expect(gyro.name, nominal_outputs(tuple(gyro.channels), identity.output))
            gyro.start()
        except LinkError:
            if pause_s is None:
                raise
            pass_time(context, pause_s, pausing=False)
        else:
            return


def power_off(context: ExecutionContext, step: PowerOff) -> Figures:
    """Close the streams and have the units switched off; the chamber is watched while they are."""
    context.soaked = None
    if not context.monitor.run:  # the switching-on was left out
        return {"run": 0.0}
    for gyro in context.bench.gyros.values():
        gyro.stop()
    context.monitor.units_powered(0)
    run = step.run + context.added_runs
    ask(context, Prompt(context.new_prompt_id(), "power_off", f"switch the units off (session {run})"))
    record_for(context, step.off_s)
    return {"run": float(run)}


def mount(context: ExecutionContext, step: Mount) -> Figures:
    """Have a person turn the units."""
    context.soaked = None
    text = mounting_text(step.position)
    if (rules := context.recipe.turns) is not None:
        text = rules.ask.of(rules.ask.place, step.position)
    ask(context, Prompt(context.new_prompt_id(), "mount", text, step.position))
    return {"mounting": float(step.mounting)}


def mounting_text(position: str) -> str:
    """Return what a person is asked for to mount the units in a position."""
    asked = Position.of(position)
    text = f"turn the units so that body axis {asked.end} points up along the table axis"
    if asked.unit_deg:
        text += f", and each unit on the same face of its fixture by {asked.unit_deg} deg from where it was first"
    if asked.fixture_deg:
        text += f", and the fixture with the units on the table by {asked.fixture_deg} deg from where it was first"
    return f"{text} (counter-clockwise seen from above)" if asked.turned_deg else text


def move_chamber(context: ExecutionContext, step: MoveChamber) -> Figures:
    """Write the set point and wait until the air is in the band. Raises SoakFailed when it does not arrive in time."""
    context.soaked = None
    set_c = context.bench.chamber.set_temperature_c(step.temperature_c)
    half_step_c = context.bench.chamber.limits.resolution_c / 2
    if abs(set_c - step.temperature_c) > half_step_c + 1e-6:
        raise StepFailed(
            f"{context.bench.chamber.name}: set point {set_c:g} deg C was read back instead of "
            f"{step.temperature_c:g} deg C; check the panel of the chamber"
        )
    began_s = context.clock.now_s() - context.paused_s
    for _ in polls(context):
        off_c = abs(context.monitor.chamber_c - step.temperature_c)
        took_s = context.clock.now_s() - context.paused_s - began_s
        if off_c <= step.band_c and context.monitor.setpoint_c == set_c:
            break
        if took_s >= step.timeout_s:
            raise SoakFailed(
                f"{context.bench.chamber.name}: {context.monitor.chamber_c:.1f} deg C after {took_s:.0f} s, not "
                f"within {step.band_c:g} deg C of the set point {step.temperature_c:g} deg C; limit "
                f"{step.timeout_s:g} s; check chamber and door",
                {"off_c": off_c, "took_s": took_s},
            )
    return {"setpoint_c": set_c, "chamber_c": context.monitor.chamber_c}


def soak(context: ExecutionContext, step: Soak) -> Figures:
    """Hold a temperature until the units have taken it. When they do not in time, the recipe says what follows."""
    judge = SoakCriterion(step)
    began_s = context.clock.now_s() - context.paused_s
    with context.monitor.listening(judge.add):
        for _ in polls(context):
            if judge.settled():
                break
            took_s = context.clock.now_s() - context.paused_s - began_s
            if took_s >= step.timeout_s:
                _unsettled(context, step, judge, took_s)
                break
    context.soaked = step
    return judge.figures()


def _unsettled(context: ExecutionContext, step: Soak, judge: SoakCriterion, took_s: float) -> None:
    """Do what the recipe says about a soak that does not settle. Raises SoakFailed or GuardTripped, or warns."""
    action = context.recipe.guards.action_of("soak")
    reason = f"the soak at {step.temperature_c:g} deg C did not settle within {step.timeout_s:g} s: {judge.why_not()}"
    level = "warning" if action == "warn" else "error"
    context.recorder.event(Event("guard.soak", reason, level, context.bench.chamber.name, took_s, step.timeout_s, "s"))
    if action == "fail":
        raise SoakFailed(reason, judge.figures())
    if action == "suspend":
        raise GuardTripped("soak", action, reason, context.bench.chamber.name)


def rest(context: ExecutionContext, step: Rest) -> Figures:
    """Let nothing move for a while."""
    with context.monitor.taking_readings():
        record_for(context, step.duration_s)
    return {}


def safe_state(context: ExecutionContext, _step: SafeState) -> Figures:
    """Bring the bench to its safe state. Raises StepFailed naming what could not be confirmed."""
    context.monitor.units_powered(0)
    if complaints := make_safe(context.full_bench, context.clock):
        raise StepFailed("NOT confirmed safe: " + "; ".join(complaints))
    return {}


HANDLERS: Mapping[str, Callable[..., Figures]] = {
    "home": home,
    "measure_clock": measure_clock,
    "check_home": check_home,
    "power_on": power_on,
    "power_off": power_off,
    "mount": mount,
    "move_chamber": move_chamber,
    "soak": soak,
    "acquire": acquire,
    "turn": turn,
    "rest": rest,
    "safe_state": safe_state,
}
