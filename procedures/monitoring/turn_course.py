"""The output of one unit over a rest or a turn, by its nominal scale factor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from instruments.interfaces.gyro import Channel, Readings

Array = NDArray[np.float64]

#: Units of an output that are rates already: what one deg/s is in them.
RATE_UNITS = {"deg/s": 1.0, "rad/s": math.pi / 180.0, "deg/h": 3600.0}
PREFIX = "gyro_"


@dataclass(frozen=True)
class Nominal:
    """What one channel of a unit means by its data sheet: rate_dps = (value - offset) / scale."""

    channel: Channel
    offset: float
    scale: float
    is_scaled: bool = True  #: whether its scale factor is stated, or its unit is one of rates

    def rate_dps(self, raw: NDArray[np.int64]) -> Array:
        """Return rates (n,) of raw integers (n,)."""
        return (self.channel.value(raw) - self.offset) / self.scale


def nominal_outputs(
    channels: tuple[Channel, ...], output: Mapping[str, Mapping[str, float | str]]
) -> dict[str, Nominal]:
    """Return axis -> nominal law of each gyro channel, by the unit's own statement where it makes one."""
    by_axis = {}
    for channel in channels:
        if not channel.name.startswith(PREFIX):
            continue
        axis = channel.name.removeprefix(PREFIX)
        nominal = output.get(axis, {})
        usual = RATE_UNITS.get(str(nominal.get("unit", channel.unit)), 1.0)
        unit_symbol, scale = str(nominal.get("unit", channel.unit)), float(nominal.get("scale", usual))
        by_axis[axis] = Nominal(
            channel, float(nominal.get("offset", 0.0)), scale, unit_symbol in RATE_UNITS or "scale" in nominal
        )
    return by_axis


@dataclass
class Course:
    """The readings of one unit over a rest or a turn, as they come in."""

    outputs: Mapping[str, Nominal]
    sample_rate_hz: float
    damaged: int = 0  #: lost, or not of the protocol
    invalid: int = 0  #: marked bad by the instrument
    _times: list[Array] = field(default_factory=list)
    _rates: dict[str, list[Array]] = field(default_factory=dict)
    _largest_dps: float = 0.0

    def add(self, readings: Readings) -> None:
        """Take one block in."""
        self.damaged += readings.lost + readings.damaged
        self.invalid += len(readings) - int(readings.valid.sum())
        if not len(readings):
            return
        self._times.append(readings.t_s[readings.valid])
        for axis, output in self.outputs.items():
            rates = output.rate_dps(readings.raw[output.channel.name])
            self._largest_dps = max(self._largest_dps, float(np.abs(rates).max()))  # a clipped one may be marked bad
            self._rates.setdefault(axis, []).append(rates[readings.valid])

    def __len__(self) -> int:
        return sum(len(part) for part in self._times)

    @property
    def t_s(self) -> Array:
        """Times (n,) of the valid readings, s."""
        return np.concatenate(self._times) if self._times else np.zeros(0)

    def rate_dps(self, axis: str) -> Array:
        """Return the valid readings of an axis, (n,) deg/s."""
        parts = self._rates.get(axis)
        return np.concatenate(parts) if parts else np.zeros(0)

    @property
    def largest_dps(self) -> float:
        """Largest reading of any axis, without its sign."""
        return self._largest_dps

    @property
    def duration_s(self) -> float:
        """Time from the first valid reading to the last."""
        t_s = self.t_s
        return float(t_s[-1] - t_s[0]) if len(t_s) else 0.0

    def mean_dps(self, axis: str) -> float:
        """Return the mean of an axis; 0 without readings."""
        rates = self.rate_dps(axis)
        return float(rates.mean()) if len(rates) else 0.0

    def angle_deg(self, axis: str, bias_dps: float) -> float:
        """Return the integral of an axis less its bias, by trapezoids, deg."""
        return float(np.trapezoid(self.rate_dps(axis) - bias_dps, self.t_s)) if len(self) else 0.0

    @property
    def lost(self) -> float:
        """Readings that are lost or bad, as a share of all that should have come."""
        expected = max(self.duration_s * self.sample_rate_hz, len(self) + self.damaged + self.invalid, 1.0)
        return (self.damaged + self.invalid) / expected
