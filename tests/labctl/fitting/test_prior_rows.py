"""What is known of coefficients beside the data, against the posterior of a normal prior in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.numeric.drift_noise import Drift, Scatter
from labctl.fitting.numeric.least_squares import Considered, solve
from labctl.fitting.numeric.prior_rows import PriorRows

M, TAU_S, PER_RATE, WHITE_DPS = 30, 500.0, 1e-4, 1e-3
#: Of the same size as the drift: a drift that was added to the prior would widen it by a factor of 1.4.
KNOWN_U = 0.003


def noise(drift_dps: float) -> tuple[Scatter, Drift, NDArray[np.float64]]:
    """Return what is known of the noise, its drift, and the covariance (M, M) of the data that they make."""
    count = np.arange(float(M))
    t_s, rate_dps = 60.0 * count, 10.0 * (count % 5 - 2.0)
    scatter = Scatter(t_s, np.ones(M, dtype=np.int64), rate_dps, np.full(M, WHITE_DPS**2))
    covariance = drift_dps**2 * np.exp(-np.abs(t_s[:, None] - t_s) / TAU_S)
    covariance += np.diag(WHITE_DPS**2 + (PER_RATE * rate_dps) ** 2)
    return scatter, Drift(drift_dps, TAU_S, PER_RATE), covariance


def design_of(scatter: Scatter) -> NDArray[np.float64]:
    """Return a bias, a scale factor, and two columns like those of the Earth's rate that goes round."""
    turn = 0.7 * np.arange(M)
    return np.column_stack([np.ones(M), scatter.rate_dps, np.cos(turn) + 0.5, np.sin(turn) + 0.5])


@pytest.mark.parametrize("drift_dps", [0.0, KNOWN_U, 30 * KNOWN_U])
def test_the_posterior_is_that_of_a_normal_prior_whatever_the_drift(drift_dps: float) -> None:
    scatter, drift, covariance = noise(drift_dps)
    design = design_of(scatter)
    rng = np.random.default_rng(5)
    truth = np.array([0.02, 3e-4, *rng.normal(0.0, KNOWN_U, 2)])
    y = design @ truth + 0.3 * np.linalg.cholesky(covariance) @ rng.normal(size=M)
    prior = PriorRows.none(2).with_coefficients(np.full(2, KNOWN_U))
    found = solve(design, y, scatter, drift, prior=prior)
    information = design.T @ np.linalg.solve(covariance, design) + np.diag([0.0, 0.0, KNOWN_U**-2, KNOWN_U**-2])
    posterior = np.linalg.inv(information)
    assert found.scale == 1.0
    assert found.values == pytest.approx(posterior @ design.T @ np.linalg.solve(covariance, y), rel=1e-8)
    assert found.covariance == pytest.approx(posterior, rel=1e-8)


def test_known_combinations_of_coefficients_enter_with_their_values() -> None:
    scatter, drift, covariance = noise(KNOWN_U)
    design = design_of(scatter)[:, :2]
    y = 0.02 + 3e-4 * scatter.rate_dps
    rows, values = np.array([[500.0, 0.0], [200.0, 9e4]]), np.array([11.0, 30.0])
    found = solve(design, y, scatter, drift, prior=PriorRows.none(2).plus(rows, values))
    information = design.T @ np.linalg.solve(covariance, design) + rows.T @ rows
    towards = design.T @ np.linalg.solve(covariance, y) + rows.T @ values
    assert found.values == pytest.approx(np.linalg.solve(information, towards), rel=1e-8)


def test_an_error_of_what_is_held_moves_a_known_coefficient_less() -> None:
    scatter, drift, covariance = noise(KNOWN_U)
    design = design_of(scatter)
    held = scatter.rate_dps[:, None] ** 2
    known = Considered(held, held * 1e-6, np.ones(1))
    prior = PriorRows.none(2).with_coefficients(np.full(2, KNOWN_U))
    found = solve(design, design @ np.zeros(4), scatter, drift, considered=known, prior=prior)
    information = design.T @ np.linalg.solve(covariance, design) + np.diag([0.0, 0.0, KNOWN_U**-2, KNOWN_U**-2])
    along = -np.linalg.solve(information, design.T @ np.linalg.solve(covariance, held))
    assert found.along_held == pytest.approx(along, rel=1e-6)


def test_a_coefficient_that_no_data_show_is_what_is_known_of_it() -> None:
    scatter, drift, _ = noise(KNOWN_U)
    design = np.column_stack([np.ones(M), np.zeros(M)])
    prior = PriorRows.none(2).plus(np.array([[0.0, 1 / KNOWN_U]]), np.array([2.0]))
    found = solve(design, np.full(M, 0.02), scatter, drift, prior=prior)
    assert found.values[1] == pytest.approx(2 * KNOWN_U)
    assert np.sqrt(found.covariance[1, 1]) == pytest.approx(KNOWN_U)
    with pytest.raises(NotEnoughData, match="30 data sets at these rates and temperatures determine only 1 of the 2"):
        solve(design, np.full(M, 0.02), scatter, drift)


def test_coefficients_that_are_free_have_no_row() -> None:
    prior = PriorRows.none(1).with_coefficients(np.array([0.5, np.inf]))
    assert prior.rows.tolist() == [[0.0, 2.0, 0.0]]
    assert prior.below(np.zeros((3, 2, 4))).shape == (3, 3, 4)
