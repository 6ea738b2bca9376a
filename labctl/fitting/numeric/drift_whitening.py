"""Whitening of data-set means in order of time: by the Cholesky factors of their covariance, or in linear time.

Only the last value of each Ornstein-Uhlenbeck process matters for what follows, as in a Kalman filter. A filter of
several parts takes a step of the interpreter for each row: where the powered runs are short, factors are faster.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Drift, Scatter
from labctl.fitting.numeric.triangular import lower_factor, solve_lower

#: A drift of no size counts as one of this variance, (deg/s)^2, so that nothing is divided by 0.
MIN_VAR = 1e-200
#: Powered runs of so many rows, and so many squares of rows in all, are whitened by factors: 2 MB a correlation.
MAX_FACTORED, MAX_SQUARES = 256, 250_000


def whitened(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], Array]:
    """Return values (m, k) whitened for each drift, (drifts, m, k), and log determinants of the covariances, (drifts,).

    The returned rows are in order of time. The number of operations grows with m and not with its cube.
    """
    order = np.lexsort((scatter.t_s, scatter.run))
    ordered = values[order]
    # a drift of several parts, in steps, is many times slower than one of a single part
    by_parts: dict[int, list[int]] = {}
    for place, drift in enumerate(drifts):
        by_parts.setdefault(len(drift.taus_s), []).append(place)
    rows, log_determinants = np.empty((len(drifts), *values.shape)), np.empty(len(drifts))
    for parts, places in by_parts.items():
        of_these = [drifts[place] for place in places]
        whiten = _of_one_part if parts == 1 else _by_factors if _has_short_runs(scatter) else _of_many_parts
        rows[places], log_determinants[places] = whiten(scatter, of_these, white_var, order, ordered)
    return rows, log_determinants


def _of_one_part(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, order: NDArray[np.int64], ordered: NDArray[np.float64]
) -> tuple[NDArray[np.float64], Array]:
    """Whiten rows in order for drifts of one time constant.

    The expectation of each row is a linear recurrence, solved for all columns at once.
    """
    remaining, total, share = _filter(scatter, drifts, white_var, order)
    before = remaining * np.roll(share, 1, axis=1)  # 0 in the first row, as `remaining` is
    shares = remaining * np.roll(1.0 - share, 1, axis=1)
    expect = _expected_of_one if len(drifts) == 1 else _expected_of_many
    expected = expect(ordered, before, shares)
    np.subtract(ordered, expected, out=expected)
    expected /= np.sqrt(total)[:, :, None]
    return expected, np.log(total).sum(axis=1)


def _expected_of_one(
    ordered: NDArray[np.float64], before: NDArray[np.float64], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what is expected of each row (m, k) from those before it, (1, m, k): the solution of a banded system."""
    band = np.ones((2, len(ordered)))
    band[1, :-1] = -shares[0, 1:]
    pull = np.zeros_like(ordered, order="F")
    pull[1:] = before[0, 1:, None] * ordered[:-1]
    expected, _ = dtbtrs(band, pull, uplo="L", diag="U", overwrite_b=True)
    return np.asarray(expected)[None]


def _expected_of_many(
    ordered: NDArray[np.float64], before: NDArray[np.float64], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the same for many drifts, (drifts, m, k), row by row for all of them at once."""
    expected = np.empty((len(ordered), len(before), ordered.shape[1]))
    expected[0] = 0.0
    np.multiply(before.T[1:, :, None], ordered[:-1, None, :], out=expected[1:])
    pull = np.empty(expected.shape[1:])
    for row, last, share in zip(expected[1:], expected[:-1], shares.T[1:, :, None], strict=True):
        np.multiply(share, last, out=pull)
        np.add(row, pull, out=row)
    return np.ascontiguousarray(expected.transpose(1, 0, 2))


def _filter(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, order: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the terms of the recurrence for rows in order of time, (drifts, m) each.

    They are the share of the drift that is left since the row before (0 where a run begins), the variance of a row
    about its expectation, and the drift's share of that variance.
    """
    decay, white = _decays(scatter, drifts, order)[:, :, 0].T, _noise_var(scatter, drifts, white_var, order).T
    size: Any = np.array([drift.drift_dps**2 for drift in drifts])
    rows: Any = zip((decay**2).T, white.T, strict=True)
    if len(drifts) == 1:  # single numbers are faster than arrays of one
        size, rows = float(size[0]), zip((decay[0] ** 2).tolist(), white[0].tolist(), strict=True)
    variances, variance = [], size
    for part, noise in rows:
        before = size + part * (variance - size)
        variances.append(before)
        variance = before * noise / (before + noise)
    drift_var = np.array(variances).reshape(len(order), len(drifts)).T
    return decay, drift_var + white, drift_var / (drift_var + white)


def _has_short_runs(scatter: Scatter) -> bool:
    rows = np.unique(scatter.run, return_counts=True)[1].astype(np.float64)
    return bool(rows.max() <= MAX_FACTORED and rows @ rows <= MAX_SQUARES)


def _by_factors(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, order: NDArray[np.int64], ordered: NDArray[np.float64]
) -> tuple[NDArray[np.float64], Array]:
    """Whiten rows in order by the Cholesky factors of each run: the same rows as those of the filter."""
    noise_var = _noise_var(scatter, drifts, white_var, order)
    t_s, run = scatter.t_s[order], scatter.run[order]
    begins = np.flatnonzero(np.diff(run, prepend=run[0] - 1))
    runs = [slice(begin, end) for begin, end in zip(begins, [*begins[1:], len(run)], strict=True)]
    rows, log_determinants = np.empty((len(drifts), *ordered.shape)), np.zeros(len(drifts))
    for place, drift in enumerate(drifts):
        for of_run in runs:
            covariance = drift.drift_dps**2 * _correlation(t_s[of_run].tobytes(), drift.taus_s)
            np.einsum("ii->i", covariance)[:] += noise_var[of_run, place]
            factor = lower_factor(covariance)
            rows[place, of_run] = solve_lower(factor, ordered[of_run])
            log_determinants[place] += 2.0 * float(np.log(np.diag(factor)).sum())
    return rows, log_determinants


@lru_cache(maxsize=96)
def _correlation(times: bytes, taus_s: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the correlation (n, n) of a drift of equal parts at times; kept, since fits of one recording share it."""
    t_s = np.frombuffer(times, dtype=np.float64)
    lag = np.abs(t_s[:, None] - t_s)
    correlation = np.zeros_like(lag)
    for tau_s in taus_s:
        correlation += np.exp(lag / -tau_s)
    correlation /= len(taus_s)
    correlation.setflags(write=False)
    return correlation


def _of_many_parts(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, order: NDArray[np.int64], ordered: NDArray[np.float64]
) -> tuple[NDArray[np.float64], Array]:
    """Whiten rows in order for drifts of p equal parts, each with a time constant of its own.

    A Kalman filter with p states, of all drifts at once: what each part is expected to be, (drifts, p, k), and the
    covariance of what it may be beside that, (drifts, p, p), over the variance of a part.
    """
    decay, noise_var = _decays(scatter, drifts, order), _noise_var(scatter, drifts, white_var, order)
    parts = decay.shape[2]
    part_var = np.maximum([drift.drift_dps**2 / parts for drift in drifts], MIN_VAR)
    noise = noise_var / part_var
    covariance: NDArray[np.float64] = np.broadcast_to(np.eye(parts), (len(drifts), parts, parts)).copy()
    diagonal = covariance.reshape(len(drifts), -1)[:, :: parts + 1]
    state = np.zeros((len(drifts), parts, ordered.shape[1]))
    innovations = np.empty((len(order), len(drifts), ordered.shape[1]))
    totals = np.empty((len(order), len(drifts)))
    gained = 1.0 - decay**2
    for row, (values, kept) in enumerate(zip(ordered, decay, strict=True)):
        covariance *= kept[:, :, None]
        covariance *= kept[:, None, :]
        diagonal += gained[row]
        state *= kept[:, :, None]
        with_output = np.add.reduce(covariance, axis=2)
        total = np.add.reduce(with_output, axis=1, out=totals[row])
        total += noise[row]
        innovation = np.subtract(values, np.add.reduce(state, axis=1), out=innovations[row])
        gain = (with_output / total[:, None])[:, :, None]
        covariance -= gain * with_output[:, None, :]
        state += gain * innovation[:, None, :]
    totals *= part_var
    innovations /= np.sqrt(totals)[:, :, None]
    return innovations.transpose(1, 0, 2), np.log(totals).sum(axis=0)


def _decays(scatter: Scatter, drifts: Sequence[Drift], order: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the share of each part that is left since the row before, (m, drifts, p); 0 where a run begins."""
    t_s = scatter.t_s[order]
    begins = np.concatenate([[True], np.diff(scatter.run[order]) != 0])
    taus_s = np.array([drift.taus_s for drift in drifts])
    decay = np.exp(-np.diff(t_s, prepend=t_s[0])[:, None, None] / taus_s)
    decay[begins] = 0.0
    return decay


def _noise_var(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, order: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the variance that is independent from row to row, (m, drifts)."""
    per_rate = np.array([drift.per_rate for drift in drifts])
    growing = np.asarray(scatter.rate_dps)[order][:, None] * per_rate
    return np.asarray(white_var[order][:, None] + growing**2)
