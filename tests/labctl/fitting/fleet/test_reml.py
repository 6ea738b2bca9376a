"""Spread by restricted likelihood, against a published analysis and against what is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.fleet.group_effects import heterogeneity
from labctl.fitting.fleet.reml import reml

#: Colditz et al. 1994: 13 trials of the BCG vaccine; with and without tuberculosis, vaccinated and not.
BCG = np.array([
    (4, 119, 11, 128), (6, 300, 29, 274), (3, 228, 11, 209), (62, 13536, 248, 12619), (33, 5036, 47, 5761),
    (180, 1361, 372, 1079), (8, 2537, 10, 619), (505, 87886, 499, 87892), (29, 7470, 45, 7232),
    (17, 1699, 65, 1600), (186, 50448, 141, 27197), (5, 2493, 3, 2338), (27, 16886, 29, 17825),
], dtype=np.float64)  # fmt: skip


def log_risk_ratios() -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithm of the ratio of risks of each trial, and its variance."""
    a, b, c, d = BCG.T
    return np.log((a / (a + b)) / (c / (c + d))), 1 / a - 1 / (a + b) + 1 / c - 1 / (c + d)


def test_the_spread_of_the_trials_of_a_vaccine_is_the_published_one() -> None:
    """R package metafor, rma(yi, vi, data=dat.bcg): tau^2 = 0.3132, mean -0.7145, se 0.1798 (Viechtbauer 2010)."""
    y, variance = log_risk_ratios()
    found = reml(y, variance, np.ones((13, 1)))
    assert found.tau**2 == pytest.approx(0.3132, abs=6e-5)
    assert found.values[0] == pytest.approx(-0.7145, abs=6e-5)
    assert np.sqrt(found.covariance[0, 0]) == pytest.approx(0.1798, abs=6e-5)
    assert found.low < found.tau < found.predictive < found.high


def test_units_that_differ_by_less_than_their_uncertainties_show_have_no_spread() -> None:
    y = np.random.default_rng(3).normal(0.0, 0.2, 30)
    found = reml(y, np.ones(30), np.ones((30, 1)))
    assert (found.tau, found.low) == (0.0, 0.0)
    assert found.values[0] == pytest.approx(np.mean(y))
    assert 0.0 < found.predictive < found.high < 0.5


def test_the_test_of_heterogeneity_is_the_published_one() -> None:
    """The same analysis: Q(df = 12) = 152.2330, and tau^2 = 0.3088 by DerSimonian and Laird."""
    y, variance = log_risk_ratios()
    ((factor, spread, chi2, levels),) = heterogeneity(y, variance, np.ones((13, 1)), {"trial": np.arange(13)})
    assert (factor, levels) == ("trial", 13)
    assert chi2 == pytest.approx(152.2330, abs=6e-5)
    assert spread**2 == pytest.approx(0.3088, abs=6e-5)


@pytest.mark.parametrize("tau", [0.0, 0.3, 3.0])
def test_the_interval_of_a_spread_covers_it(tau: float) -> None:
    rng, inside = np.random.default_rng(3), 0
    for _ in range(60):
        u = rng.uniform(0.5, 1.5, 25)
        found = reml(5.0 + tau * rng.normal(size=25) + u * rng.normal(size=25), u**2, np.ones((25, 1)))
        inside += found.low <= tau <= found.high
    assert inside >= 52


def test_units_of_which_nothing_is_uncertain_have_the_plain_standard_deviation() -> None:
    y = np.random.default_rng(4).normal(size=40)
    found = reml(y, np.zeros(40), np.ones((40, 1)))
    assert found.tau == pytest.approx(np.std(y, ddof=1), rel=1e-4)
