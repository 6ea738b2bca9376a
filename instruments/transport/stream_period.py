"""Period of a stream's readings: the slope of a least-squares line through the moments at which readings arrived.

A manual allows a device some per cent (DSP-3000: 2 to 3 %), and a campaign needs its period to parts per million. Every
arrival is a point (number of the reading, clock time). Where the count was broken a new stretch begins: stretches share
their slope, not their offset. Older points fade, because the clock of a device drifts with its temperature.
"""

from __future__ import annotations

import math

#: Largest share by which the rate of a device may differ from the one in the bench file, where its driver states none,
#: and where a quartz crystal drives the device: many times what one is off, so that it is another rate.
TOLERANCE, OF_A_CRYSTAL = 0.04, 0.005
#: Before anything was measured the period may be off by this share: a wrong bench file is distinguished from losses.
UNKNOWN = 0.5
#: A period that is known to this share, from so many points, is measured.
MEASURED, ENOUGH_POINTS = 0.005, 8
#: Points fade with this time constant, s.
MEMORY_S = 600.0
#: An arrival is never taken to be known better than this, s.
LEAST_WIDTH_S = 1e-5
#: Standard uncertainties within which the period is taken to be.
COVERAGE = 4.0
#: A point further from the line than this, in periods, belongs to another stretch.
OFF_LINE = 2.0


class PeriodLine:
    """Estimate of one period, s. The nominal period stands until the arrivals exclude it."""

    def __init__(self, nominal_s: float, tolerance: float = TOLERANCE) -> None:
        self.nominal_s = nominal_s
        self.tolerance = tolerance
        self._weight = self._mean_x = self._mean_z = 0.0  # of the present stretch
        self._last_s = 0.0
        self._forget()

    def _forget(self) -> None:
        """Know nothing of the period."""
        self.period_s = self.nominal_s  #: of the device, as far as it is known
        self.is_followed = False  #: whether the arrivals have excluded the nominal period
        self._points = 0.0  # number of points, faded
        # sums of all stretches about their own means; z is the arrival less the nominal time of the reading
        self._sxx = self._sxz = 0.0

    @property
    def u_share(self) -> float:
        """Expanded uncertainty of the period as a share of it: at most UNKNOWN, before anything is known."""
        if self._sxx <= 0.0:
            return UNKNOWN
        return min(COVERAGE / math.sqrt(12.0 * self._sxx) / self.nominal_s, UNKNOWN)

    @property
    def measured_s(self) -> float | None:
        """Slope of the line, s; None where it is not known to MEASURED from ENOUGH_POINTS."""
        known = self._points >= ENOUGH_POINTS and self.u_share < MEASURED
        return self.nominal_s + self._shift_s if known else None

    @property
    def is_outside_tolerance(self) -> bool:
        """Whether the arrivals exclude every rate within the tolerance of the nominal one."""
        if (period_s := self.measured_s) is None:
            return False
        return abs(self.nominal_s / period_s - 1.0) > self.tolerance + self._bound_s / period_s

    def restart(self) -> None:
        """Begin a new stretch: the number of the next reading is not known."""
        self._weight = 0.0

    def add(self, number: int, t_s: float, width_s: float) -> None:
        """Take in that reading `number` arrived within the `width_s` seconds before clock time `t_s`."""
        width_s = max(width_s, LEAST_WIDTH_S)
        weight = width_s**-2
        x = float(number)
        z = t_s - 0.5 * width_s - x * self.nominal_s
        if self._weight and self._is_off(x, z, width_s):
            self.restart()
            if self._points < ENOUGH_POINTS:  # readings may have been lost before: the line is not to be trusted
                self._forget()
        self._fade(t_s)
        self._points += 1.0
        if not self._weight:
            self._weight, self._mean_x, self._mean_z = weight, x, z
            return
        self._weight += weight
        dx, dz = x - self._mean_x, z - self._mean_z
        self._mean_x += dx * weight / self._weight
        self._mean_z += dz * weight / self._weight
        self._sxx += weight * dx * (x - self._mean_x)
        self._sxz += weight * dx * (z - self._mean_z)
        self._choose()

    @property
    def _shift_s(self) -> float:
        return self._sxz / self._sxx if self._sxx > 0.0 else 0.0

    @property
    def _bound_s(self) -> float:
        """Largest error that the widths of the points can give the slope in the worst case (Cauchy, Schwarz)."""
        return 0.5 * math.sqrt(self._points / self._sxx)

    def _is_off(self, x: float, z: float, width_s: float) -> bool:
        dx = x - self._mean_x
        off_s = abs(z - self._mean_z - self._shift_s * dx)
        return off_s > (OFF_LINE + self.u_share * abs(dx)) * self.nominal_s + width_s

    def _fade(self, t_s: float) -> None:
        share = math.exp(min(self._last_s - t_s, 0.0) / MEMORY_S)
        self._points *= share
        self._weight *= share
        self._sxx *= share
        self._sxz *= share
        self._last_s = t_s

    def _choose(self) -> None:
        if self._sxx <= 0.0 or not (self.is_followed or abs(self._shift_s) > self._bound_s):
            return
        self.is_followed = True
        limit_s = UNKNOWN * self.nominal_s
        self.period_s = self.nominal_s + min(max(self._shift_s, -limit_s), limit_s)
