"""Rests: the stretches in which no reading scatters by more than the sensors' own noise.

Tedaldi et al. (2014, section IV.C) compare the variance in a window with that of a first long rest. Here the static
noise is estimated from all windows, so that no initial rest is needed, and the readings of the gyro are used too: a
rotation about the vertical does not change the specific force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.readings import PoseReadings

#: Length of the windows, s, and the least number of readings of one.
WINDOW_S, MIN_IN_WINDOW = 0.5, 8
#: Limit of the standard deviation of each channel in a window at rest, as a multiple of its static noise.
REST_FACTOR = 3.0
#: Largest static noise; a recording above it has no rest.
MAX_NOISE_G, MAX_NOISE_DPS = 0.05, 3.0
#: Quantile of the standard deviations that is the first estimate of the static noise, and largest number of iterations.
QUIET_QUANTILE, MAX_ITERATIONS = 0.1, 6
#: Least degrees of freedom of the noise of a mean over half seconds; with fewer, readings are taken as independent.
MIN_BLOCKS = 20
#: Margin that is cut off both ends of a quiet stretch, as a share of a window: the turn begins there.
MARGIN = 0.5
#: Least duration of a rest without its margins, s.
MIN_REST_S = 0.5
#: Limit of the difference of the gyro means of a rest from their median, deg/s, plus a multiple of their spread.
TURNING_DPS, TURNING_DEVIATIONS = 2.0, 12.0


@dataclass(frozen=True)
class Rests:
    """k rests of a recording."""

    begin: NDArray[np.int64]  #: (k,) first reading
    end: NDArray[np.int64]  #: (k,) reading after the last
    t_s: Array  #: (k,) middle
    duration_s: Array  #: (k,)
    accel_g: NDArray[np.float64]  #: (k, 3) means
    gyro_dps: NDArray[np.float64]  #: (k, 3) means
    noise: Array  #: (6,) static noise of one reading, accelerometer in g and gyro in deg/s
    density: Array  #: (6,) variance of a mean over one second, g^2 s and (deg/s)^2 s

    def __len__(self) -> int:
        return len(self.begin)

    @property
    def n(self) -> NDArray[np.int64]:
        """Readings of each rest, (k,)."""
        return self.end - self.begin

    @property
    def accel_white_var(self) -> NDArray[np.float64]:
        """Variance of each mean of the accelerometer from its noise, (k, 3) g^2."""
        return np.asarray(self.density[:3] / self.duration_s[:, None])

    @property
    def gyro_white_var(self) -> NDArray[np.float64]:
        """Variance of each mean of the gyro from its noise, (k, 3) (deg/s)^2."""
        return np.asarray(self.density[3:] / self.duration_s[:, None])


def find_rests(readings: PoseReadings) -> Rests:
    """Return the rests of a recording. Raises NotEnoughData where nothing rests."""
    size = max(round(WINDOW_S / readings.spacing_s), MIN_IN_WINDOW)
    if len(readings) < 3 * size:
        raise NotEnoughData(
            f"{readings.info.serial}: the recording lasts {readings.t_s[-1] - readings.t_s[0]:.3g} s, too short for "
            "rests and turns between them; record longer"
        )
    channels = np.column_stack([readings.accel_g, readings.gyro_dps])
    spread = _spread(channels, size)
    noise = _static_noise(spread, _steps(channels))
    _require_quiet(readings.info.serial, noise)
    quiet = np.all(spread < REST_FACTOR * noise, axis=1) & ~_broken(readings.breaks, size)
    inside = _union(quiet, size, len(readings))
    begin, end = _stretches(inside & ~readings.breaks, inside)
    margin = round(MARGIN * size)
    begin, end = begin + margin, end - margin
    least = max(round(MIN_REST_S / readings.spacing_s), MIN_IN_WINDOW)
    long = end - begin >= least
    begin, end = begin[long], end[long]
    if len(begin) == 0:
        raise NotEnoughData(
            f"{readings.info.serial}: the recording has no rest of {MIN_REST_S:g} s; lay the unit "
            "down between turns for 2 s or more, in many poses"
        )
    accel, gyro = _means(readings.accel_g, begin, end), _means(readings.gyro_dps, begin, end)
    still = ~_turning(gyro)
    begin, end = begin[still], end[still]
    first, last = readings.t_s[begin], readings.t_s[end - 1]
    density = _density(channels, begin, end, size, readings.spacing_s, noise)
    return Rests(
        begin, end, (first + last) / 2, last - first + readings.spacing_s, accel[still], gyro[still], noise,
        density,
    )  # fmt: skip


def _density(
    channels: NDArray[np.float64], begin: NDArray[np.int64], end: NDArray[np.int64], size: int, spacing_s: float,
    noise: Array,
) -> Array:  # fmt: skip
    """Return the variance of a mean over one second of each channel, (channels,): from means over half a second.

    A filter inside the sensor correlates neighbouring readings, so that the noise of a mean exceeds white / sqrt(n).
    """
    squares, freedom = np.zeros(channels.shape[1]), 0
    for first, last in zip(begin, end, strict=True):
        blocks = (last - first) // size
        if blocks < 2:
            continue
        means = channels[first : first + blocks * size].reshape(blocks, size, -1).mean(axis=1)
        squares += np.sum((means - means.mean(axis=0)) ** 2, axis=0)
        freedom += blocks - 1
    white = noise**2 * spacing_s
    if freedom < MIN_BLOCKS:
        return np.asarray(white)
    # rounding may make the means agree better than the noise of the readings allows
    return np.asarray(np.maximum(squares / freedom * size * spacing_s, white / 4))


def rest_of_each(rests: Rests, n: int, spacing_s: float) -> NDArray[np.int64]:
    """Return the number of the rest that each of n readings is in, from 1; 0 between rests.

    The ends that `find_rests` has cut off count: the unit is still in its place there.
    """
    margin = round(MARGIN * max(round(WINDOW_S / spacing_s), MIN_IN_WINDOW))
    number = np.zeros(n, dtype=np.int64)
    for place, (begin, end) in enumerate(zip(rests.begin, rests.end, strict=True), start=1):
        number[max(begin - margin, 0) : end + margin] = place
    return number


def density_in_rests(channels: NDArray[np.float64], rests: Rests, spacing_s: float) -> Array:
    """Return the variance of a mean over one second of other channels (n, c) in the same rests, (c,)."""
    size = max(round(WINDOW_S / spacing_s), MIN_IN_WINDOW)
    variances = [channels[a:b].var(axis=0, ddof=1) for a, b in zip(rests.begin, rests.end, strict=True)]
    return _density(channels, rests.begin, rests.end, size, spacing_s, np.sqrt(np.median(variances, axis=0)))


def _require_quiet(serial: str, noise: Array) -> None:
    """Raise NotEnoughData where the static noise is larger than that of any sensor at rest."""
    accel, gyro = float(noise[:3].max()), float(noise[3:].max())
    if accel > MAX_NOISE_G or gyro > MAX_NOISE_DPS:
        raise NotEnoughData(
            f"{serial}: the unit is never at rest in this recording: its quietest half seconds scatter by "
            f"{accel:.2g} g and {gyro:.2g} deg/s (limit for rest: {MAX_NOISE_G:g} g and {MAX_NOISE_DPS:g} deg/s); "
            "lay the unit down "
            "between turns for 2 s or more, in many poses"
        )


def _spread(channels: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """Return the standard deviation in every window of `size` readings, (n - size + 1, channels)."""
    centred = channels - np.median(channels, axis=0)
    sums = np.concatenate([np.zeros((1, channels.shape[1])), np.cumsum(centred, axis=0)])
    squares = np.concatenate([np.zeros((1, channels.shape[1])), np.cumsum(centred**2, axis=0)])
    mean = (sums[size:] - sums[:-size]) / size
    variance = (squares[size:] - squares[:-size]) / size - mean**2
    return np.sqrt(np.maximum(variance, 0.0) * size / (size - 1))


def _steps(channels: NDArray[np.float64]) -> Array:
    """Return the standard deviation by rounding alone of each channel, (channels,): its step over sqrt(12)."""
    steps = [np.diff(np.unique(channel)) for channel in channels.T]
    return np.array([float(step.min()) / np.sqrt(12.0) if len(step) else 0.0 for step in steps])


def _static_noise(spread: NDArray[np.float64], rounding: Array) -> Array:
    """Return the static noise of each channel, (channels,): its median standard deviation in windows at rest."""
    noise = np.maximum(np.quantile(spread, QUIET_QUANTILE, axis=0), rounding)
    for _ in range(MAX_ITERATIONS):
        quiet = np.all(spread < REST_FACTOR * noise, axis=1)
        if not quiet.any():
            break
        noise = np.maximum(np.median(spread[quiet], axis=0), rounding)
    return np.maximum(noise, 1e-12)


def _broken(breaks: NDArray[np.bool_], size: int) -> NDArray[np.bool_]:
    """Return which windows have a break inside, (n - size + 1,)."""
    count = np.concatenate([[0], np.cumsum(breaks)])
    return np.asarray(count[size:] - count[1 : len(count) - size + 1] > 0)


def _union(quiet: NDArray[np.bool_], size: int, n: int) -> NDArray[np.bool_]:
    """Return which readings are in a quiet window, (n,)."""
    edges = np.zeros(n + 1, dtype=np.int64)
    quiet_rows = np.flatnonzero(quiet)
    np.add.at(edges, quiet_rows, 1)
    np.add.at(edges, quiet_rows + size, -1)
    return np.asarray(np.cumsum(edges)[:n] > 0)


def _stretches(joined: NDArray[np.bool_], inside: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return first reading and end of each stretch; a break divides a stretch."""
    before = np.concatenate([[False], inside[:-1]])
    begin = np.flatnonzero(inside & (~before | ~joined))
    after = np.concatenate([inside[1:] & joined[1:], [False]])
    return begin, np.flatnonzero(inside & ~after) + 1


def _means(values: NDArray[np.float64], begin: NDArray[np.int64], end: NDArray[np.int64]) -> NDArray[np.float64]:
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    return np.asarray((sums[end] - sums[begin]) / (end - begin)[:, None])


def _turning(gyro_dps: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return in which rests the unit turns steadily, (k,): by the deviation of their gyro means from the median."""
    away = np.abs(gyro_dps - np.median(gyro_dps, axis=0))
    usual = 1.4826 * np.median(away, axis=0)
    return np.asarray(np.any(away > TURNING_DPS + TURNING_DEVIATIONS * usual, axis=1))
