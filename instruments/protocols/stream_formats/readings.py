"""What the bytes of a stream hold, as whole numbers, and how these become the channels of a recording."""

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
#: A number that does not fit into this many steps is no reading.
MAX_STEPS = 2.0**62


class Scale(NamedTuple):
    """Value in `unit` = offset + scale * whole number."""

    unit: str
    scale: float
    offset: float


class StampTicks(NamedTuple):
    """Time stamps as whole numbers: one is `tick_s` s, and they begin again at 0 after `wrap` - 1 (None: never)."""

    field: str
    tick_s: float
    wrap: int | None


class PulseTicks(NamedTuple):
    """Where a format tells of pulses: time since the last as whole numbers of `tick_s` s, or a number (`tick_s` 0)."""

    field: str
    tick_s: float
    interval_s: float


@dataclass(frozen=True)
class Decoded:
    """Messages of a stream, n readings: field name -> (n,) whole numbers; which are valid (n,); damaged messages.

    `behind` (n,) is how many bytes arrived after each message.
    """

    values: Mapping[str, Whole]
    valid: NDArray[np.bool_]
    behind: Whole
    damaged: int = 0
    missed: int | None = None  #: readings that did not come whole; None: one for each damaged message

    def __len__(self) -> int:
        return len(self.valid)


class Decoder(Protocol):
    """Takes the bytes of a stream as they come."""

    def drop(self) -> None:
        """Drop the unfinished message: what comes next may begin anywhere in one."""
        ...

    def feed(self, data: bytes) -> Decoded:
        """Return every message that is whole now."""
        ...


def step_of(field: StreamField) -> float:
    """Return what one whole number of a field is, in its unit before `scale`."""
    if isinstance(field, BytesField):
        return (field.resolution or BINARY_STEP) if field.is_float else 1.0
    return field.resolution or DECIMAL_STEP


def scale_of(field: StreamField, rate_hz: float) -> Scale:
    """Return how the whole numbers of a field with a unit become values of its channel; `rate_hz` of the readings."""
    conversion = UNITS[field.unit or ""]
    per_s = rate_hz if conversion.is_per_sample else 1.0
    return Scale(conversion.unit, step_of(field) * field.scale * conversion.factor * per_s, conversion.offset)


def stamp_ticks(format_: StreamFormat) -> StampTicks | None:
    """Return what the whole numbers of a format's time stamps are; None for a format without time stamps."""
    if (stamp := format_.time) is None:
        return None
    step = next(step_of(field) for field in format_.fields if field.name == stamp.field)
    return StampTicks(stamp.field, stamp.tick_s * step, None if stamp.wrap is None else round(stamp.wrap / step))


def pulse_ticks(format_: StreamFormat) -> PulseTicks | None:
    """Return what the whole numbers of a format tell of pulses; None for a format without."""
    if (given := format_.pulses) is None:
        return None
    step = next(step_of(field) for field in format_.fields if field.name == given.field)
    return PulseTicks(given.field, (given.tick_s or 0.0) * step, given.interval_s)


def whole_numbers(values: NDArray[np.float64], step: float) -> tuple[Whole, NDArray[np.bool_]]:
    """Return numbers (n,) in whole steps, and which of them are numbers that fit."""
    steps = values / step
    good = np.abs(steps) < MAX_STEPS  # not for one that is no number
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
