"""Quantisation: the step of a coarse converter, and the error of the mean of many readings by it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labctl.recording.spread import MIN_FOR_SPECTRUM, of_one_length, white_std

#: Suffix of the column with the standard deviation of a mean by the quantisation of an output.
QUANTISATION = "_quantisation_std"
#: Readings of a data set that are searched for codes, largest number of codes of a coarse converter, least readings.
CODE_READINGS, MAX_CODES, MIN_READINGS = 256, 32, 16
#: Share of the data sets that must take few codes, and of those the share that shows two codes or more.
COARSE_SHARE, STEP_SHARE = 0.5, 0.2
#: Codes that differ by less than this share of the largest are taken as equal.
SAME_CODE = 1e-9
#: Indices of the terms of the series; the remainder is below 1e-3 of the sum even without noise.
_K = np.arange(1.0, 201.0)


class Codes(NamedTuple):
    """Codes of one data set: step between the nearest two, one of them, spread of the readings and its white part.

    The step is 0 where every reading is the same; step and code are NaN where the codes are not few.
    """

    step: float
    code: float
    std: float
    white_std: float


def codes_of(values: NDArray[np.float64]) -> Codes:
    """Return what the readings of one data set, (n,), show of a converter's steps, in their unit."""
    std = float(values.std()) if len(values) else 0.0
    some = values[:CODE_READINGS]
    if np.isfinite(std) and len(set(some[: MAX_CODES + 1].tolist())) > MAX_CODES:  # a fine converter, mostly
        return Codes(np.nan, np.nan, std, std)
    codes = np.unique(some)
    if len(some) < MIN_READINGS or len(codes) > min(MAX_CODES, len(some) // 4):
        return Codes(np.nan, np.nan, std, std)
    steps = np.diff(codes)
    apart = steps[steps > SAME_CODE * max(float(np.abs(codes).max()), 1e-300)]
    white = min(white_std(values), std) if len(values) >= MIN_FOR_SPECTRUM else std
    return Codes(float(apart.min()) if len(apart) else 0.0, float(codes[0]), std, white)


def figures_of(sets: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return `codes_of` of each data set, (m, 4): of those of a fine converter, nearly all, many together."""
    figures = np.empty((len(sets), 4))
    for numbers, rows in of_one_length(sets):
        std = rows.std(axis=1) if rows.shape[1] else np.zeros(len(rows))
        few = rows[:, : MAX_CODES + 1]
        fine = np.isfinite(std) & (few.shape[1] > MAX_CODES) & np.all(np.diff(np.sort(few, axis=1)) != 0, axis=1)
        for number, readings, spread, is_fine in zip(numbers, rows, std, fine, strict=True):
            figures[number] = (np.nan, np.nan, spread, spread) if is_fine else codes_of(readings)
    return figures


def quantisation_std(
    steps: NDArray[np.float64], codes: NDArray[np.float64], std: NDArray[np.float64], white: NDArray[np.float64]
) -> tuple[float | None, NDArray[np.float64]]:
    """Return the step of an output, and the standard deviation that it gives each data set's mean, (m,).

    From `Codes` of the m data sets. The step is None, and the deviations 0, where the output is not coarse.
    """
    nothing = np.zeros(len(steps))
    coarse = np.isfinite(steps)
    if not len(steps) or coarse.mean() < COARSE_SHARE:
        return None, nothing
    coarse_steps = steps[coarse & (steps > 0)]
    enough = len(coarse_steps) > STEP_SHARE * coarse.sum()
    step = float(np.quantile(coarse_steps, 0.25)) if enough else _common_step(codes[coarse])
    if step is None:
        return None, nothing
    variance = [quantisation_variance(step, w, s) if c else 0.0 for c, s, w in zip(coarse, std, white, strict=True)]
    return step, np.sqrt(variance)


def steps_columns(name: str, sets: Sequence[NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """Return the column of the standard deviation of the means by quantisation; none for a fine converter."""
    step, deviation = quantisation_std(*figures_of(sets).T)
    return {} if step is None else {f"{name}{QUANTISATION}": deviation}


def quantisation_variance(step: float, white: float, std: float) -> float:
    """Return the variance of a mean of many readings that come in steps, in the square of the unit of all three.

    `std` is the spread of the readings and `white` its white part; what is between them is taken as a wave. Without
    either it is step^2 / 12; both in front of the converter average it out: step^2 / (2 pi^2) times the sum over k of
    |characteristic function at 2 pi k / step|^2 / k^2 (Widrow and Kollar, Quantization Noise, 2008). Of the wave's
    squared Bessel function its mean over the amplitude is taken.
    """
    if step <= 0:
        return 0.0
    of_steps = step**2 / 12.0  # the steps themselves make readings spread
    noise_var = max(white**2 - of_steps, 0.0)
    wave_var = max(std**2 - max(white**2, of_steps), 0.0)
    angle = 2.0 * np.pi * _K / step
    gaussian = np.exp(-(angle**2) * noise_var)
    bessel = 1.0 / np.sqrt(1.0 + (np.pi * angle) ** 2 * 2.0 * wave_var)
    return float(step**2 / (2.0 * np.pi**2) * np.sum(gaussian * bessel / _K**2))


def _common_step(codes: NDArray[np.float64]) -> float | None:
    """Return the step of which all distances between codes (n,) are multiples; None where there is none."""
    apart = np.diff(np.unique(codes))
    tolerance = 1e-6 * float(np.ptp(codes)) if len(codes) > 1 else 0.0
    apart = apart[apart > tolerance]
    if len(apart) == 0:
        return None
    step = float(apart.min())
    for distance in apart:
        remainder = float(distance) % step
        while min(remainder, step - remainder) > 20 * tolerance:
            step, remainder = remainder, step % remainder
    off = np.abs(apart / step - np.round(apart / step))
    return step if step > 1000 * tolerance and float(np.mean(off < 0.02)) > 0.9 else None
