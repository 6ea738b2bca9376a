"""Drift is taken out row by row as by the whole covariance, and is called large where it is."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.criticism.criticism import LARGE_DRIFT
from labctl.fitting.numeric.drift_noise import Drift, Scatter, whitened
from labctl.fitting.numeric.least_squares import drift_beside

DRIFTS = [Drift(0.0, 10.0), Drift(2.0, 300.0, 0.01), Drift(0.5, 1e5), Drift(3.0, 1e-3)]


def scatter(rng: np.random.Generator, m: int) -> Scatter:
    """Two powered runs, in no order, one time twice."""
    t_s = np.sort(rng.uniform(0, 9000, m))
    t_s[5] = t_s[4]
    mixed = rng.permutation(m)
    runs = np.repeat([1, 2], m // 2)
    return Scatter(t_s[mixed], runs[mixed], rng.normal(0, 50, m), rng.uniform(0.5, 2, m) ** 2)


@pytest.mark.parametrize("point", range(len(DRIFTS)))
def test_the_same_inner_products_and_determinant_as_by_the_covariance(point: int) -> None:
    rng = np.random.default_rng(1)
    known, drift = scatter(rng, 120), DRIFTS[point]
    values = rng.normal(size=(120, 5))
    assert known.white_var is not None
    rows, log_det = whitened(known, DRIFTS, known.white_var, values)
    lag = np.abs(known.t_s[:, None] - known.t_s)
    together = known.run[:, None] == known.run
    covariance = np.diag(known.white_var + (drift.per_rate * known.rate_dps) ** 2)
    covariance += drift.drift_dps**2 * np.exp(-lag / drift.tau_s) * together
    np.testing.assert_allclose(rows[point].T @ rows[point], values.T @ np.linalg.solve(covariance, values), atol=1e-10)
    assert log_det[point] == pytest.approx(np.linalg.slogdet(covariance)[1])


def least_over_expected(size: float, seed: int, draws: int = 100) -> np.ndarray:
    """Return the least sizes found in so many series with a drift of `size`, both over what the data sheet says."""
    rng = np.random.default_rng(seed)
    m, white_dps, expected_dps = 120, 0.001, 0.003
    t_s = 60.0 * np.arange(m)
    columns: np.ndarray = np.linalg.qr(np.column_stack([np.ones(m), t_s]))[0]
    known = Scatter(t_s, np.ones(m, dtype=np.int64), np.zeros(m), np.full(m, white_dps**2), 2 * expected_dps)
    found = []
    for _ in range(draws):
        tau_s = 60.0 * np.exp(rng.uniform(np.log(0.25), np.log(50.0)))
        covariance = (size * expected_dps) ** 2 * np.exp(-np.abs(t_s[:, None] - t_s) / tau_s)
        y = np.linalg.cholesky(covariance + white_dps**2 * np.eye(m)) @ rng.normal(size=m)
        found.append(drift_beside(columns, y, known).least_dps / expected_dps)
    return np.array(found)


def test_a_drift_as_specified_is_not_called_large_and_a_large_one_is() -> None:
    assert least_over_expected(0.0, 5).max() < 0.3
    assert np.mean(least_over_expected(1.0, 6) >= LARGE_DRIFT) <= 0.05
    assert np.mean(least_over_expected(4.0, 7) >= LARGE_DRIFT) >= 0.95
