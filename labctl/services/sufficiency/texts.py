"""What is said of U while a campaign runs, and at its end."""

from __future__ import annotations

from collections.abc import Sequence

from labctl.services.sufficiency.evaluation import UnitU
from labctl.services.sufficiency.event_kinds import KINDS
from procedures.contracts.journal import Event

#: Part of the variance from which on the model is named as the reason of a U that is too large.
MOSTLY = 0.5


def event_of(unit: UnitU, planned: int, limit_dps: float) -> Event:
    """Return the event of one evaluation."""
    after = f"after {unit.datasets} of {planned} data sets"
    if unit.u_dps is None:
        text = f"{unit.gyro}: U is not known{_unknown_place(unit)} {after}: {unit.why}"
    elif unit.known == "at least":
        text = f"{unit.gyro}: U is at least {unit.u_dps:.2g} deg/s {_place(unit)}, {after}; target {limit_dps:g} deg/s"
        text += f"; {unit.why}" if unit.why else ""
    else:
        text = f"{unit.gyro}: U is {unit.u_dps:.2g} deg/s {_place(unit)}, {after}; target {limit_dps:g} deg/s"
        text += f"; {unit.why}" if unit.why else ""
    return Event(KINDS[unit.known], text, device=unit.gyro, value=unit.u_dps, limit=limit_dps, unit="deg/s")


def reached_text(units: Sequence[UnitU], planned: int, limit_dps: float) -> str:
    """Return that every unit has reached the limit; empty where one has not."""
    if not units or not all(unit.reaches(limit_dps) for unit in units):
        return ""
    worst = max(units, key=lambda unit: unit.u_dps or 0.0)
    of = f" of {worst.gyro}" if len(units) > 1 else ""
    return (
        f"U{of} {worst.u_dps:.2g} deg/s reached the target {limit_dps:g} deg/s after {worst.datasets} of {planned} "
        "data sets"
    )


def missing_text(units: Sequence[UnitU], limit_dps: float) -> str:
    """Return what is missing of each unit that has not reached the limit, and what would help."""
    return "; ".join(_missing(unit, limit_dps, len(units)) for unit in units if not unit.reaches(limit_dps))


def _missing(unit: UnitU, limit_dps: float, units: int) -> str:
    of = f" of {unit.gyro}" if units > 1 else ""
    if unit.u_dps is None:
        return f"U{of} is not known{_unknown_place(unit)}: {unit.why}; the target {limit_dps:g} deg/s was not reached"
    if unit.known == "of the fit" and unit.u_dps <= limit_dps:
        return f"U{of} {unit.u_dps:.2g} deg/s {_place(unit)} is within the target {limit_dps:g} deg/s, but {unit.why}"
    if unit.known == "at least":
        return f"U{of} is at least {unit.u_dps:.2g} deg/s: {unit.why}"
    text = f"U{of} {unit.u_dps:.2g} deg/s {_place(unit)} is above the target {limit_dps:g} deg/s"
    if unit.more_sets is not None:
        sets = "1 more data set" if unit.more_sets == 1 else f"{unit.more_sets} more data sets"
        return f"{text}; about {sets} there would bring it to the target"
    why = "standards of the bench, repeatability and what the model leaves"
    if unit.model_share > MOSTLY:
        why = "what the model leaves at data sets that it has not seen; `labctl criticise` says what is missing in it"
    return f"{text}; more data sets there would not bring it to the target, because the rest is {why}"


def _unknown_place(unit: UnitU) -> str:
    return f" {_place(unit)}," if unit.axis else ""


def _place(unit: UnitU) -> str:
    return f"at {unit.temperature_c:.1f} deg C and {unit.rate_dps:g} deg/s about {unit.axis}"
