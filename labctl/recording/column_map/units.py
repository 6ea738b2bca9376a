"""The units that a log may be in, and what one of each is in the unit of a recording's column."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from labctl.recording.columns import BY_NAME

#: Standard acceleration of gravity, m/s2 (CGPM 1901).
STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True)
class Unit:
    """A unit: value in the recording's unit = factor x value + zero."""

    name: str
    factor: float = 1.0
    zero: float = 0.0
    aliases: tuple[str, ...] = ()
    is_epoch: bool = False  #: a date: seconds since 1970-01-01T00:00:00Z = factor x value + zero


_RATE = (
    Unit("deg/s", 1.0, aliases=("dps", "°/s", "degs", "deg/sec", "degps", "degpersec", "deg_s")),
    Unit("rad/s", 180.0 / math.pi, aliases=("rads", "rad/sec", "rps", "radps", "rad_s", "radians/s")),
    Unit("mdps", 1e-3, aliases=("mdeg/s", "millideg/s", "m°/s")),
    Unit("mrad/s", 0.18 / math.pi, aliases=("mradps",)),
    Unit("urad/s", 0.18e-3 / math.pi, aliases=("µrad/s", "μrad/s", "uradps")),
    Unit("deg/h", 1.0 / 3600.0, aliases=("dph", "°/h", "deg/hr", "deg/hour")),
    Unit("rpm", 6.0, aliases=("turns/min", "1/min", "rev/min")),
)
_TIME = (
    Unit("s", 1.0, aliases=("sec", "secs", "second", "seconds")),
    Unit("ms", 1e-3, aliases=("msec", "millis", "milliseconds", "millisecond")),
    Unit("us", 1e-6, aliases=("usec", "µs", "μs", "micros", "microseconds", "microsecond")),
    Unit("ns", 1e-9, aliases=("nsec", "nanos", "nanoseconds", "nanosecond")),
    Unit("min", 60.0, aliases=("minute", "minutes")),
    Unit("h", 3600.0, aliases=("hour", "hours", "hr")),
    Unit("epoch s", 1.0, is_epoch=True, aliases=("epoch", "unix", "epoch_s", "unix s")),
    Unit("epoch ms", 1e-3, is_epoch=True, aliases=("epoch_ms", "unix ms")),
    Unit("epoch us", 1e-6, is_epoch=True, aliases=("epoch_us", "unix us")),
    Unit("epoch ns", 1e-9, is_epoch=True, aliases=("epoch_ns", "unix ns")),
    Unit("filetime", 1e-7, -11_644_473_600.0, is_epoch=True, aliases=("windows filetime", "100 ns since 1601")),
    Unit("excel days", 86_400.0, -25_569.0 * 86_400.0, is_epoch=True, aliases=("excel date", "serial date")),
    Unit("datenum", 86_400.0, -719_529.0 * 86_400.0, is_epoch=True, aliases=("matlab datenum", "matlab days")),
    Unit("epoch 1904 s", 1.0, -2_082_844_800.0, is_epoch=True, aliases=("labview s", "labview", "epoch_1904_s")),
    Unit("date-time", 1.0, is_epoch=True, aliases=("iso", "iso8601", "iso 8601", "datetime")),
    Unit("date-time d/m/y", 1.0, is_epoch=True, aliases=("d/m/y", "dd/mm/yyyy")),
    Unit("date-time m/d/y", 1.0, is_epoch=True, aliases=("m/d/y", "mm/dd/yyyy")),
)
_TEMPERATURE = (
    Unit("deg C", 1.0, aliases=("c", "°c", "degc", "celsius", "deg_c", "℃")),
    Unit("K", 1.0, -273.15, aliases=("kelvin", "degk")),
    Unit("degF", 5.0 / 9.0, -160.0 / 9.0, aliases=("f", "°f", "deg f", "fahrenheit", "℉")),
    Unit("mdegC", 1e-3, aliases=("m°c", "mc", "millidegc")),
    Unit("cdegC", 1e-2, aliases=("c°c", "centidegc", "centi-degc")),
    Unit("ddegC", 1e-1, aliases=("d°c", "decidegc", "deci-degc")),
)
_FORCE = (
    Unit("g", 1.0, aliases=("gee", "g0", "gn")),
    Unit("mg", 1e-3, aliases=("milli-g",)),
    Unit("ug", 1e-6, aliases=("µg", "μg", "micro-g")),
    Unit("m/s2", 1.0 / STANDARD_GRAVITY, aliases=("m/s^2", "m/s²", "mps2", "m/s/s", "ms-2", "m/s**2", "m_s2")),
)
_ANGLE = (
    Unit("deg", 1.0, aliases=("°", "degree", "degrees")),
    Unit("rad", 180.0 / math.pi, aliases=("radian", "radians")),
    Unit("turn", 360.0, aliases=("turns", "rev", "revolutions")),
)
_VOLTAGE = (Unit("V", 1.0, aliases=("volt", "volts")), Unit("mV", 1e-3, aliases=("millivolt", "millivolts")))
_FIELD = (
    Unit("microtesla", 1.0, aliases=("ut", "µt", "μt")),
    Unit("T", 1e6, aliases=("tesla",)),
    Unit("mT", 1e3, aliases=()),
    Unit("nT", 1e-3, aliases=()),
    Unit("gauss", 100.0, aliases=("gs", "ga")),
    Unit("mgauss", 0.1, aliases=("mga",)),
)

#: Unit of a recording's column -> the units that a file may have it in.
QUANTITIES: dict[str, tuple[Unit, ...]] = {
    "deg/s": _RATE, "s": _TIME, "deg C": _TEMPERATURE, "g": _FORCE, "deg": _ANGLE, "V": _VOLTAGE,
    "microtesla": _FIELD,
}  # fmt: skip
#: A word of a converter, of any quantity; it needs its scale.
LSB = "LSB"
#: Signs that keyboards and fonts have in place of the degree sign: the ordinal and the ring above.
_DEGREES = str.maketrans({"º": "°", "˚": "°"})
_LSB = frozenset({"lsb", "count", "counts", "raw", "digit", "digits", "adc"})


def unit_of_target(target: str) -> str:
    """Return the unit of a recording's column; empty where it has none. A gyro's output counts as deg/s."""
    if target.startswith("gyro_"):
        return "deg/s"
    column_spec = BY_NAME.get(target)
    return column_spec.unit if column_spec else ""


def find_unit(quantity: str, text: str) -> Unit | None:
    """Return the unit that a text names among those of a quantity; None for none."""
    units = QUANTITIES.get(quantity, ())
    unit_text = text.strip()
    for unit in units:
        if unit_text == unit.name:
            return unit
    folded = _folded(unit_text)
    for unit in units:
        if folded == _folded(unit.name) or folded in {_folded(alias) for alias in unit.aliases}:
            return unit
    return None


def names_of_units() -> list[str]:
    """Return the names and aliases of all units but the times since 1970, as they may end the name of a column."""
    units = [unit for each in QUANTITIES.values() for unit in each if not unit.is_epoch]
    return [name for unit in units for name in (unit.name, *unit.aliases)]


def is_lsb(text: str) -> bool:
    """Whether a text means words of a converter."""
    return text.strip().lower() in _LSB


def names_of(quantity: str) -> str:
    """Return the units of a quantity as a message lists them."""
    return ", ".join([*(unit.name for unit in QUANTITIES.get(quantity, ())), f"{LSB} with its scale"])


def _folded(text: str) -> str:
    return re.sub(r"[\s]+", " ", text.strip().lower().translate(_DEGREES)).replace("deg ", "deg")
