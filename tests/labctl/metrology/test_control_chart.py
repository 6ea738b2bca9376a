"""Control charts: limits against published figures, and what a value is judged by."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.metrology.control_chart import MIN_HISTORY, ChartPoint, judged, limits_from_history

#: NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.2, Individuals Control Charts: ten batches.
FLOW_RATES = [49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1]
#: T. Pyzdek, The Handbook for Quality Management (2013), table 9.4: individuals, and the ranges printed beside them.
PYZDEK = [110, 103, 97, 96, 105, 110, 100, 93, 90, 103, 97, 103, 90, 97, 99, 106, 90, 96, 109, 90, 91, 108, 96, 101, 96]
PYZDEK_RANGES = [7, 6, 1, 9, 5, 10, 7, 3, 13, 6, 6, 13, 7, 2, 7, 16, 6, 13, 19, 1, 17, 12, 5, 5]


def test_limits_are_those_that_nist_published() -> None:
    limits = limits_from_history(FLOW_RATES)
    assert limits.centre == pytest.approx(50.81, abs=1e-9)
    assert limits.sigma * 1.128 == pytest.approx(1.8778, abs=5e-5)  # the average moving range
    assert (limits.high, limits.low) == (pytest.approx(55.8041, abs=5e-5), pytest.approx(45.8159, abs=5e-5))


def test_limits_are_those_of_the_factor_2_66() -> None:
    limits = limits_from_history(PYZDEK)
    mean_range = np.mean(PYZDEK_RANGES)
    assert limits.high - limits.centre == pytest.approx(2.66 * mean_range, rel=1e-3)
    assert limits.centre == pytest.approx(np.mean(PYZDEK))


def test_one_value_gives_no_limits() -> None:
    with pytest.raises(BadInput, match="at least 2"):
        limits_from_history([1.0])


def test_a_value_widens_no_limit_by_which_it_is_judged() -> None:
    random = np.random.default_rng(7)
    values = [*random.normal(10.0, 0.1, 20), 11.0, *random.normal(10.0, 0.1, 3)]
    found = judged([ChartPoint(float(value), None) for value in values])
    assert [one.state for one in found[:MIN_HISTORY]] == ["unknown"] * MIN_HISTORY
    assert found[20].state == "out"
    assert "out" not in {one.state for one in found[21:]}
    # the value that was out is in no later limits
    assert found[23].limits[0].values == sum(one.state != "out" for one in found[:23]) < 23
    assert found[23].limits[0].sigma < 0.15


@pytest.mark.slow
def test_false_alarms_are_as_rare_as_three_standard_deviations_are() -> None:
    random = np.random.default_rng(1)
    found = judged([ChartPoint(float(value), None) for value in random.normal(0.0, 1.0, 4000)])
    alarms = sum(one.state == "out" for one in found[100:])
    assert 2 <= alarms <= 25  # 0.27 % of 3900 are 10.5


def test_a_stated_uncertainty_judges_the_first_values() -> None:
    # expected 1.0 with u 0.3, check with u 0.4: standard deviation of the difference 0.5
    inside, warned, out = (judged([ChartPoint(value, 0.4, 1.0, 0.3)])[0] for value in (1.9, 2.2, 2.6))
    assert [inside.state, warned.state, out.state] == ["in", "warning", "out"]
    assert out.limits[0].high == pytest.approx(2.5)
    assert out.limits[0].basis == "stated u"


def test_without_an_expected_value_it_is_judged_by_the_mean_of_those_before() -> None:
    found = judged([ChartPoint(1.0, 0.3), ChartPoint(1.2, 0.3), ChartPoint(3.0, 0.3)])
    assert [one.state for one in found] == ["unknown", "in", "out"]
    assert found[2].limits[0].centre == pytest.approx(1.1)
    assert found[2].limits[0].sigma == pytest.approx(0.3 * math.sqrt(1 + 1 / 2))


def test_equal_values_of_a_coarse_display_give_no_limits() -> None:
    """Eight times 0.01, then one step more: a moving range of 0 would call it out of any limits."""
    found = judged([ChartPoint(0.01, 0.02)] * MIN_HISTORY + [ChartPoint(0.02, 0.02)])
    assert [each.basis for each in found[-1].limits] == ["stated u"]
    assert found[-1].state == "in"


@pytest.mark.parametrize(("centre", "u"), [(0.0245, None), (0.0245, 1e-7), (0.0, 1e-4)])
def test_differences_by_rounding_give_no_limits(centre: float, u: float | None) -> None:
    step = max(abs(centre) * 1e-15, (u or 0.0) * 1e-9)
    history = [ChartPoint(centre + step * (number % 3), u) for number in range(MIN_HISTORY)]
    (*_, last) = judged([*history, ChartPoint(centre + 20 * step, u)])
    assert "history" not in {limits.basis for limits in last.limits}
    scatter = (u or 1e-6) / 2
    seen = judged([ChartPoint(centre + number % 3 * scatter, u) for number in range(MIN_HISTORY + 1)])[-1]
    assert "history" in {limits.basis for limits in seen.limits}
