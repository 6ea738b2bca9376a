"""A line through figures of different days, against scipy's ordinary least squares and by coverage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import linregress

from labctl.fitting.numeric.trend_line import trend_line


def test_points_without_an_uncertainty_of_their_own_give_the_ordinary_line() -> None:
    rng = np.random.default_rng(1)
    time = np.array([0.0, 0.4, 1.1, 2.0, 2.9, 4.2])
    values = 0.01 + 0.003 * time + rng.normal(0, 0.002, 6)
    found, known = trend_line(time, values, np.zeros(6)), linregress(time, values)
    assert found is not None
    assert found.slope == pytest.approx(known.slope, rel=1e-6)
    assert found.u_slope == pytest.approx(known.stderr, rel=1e-4)
    assert found.covariance[0, 0] ** 0.5 == pytest.approx(known.intercept_stderr, rel=1e-4)


def test_the_interval_of_a_slope_covers_it_in_95_of_100() -> None:
    rng = np.random.default_rng(3)
    time, inside = np.array([0.0, 1.0, 2.0, 3.5, 5.0]), 0
    for _ in range(400):
        u = rng.uniform(1e-4, 3e-4, 5)
        found = trend_line(time, 0.003 * time + rng.normal(0, u) + rng.normal(0, 2e-3, 5), u)
        assert found is not None
        inside += abs(found.slope - 0.003) < found.factor * found.u_slope
    assert 0.93 <= inside / 400 <= 0.975


def test_two_points_have_a_slope_without_an_uncertainty_and_one_has_none() -> None:
    found = trend_line(np.array([0.0, 2.0]), np.array([0.1, 0.3]), np.full(2, 0.01))
    assert found is not None
    assert found.slope == pytest.approx(0.1)
    assert np.isnan(found.u_slope)
    assert found.leaves(0.5, 2.0) == (pytest.approx(4.0, abs=0.02), None, None)
    assert trend_line(np.array([1.0]), np.array([0.1]), np.array([0.01])) is None


def test_a_limit_is_left_when_the_line_passes_it_and_the_interval_holds_that_time() -> None:
    time = np.arange(6.0)
    values = 0.01 * time + np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0]) * 1e-3
    found = trend_line(time, values, np.full(6, 1e-4))
    assert found is not None
    expected, earliest, latest = found.leaves(0.1, 5.0)
    assert expected is not None
    assert earliest is not None
    assert latest is not None
    assert expected == pytest.approx((0.1 - found.value) / found.slope, abs=0.02)
    assert earliest < expected < latest
    steady = trend_line(time, np.zeros(6) + values % 2e-3, np.full(6, 1e-3))
    assert steady is not None
    assert steady.leaves(1e3, 5.0) == (None, None, None)
