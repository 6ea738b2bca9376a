"""The drift of one more unit of a population: closed forms for one interval each, for equal and other histories."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student

from labctl.fitting.numeric.degrees_of_freedom import COVERAGE_PROBABILITY
from labctl.fitting.uncertainty.drift_prediction import of_item, of_type, with_drift


def test_units_with_one_interval_predict_as_a_sample_does() -> None:
    """The prediction interval of one more value of a normal sample."""
    drifts = np.array([0.01, 0.03, -0.02, 0.05])
    found = of_type(drifts[:, np.newaxis, np.newaxis], np.array([[0.5], [1.0], [2.0], [1.5]]))
    assert found.mean_dps == pytest.approx(drifts.mean())
    assert found.u_dps == pytest.approx(drifts.std(ddof=1) * np.sqrt(1 + 1 / 4))
    assert found.freedom == pytest.approx(3)
    assert found.expanded_about_mean_dps == pytest.approx(
        student(3).ppf(0.5 * (1 + COVERAGE_PROBABILITY)) * found.u_dps
    )


def test_equal_histories_are_an_analysis_of_variance() -> None:
    rng = np.random.default_rng(4)
    rates = rng.normal(size=(5, 3, 1)) + rng.normal(size=(5, 1, 1))
    found = of_type(rates, np.full((5, 3), 0.7))
    means = rates.mean(axis=1)
    between, within = means.var(ddof=1), float(((rates - means[:, np.newaxis]) ** 2).sum()) / 10
    parts = np.array([between * (1 + 1 / 5), within * (1 - 1 / 3)])
    assert found.u_dps**2 == pytest.approx(parts.sum())
    assert found.freedom == pytest.approx(parts.sum() ** 2 / (parts[0] ** 2 / 4 + parts[1] ** 2 / 10))


def test_a_unit_counts_by_its_change_over_its_whole_history_and_only_where_it_is_known() -> None:
    nan = np.nan
    rates = np.array(
        [[[1.0, nan], [4.0, nan]], [[3.0, 3.0], [nan, nan]], [[2.0, 2.0], [nan, nan]], [[1.0, 5.0], [1.0, 5.0]]]
    )
    found = of_type(rates, np.array([[2.0, 1.0], [1.0, 0.0], [1.0, 0.0], [1.0, 1.0]]))
    assert found.mean_dps == pytest.approx([(6 / 3 + 3 + 2 + 1) / 4, (3 + 2 + 5) / 3])
    assert np.all(np.isfinite(found.u_dps))
    assert found.freedom[1] == pytest.approx(2)  # three units, without a difference between the intervals of one


def test_the_variances_are_not_biased_where_histories_differ() -> None:
    rng = np.random.default_rng(11)
    known = np.arange(4) < np.array([[1], [2], [4], [3], [1]])
    rates = rng.normal(size=(5, 1, 40_000)) + 0.8 * rng.normal(size=(5, 4, 40_000))
    found = of_type(np.where(known[:, :, np.newaxis], rates, np.nan), rng.uniform(0.5, 2.0, size=(5, 4)))
    mean = float(found.mean_dps.var())
    assert float((found.u_dps**2).mean()) == pytest.approx(1 + 0.8**2 + mean, rel=0.03)


def test_units_that_all_drift_alike_leave_no_spread() -> None:
    found = of_type(np.full((3, 2, 1), 0.02), np.ones((3, 2)))
    assert (found.mean_dps[0], found.expanded_about_mean_dps[0]) == pytest.approx((0.02, 0.0))


def test_a_history_of_its_own_has_the_root_mean_square_of_its_intervals() -> None:
    found = of_item(np.array([[0.01, 0.02], [0.03, np.nan]]))
    assert found.u_dps == pytest.approx([np.sqrt((0.01**2 + 0.03**2) / 2), 0.02])
    assert found.freedom == pytest.approx([2, 1])
    assert found.mean_dps == pytest.approx([0, 0])


def test_a_mean_drift_widens_as_a_known_error_does() -> None:
    """Half widths of Phillips, Eberhardt and Parry: a known error is added in part, the more the larger it is."""
    assert with_drift(0.03, 0.04, 0.0) == pytest.approx(0.05)
    assert np.hypot(0.05, 0.02) < with_drift(0.03, 0.04, 0.02) < 0.07
    assert with_drift(0.03, 0.04, 1e-19) == pytest.approx(0.05)
    assert with_drift(0.03, 0.04, 1.0) == pytest.approx(1.0 + 0.025 * 1.69, rel=1e-3)
