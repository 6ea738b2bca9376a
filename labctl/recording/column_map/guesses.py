"""Units that the values of a column show where its name does not say them: each is tested by what it implies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.recording.column_map.implied import EPOCH_S, LONGEST_UPTIME_S, too_steep
from labctl.recording.column_map.units import STANDARD_GRAVITY, Unit, find_unit

Array = NDArray[np.float64]
#: Words per g of common accelerometers: powers of two, by the range that is set.
_WORDS_PER_G = (256.0, 512.0, 1024.0, 2048.0, 4096.0, 8192.0, 16384.0)
#: A size at rest counts as gravity within this share.
_GRAVITY_WITHIN = 0.06
#: Degrees Celsius, and kelvin, that a thermometer of a gyro may show.
_CELSIUS, _KELVIN = (-80.0, 180.0), (193.0, 453.0)
#: A room, deg C, deg F and K: a log begins or stays there, or nearly so.
_ROOM_C, _ROOM_F, _ROOM_K = (10.0, 50.0), (59.0, 95.0), (280.0, 325.0)
#: Numbers that never exceed this are no degrees Fahrenheit: all of a log would be colder than any room.
_NO_FAHRENHEIT = 55.0
#: Readings per second that a log has where its unit of time is not stated.
SLOWEST_HZ, FASTEST_HZ = 0.5, 8192.0
#: Means at constant rates, one row each: so many rows or more, so far apart at least, s, of which at least this share
#: differ from the row before by more than this share of the range of the rates.
MIN_MEANS, SLOW_S, JUMPING, JUMP = 5, 2.0, 0.5, 0.02
#: Units that the numbers of a clock may be in; a date comes first, since a clock since power-on is seldom as large.
_DATES = ("epoch s", "epoch ms", "epoch us", "epoch ns", "filetime", "excel days", "datenum")
_CLOCKS = (*_DATES, "s", "ms", "us", "ns")
#: Units of dates that are asked for and never taken: seconds since 1904 are of LabVIEW, those since 1900 look the same.
_ASKED = ("epoch 1904 s",)


@dataclass(frozen=True)
class Guess:
    """A unit by the values of a column: empty where they leave it open; `why` says what speaks for it, or is open."""

    unit: str = ""
    why: str = ""


def time_unit(values: Array, temperature_c: Array | None = None) -> Guess:
    """Return the unit of a column of time, (n,): the only one by which nothing impossible follows.

    `temperature_c` are the readings of a thermometer in the same rows: no gyro warms by tens of kelvin in a second.
    """
    steps = np.diff(values)
    if not len(steps):
        return Guess()
    step = usual_step(values)
    possible = [name for name in _CLOCKS if _is_possible(name, values, step, temperature_c)]
    dates = [name for name in possible if name in _DATES]
    if dates:
        return Guess(dates[0], f"{values[0]:.0f} is {_date(values, dates[0])}, and {_rate(step, dates[0])}")
    if candidates := [name for name in _ASKED if _is_possible(name, values, step, temperature_c)]:
        return Guess("", f"in {candidates[0]}, of LabVIEW, it would begin {_date(values, candidates[0])}")
    if len(possible) == 1:
        return Guess(possible[0], f"steps of {step:.6g} are {_rate(step, possible[0])}")
    return Guess("", "; or ".join(f"in {name} it is {_rate(step, name)}" for name in possible))


def _date(values: Array, name: str) -> str:
    unit = _unit(name)
    return f"{np.datetime64(0, 's') + np.timedelta64(int(float(values[0]) * unit.factor + unit.zero), 's')} UTC"


def _is_possible(name: str, values: Array, step: float, temperature_c: Array | None) -> bool:
    unit = _unit(name)
    if not SLOWEST_HZ <= 1.0 / max(step * unit.factor, 1e-12) <= FASTEST_HZ:
        return False
    first_s = float(values[0]) * unit.factor + unit.zero
    low, high = EPOCH_S if unit.is_epoch else (-LONGEST_UPTIME_S, LONGEST_UPTIME_S)
    if not low <= first_s <= high:
        return False
    if temperature_c is None:
        return True
    passed = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(values)))])  # of a clock that was set back too
    return not too_steep(passed * unit.factor, temperature_c)


def means_at_rates(t_s: Array, rate: Array) -> str:
    """Return what shows that each row (n,) is a mean at a rate of its own, and no reading of a motion; "" if nothing.

    The rates may be in any unit, the same for all. A log that follows a motion has several readings while the rate
    changes: here it jumps from row to row.
    """
    if len(rate) < MIN_MEANS or not np.all(np.isfinite(rate)):
        return ""
    step_s, jumps = usual_step(t_s), np.abs(np.diff(rate))
    span = float(np.ptp(rate))
    jumping = float(np.mean(jumps > JUMP * span))
    if step_s < SLOW_S or span == 0 or jumping < JUMPING:
        return ""
    return f"the rate jumps from row to row, {step_s:.4g} s apart"


def usual_step(values: Array) -> float:
    """Return the usual step of a clock, (n,); the mean one where most readings share their stamp with the one before.

    Stamps of whole seconds have a median step of 0.
    """
    step = float(np.median(np.diff(values)))
    return step if step != 0 else float(values[-1] - values[0]) / (len(values) - 1)


def _unit(name: str) -> Unit:
    unit = find_unit("s", name)
    assert unit is not None  # of _CLOCKS
    return unit


def _rate(step: float, name: str) -> str:
    return f"{1.0 / (step * _unit(name).factor):.4g} readings a second"


def temperature_unit(values: Array) -> Guess:
    """Return the unit of a column of temperature; open where the readings make sense in two units."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return Guess()
    low, high = float(finite.min()), float(finite.max())
    usual = (float(finite[0]), float(np.median(finite)))
    range_text = f"{low:.4g} to {high:.4g}"
    if _KELVIN[0] <= low and high <= _KELVIN[1] and _any_within(_ROOM_K, usual) and not _whole(finite):
        return Guess("K", range_text)
    if not (_CELSIUS[0] <= low and high <= 180.0 * 9 / 5 + 32):
        return Guess()  # words of a converter, say, which a recording can do without
    is_celsius = high <= _CELSIUS[1] and (
        high <= _NO_FAHRENHEIT or (_any_within(_ROOM_C, usual) and not _any_within(_ROOM_F, usual))
    )
    if is_celsius:
        return Guess("deg C", range_text)
    low_c, high_c = ((each - 32.0) / 1.8 for each in (low, high))
    return Guess("", f"{range_text} deg C and {range_text} degF ({low_c:.3g} to {high_c:.3g} deg C) are both possible")


def _any_within(limits: tuple[float, float], values: tuple[float, ...]) -> bool:
    return any(limits[0] <= value <= limits[1] for value in values)


def force_unit(force: Array, still: NDArray[np.bool_]) -> tuple[str, float | None, str]:
    """Return the unit of the specific force (n, 3), its scale for words of a converter, and why; by gravity at rest."""
    if not still.any():
        return "", None, ""
    size = float(np.nanmedian(np.linalg.norm(force[still], axis=1)))
    evidence = f"{size:.5g} at rest is gravity"
    for gravity, unit in ((1.0, "g"), (STANDARD_GRAVITY, "m/s2"), (1000.0, "mg")):
        if abs(size / gravity - 1) < _GRAVITY_WITHIN and not (unit == "mg" and _whole(force)):
            return unit, None, evidence
    for words in _WORDS_PER_G:
        if _whole(force) and abs(size / words - 1) < _GRAVITY_WITHIN:
            return "LSB", words, evidence
    return "", None, ""


def _whole(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return bool(np.all(finite == np.round(finite)))
