"""The sine generator of a servo controller: a rate whose size and frequency change towards what is demanded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Parts of a period over which the rate is taken for a parabola.
PARTS = 64
#: So much is computed ahead at once, s.
AHEAD_S = 30.0


@dataclass(frozen=True)
class Sine:
    """A sine of the rate from a moment on, and what it changes to."""

    start_s: float
    phase_rad: float  #: at the start
    size_dps: float  #: at the start, and so below
    hz: float
    to_dps: float
    to_hz: float
    slew_dps2: float
    decades_per_s: float

    def sizes_dps(self, t_s: Array) -> Array:
        """Return the peak of the rate at times (n,) from the start on."""
        way = self.to_dps - self.size_dps
        return np.asarray(self.size_dps + np.sign(way) * np.minimum(self.slew_dps2 * (t_s - self.start_s), abs(way)))

    def rates_dps(self, t_s: Array) -> Array:
        """Return the rate at times (n,) from the start on."""
        return np.asarray(self.sizes_dps(t_s) * np.sin(self.phases_rad(t_s)))

    def phases_rad(self, t_s: Array) -> Array:
        """Return the phase at times (n,) from the start on."""
        since, decades = t_s - self.start_s, math.log10(self.to_hz / self.hz)
        changes_s = abs(decades) / self.decades_per_s if decades else 0.0
        early = np.minimum(since, changes_s)
        slope = math.copysign(self.decades_per_s, decades) * math.log(10.0)
        cycles = self.hz * (np.exp(slope * early) - 1.0) / slope if decades else 0.0
        return np.asarray(self.phase_rad + 2 * math.pi * (cycles + self.to_hz * (since - early)))

    def frequency_hz(self, t_s: float) -> float:
        """Return the frequency at one time from the start on, Hz."""
        decades = math.log10(self.to_hz / self.hz)
        done = min(self.decades_per_s * (t_s - self.start_s), abs(decades))
        return float(self.hz * 10 ** math.copysign(done, decades))

    def changed(self, t_s: float, to_dps: float, to_hz: float, slew_dps2: float, decades_per_s: float) -> Sine:
        """Return the sine from a time on, with another demand: without a jump of size, frequency or phase."""
        now = np.array([t_s])
        phase, size = float(self.phases_rad(now)[0]), float(self.sizes_dps(now)[0])
        return Sine(t_s, phase, size, self.frequency_hz(t_s), to_dps, to_hz, slew_dps2, decades_per_s)


class SineMotion:
    """The angle of a table that follows a sine from its start on."""

    def __init__(self, sine: Sine, angle_deg: float) -> None:
        self.sine = sine
        self._step_s = 1.0 / (PARTS * max(sine.hz, sine.to_hz))
        self._angles = np.array([angle_deg])

    def angle_deg(self, t_s: Array) -> Array:
        """Return the angle, (n,) degrees, at times from the start on."""
        if not len(t_s):
            return np.zeros(0)
        since = np.maximum((t_s - self.sine.start_s) / self._step_s, 0.0)
        self._reach(int(since.max()) + 1)
        k = since.astype(np.int64)
        begin_s = np.asarray(self.sine.start_s + self._step_s * k, dtype=np.float64)
        return np.asarray(
            self._angles[k] + self._turned(begin_s, np.asarray(self._step_s * (since - k), dtype=np.float64))
        )

    def _reach(self, parts: int) -> None:
        """Compute at least so many parts."""
        have = len(self._angles) - 1
        if parts <= have:
            return
        more = max(parts - have, int(AHEAD_S / self._step_s))
        begin_s = np.asarray(self.sine.start_s + self._step_s * np.arange(have, have + more), dtype=np.float64)
        increments = self._turned(begin_s, np.full(more, self._step_s))
        self._angles = np.concatenate([self._angles, self._angles[-1] + np.cumsum(increments)])

    def _turned(self, begin_s: Array, length_s: Array) -> Array:
        """Return the integrals of the rate by Simpson's rule, (n,) degrees."""
        rates = [self.sine.rates_dps(begin_s + share * length_s) for share in (0.0, 0.5, 1.0)]
        return np.asarray(length_s / 6 * (rates[0] + 4 * rates[1] + rates[2]))
