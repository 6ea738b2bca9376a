"""Text lines of the KVH fibre-optic gyros: one reading per line, in the format of each model."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from instruments.bench_config import GyroSettings
from instruments.protocols.serial_options import SerialOptions

#: Raw rates are whole microdegrees per second, raw temperatures whole millidegrees Celsius: the digits of the line.
DPS_PER_COUNT = 1e-6
C_PER_COUNT = 1e-3
MAX_LINE_BYTES = 80


@dataclass(frozen=True)
class LineFormat:
    """Line of one model. Groups of `pattern`: `rate` (deg/s), optionally `flag` (1: valid), `temperature` (deg C)."""

    pattern: str
    baudrate: int
    rate_hz: float  #: lines per second
    sign: Literal[1, -1]  #: -1 where the device counts clockwise positive
    limit_dps: float  #: a reading beyond this rate is not valid, whatever its flag says
    length: int | None = None  #: characters of a line without its line end
    start_command: str = ""


@dataclass(frozen=True)
class Line:
    """One reading of a line in counts."""

    rate: int  #: in DPS_PER_COUNT, with the sign of the device
    flag: bool  #: False where the device marks the reading as bad
    temperature: int | None  #: in C_PER_COUNT; None where the line carries none


#: DSP-3000 manual, pages 7 and 13: 38400 baud, 19 characters, clockwise positive, linear to 375 deg/s.
DSP3000 = LineFormat(r"\s*(?P<rate>-?\d+\.\d{6})\s+(?P<flag>[01])", 38_400, 100.0, -1, 375.0, 19, "R")
#: The E-Core's line is not public: one decimal number and, by assumption, the temperature behind it.
RD2100 = LineFormat(r"\s*(?P<rate>-?\d+\.\d+)(?:\s+(?P<temperature>-?\d+\.\d+))?\s*", 9_600, 10.0, 1, 150.0)


class LineOptions(SerialOptions):
    """Deviations of a unit from the line format of its model, from the manual of the unit."""

    pattern: str | None = None
    baudrate: int | None = None
    sign: Literal[1, -1] | None = None
    limit_dps: float | None = None


class KvhSettings(GyroSettings):
    """Settings of a KVH gyro, as a bench file gives them."""

    options: LineOptions = Field(default_factory=LineOptions)


def parse_line(text: str, pattern: re.Pattern[str], length: int | None = None) -> Line | None:
    """Return the reading of a line without its line end; None where the text does not fit the format."""
    if length is not None and len(text) != length:
        return None
    match = pattern.fullmatch(text)
    if match is None:
        return None
    fields = match.groupdict()
    temperature = fields.get("temperature")
    return Line(
        round(float(fields["rate"]) / DPS_PER_COUNT),
        fields.get("flag", "1") != "0",
        None if temperature is None else round(float(temperature) / C_PER_COUNT),
    )
