"""The text that shows a step in the progress."""

from __future__ import annotations

from procedures.contracts.steps import Acquire, Home, Mount, MoveChamber, PowerOff, PowerOn, Rest, Soak, Step, Turn


def describe_step(step: Step, datasets: int) -> str:
    """Return what a step does, with its values; `datasets` is the number of data sets of the plan."""
    text = "safe state"
    match step:
        case Acquire():
            where = f"at {step.temperature_c:g} deg C, {step.position} up"
            text = f"data set {step.dataset} of {datasets}: {step.rate_dps:+g} deg/s {where}"
        case Turn():
            text = f"data set {step.dataset} of {datasets}: {step.turn_deg:+g} deg by hand, {step.position} up"
        case Soak():
            text = f"soak at {step.temperature_c:g} deg C for {step.hold_s / 60:g} min"
        case MoveChamber():
            text = f"chamber to {step.temperature_c:g} deg C"
        case Mount():
            text = f"turn the units: {step.position} up"
        case PowerOn() | PowerOff():
            text = f"switch the units {'on' if isinstance(step, PowerOn) else 'off'}, session {step.run}"
        case Home():
            text = "home the table"
        case Rest():
            text = f"rest for {step.duration_s:g} s"
    return text
