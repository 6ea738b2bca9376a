"""Rates that change from reading to reading, and their response through a delay and a finite bandwidth.

The response is linear, so it is applied as a factor on the spectrum of each even stretch of readings: exact at every
delay and time constant for rates that are sampled fast enough, derivatives along both included. The result is averaged
over the windows of the output, so that averaging attenuates both sides of the comparison equally.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.response import Response
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Columns, dataset_starts
from labctl.recording.motions.windows import kept_windows, stretch_starts, window_labels

#: Length of the memory of a response, in sample intervals of the readings; in time constants: `MEMORY_TAUS`.
MEMORY_STEPS = 256
#: Extrapolation beyond the ends of a stretch: decay of the slope, and span from which the slope is taken, in samples.
BEND_STEPS, SLOPE_STEPS = 64, 8
#: Largest deviation from an even spacing, as a share of it; above it readings are resampled to one, and back.
EVEN_SHARE = 1e-3
#: Means over windows that are kept for another time: 0.2 MB each.
MAX_CACHED = 128
#: A factor on a spectrum: angular frequencies (k,) rad/s to complex numbers (k,).
Factor = Callable[[Array], NDArray[np.complex128]]


@dataclass(frozen=True, eq=False)
class _Motion:
    """The rates of all readings (n,) deg/s, in even stretches, and the first reading of each window (m,)."""

    t_s: Array
    rate_dps: Array
    stretches: NDArray[np.int64]
    windows: NDArray[np.int64]
    known: dict[tuple[str, Response], Array] = field(default_factory=dict, repr=False)

    def means(self, name: str, response: Response, factor: Factor) -> Array:
        """Return the means over all windows, (m,), of the rates filtered by a factor; cached by name and response.

        Only the last ones are kept: a fit evaluates the same responses for every axis and every fold.
        """
        key = (name, response)
        if key not in self.known:
            ends = np.append(self.stretches[1:], len(self.t_s))
            values = np.concatenate([
                _filtered(self.t_s[begin:end], self.rate_dps[begin:end], factor, response.memory_s)
                for begin, end in zip(self.stretches, ends, strict=True)
            ])  # fmt: skip
            counts = np.diff(np.append(self.windows, len(values)))
            if len(self.known) >= MAX_CACHED:
                self.known.pop(next(iter(self.known)))
            self.known[key] = np.add.reduceat(values, self.windows) / counts
        return self.known[key]


@dataclass(frozen=True, eq=False)
class RateProfile:
    """The rate of the table over some windows of a recording, filtered by any response; holds all readings."""

    motion: _Motion
    rows: NDArray[np.int64]  #: (n,) indices of the windows

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> RateProfile:
        """Return the profile of some of these windows, by index or mask."""
        return replace(self, rows=self.rows[rows])

    def seen_dps(self, response: Response) -> Array:
        """Return the mean over each window, (n,) deg/s, of the rate filtered by a response."""
        return self.motion.means("", response, response.gain)[self.rows]

    def slope(self, name: str, response: Response) -> Array:
        """Return the derivative of `seen_dps` by `DELAY` or `TIME_CONSTANT`, (n,) deg/s^2."""
        return self.motion.means(name, response, lambda rad_s: response.slope(name, rad_s))[self.rows]


def profiles_in_turn(first: RateProfile, second: RateProfile, later_s: float) -> RateProfile:
    """Return two profiles as one, the times of the second moved by `later_s`: the rows of the first, then its rows."""
    one, two = first.motion, second.motion
    motion = _Motion(
        np.concatenate([one.t_s, two.t_s + later_s]),
        np.concatenate([one.rate_dps, two.rate_dps]),
        np.concatenate([one.stretches, two.stretches + len(one.t_s)]),
        np.concatenate([one.windows, two.windows + len(one.t_s)]),
    )
    return RateProfile(motion, np.concatenate([first.rows, second.rows + len(one.windows)]))


def rate_profile(columns: Columns, *, windows: bool) -> RateProfile:
    """Return the rates of valid readings, (n,) each of `t_s`, `dataset` and `table_rate_dps`.

    Rows are the windows that `to_points` keeps; without `windows` each reading is one.
    """
    labels = window_labels(columns) if windows else np.arange(len(columns["t_s"]))
    starts = dataset_starts(labels)
    motion = _Motion(
        np.asarray(columns["t_s"], dtype=np.float64),
        np.asarray(columns["table_rate_dps"], dtype=np.float64),
        stretch_starts(columns),
        starts,
    )
    return RateProfile(motion, kept_windows(columns, labels) if windows else np.arange(len(starts)))


def _filtered(t_s: Array, rate_dps: Array, factor: Factor, memory_s: float) -> Array:
    """Return rates (n,) with a factor applied to their spectrum; beyond both ends the rates soon become constant."""
    from scipy.fft import next_fast_len
    from scipy.interpolate import CubicSpline

    n = len(rate_dps)
    if n < 2:
        return np.asarray(rate_dps * float(np.real(factor(np.zeros(1))[0])))
    step_s = float(t_s[-1] - t_s[0]) / (n - 1)
    even = t_s[0] + step_s * np.arange(n)
    is_even = bool(np.max(np.abs(t_s - even)) < EVEN_SHARE * step_s)
    values = rate_dps if is_even else CubicSpline(t_s, rate_dps)(even)
    spare = MEMORY_STEPS + int(np.ceil(memory_s / step_s))
    total = int(next_fast_len(n + 3 * spare, real=True))
    back = total - n - 2 * spare  # smooth transition from the last rate to the first: the spectrum is periodic
    bend = 0.5 - 0.5 * np.cos(np.pi * (np.arange(back) + 0.5) / back)
    before, after = _beyond(values[::-1], spare)[::-1], _beyond(values, spare)
    whole = np.concatenate([before, values, after, after[-1] + (before[0] - after[-1]) * bend])
    rad_s: Array = np.asarray(2 * np.pi * np.fft.rfftfreq(total, step_s), dtype=np.float64)
    spectrum: NDArray[np.complex128] = np.asarray(np.fft.rfft(whole), dtype=np.complex128)
    filtered = np.fft.irfft(np.multiply(spectrum, factor(rad_s)), total)[spare : spare + n]
    return np.asarray(filtered if is_even else CubicSpline(even, filtered)(t_s))


def _beyond(values: Array, number: int) -> Array:
    """Return the extrapolation of values (n,), (number,): first with their slope, against ringing, then constant."""
    last = min(SLOPE_STEPS, len(values) - 1)
    slope = float(values[-1] - values[-1 - last]) / last
    return np.asarray(values[-1] - slope * BEND_STEPS * np.expm1(-(np.arange(number) + 1) / BEND_STEPS))
