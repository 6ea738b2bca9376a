"""Interface of gyros: readings exactly as the device sent them, with its own validity flags."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Channel:
    """One quantity of a device: value in `unit` = offset + scale * raw integer."""

    name: str  #: the recording's column: gyro_x, temperature_x_c, supply_v, accel_x_g ...
    unit: str
    scale: float
    offset: float = 0.0

    def value(self, raw: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the values, (n,) in `unit`, of raw integers (n,)."""
        return self.offset + self.scale * raw.astype(np.float64)


@dataclass(frozen=True)
class Readings:
    """Consecutive readings, n rows. `raw` holds the integers that the device sent, never scaled floats."""

    t_s: NDArray[np.float64]  #: (n,) clock time of each reading
    raw: Mapping[str, NDArray[np.int64]]  #: channel name -> (n,)
    valid: NDArray[np.bool_]  #: (n,) False where the instrument marked the reading as bad
    lost: int = 0  #: readings missing by the counter of the device or by the clock
    damaged: int = 0  #: frames or lines that arrived malformed (CRC, framing)

    def __len__(self) -> int:
        return len(self.t_s)

    def newest(self) -> Readings:
        """Return the last reading alone, n = 1, without the counts of lost and damaged ones."""
        return Readings(self.t_s[-1:], {name: values[-1:] for name, values in self.raw.items()}, self.valid[-1:])


@dataclass(frozen=True)
class GyroLimits:
    """Limits of exposure of the unit under calibration, from its bench file or data sheet."""

    max_rate_dps: float
    min_c: float
    max_c: float


@dataclass(frozen=True)
class GyroIdentity:
    """Identity of the unit: from the device where the protocol has it, else from the bench file."""

    serial: str
    model: str
    technology: str = ""  #: "fog", "mems", "piezo" or "" for unknown
    datasheet: Mapping[str, float] = field(default_factory=dict)
    output: Mapping[str, Mapping[str, float | str]] = field(default_factory=dict)  #: axis -> unit, offset, scale
    #: What the device and its adapter say of themselves: serial, firmware, adapter ...; empty where they say nothing.
    reported: Mapping[str, str] = field(default_factory=dict)


class Gyro(Protocol):
    """One unit under calibration. Every failure is an InstrumentError."""

    name: str
    axes: tuple[str, ...]
    sample_rate_hz: float
    limits: GyroLimits

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Get the channels of a reading."""
        ...

    def identify(self) -> GyroIdentity:
        """Get the unit's identity; raises WrongInstrument when the device reports another one."""
        ...

    def start(self) -> None:
        """Control the stream: open it and drop stale or partial data."""
        ...

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` clock seconds; blocks that long. May hold fewer, even none."""
        ...

    def read_latest(self) -> Readings:
        """Get one fresh reading (n = 1) and drop everything older; raises NoReply when none comes in time."""
        ...

    def stop(self) -> None:
        """Control the stream: stop and close it. Safe to call at any time, also twice."""
        ...
