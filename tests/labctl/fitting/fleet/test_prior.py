"""Priors of a type: what they say before a unit is measured, and fits that use them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.design.heat_course import HeatCourse
from labctl.fitting.design.noise_figures import AxisNoiseFigures, NoiseFigures, UnsettledHeat
from labctl.fitting.design.planned_sets import PlannedSets, planned_data
from labctl.fitting.design.predicted_uncertainty import predicted_uncertainty
from labctl.fitting.design.range_of_use import RangeOfUse
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.estimation.prior import CoefficientPrior
from labctl.fitting.fleet.population import population_of
from labctl.fitting.fleet.prior import fit_with_prior, prior_of
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients, unit_coefficients_of
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import PRESETS, preset_for

PRESET = preset_for("bias_scale", [])
NOISE = NoiseFigures(dict.fromkeys(BODY_AXES, AxisNoiseFigures(0.02, 1e-4, 600.0)), UnsettledHeat(0.0))
USE = RangeOfUse(BODY_AXES, 100.0, (0.0, 50.0))


def planned(levels_c: tuple[float, ...]) -> PlannedSets:
    """Return data sets of one minute at four rates in three positions at some temperatures."""
    each = [(rate, warm) for warm in levels_c for rate in (-100.0, -30.0, 30.0, 100.0)]
    sets = np.array(each * 3)
    n = len(sets)
    begin, one = 60.0 * np.arange(n), np.ones(n, dtype=np.int64)
    return PlannedSets(begin, np.full(n, 40.0), sets[:, 0], np.repeat(np.array(BODY_AXES), len(each)), one, one, begin,
                       HeatCourse.constant_in_steps(sets[:, 1], 60.0))  # fmt: skip


FULL, SHORT = planned((0.0, 25.0, 50.0)), planned((25.0,))


@pytest.fixture(scope="module")
def names() -> tuple[str, ...]:
    data = planned_data(FULL, BODY_AXES, NOISE)
    model, _ = PRESET.build(data)
    return unit_coefficients_of(FittedModel(model, solve_axes(data, model).fits), "U").names


@pytest.fixture(scope="module")
def prior(names: tuple[str, ...]) -> CoefficientPrior:
    """All coefficients of the temperature are known well, bias and scale factor hardly."""
    mean = np.array([1e-3 if "_t" in name else 0.0 for name in names])
    u = np.array([(1e-6 if "bias" in name else 1e-9) if "_t" in name else 1.0 for name in names])
    return CoefficientPrior(names, mean, np.diag(u**2), 50, 25.0)


def test_names_are_those_of_the_axes_and_of_the_nodes_of_a_table() -> None:
    data = planned_data(FULL, BODY_AXES, NOISE)
    model, _ = PRESETS["yang2018"][0].build(data)
    found = unit_coefficients_of(FittedModel(model, solve_axes(data, model).fits), "U")
    assert found.names[:3] == ("x.bias@0", "x.bias@25", "x.bias@50")
    assert found.units[:4] == ("deg/s",) * 3 + ("1",)
    assert found.covariance.shape == (len(found.names),) * 2
    assert (found.model, found.reference_temperature_c) == ("yang2018 of the rate", None)


def test_data_and_prior_together_are_the_weighted_mean_of_both(names: tuple[str, ...]) -> None:
    data = planned_data(FULL, BODY_AXES, NOISE)
    model, _ = PRESET.build(data)
    stated = solve_axes(data, model).noise
    fit = solve_axes(data, model, stated).fits["x"]
    k = fit.values.size
    rng = np.random.default_rng(1)
    root = rng.normal(size=(k, k)) * np.sqrt(np.diag(fit.covariance))
    prior = CoefficientPrior(
        names[:k], fit.values.ravel() + 0.5 * np.sqrt(np.diag(fit.covariance)), root @ root.T, 50, 25.0
    )
    together = solve_axes(data, model, stated, prior).fits["x"]
    weight = np.linalg.inv(fit.covariance)
    covariance = np.linalg.inv(weight + np.linalg.inv(prior.covariance))
    expected = covariance @ (weight @ fit.values.ravel() + np.linalg.inv(prior.covariance) @ prior.mean)
    scale = np.sqrt(np.diag(covariance))
    assert together.values.ravel() / scale == pytest.approx(expected / scale, abs=1e-4)
    assert np.sqrt(np.diag(together.covariance)) == pytest.approx(scale, rel=1e-4)


def test_with_a_prior_one_temperature_suffices_and_the_prediction_is_that_of_the_fit(prior: CoefficientPrior) -> None:
    full = predicted_uncertainty(FULL, BODY_AXES, PRESET, NOISE, USE)
    short = predicted_uncertainty(SHORT, BODY_AXES, PRESET, NOISE, USE, prior)
    assert (short.datasets, short.coefficients) == (12, 24)
    assert short.rms_dps < 1.5 * full.rms_dps
    data = planned_data(SHORT, BODY_AXES, NOISE)
    fitted = fit_with_prior(data, PRESET, replace(prior, mean=0.0 * prior.mean))
    assert fitted.is_used
    assert fitted.fitted.axes["x"].u_of("bias_t1") == pytest.approx(1e-6, rel=0.01)
    assert fitted.fitted.axes["x"].value_of("bias_t1") == pytest.approx(0.0, abs=1e-9)
    points, weights = USE.points
    off = fitted.fitted.error_dps(points, "x")
    assert np.sqrt(weights @ off**2) < 1e-6  # nothing is wrong with these data, nor with this prior


def test_a_unit_that_is_not_like_its_type_is_fitted_alone(prior: CoefficientPrior) -> None:
    data = planned_data(FULL, BODY_AXES, NOISE)  # its coefficients of the temperature are 0
    found = fit_with_prior(data, PRESET, prior)
    assert not found.is_used
    assert found.p_value < 1e-3
    assert abs(found.fitted.axes["x"].value_of("bias_t1")) < 1e-6
    alike = fit_with_prior(data, PRESET, replace(prior, mean=0.0 * prior.mean))
    assert alike.is_used
    assert alike.units == 50


def test_the_prior_of_a_population_covers_a_unit_to_come() -> None:
    rng, inside, every = np.random.default_rng(6), 0, 0
    for _ in range(25):
        values = 1.0 + 0.3 * rng.normal(size=(12, 2)) + 0.2 * rng.normal(size=(12, 2))
        units = [
            UnitCoefficients(f"U{i}", ("x.a", "x.b"), v, 0.04 * np.eye(2), reference_temperature_c=20.0)
            for i, v in enumerate(values)
        ]
        prior = prior_of(population_of(units))
        assert prior.reference_temperature_c == 20.0
        new = 1.0 + 0.3 * rng.normal(size=(40, 2))
        inside += int(np.sum(np.abs(new - prior.mean) <= 1.96 * np.sqrt(np.diag(prior.covariance))))
        every += new.size
    assert 0.92 <= inside / every <= 0.99
