"""Interface of gyros: readings exactly as the device sent them, with its own validity flags."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
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
    #: (n,) time by the device's own clock, from its counter or time stamp, in its seconds from its own zero; None: the
    #: device has none. A gyro gives it for all of its readings or for none, and so `arrival_s`.
    device_s: NDArray[np.float64] | None = None
    arrival_s: NDArray[np.float64] | None = None  #: (n,) clock time at which the last byte of each had arrived

    def __len__(self) -> int:
        return len(self.t_s)

    def newest(self) -> Readings:
        """Return the last reading alone, n = 1, without the counts of lost and damaged ones."""
        return replace(self.only(slice(-1, None)), lost=0, damaged=0)

    def only(self, which: slice | NDArray[np.bool_]) -> Readings:
        """Return some of the readings, by a slice or a mask (n,), with the counts of lost and damaged ones."""
        return replace(
            self,
            t_s=self.t_s[which],
            raw={name: values[which] for name, values in self.raw.items()},
            valid=self.valid[which],
            device_s=None if self.device_s is None else self.device_s[which],
            arrival_s=None if self.arrival_s is None else self.arrival_s[which],
        )

    def after(self, before: Readings) -> Readings:
        """Return these readings after those that came before them, with the counts of both."""
        time_pairs = (self.device_s, self.arrival_s), (before.device_s, before.arrival_s)
        device_s, arrival_s = (
            None if late is None or early is None else np.concatenate([early, late])
            for late, early in zip(*time_pairs, strict=True)
        )
        return Readings(
            np.concatenate([before.t_s, self.t_s]),
            {name: np.concatenate([before.raw[name], values]) for name, values in self.raw.items()},
            np.concatenate([before.valid, self.valid]),
            before.lost + self.lost, before.damaged + self.damaged, device_s, arrival_s,
        )  # fmt: skip


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
        """Open the stream and drop stale or partial data."""
        ...

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` clock seconds; blocks that long. May hold fewer, even none."""
        ...

    def read_latest(self) -> Readings:
        """Get one fresh reading (n = 1) and drop everything older; raises NoReply when none comes in time."""
        ...

    def stop(self) -> None:
        """Stop and close the stream. Safe to call at any time, also twice."""
        ...
