"""Period of a stream's readings: the slope of a least-squares line through the moments at which readings arrived.

A manual allows a device some per cent (DSP-3000: 2 to 3 %), and a campaign needs its period to parts per million. Every
arrival is a point (number of the reading, clock time). Bytes are late at times, never early: first the line under the
arrivals tells which of them were on time (`arrival_envelope`), and only these are used. Where the count was broken a
new stretch begins: stretches share their slope, not their offset. Older points fade, because the clock of a device
drifts with its temperature.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from instruments.transport.arrival_envelope import line_under

#: Largest share by which the rate of a device may differ from the one in the bench file, where its driver states none,
#: and where a quartz crystal drives the device: many times what one is off, so that it is another rate.
TOLERANCE, OF_A_CRYSTAL = 0.04, 0.005
#: Before anything was measured the period may be off by this share: a wrong bench file is distinguished from losses.
UNKNOWN = 0.5
#: A period that is known to this share, from so many points, is measured.
MEASURED, ENOUGH_POINTS = 0.005, 8
#: A line through fewer points than this is not followed: two points always lie on one.
MIN_POINTS = 3
#: The line under the arrivals is sought in at most so many, the least late ones of so many seconds each.
MAX_POINTS, SPACING_S = 32, 0.25
#: A rate beyond the tolerance is believed where at least this share of the arrivals was on time by it.
ON_TIME_SHARE = 0.5
#: Points fade with this time constant, s.
MEMORY_S = 600.0
#: An arrival is never taken to be known better than this, s.
MIN_WIDTH_S = 1e-5
#: A point this much further from a known line than its width still counts as on time, s: a clock that drifts by 50 ppm
#: in an hour, as in a chamber, is as far from a line of MEMORY_S.
DRIFT_S = 0.005
#: Standard uncertainties within which the period is taken to be.
COVERAGE = 4.0


@dataclass
class Sums:
    """Weighted sums of points about their own mean; z is the arrival less the nominal time of the reading, s."""

    points: float = 0.0  #: number of them, faded
    weight: float = 0.0
    mean_x: float = 0.0
    mean_z: float = 0.0
    sxx: float = 0.0
    sxz: float = 0.0

    def add(self, x: float, z: float, weight: float) -> None:
        """Take in one point."""
        self.points += 1.0
        self.weight += weight
        dx, dz = x - self.mean_x, z - self.mean_z
        self.mean_x += dx * weight / self.weight
        self.mean_z += dz * weight / self.weight
        self.sxx += weight * dx * (x - self.mean_x)
        self.sxz += weight * dx * (z - self.mean_z)

    def merge(self, stretch: Sums) -> None:
        """Take in the points of a stretch, about its own mean."""
        self.points += stretch.points
        self.sxx += stretch.sxx
        self.sxz += stretch.sxz

    def fade(self, share: float) -> None:
        """Keep a share of the weight of every point."""
        self.points *= share
        self.weight *= share
        self.sxx *= share
        self.sxz *= share


class PeriodLine:
    """Estimate of one period, s. The nominal period stands until the arrivals exclude it."""

    def __init__(self, nominal_s: float, tolerance: float = TOLERANCE) -> None:
        self.nominal_s = nominal_s
        self.tolerance = tolerance
        self.period_s = nominal_s  #: of the device, as far as it is known; within the tolerance unless that is excluded
        self.is_followed = False  #: whether the arrivals have excluded the nominal period
        self._before = Sums()  #: of all earlier stretches
        self._present = Sums()  #: of the present one: of its points that were on time
        self._recent: list[tuple[float, float, float]] = []  #: number, z and width, of the present stretch, until known
        self._group_x = 0.0  #: the first number of those that the last of them stands for
        self._late = 0  #: points in a row that were late
        self._last_s = 0.0

    @property
    def u_share(self) -> float:
        """Expanded uncertainty of the period as a share of it: at most UNKNOWN, before anything is known."""
        return self._u_share if self.is_outside_tolerance or not self._is_beyond else UNKNOWN

    @property
    def _u_share(self) -> float:
        if self._sxx <= 0.0:
            return UNKNOWN
        return min(COVERAGE / math.sqrt(12.0 * self._sxx) / self.nominal_s, UNKNOWN)

    @property
    def is_known(self) -> bool:
        """Whether the slope of the line is known to MEASURED from ENOUGH_POINTS that were on time."""
        return self._points >= ENOUGH_POINTS and self._u_share < MEASURED

    @property
    def measured_s(self) -> float | None:
        """Slope of the line, s; None where it is not known."""
        return self.nominal_s + self._shift_s if self.is_known else None

    @property
    def is_outside_tolerance(self) -> bool:
        """Whether the arrivals exclude every rate within the tolerance of the nominal one."""
        on_time = not self._recent or self._present.points >= ON_TIME_SHARE * len(self._recent)
        return self.is_known and on_time and self._is_beyond

    def restart(self) -> None:
        """Begin a new stretch: the number of the next reading is not known."""
        if self._present.points >= MIN_POINTS and (self.is_known or not self._is_beyond):
            self._before.merge(self._present)
        self._forget_stretch()

    def add(self, number: int, t_s: float, width_s: float) -> None:
        """Take in that reading `number` arrived by clock time `t_s`: within `width_s` seconds, unless it was late."""
        width_s = max(width_s, MIN_WIDTH_S)
        self._fade(t_s)
        x, z = float(number), t_s - number * self.nominal_s
        if self.is_known and not self._recent:
            self._follow(x, z, width_s)
        else:
            self._seek(x, z, width_s)
        self._choose()

    def _follow(self, x: float, z: float, width_s: float) -> None:
        """Add one point to a known line if it was on time."""
        stretch = self._present
        off_s = self._off_s(x, z, width_s)
        slack_s = width_s + DRIFT_S + self._u_share * abs(x - stretch.mean_x) * self.nominal_s
        if not stretch.points or abs(off_s) <= slack_s:
            self._late = 0
        elif off_s > 0.0:
            self._late += 1
            if self._late < ENOUGH_POINTS:
                return
            self.restart()  # it did not catch up: this is where the stream now is
        elif stretch.points >= ENOUGH_POINTS:
            self.restart()
        else:
            self._forget_stretch()  # its points were late
        self._present.add(x, z - 0.5 * width_s, width_s**-2)

    def _off_s(self, x: float, z: float, width_s: float) -> float:
        """Return by how much a point is above the present stretch, s."""
        return z - 0.5 * width_s - self._present.mean_z - self._shift_s * (x - self._present.mean_x)

    def _seek(self, x: float, z: float, width_s: float) -> None:
        """Take the points that the line under the present stretch shows to have been on time."""
        if not self._recent and self._present.points:  # known before, and faded
            self._before.merge(self._present)
        if self._recent and (x - self._group_x) * self.nominal_s < SPACING_S:
            if z - 0.5 * width_s < self._recent[-1][1] - 0.5 * self._recent[-1][2]:
                self._recent[-1] = (x, z, width_s)
        else:
            self._group_x = x
            self._recent = [*self._recent[1 - MAX_POINTS :], (x, z, width_s)]
        offset, slope = line_under([point[0] for point in self._recent], [point[1] for point in self._recent])
        self._present = Sums()
        for x_k, z_k, width_k in self._recent:
            if z_k - offset - slope * x_k <= width_k:
                self._present.add(x_k, z_k - 0.5 * width_k, width_k**-2)
        if self.is_known and (self.is_outside_tolerance or not self._is_beyond):
            self._recent = []

    def _forget_stretch(self) -> None:
        self._present, self._recent, self._late = Sums(), [], 0

    @property
    def _points(self) -> float:
        return self._before.points + self._present.points

    @property
    def _sxx(self) -> float:
        return self._before.sxx + self._present.sxx

    @property
    def _shift_s(self) -> float:
        sxx = self._sxx
        return (self._before.sxz + self._present.sxz) / sxx if sxx > 0.0 else 0.0

    @property
    def _bound_s(self) -> float:
        """Largest error that the widths of the points can give the slope in the worst case (Cauchy, Schwarz)."""
        return 0.5 * math.sqrt(self._points / self._sxx)

    @property
    def _is_beyond(self) -> bool:
        """Whether the slope of the line, which late bytes may have bent, excludes the rates within the tolerance."""
        if self._sxx <= 0.0:
            return False
        period_s = max(self.nominal_s + self._shift_s, 1e-9)
        return abs(self.nominal_s / period_s - 1.0) > self.tolerance + self._bound_s / period_s

    def _fade(self, t_s: float) -> None:
        share = math.exp(min(self._last_s - t_s, 0.0) / MEMORY_S)
        self._before.fade(share)
        self._present.fade(share)
        self._last_s = t_s

    def _choose(self) -> None:
        """Choose the period in use."""
        if self._points < MIN_POINTS or self._sxx <= 0.0:
            return
        if self.is_outside_tolerance:
            least_s, most_s = (1 - UNKNOWN) * self.nominal_s, (1 + UNKNOWN) * self.nominal_s
        else:
            least_s, most_s = self.nominal_s / (1 + self.tolerance), self.nominal_s / (1 - self.tolerance)
        if self._is_beyond and not self.is_outside_tolerance:
            return  # bytes that came late bend the line
        if self.is_followed or abs(self._shift_s) > self._bound_s:
            self.is_followed = True
            self.period_s = min(max(self.nominal_s + self._shift_s, least_s), most_s)
