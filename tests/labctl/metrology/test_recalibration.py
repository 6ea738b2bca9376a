"""When an error leaves its limit, and intervals by the methods of ILAC-G24."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.metrology.recalibration import (
    MAX_YEARS,
    PastCalibration,
    Rate,
    control_chart,
    control_chart_rate,
    in_use_time,
    interval_for_risk,
    leaving,
    risk_at,
    staircase,
)

STEADY = Rate(0.1, 0.0)


def found(error: float, year: int = 2026) -> PastCalibration:
    return PastCalibration(date(year, 1, 1), error, 0.05)


def test_an_error_that_drifts_steadily_leaves_its_limit_when_it_reaches_it() -> None:
    when = leaving(0.2, 0.05, STEADY, 1.0)
    assert when.expected_years == pytest.approx(8.0, abs=0.03)
    assert when.early_years == pytest.approx(8.0 - 1.96 * 0.05 / 0.1, abs=0.03)
    assert when.late_years == pytest.approx(8.0 + 1.96 * 0.05 / 0.1, abs=0.03)


def test_the_risk_is_the_share_of_units_that_are_out() -> None:
    rng, n = np.random.default_rng(1), 200_000
    errors = 0.2 + rng.normal(0, 0.05, n) + 5.0 * (0.05 + 0.1 * rng.standard_t(6, n))
    risk = risk_at(5.0, 0.2, 0.05, Rate(0.05, 0.1, 6), 1.0)
    # u of the error is normal, that of the rate Student's: the sum is close to Student's with the rate's freedom
    assert risk == pytest.approx(np.mean(np.abs(errors) > 1.0), rel=0.03)


def test_without_drift_it_never_leaves_and_the_interval_is_the_longest() -> None:
    when = leaving(0.0, 0.05, Rate(0.0, 0.0), 1.0)
    assert (when.expected_years, when.early_years, when.late_years) == (None, None, None)
    assert interval_for_risk(0.0, 0.05, Rate(0.0, 0.0), 1.0).years == pytest.approx(MAX_YEARS, abs=0.03)


def test_the_interval_for_a_risk_ends_where_the_risk_is_reached() -> None:
    rate = Rate(0.05, 0.08, 10)
    interval = interval_for_risk(0.1, 0.05, rate, 1.0, 0.95)
    assert interval.risk == pytest.approx(0.05, abs=0.003)
    assert float(risk_at(interval.years + 0.1, 0.1, 0.05, rate, 1.0)) > 0.05
    assert interval_for_risk(0.1, 0.05, rate, 1.0, 0.99).years < interval.years


@pytest.mark.parametrize(
    ("error", "decision", "factor"), [(0.8, "extend", 1.032), (-0.9, "keep", 1.0), (1.01, "reduce", 0.55)]
)
def test_a_staircase_goes_up_within_80_percent_of_the_limit_and_down_outside(
    error: float, decision: str, factor: float
) -> None:
    step = staircase([found(9.0, 2024), found(error)], 2.0, 1.0)
    assert (step.decision, step.years) == (decision, pytest.approx(2.0 * factor, rel=1e-3))
    assert step.risk is None


def test_the_steps_of_a_staircase_balance_at_its_target() -> None:
    up, down = (staircase([found(error)], 1.0, 1.0, target=0.9).years for error in (0.0, 2.0))
    assert 0.9 * np.log(up) + 0.1 * np.log(down) == pytest.approx(0.0, abs=1e-9)


def test_the_staircase_states_the_risk_by_a_known_drift() -> None:
    step = staircase([found(0.5)], 4.0, 1.0, Rate(0.1, 0.05))
    assert step.risk == pytest.approx(float(risk_at(step.years, 0.5, 0.05, Rate(0.1, 0.05), 1.0)))


def test_time_in_use_is_a_staircase_in_hours() -> None:
    assert in_use_time([found(1.5)], 1000.0, 1.0, 500.0).years == pytest.approx(2.0 * 0.55)
    with pytest.raises(BadInput, match="use of 0 h, 500 h per year: both must be above 0 h"):
        in_use_time([found(0.1)], 0.0, 1.0, 500.0)


def test_a_control_chart_has_the_drift_of_its_own_history() -> None:
    history = [PastCalibration(date(2020 + k, 1, 1), 0.1 * k + e, 0.02) for k, e in enumerate((0.01, -0.02, 0.01, 0.0))]
    rate = control_chart_rate(history)
    assert rate.mean == pytest.approx(0.1, abs=0.02)
    assert rate.freedom == 2
    chart = control_chart(history, 1.0, 1.0)
    assert chart.decision == "extend"
    assert 1.05 < chart.years < 7.0
    assert control_chart(history, 9.0, 1.0).decision == "reduce"


def test_what_cannot_be_evaluated_is_refused() -> None:
    with pytest.raises(BadInput, match="2 calibrations on different days are too few for a control chart"):
        control_chart_rate([found(0.1, 2025), found(0.1)])
    with pytest.raises(BadInput, match="limit = 0: a limit of the error must be a number above 0"):
        leaving(0.0, 0.1, STEADY, 0.0)
    with pytest.raises(BadInput, match="no calibration to derive an interval from"):
        staircase([], 1.0, 1.0)
    with pytest.raises(BadInput, match=r"target = 1\.5 is no probability"):
        staircase([found(0.1)], 1.0, 1.0, target=1.5)
