"""Uncertainty budgets against published ones: GUM (JCGM 100:2008) H.1 and H.2, EA-4/02 M:2022 S3 and S9."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, date, datetime
from typing import Any

import numpy as np
import pytest

from labctl.fitting import fit
from labctl.fitting.numeric.degrees_of_freedom import student_factor
from labctl.fitting.uncertainty import BenchConditions, coefficient_budgets, evidence_of, rate_uncertainty
from labctl.fitting.uncertainty.budget import Budget, BudgetLine, budget_of
from labctl.fitting.uncertainty.combination import (
    combined_u,
    coverage_factor,
    effective_freedom,
)
from labctl.recording import Recording, Standard

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


def test_end_gauge_of_the_gum() -> None:
    """H.1.6: contributions 25, 9.7, 2.9 and 16.6 nm; u_c = 32 nm, 16 degrees of freedom, U99 = 93 nm with 2.92."""
    contributions, freedom = [25.0, 9.7, 2.9, 16.6], [18.0, 25.6, 50.0, 2.0]
    u_c = combined_u(np.array(contributions))
    effective = effective_freedom(contributions, freedom)
    assert round(u_c) == 32
    assert effective is not None
    assert int(effective) == 16
    assert student_factor(int(effective), 0.99) == pytest.approx(2.92, abs=0.005)
    assert student_factor(int(effective), 0.99) * 32 == pytest.approx(93, abs=0.5)


def test_resistance_and_reactance_of_the_gum() -> None:
    """H.2: five sets of simultaneous readings; correlated means give R, X and Z with 0.071, 0.295 and 0.236 ohm."""
    volt, ampere, phase = 4.9990, 19.6610e-3, 1.04446
    u = np.array([0.0032, 0.0095e-3, 0.00075])
    r = np.array([[1, -0.36, 0.86], [-0.36, 1, -0.65], [0.86, -0.65, 1]])
    z, cos, sin = volt / ampere, math.cos(phase), math.sin(phase)
    gradients = {
        "R": (z * cos, [cos / ampere, -z * cos / ampere, -z * sin], 127.732, 0.071),
        "X": (z * sin, [sin / ampere, -z * sin / ampere, z * cos], 219.847, 0.295),
        "Z": (z, [1 / ampere, -z / ampere, 0.0], 254.260, 0.236),
    }
    for value, gradient, published, published_u in gradients.values():
        assert value == pytest.approx(published, abs=0.01)  # from the rounded means
        assert combined_u(np.array(gradient) * u, r) == pytest.approx(published_u, rel=0.04)  # rounded u and r
    independent = combined_u(np.array(gradients["R"][1]) * u)
    assert independent > 2 * 0.071  # without the correlations


@pytest.mark.parametrize(
    ("freedom", "factor"), [(1, 13.97), (2, 4.53), (5, 2.65), (10, 2.28), (20, 2.13), (50, 2.05), (None, 2.0)]
)
def test_students_factors_of_the_gum(freedom: float | None, factor: float) -> None:
    """Table G.2, column 95.45 %."""
    assert student_factor(freedom) == pytest.approx(factor, abs=0.005)


@pytest.mark.parametrize(
    ("contributions", "distributions", "k"),
    [
        ([1.0], ["rectangular"], 0.9545 * math.sqrt(3)),
        ([1.0], ["u-shaped"], math.sqrt(2) * math.sin(0.9545 * math.pi / 2)),
        ([1.0], ["triangular"], math.sqrt(6) * (1 - math.sqrt(1 - 0.9545))),
        ([1.0, 1.0], ["rectangular", "rectangular"], math.sqrt(6) * (1 - math.sqrt(1 - 0.9545))),  # a triangle
        ([1.0, 0.2], ["normal", "rectangular"], 2.0),
        ([1.0, 1.0, 1.0], ["normal", "normal", "normal"], 2.0),
    ],
)
def test_the_factor_covers_whatever_dominates(contributions: list[float], distributions: list[str], k: float) -> None:
    assert coverage_factor(contributions, distributions, None) == pytest.approx(k, abs=0.01)


def test_a_mixture_covers_what_drawn_errors_say() -> None:
    rng = np.random.default_rng(1)
    drawn = rng.uniform(-math.sqrt(3), math.sqrt(3), 400_000) + 0.5 * rng.normal(size=400_000)
    k = coverage_factor([1.0, 0.5], ["rectangular", "normal"], None)
    assert np.mean(np.abs(drawn) <= k * math.hypot(1.0, 0.5)) == pytest.approx(0.9545, abs=0.002)


def line(source: str, contribution: float | None, **known: Any) -> BudgetLine:
    return BudgetLine(source, source, "B", "normal", 1.0, "ppm", 1.0, contribution, **known)


def test_a_line_that_is_not_stated_is_listed_and_one_of_the_fit_makes_the_result_unknown() -> None:
    budget = budget_of(
        "corrected_rate", "deg/s", [line("clock", 3.0), line("level", None, is_stated=False), line("tilt", 4.0)]
    )
    assert budget.combined == 5.0
    assert budget.not_stated == ("level",)
    assert budget.expanded == pytest.approx(10.0, rel=1e-4)
    unknown = replace(line("model", None), kind="A")
    assert budget_of("corrected_rate", "deg/s", [line("clock", 3.0), unknown]).expanded is None


@pytest.mark.parametrize("known", [0.0, -2.0, 10.0, 100.0])
def test_u_covers_as_often_where_a_known_error_is_not_corrected(known: float) -> None:
    lines = [line("clock", 3.0, uncorrected=known), line("thermometer", 4.0, uncorrected=0.5)]
    expanded = budget_of("corrected_rate", "deg/s", lines).expanded
    assert expanded is not None
    assert 10.0 <= expanded < 10.0 + abs(known + 0.5)
    error = np.random.default_rng(11).normal(known + 0.5, 5.0, 400_000)
    assert np.mean(np.abs(error) <= expanded) == pytest.approx(0.9545, abs=0.0012)


def recording_of(make_points: Callable[..., Recording], grid: Any, **info: Any) -> Recording:
    rate, warm = grid
    noise = np.random.default_rng(5).normal(0, 1e-3, len(rate))
    output = rate * 1.02 + 0.3 + 0.01 * (warm - 35) + noise
    return make_points(rate, warm, output, datasheet={"bias_stability_dps": 1e-3}, **info)


EFFECTS = ["bias", "bias_temperature:1", "scale_factor"]


def budgets(recording: Recording, rate: float, *standards: Standard, **bench: Any) -> tuple[Budget, dict[str, Budget]]:
    conditions = BenchConditions(date(2026, 1, 5), standards=standards, **bench)
    fitted, evidence = fit(recording, effects=EFFECTS).fitted, evidence_of(recording, None, EFFECTS)
    found = rate_uncertainty(fitted, rate, 35.0, evidence=evidence, name="unit", bench=conditions)["z"]
    named = coefficient_budgets(fitted, 35.0, evidence=evidence, name="unit", bench=conditions)["z"]
    assert found.expanded_dps == found.budget.expanded
    return found.budget, named


def contribution(budget: Budget, source: str) -> float | None:
    (found,) = [one for one in budget.lines if one.source == source]
    return found.contribution


@pytest.fixture
def recording(make_points: Callable[..., Recording], grid_11_by_11: Any) -> Recording:
    return recording_of(make_points, grid_11_by_11)


def test_an_error_of_the_time_base_is_a_scale_factor_and_no_number_of_rates_reduces_it(recording: Recording) -> None:
    clock = Standard(quantity="clock", u=50.0)
    for rate in (40.0, 80.0, -80.0):
        budget, named = budgets(recording, rate, clock)
        assert contribution(budget, "clock") == pytest.approx(50e-6 * abs(rate))
    assert contribution(named["scale_factor"], "clock") == pytest.approx(50e-6 * 1.02, rel=1e-3)
    assert contribution(named["bias"], "clock") == 0.0
    (one,) = [each for each in budget.lines if each.source == "clock"]
    assert one.is_common


def test_the_sensitivity_to_the_time_base_is_what_a_refit_shows(
    make_points: Callable[..., Recording], grid_11_by_11: Any
) -> None:
    """All reference rates off by 100 ppm, fitted again: scale factor and corrected rate follow as the budget says."""
    rate, warm = grid_11_by_11
    output = rate * 1.02 + 0.3 + 0.01 * (warm - 35)
    found = [
        fit(make_points(rate * off, warm, output), effects=EFFECTS).fitted.axes["z"].values[2, 0]
        for off in (1.0, 1.0001)
    ]
    assert found[0] - found[1] == pytest.approx(100e-6 * 1.02, rel=1e-3)


def test_a_thermometer_of_the_unit_cancels_and_one_of_the_bench_counts(recording: Recording) -> None:
    thermometer = Standard(quantity="thermometer", u=0.1)
    own, _ = budgets(recording, 0.0, thermometer)
    assert contribution(own, "thermometer") == 0.0
    by_chamber, named = budgets(recording, 0.0, thermometer, thermometer="chamber")
    assert contribution(by_chamber, "thermometer") == pytest.approx(0.1 * 0.01 / 1.02, rel=0.01)
    assert contribution(named["bias"], "thermometer") == pytest.approx(0.1 * 0.01, rel=0.01)
    assert "chamber_gradient" in by_chamber.not_stated


def test_level_counts_by_the_earths_rate_and_a_tilt_by_its_cosine(recording: Recording) -> None:
    budget, named = budgets(
        recording,
        100.0,
        Standard(quantity="level", u=0.1),
        Standard(quantity="fixture_angle", u=1.0),
        latitude_deg=60.0,
    )
    assert contribution(named["bias"], "level") == pytest.approx(0.1 * math.radians(1) * 15.041 / 3600 * 0.5, rel=1e-3)
    rng = np.random.default_rng(1)
    a, b = rng.normal(0, math.radians(1.0), (2, 200_000))
    lost = 100 * (1 - np.cos(np.hypot(a, b)))
    assert contribution(budget, "fixture_angle") == pytest.approx(float(np.sqrt(np.mean(lost**2))), rel=0.02)
    assert contribution(named["scale_factor"], "fixture_angle") == pytest.approx(
        np.sqrt(np.mean(lost**2)) / 100 * 1.02, rel=0.02
    )


def test_what_is_not_stated_is_null_and_listed(recording: Recording) -> None:
    budget, _ = budgets(recording, 50.0)
    assert budget.not_stated == ("clock", "fixture_angle", "level", "earth_rate")
    assert contribution(budget, "clock") is None
    assert budget.expanded is not None
    stated, _ = budgets(recording, 50.0, Standard(quantity="clock", u=500.0))
    assert stated.expanded is not None
    assert stated.expanded > 10 * budget.expanded  # 0.05 deg/s
    assert "clock" not in stated.not_stated


def test_a_standard_past_its_due_date_marks_the_budget(recording: Recording) -> None:
    late = Standard(quantity="clock", u=1.0, due=date(2025, 12, 31))
    budget, _ = budgets(recording, 50.0, late)
    assert budget.is_overdue
    assert not budgets(recording, 50.0, late.model_copy(update={"due": date(2026, 1, 5)}))[0].is_overdue


def test_a_supply_without_a_sensitivity_is_unknown_and_says_why(recording: Recording) -> None:
    budget, _ = budgets(recording, 50.0, Standard(quantity="supply", u=0.01))
    (one,) = [each for each in budget.lines if each.source == "supply"]
    assert one.contribution is None
    assert one.why == "its sensitivity is not known: the model has no supply_sensitivity"
