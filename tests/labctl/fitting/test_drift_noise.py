"""Drift is taken out row by row as by the whole covariance, and is called large where it is."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.criticism.criticism import LARGE_DRIFT
from labctl.fitting.data.noise_floor import correlation_times
from labctl.fitting.numeric.drift_noise import Drift, Scatter, grid, hidden
from labctl.fitting.numeric.drift_whitening import MAX_FACTORED, whitened
from labctl.fitting.numeric.least_squares import drift_beside, solve
from studies.drift_shapes import SCHEDULES, TRUTHS, share_inside

DRIFTS = [
    Drift(0.0, 10.0),
    Drift(2.0, 300.0, 0.01),
    Drift(0.5, 1e5),
    Drift(3.0, 1e-3),
    Drift(1.5, 4000.0, 0.02, shortest_tau_s=20.0),
]


def scatter(rng: np.random.Generator, m: int) -> Scatter:
    """Two powered runs, in no order, one time twice."""
    t_s = np.sort(rng.uniform(0, 75 * m, m))
    t_s[5] = t_s[4]
    mixed = rng.permutation(m)
    runs = np.repeat([1, 2], m // 2)
    return Scatter(t_s[mixed], runs[mixed], rng.normal(0, 50, m), rng.uniform(0.5, 2, m) ** 2)


@pytest.mark.parametrize("rows_of_run", [60, MAX_FACTORED + 1], ids=["by factors", "by the filter"])
@pytest.mark.parametrize("point", range(len(DRIFTS)))
def test_the_same_inner_products_and_determinant_as_by_the_covariance(point: int, rows_of_run: int) -> None:
    rng, m = np.random.default_rng(1), 2 * rows_of_run
    known, drift = scatter(rng, m), DRIFTS[point]
    values = rng.normal(size=(m, 5))
    assert known.white_var is not None
    rows, log_det = whitened(known, DRIFTS, known.white_var, values)
    lag = np.abs(known.t_s[:, None] - known.t_s)
    together = known.run[:, None] == known.run
    covariance = np.diag(known.white_var + (drift.per_rate * known.rate_dps) ** 2)
    covariance += drift.drift_dps**2 * np.mean([np.exp(-lag / tau_s) for tau_s in drift.taus_s], axis=0) * together
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


@pytest.mark.slow
def test_a_drift_as_specified_is_not_called_large_and_a_large_one_is() -> None:
    assert least_over_expected(0.0, 5).max() < 0.3
    assert np.mean(least_over_expected(1.0, 6) >= LARGE_DRIFT) <= 0.05
    assert np.mean(least_over_expected(4.0, 7) >= LARGE_DRIFT) >= 0.95


def test_coefficients_are_within_their_uncertainty_where_the_drift_is_flicker() -> None:
    schedule, truth = SCHEDULES["10 temperatures, 21 rates, soaks of 1 h"], TRUTHS["flicker, 10 s to 28 h"]
    assert share_inside(schedule, *truth, units=50, seed=8)[0] > 92.0  # 83 with drifts of one time constant only


def test_flicker_is_reported_with_its_shortest_and_longest_time_constant() -> None:
    m, rng = 240, np.random.default_rng(9)
    t_s = 100.0 * np.arange(m)
    lag_s = np.abs(t_s[:, None] - t_s)
    covariance = 1e-6 * np.mean([np.exp(-lag_s / tau_s) for tau_s in np.geomspace(100.0, 24_000.0, 7)], axis=0)
    y = np.linalg.cholesky(covariance + 1e-9 * np.eye(m)) @ rng.normal(size=m)
    known = Scatter(t_s, np.ones(m, dtype=np.int64), np.zeros(m), np.full(m, 1e-9), 2e-3)
    found = correlation_times(drift_beside(np.full((m, 1), m**-0.5), y, known))
    assert found == {"drift_tau_s": 100.0 * (m - 1), "drift_shortest_tau_s": 100.0}


def test_no_drift_is_longer_than_a_powered_run() -> None:
    run = np.repeat([1, 2], 30)
    t_s = np.concatenate([60.0 * np.arange(30), 1e7 + 60.0 * np.arange(30)])  # the second power-on is months later
    known = Scatter(np.asarray(t_s, dtype=np.float64), run, np.zeros(60), np.full(60, 1e-6), 2e-3)
    assert {drift.tau_s for drift in (*grid(known, 1e-3), *hidden(known, 1e-3)) if drift.shortest_tau_s} == {29 * 60.0}
    assert max(drift.tau_s for drift in hidden(known, 1e-3)) <= 200 * 60.0


@pytest.mark.parametrize("knows_white", [True, False])
def test_a_fit_at_the_noise_of_another_does_not_depend_on_the_unit_of_the_output(knows_white: bool) -> None:
    """Means without a scatter have weights in units of their white noise, and the drift that they show has deg/s."""
    rng = np.random.default_rng(8)
    m, tau_s = 120, 2000.0
    t_s = 60.0 * np.arange(float(m))
    walk = np.linalg.cholesky(np.exp(-np.abs(t_s[:, None] - t_s) / tau_s) + 1e-9 * np.eye(m)) @ rng.normal(size=m)
    y = 0.02 + 0.005 * walk + rng.normal(0.0, 0.001, m)
    design = np.column_stack([np.ones(m), t_s / t_s[-1]])
    found = []
    for size in (1.0, 1000.0):
        white = np.full(m, (0.001 * size) ** 2) if knows_white else None
        stability = 0.01 * size
        every = Scatter(t_s, np.ones(m, dtype=np.int64), np.zeros(m), white, stability)
        noise = solve(design, size * y, every).noise
        half = Scatter(t_s[: m // 2], every.run[: m // 2], every.rate_dps[: m // 2],
                       None if white is None else white[: m // 2], stability)  # fmt: skip
        assert 0.002 < noise.drift.drift_dps / size < 0.0125  # four correlation times tell it to a factor of 2.5
        found.append(solve(design[: m // 2], size * y[: m // 2], half, noise.drift_beside(half)).values / size)
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    ratio = np.eye(m // 2) * 0.001**2 + 0.005**2 * np.exp(-np.abs(t_s[: m // 2, None] - t_s[: m // 2]) / tau_s)
    weight = np.linalg.inv(ratio)
    part = design[: m // 2]
    expected = np.linalg.solve(part.T @ weight @ part, part.T @ weight @ y[: m // 2])
    plain, *_ = np.linalg.lstsq(part, y[: m // 2], rcond=None)
    assert np.abs(found[0] - expected).max() < 0.5 * np.abs(plain - expected).max()
