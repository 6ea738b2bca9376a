"""The spread of random effects, against Student's t and against normal distributions in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student

from labctl.fitting.numeric.drift_noise import Drift, Scatter
from labctl.fitting.numeric.least_squares import Solution, solve
from labctl.fitting.numeric.prior_rows import PriorRows
from labctl.fitting.numeric.variance_components import FACTOR, RandomEffects, half_width


def group_fit(offsets: list[float], noise: float = 1e-4, each: int = 40) -> Solution:
    """Return the fit of one mean to groups of values that are off by `offsets`, their spread a random effect."""
    groups, wide = len(offsets), 5.0
    rng = np.random.default_rng(4)
    member = np.repeat(np.eye(groups), each, axis=0)
    y = member @ np.array(offsets) + rng.normal(0, noise, groups * each)
    m = len(y)
    design = np.column_stack([np.ones(m), member])
    scatter = Scatter(np.arange(float(m)), np.arange(m), np.zeros(m), np.full(m, noise**2))
    random = RandomEffects(np.zeros(groups, dtype=np.int64), np.full(groups, wide))
    prior = PriorRows.none(1).with_coefficients(np.full(groups, wide))
    return solve(design, y, scatter, Drift(0.0, 1.0), random, prior=prior)


@pytest.mark.parametrize("offsets", [[0.01, -0.02], [0.01, 0.02, -0.015], [0.01, -0.02, 0.005, 0.03, -0.01]])
def test_a_mean_of_groups_is_as_uncertain_as_by_students_t(offsets: list[float]) -> None:
    found = group_fit(offsets)
    groups = len(offsets)
    expected = student.ppf(0.975, groups - 1) * np.std(offsets, ddof=1) / np.sqrt(groups)
    assert found.values[0] == pytest.approx(np.mean(offsets), abs=1e-4)
    assert FACTOR * np.sqrt(found.covariance[0, 0]) == pytest.approx(expected, rel=0.08)
    (component,) = found.components
    assert component.groups == groups - 1
    assert component.low < np.std(offsets, ddof=1) < component.high
    assert component.p_value < 1e-12


def test_groups_without_a_shift_show_none_and_cost_little() -> None:
    found = group_fit([0.0, 0.0, 0.0])
    (component,) = found.components
    assert component.p_value > 0.01
    assert component.value < 1e-4
    assert np.sqrt(found.covariance[0, 0]) < 10 * 1e-4 / np.sqrt(120)


def test_the_half_width_of_one_normal_distribution_is_its_own() -> None:
    found = half_width(np.array([[1.0, 2.0]]), np.array([[0.5, 3.0]]), np.ones(1), np.array([1.0, 2.0]))
    assert found == pytest.approx(FACTOR * np.array([0.5, 3.0]), rel=1e-6)
