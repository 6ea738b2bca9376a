"""Units that the values of a column show where its name does not say them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.recording.column_map.units import STANDARD_GRAVITY

Array = NDArray[np.float64]
#: Words per g of common accelerometers: powers of two, by the range that is set.
_WORDS_PER_G = (256.0, 512.0, 1024.0, 2048.0, 4096.0, 8192.0, 16384.0)
#: A size at rest counts as gravity within this share.
_GRAVITY_WITHIN = 0.06
#: Instants since 1970 that logs can be of: 2001 to 2100.
_EPOCH = (1e9, 4.2e9)
#: Degrees Celsius, and kelvin, that a thermometer of a gyro may show.
_CELSIUS, _KELVIN = (-80.0, 180.0), (193.0, 453.0)
#: Usual steps of time, s, at which only one unit makes sense.
_STEPS = (1e-5, 0.6)
#: Whole numbers as time: least and largest step, their unit, and how many of it are a second.
_WHOLE_STEPS = ((2, 200, "ms", 1e3), (201, 200_000, "us", 1e6), (200_001, 1e12, "ns", 1e9))


def time_unit(values: Array) -> tuple[str, str]:
    """Return the unit of a column of time and why, both empty where the values leave it open."""
    steps = np.diff(values)
    if not len(steps):
        return "", ""
    step, first = float(np.median(steps)), float(values[0])
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "us"), (1e9, "ns")):
        if _EPOCH[0] * factor <= first <= _EPOCH[1] * factor and step / factor <= 86_400:
            return f"epoch {unit}", f"{first:.0f} {unit} since 1970 is a date"
    whole = bool(np.all(values == np.round(values)))
    return _unit_of_step(step, whole=whole)


def _unit_of_step(step: float, *, whole: bool) -> tuple[str, str]:
    if not whole and _STEPS[0] <= step <= _STEPS[1]:
        return "s", f"fractions, in steps of {step:.4g}"
    for least, most, unit, factor in _WHOLE_STEPS:
        if whole and least <= step <= most:
            return unit, f"whole numbers in steps of {step:g}: {factor / step:.4g} readings a second"
    return "", ""


def temperature_unit(values: Array) -> tuple[str, str]:
    """Return the unit of a column of temperature and why, both empty where the values leave it open."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return "", ""
    low, high = float(finite.min()), float(finite.max())
    said = f"{low:.4g} to {high:.4g}"
    if _KELVIN[0] <= low and high <= _KELVIN[1]:
        return "K", said
    if _CELSIUS[0] <= low and high <= _CELSIUS[1]:
        return "deg C", said
    return "", ""


def force_unit(force: Array, still: NDArray[np.bool_]) -> tuple[str, float | None, str]:
    """Return the unit of the specific force (n, 3), its scale for words of a converter, and why; by gravity at rest."""
    if not still.any():
        return "", None, ""
    size = float(np.nanmedian(np.linalg.norm(force[still], axis=1)))
    said = f"{size:.5g} at rest is gravity"
    for gravity, unit in ((1.0, "g"), (STANDARD_GRAVITY, "m/s2"), (1000.0, "mg")):
        if abs(size / gravity - 1) < _GRAVITY_WITHIN and not (unit == "mg" and _whole(force)):
            return unit, None, said
    for words in _WORDS_PER_G:
        if _whole(force) and abs(size / words - 1) < _GRAVITY_WITHIN:
            return "LSB", words, said
    return "", None, ""


def _whole(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return bool(np.all(finite == np.round(finite)))
