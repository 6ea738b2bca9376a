"""What each kind of step does. A handler returns the figures that say how it went, or raises."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from instruments.errors import LinkError
from instruments.interfaces.gyro import Gyro
from instruments.positions import AXES, Position
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
    SetSupply,
    Soak,
)
from procedures.execution.acquire import acquire
from procedures.execution.by_hand import turn
from procedures.execution.context import ExecutionContext
from procedures.execution.prompting import ask
from procedures.execution.safe_state import make_safe
from procedures.execution.soak_criterion import SoakCriterion
from procedures.execution.table_checks import check_home, measure_clock
from procedures.execution.waiting import pass_time, polls, record_for
from procedures.monitoring.turn_course import nominal_outputs

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
    """Switch the units on, check that they are those of the bench file, open their streams, warm up."""
    context.soaked = None
    run = step.run + context.added_runs
    context.bench.power_units()
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
    if context.bench.supply is not None:
        context.bench.supply.switch_off()
    record_for(context, step.off_s)
    return {"run": float(run)}


def mount(context: ExecutionContext, step: Mount) -> Figures:
    """Ask a person to turn the units."""
    context.soaked = None
    text = mounting_text(step.position)
    if (rules := context.recipe.turns) is not None:
        text = rules.ask.of(rules.ask.place, step.position)
    ask(context, Prompt(context.new_prompt_id(), "mount", text, step.position))
    return {"mounting": float(step.mounting)}


def mounting_text(position: str) -> str:
    """Return what a person is asked for to mount the units in a position."""
    axis_position = Position.of(position)
    text = f"turn the units so that body axis {axis_position.end} points up along the table axis"
    if axis_position.is_tilted:
        angles = zip(AXES, axis_position.up, strict=True)
        from_text = ", ".join(f"{math.degrees(math.acos(share)):.2f} deg from {axis}" for axis, share in angles)
        text = (
            f"mount the units on the tilted fixture so that body direction {axis_position.end}, {from_text}, points up "
            "along the table axis"
        )
    if axis_position.unit_deg:
        text += (
            f", and each unit on the same face of its fixture by {axis_position.unit_deg} deg from where it was first"
        )
    if axis_position.fixture_deg:
        text += (
            f", and the fixture with the units on the table by {axis_position.fixture_deg} deg from where it was first"
        )
    text += " (counter-clockwise seen from above)" if axis_position.turned_deg else ""
    return f"{text}; the middle of each unit {axis_position.off_axis}" if axis_position.off_axis else text


def move_chamber(context: ExecutionContext, step: MoveChamber) -> Figures:
    """Write the set point and, where the step says so, wait until the air is in the band.

    Raises SoakFailed when it does not arrive in time.
    """
    context.soaked = None
    context.monitor.air_moves = not step.wait
    set_c = context.bench.chamber.set_temperature_c(step.temperature_c)
    half_step_c = context.bench.chamber.limits.resolution_c / 2
    if abs(set_c - step.temperature_c) > half_step_c + 1e-6:
        raise StepFailed(
            f"{context.bench.chamber.name}: set point {set_c:g} deg C was read back instead of "
            f"{step.temperature_c:g} deg C; check the panel of the chamber"
        )
    if not step.wait:
        return {"setpoint_c": set_c}
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


def set_supply(context: ExecutionContext, step: SetSupply) -> Figures:
    """Set the voltage of the units' supply, wait until it is measured, and let the units settle.

    Raises StepFailed when it does not arrive in time.
    """
    supply = context.bench.supply
    if supply is None:
        raise StepFailed("this bench has no programmable supply; add a [supply] section to the bench file")
    set_v, column = supply.set_voltage_v(step.voltage_v), supply.channels[0].name
    began_s = context.clock.now_s() - context.paused_s
    for _ in polls(context):
        measured_v = context.monitor.references.values[column]
        took_s = context.clock.now_s() - context.paused_s - began_s
        if abs(measured_v - set_v) <= supply.limits.tolerance_v:
            break
        if took_s >= step.timeout_s:
            raise StepFailed(
                f"{supply.name}: {measured_v:g} V was measured {took_s:.0f} s after {set_v:g} V was set, limit "
                f"{supply.limits.tolerance_v:g} V off; check the load and the current limit of "
                f"{supply.limits.current_limit_a:g} A"
            )
    record_for(context, step.settle_s)
    return {"voltage_v": set_v, "measured_v": context.monitor.references.values[column]}


def rest(context: ExecutionContext, step: Rest) -> Figures:
    """Wait at rest."""
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
    "set_supply": set_supply,
    "rest": rest,
    "safe_state": safe_state,
}
