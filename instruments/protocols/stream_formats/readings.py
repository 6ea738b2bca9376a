"""The fields of a stream as whole numbers, and their conversion to the channels of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from instruments.protocols.stream_formats.document import (
    BINARY_STEP,
    DECIMAL_STEP,
    BytesField,
    StreamField,
    StreamFormat,
)
from instruments.protocols.stream_formats.units import UNITS

Whole = NDArray[np.int64]
#: Largest number of steps of a reading; above it the reading is invalid.
MAX_STEPS = 2.0**62


class Scale(NamedTuple):
    """Value in `unit` = offset + scale * whole number."""

    unit: str
    scale: float
    offset: float


class StampTicks(NamedTuple):
    """Time stamps as whole numbers in units of `tick_s` s; they wrap to 0 after `wrap` - 1 (None: never)."""

    field: str
    tick_s: float
    wrap: int | None


class PulseTicks(NamedTuple):
    """Pulses in a format: time since the last pulse in units of `tick_s` s, or number of the pulse (`tick_s` 0)."""

    field: str
    tick_s: float
    interval_s: float


@dataclass(frozen=True)
class Decoded:
    """Messages of a stream, n readings: field name -> (n,) whole numbers; which are valid (n,); damaged messages.

    `behind` (n,) is the number of bytes that followed each message.
    """

    values: Mapping[str, Whole]
    valid: NDArray[np.bool_]
    behind: Whole
    damaged: int = 0
    missed: int | None = None  #: incomplete readings; None: one for each damaged message

    def __len__(self) -> int:
        return len(self.valid)


class Decoder(Protocol):
    """Takes the bytes of a stream as they come."""

    def drop(self) -> None:
        """Discard the incomplete message: the next bytes may begin inside a message."""
        ...

    def feed(self, data: bytes) -> Decoded:
        """Return the messages that these bytes complete."""
        ...


def step_of(field: StreamField) -> float:
    """Return the resolution of a field, in its unit before `scale`."""
    if isinstance(field, BytesField):
        return (field.resolution or BINARY_STEP) if field.is_float else 1.0
    return field.resolution or DECIMAL_STEP


def scale_of(field: StreamField, rate_hz: float) -> Scale:
    """Return the conversion of the whole numbers of a field to its channel; `rate_hz` is that of the readings."""
    conversion = UNITS[field.unit or ""]
    per_s = rate_hz if conversion.is_per_sample else 1.0
    return Scale(conversion.unit, step_of(field) * field.scale * conversion.factor * per_s, conversion.offset)


def stamp_ticks(format_: StreamFormat) -> StampTicks | None:
    """Return the unit and the range of the time stamps of a format; None for a format without time stamps."""
    if (stamp := format_.time) is None:
        return None
    step = next(step_of(field) for field in format_.fields if field.name == stamp.field)
    return StampTicks(stamp.field, stamp.tick_s * step, None if stamp.wrap is None else round(stamp.wrap / step))


def pulse_ticks(format_: StreamFormat) -> PulseTicks | None:
    """Return the unit of the pulse field of a format; None for a format without one."""
    if (pulses := format_.pulses) is None:
        return None
    step = next(step_of(field) for field in format_.fields if field.name == pulses.field)
    return PulseTicks(pulses.field, (pulses.tick_s or 0.0) * step, pulses.interval_s)


def whole_numbers(values: NDArray[np.float64], step: float) -> tuple[Whole, NDArray[np.bool_]]:
    """Return numbers (n,) in whole steps, and which of them are numbers that fit."""
    steps = values / step
    good = np.abs(steps) < MAX_STEPS  # False for NaN
    return np.rint(np.where(good, steps, 0.0)).astype(np.int64), good


def flags(format_: StreamFormat, values: Mapping[str, Whole], good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which readings (n,) are valid by their status bits and their range, of those that are `good`."""
    valid = good.copy()
    for field in format_.fields:
        raw = values[field.name]
        if field.all_set is not None:
            valid &= (raw & field.all_set) == field.all_set
        if field.none_set is not None:
            valid &= (raw & field.none_set) == 0
        if format_.limit_dps is not None and field.name.startswith("gyro_") and not _is_per_sample(field):
            scale = scale_of(field, 1.0).scale
            valid &= np.abs(raw * scale) <= format_.limit_dps
    return valid


def _is_per_sample(field: StreamField) -> bool:
    return UNITS[field.unit or ""].is_per_sample
