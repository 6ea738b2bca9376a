"""What planned data sets leave uncertain, against fits to data sets that were drawn with the same noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.design.bound import least_heat_h, u_of_one_hour_dps
from labctl.fitting.design.heat_course import HeatCourse
from labctl.fitting.design.noise_figures import AxisNoiseFigures, NoiseFigures, UnsettledHeat
from labctl.fitting.design.planned_sets import PlannedSets, planned_data
from labctl.fitting.design.predicted_uncertainty import predicted_uncertainty
from labctl.fitting.design.range_of_use import RangeOfUse
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import preset_for

USE = RangeOfUse(BODY_AXES, 100.0, (0.0, 40.0))
SETTLED = UnsettledHeat(0.0)
WHITE = NoiseFigures(dict.fromkeys(BODY_AXES, AxisNoiseFigures(0.05, 0.0, 600.0)), SETTLED)
RATES, WARM = (-100.0, -50.0, 0.0, 50.0, 100.0), (0.0, 15.0, 25.0, 40.0)


def sets(*, legs: tuple[float, ...] = (), rates: tuple[float, ...] = RATES) -> PlannedSets:
    """Return data sets of one minute at four temperatures in three positions, or along straight legs."""
    levels = [t for t in WARM for _ in rates] if not legs else np.interp(
        np.linspace(0, len(legs) - 1, 40), range(len(legs)), legs
    ).tolist()  # fmt: skip
    warm = np.tile(levels, 3)
    n = len(warm)
    begin = 60.0 * np.arange(n)
    course = np.interp(10.0 * np.arange(6 * n + 2), begin + 30.0, warm) if legs else np.repeat(warm, 6)
    position = np.repeat(np.array(BODY_AXES), n // 3)
    one = np.ones(n, dtype=np.int64)
    rate = np.resize(np.array(rates), n)
    lasts = np.full(n, 60.0 if legs else 40.0)
    return PlannedSets(begin, lasts, rate, position, one, one, begin, HeatCourse(course, course))


def test_the_mean_square_is_that_of_fits_to_drawn_noise() -> None:
    planned, preset = sets(), preset_for("bias_scale", [])
    predicted = predicted_uncertainty(planned, BODY_AXES, preset, WHITE, USE)
    data, rng = planned_data(planned, BODY_AXES, WHITE), np.random.default_rng(5)
    model, _ = preset.build(data)
    points, weights = USE.points
    squares = []
    for _ in range(40):
        drawn = {a: data.outputs[a] + rng.normal(0, np.sqrt(0.05**2 / 40.0), len(data)) for a in BODY_AXES}
        fitted = FittedModel(model, solve_axes(replace(data, outputs=drawn), model).fits)
        squares += [weights @ fitted.error_dps(points, axis) ** 2 for axis in BODY_AXES]
    assert predicted.rms_dps == pytest.approx(2.0 * np.sqrt(np.mean(squares)), rel=0.12)
    assert predicted.worst_dps > predicted.rms_dps
    assert (predicted.datasets, predicted.coefficients) == (60, 24)


def test_more_time_makes_white_noise_smaller_and_drift_not() -> None:
    preset = preset_for("bias_scale", [])

    def rms(noise: NoiseFigures, duration_s: float) -> float:
        longer = replace(sets(), duration_s=np.full(60, duration_s))
        return predicted_uncertainty(longer, BODY_AXES, preset, noise, USE).rms_dps

    assert rms(WHITE, 10.0) == pytest.approx(2.0 * rms(WHITE, 40.0), rel=1e-6)
    drifting = NoiseFigures(dict.fromkeys(BODY_AXES, AxisNoiseFigures(1e-6, 0.01, 1e4)), SETTLED)
    assert rms(drifting, 10.0) == pytest.approx(rms(drifting, 40.0), rel=0.05)


def test_both_legs_of_a_cycle_cancel_what_an_element_lags_behind_and_one_leg_does_not() -> None:
    preset = preset_for("bias_scale", [])
    late = replace(WHITE, heat=UnsettledHeat(30.0, 1e-3, 1e-4))
    one, both = (
        predicted_uncertainty(sets(legs=legs), BODY_AXES, preset, late, USE) for legs in ((0.0, 40.0), (0.0, 40.0, 0.0))
    )
    assert both.heat_rms_dps < 0.35 * one.heat_rms_dps
    assert predicted_uncertainty(sets(), BODY_AXES, preset, late, USE).heat_rms_dps < 1e-9


def test_data_sets_that_do_not_determine_a_model_are_refused() -> None:
    few = sets(rates=(100.0,))
    with pytest.raises(NotEnoughData):
        predicted_uncertainty(few, BODY_AXES, preset_for("yang2018", []), WHITE, USE)


@pytest.mark.parametrize("axes", [("z",), ("x", "y"), BODY_AXES])
def test_the_mean_over_the_ball_is_exact_for_squares_and_fourth_powers(axes: tuple[str, ...]) -> None:
    use, n = RangeOfUse(axes, 2.0, (0.0, 1.0)), len(axes)
    points, weights = use.points
    rate = np.asarray(points.rates[axes[0]])
    assert weights.sum() == pytest.approx(1.0)
    assert weights @ rate**2 == pytest.approx(4.0 / (n + 2))
    assert weights @ rate**4 == pytest.approx(16.0 * 3.0 / ((n + 2) * (n + 4)))
    assert isinstance(points, Channels)


def test_no_sharing_of_the_time_is_better_than_the_bound() -> None:
    preset = preset_for("bias_scale", [])
    best = u_of_one_hour_dps(BODY_AXES, BODY_AXES, preset, WHITE, USE)
    whole = replace(sets(), duration_s=np.full(60, 60.0))
    assert best < predicted_uncertainty(whole, BODY_AXES, preset, WHITE, USE).rms_dps < 2.0 * best


def test_the_heat_of_a_bound_goes_through_the_range_and_back_for_each_mounting() -> None:
    assert least_heat_h(3, (-40.0, 50.0), 25.0, 1.5) == pytest.approx(3 * 180.0 / 1.5 / 60.0)
    assert least_heat_h(3, (-40.0, 20.0), 25.0, 1.0) == pytest.approx(3 * 130.0 / 60.0)
    assert least_heat_h(3, (-40.0, 50.0), None, 1.5) == pytest.approx(3.0)
