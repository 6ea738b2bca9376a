"""The text that shows a step in the progress."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from instruments.positions import Position
from procedures.contracts.steps import (
    Acquire,
    CheckHome,
    Home,
    MeasureClock,
    Mount,
    MoveChamber,
    PowerOff,
    PowerOn,
    Rest,
    SafeState,
    SetSupply,
    Soak,
    Step,
    Turn,
)


def _signed(value: float) -> str:
    """Write a value with its sign; rest has none."""
    return f"{value:+g}" if value else "0"


def describe_step(step: Step, datasets: int) -> str:
    """Return what a step does, with its values; `datasets` is the number of data sets of the plan."""
    text = _TEXTS[type(step)](step)
    return f"data set {step.dataset} of {datasets}: {text}" if isinstance(step, Acquire | Turn) else text


_TEXTS: Mapping[type[Step], Callable[[Any], str]] = {
    Acquire: lambda step: (
        f"{step.course.text if step.course else f'{_signed(step.rate_dps)} deg/s'} at {step.temperature_c:g} deg C, "
        f"{step.position} up"
    ),
    Turn: lambda step: f"{step.turn_deg:+g} deg by hand, {step.position} up",
    Soak: lambda step: f"soak at {step.temperature_c:g} deg C for {step.hold_s / 60:g} min",
    MoveChamber: lambda step: (
        f"chamber to {step.temperature_c:g} deg C{'' if step.wait else ', while readings are taken'}"
    ),
    Mount: lambda step: f"turn the units: {Position.of(step.position).in_words}",
    PowerOn: lambda step: f"switch the units on, session {step.run}",
    PowerOff: lambda step: f"switch the units off, session {step.run}",
    SetSupply: lambda step: f"supply of the units to {step.voltage_v:g} V",
    Home: lambda _: "home the table",
    MeasureClock: lambda step: f"measure the step clock of the table at {step.rate_dps:g} deg/s",
    CheckHome: lambda step: f"check for missed steps at {step.temperature_c:g} deg C",
    Rest: lambda step: f"rest for {step.duration_s:g} s",
    SafeState: lambda _: "safe state",
}
