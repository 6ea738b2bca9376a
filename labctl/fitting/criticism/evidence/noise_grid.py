"""Noise between data sets: a small grid of drifts with a prior from the data sheet, to be weighted by the data.

The drift is an Ornstein-Uhlenbeck process inside each powered run, independent between runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh_tridiagonal

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.triangular import lower_factor, solve_lower

#: Drift time constants, s; 0 stands for equal parts of `MIXTURE_S`, close to the flicker of bias instability.
TAUS_S = (0.0, 120.0, 900.0, 4000.0)
#: Drift sizes, over half the data sheet's bias stability.
SIZES = (0.2, 0.45, 0.7, 1.0, 1.5, 2.3, 3.6, 6.0, 12.0)
#: Width of the prior, a factor.
PRIOR_FACTOR = 2.5
MIXTURE_S = (120.0, 700.0, 3600.0)
#: Where data sets are closer than this share of a time constant, or not in the order of time, the inverse of their
#: correlation is too large, or not tridiagonal.
MIN_LAG = 1e-6
#: Drift of this size, in three equal parts, has an Allan deviation as high as a bias instability of 1 has.
DRIFT_PER_INSTABILITY = 1.35
#: Half of the usual bias stability, deg/s, where no data sheet says it.
USUAL_DPS = {"fog": 0.001, "mems": 0.0015, "piezo": 0.01, "": 0.002}


@dataclass(frozen=True)
class Noise:
    """One point of the grid: size and time constant of the drift."""

    size_dps: float
    tau_s: float
    log_prior: float


def expected_drift_dps(technology: str, stability_dps: float | None, instability_dps: float | None = None) -> float:
    """Return the expected size of the drift, deg/s: measured at rest, else by the data sheet, else by the technology.

    `stability_dps` is the data sheet's bias stability as a standard deviation; it covers the worse units, so half of it
    is expected, within `PRIOR_FACTOR`. `instability_dps` is the bias instability B of a static record.
    """
    if instability_dps is not None:
        return DRIFT_PER_INSTABILITY * instability_dps
    return stability_dps / 2 if stability_dps else USUAL_DPS.get(technology, USUAL_DPS[""])


def noise_grid(
    technology: str, stability_dps: float | None, white_dps: float, instability_dps: float | None = None
) -> list[Noise]:
    """Return the drifts to average over; those far below `white_dps`, the white noise of a mean, are left out."""
    centre = expected_drift_dps(technology, stability_dps, instability_dps)
    width = np.log(PRIOR_FACTOR)
    points = []
    for factor in SIZES:
        size = factor * centre
        if size < 0.05 * white_dps and factor != SIZES[-1]:
            continue
        points += [Noise(size, tau, -0.5 * (np.log(factor) / width) ** 2) for tau in TAUS_S]
    return points


def correlation(t_s: Array, tau_s: float) -> NDArray[np.float64]:
    """Return the correlation (m, m) of drift between times (m,); not to be written to."""
    return _correlation(np.ascontiguousarray(t_s, dtype=np.float64).tobytes(), tau_s)


@lru_cache(maxsize=32)
def _correlation(times: bytes, tau_s: float) -> NDArray[np.float64]:
    """Cached by the bytes of the times: axes and sizes of drift share it."""
    t_s = np.frombuffer(times, dtype=np.float64)
    lag = np.abs(t_s[:, None] - t_s[None, :])
    taus = (tau_s,) if tau_s > 0 else MIXTURE_S
    autocorrelation = np.mean([np.exp(-lag / tau) for tau in taus], axis=0)
    autocorrelation.setflags(write=False)
    return np.asarray(autocorrelation)


def factors(
    noise: Noise, white_var: Array, t_s: Array, run: NDArray[np.int64]
) -> tuple[list[tuple[NDArray[np.int64], NDArray[np.float64]]], float]:
    """Return each run's rows with the lower Cholesky factor of their covariance, and the log determinant of all."""
    blocks, log_determinant = [], 0.0
    for number in np.unique(run):
        rows = np.flatnonzero(run == number)
        covariance = noise.size_dps**2 * correlation(t_s[rows], noise.tau_s)
        covariance[np.diag_indices(len(rows))] += white_var[rows]
        factor = lower_factor(covariance)
        blocks.append((rows, factor))
        log_determinant += 2.0 * float(np.log(np.diag(factor)).sum())
    return blocks, log_determinant


@dataclass(frozen=True)
class DriftModes:
    """Modes of a drift of one time constant over white noise: with its size only the weight of each mode changes.

    The same inner products as by Cholesky factors, one decomposition for all sizes.
    """

    blocks: list[tuple[NDArray[np.int64], NDArray[np.float64]]]  #: each run's rows, and its modes (n, n) over the noise
    variance: Array  #: (m,) of each mode for a drift of 1 deg/s, over white noise
    log_white: float  #: log determinant of the white noise

    @staticmethod
    def of(tau_s: float, white_var: Array, t_s: Array, run: NDArray[np.int64]) -> DriftModes:
        """Return the modes of m data sets; `white_var` (m,) is the white variance of the means, (deg/s)^2."""
        cache_key = (np.ascontiguousarray(values, dtype=np.float64).tobytes() for values in (white_var, t_s))
        return _modes(tau_s, *cache_key, np.ascontiguousarray(run, dtype=np.int64).tobytes())

    def amplitudes(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values (m, k) as amplitudes of the modes, (m, k), over white noise."""
        mode_amplitudes = np.empty_like(values)
        for rows, modes in self.blocks:
            mode_amplitudes[rows] = modes.T @ values[rows]
        return mode_amplitudes

    def weights(self, size_dps: float) -> tuple[Array, float]:
        """Return the factors (m,) that whiten amplitudes where the drift has a size, and the log determinant."""
        total = 1.0 + size_dps**2 * self.variance
        return 1.0 / np.sqrt(total), self.log_white + float(np.log(total).sum())


@lru_cache(maxsize=3 * len(TAUS_S))
def _modes(tau_s: float, white: bytes, times: bytes, runs: bytes) -> DriftModes:
    """Cached by the bytes of the arrays: axes, and the steps of a search, share the decomposition."""
    white_var, t_s = np.frombuffer(white, dtype=np.float64), np.frombuffer(times, dtype=np.float64)
    run = np.frombuffer(runs, dtype=np.int64)
    blocks, variance = [], np.empty(len(t_s))
    for number in np.unique(run):
        rows = np.flatnonzero(run == number)
        white_dps = np.sqrt(white_var[rows])
        values, vectors = _of_one_run(t_s[rows], tau_s, white_dps)
        variance[rows] = np.maximum(values, 0.0)
        blocks.append((rows, vectors / white_dps[:, None]))
    return DriftModes(blocks, variance, float(np.log(white_var).sum()))


def _of_one_run(t_s: Array, tau_s: float, white_dps: Array) -> tuple[Array, NDArray[np.float64]]:
    """Return the eigenvalues (n,) and eigenvectors (n, n) of the drift's correlation over the white noise.

    The inverse of the correlation of one time constant is tridiagonal (Rybicki and Press 1995, eq. 5): there the same
    decomposition takes n^2 instead of n^3 steps.
    """
    lag = np.diff(t_s) / tau_s if tau_s > 0 else np.zeros(len(t_s) - 1)
    if len(lag) == 0 or lag.min() < MIN_LAG:
        return np.linalg.eigh(correlation(t_s, tau_s) / np.outer(white_dps, white_dps))
    next_to, step_share = np.exp(-lag), -np.expm1(-2 * lag)
    diagonal = np.append(1 / step_share, 1.0) + np.append(0.0, next_to**2 / step_share)
    values, vectors = eigh_tridiagonal(
        diagonal * white_dps**2, -next_to / step_share * white_dps[:-1] * white_dps[1:], check_finite=False
    )
    return 1 / values[::-1], vectors[:, ::-1]


def whiten(
    blocks: list[tuple[NDArray[np.int64], NDArray[np.float64]]], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return values (m,) or (m, k) whitened by the Cholesky factors of their covariance, run by run."""
    whitened = np.empty_like(values)
    for rows, factor in blocks:
        whitened[rows] = solve_lower(factor, values[rows])
    return whitened
