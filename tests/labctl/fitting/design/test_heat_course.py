"""The temperature of a unit before a campaign runs: against the closed solution of two first-order lags."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labctl.fitting.design.heat_course import STEP_S, HeatCourse, HeatFlow, heat_course

FLOW = HeatFlow(ramp_c_per_min=2.0, air_tau_s=100.0, unit_tau_s=600.0)


def test_far_along_a_ramp_air_and_unit_lag_by_rate_times_time_constant() -> None:
    course = heat_course(FLOW, [(0.0, 400.0)], 0.0, 7200.0)
    t_s = course.t_s
    rate = 2.0 / 60.0
    late = t_s > 6000.0
    asked = rate * (t_s + STEP_S)  # the set value of a step is reached at its end
    assert asked[late] - course.air_c[late] == pytest.approx(rate * 100.0, rel=0.02)
    assert course.air_c[late] - course.unit_c[late] == pytest.approx(rate * 600.0, rel=0.02)


def test_after_a_step_the_unit_nears_the_air_exponentially_and_stays() -> None:
    flow = HeatFlow(math.inf, 0.0, 600.0)
    course = heat_course(flow, [(0.0, 10.0)], 0.0, 6000.0)
    begun = course.t_s + STEP_S / 2  # the air is taken to change on a straight line within a step
    assert course.unit_c == pytest.approx(10.0 * -np.expm1(-begun / 600.0), abs=1e-3)
    assert course.unit_c[-1] == pytest.approx(10.0, abs=0.01)


def test_a_ramp_turns_where_the_set_point_changes() -> None:
    flow = HeatFlow(6.0, 0.0, 0.0)
    course = heat_course(flow, [(0.0, 10.0), (300.0, -5.0)], 0.0, 900.0)
    assert course.unit_c.max() == pytest.approx(10.0)
    assert course.unit_c[-1] == pytest.approx(-5.0)
    assert np.abs(np.diff(course.unit_c)).max() == pytest.approx(6.0 * STEP_S / 60.0)


def test_means_and_slopes_are_those_of_a_straight_course() -> None:
    course = HeatCourse(np.zeros(100), 0.5 * np.arange(100.0))
    begin, end = np.array([12.0, 300.0]), np.array([72.0, 345.0])
    assert course.mean_c(begin, end) == pytest.approx(0.05 * (begin + end) / 2, abs=0.02)
    assert course.slope_k_s(begin, end) == pytest.approx([0.05, 0.05])


@pytest.mark.parametrize("way_c", [45.0, -10.0])
def test_a_unit_has_settled_when_it_changes_by_less_than_asked(way_c: float) -> None:
    settled_s = FLOW.settling_s(way_c, 0.2, 300.0)
    assert FLOW.change_c(way_c, settled_s, 300.0) == pytest.approx(0.2)
    assert FLOW.settling_s(0.1, 0.2, 300.0) == 300.0
