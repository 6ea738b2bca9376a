"""Units that the fields of a stream may have, and what they are in the unit of a recording's channel."""

from __future__ import annotations

import math
from typing import NamedTuple

STANDARD_GRAVITY_M_S2 = 9.80665


class Conversion(NamedTuple):
    """Value in `unit` = offset + factor * value, and for increments per sample also times the sample rate."""

    unit: str
    factor: float
    offset: float = 0.0
    is_per_sample: bool = False


_DEG = 180.0 / math.pi
#: Unit of a field -> what one of it is in the unit of the channel.
UNITS: dict[str, Conversion] = {
    "deg/s": Conversion("deg/s", 1.0),
    "mdeg/s": Conversion("deg/s", 1e-3),
    "deg/h": Conversion("deg/s", 1 / 3600),
    "rad/s": Conversion("deg/s", _DEG),
    "mrad/s": Conversion("deg/s", 1e-3 * _DEG),
    "deg/sample": Conversion("deg/s", 1.0, is_per_sample=True),
    "rad/sample": Conversion("deg/s", _DEG, is_per_sample=True),
    "deg C": Conversion("deg C", 1.0),
    "K": Conversion("deg C", 1.0, -273.15),
    "deg F": Conversion("deg C", 5 / 9, -32 * 5 / 9),
    "g": Conversion("g", 1.0),
    "mg": Conversion("g", 1e-3),
    "m/s2": Conversion("g", 1 / STANDARD_GRAVITY_M_S2),
    "V": Conversion("V", 1.0),
    "mV": Conversion("V", 1e-3),
    "": Conversion("", 1.0),
}


def unit_of_channel(name: str) -> str | None:
    """Return the unit that a channel of this name has in a recording; None where any will do."""
    if name.startswith("gyro_"):
        return "deg/s"
    if name.startswith("temperature_"):
        return "deg C"
    if name.startswith("accel_"):
        return "g"
    return "V" if name == "supply_v" else None
