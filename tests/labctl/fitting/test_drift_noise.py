"""Taking out the correlation of drift row by row is the same as by the whole covariance."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.numeric.drift_noise import Drift, Scatter, whitened

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
