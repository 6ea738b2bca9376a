"""Uncertainty of a corrected rate in use, on later days: coefficients, error of the model there, and repeatability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from labctl.answers.calibration_file import AxisEvidenceJson
from labctl.errors import LabctlError
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.estimation.axis_solutions import leaning, residuals, solve_axes
from labctl.fitting.estimation.held import Fixed, with_held
from labctl.fitting.estimation.prior import CoefficientPrior
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import Preset, preset_for
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.drift_noise import Noise
from labctl.fitting.numeric.json_numbers import plain_list
from labctl.fitting.uncertainty.local_model_error import LocalModelError
from labctl.fitting.uncertainty.repeatability import Repeatability, repeatability_of
from labctl.recording import Recording

# Variance that a model leaves at each data set, by leaving out its temperature and its rate in turn.
#
# A residual of the fit is too small by what the fit has adapted to its data set, the residual of a fit without it too
# large by the error of that fit. The product of the two has the variance of the data about the model as its
# expectation (for a linear fit: r'(I - H)^-1 r), for noise and for misfit alike, so neither a noise model nor a
# correction is needed.

#: At most this many groups of rates are left out in turn.
RATE_FOLDS = 11


def left_variance(data: FitData, preset: Preset, prior: CoefficientPrior | None = None) -> dict[str, Array]:
    """Return axis -> (m,) (deg/s)^2, the variance left at each data set; NaN where it could not be left out.

    `prior` is what is known of the coefficients beside the data, in each fit.

    Raises NotEnoughData where the data sets do not determine the model.
    """
    model, rows = preset.build(data)
    axis_solutions = solve_axes(data.take(rows), model, prior=prior)
    inside = residuals(FittedModel(model, axis_solutions.fits), data, axis_solutions.nuisance)
    data = leaning(data, axis_solutions.nuisance)
    by_temperature = data.folds
    if preset.inner_only:
        by_temperature = by_temperature[1:-1]
    noise = axis_solutions.noise
    outside = [_left_out(data, preset, masks, noise, prior) for masks in (by_temperature, rate_folds(data))]
    residual_var = {}
    for axis, values in inside.items():
        within = within_runs(data, values)
        products = np.stack([within * within_runs(data, without[axis]) for without in outside])
        is_finite = np.isfinite(products)
        total = np.where(is_finite, products, 0.0).sum(axis=0)
        residual_var[axis] = np.where(is_finite.any(axis=0), total / np.maximum(is_finite.sum(axis=0), 1), np.nan)
    return residual_var


def within_runs(data: FitData, values: Array) -> Array:
    """Return values (m,) without the mean of each powered run, where there are several: that is repeatability."""
    runs = np.asarray(data.channels["run"]) if "run" in data.channels else np.ones(len(values))
    numbers = np.unique(runs)
    if len(numbers) < 2:
        return values
    residuals_within = values.copy()
    for number in numbers:
        in_run = (runs == number) & np.isfinite(values)
        residuals_within[in_run] -= values[in_run].mean() if in_run.any() else 0.0
    return residuals_within


def rate_folds(data: FitData) -> list[NDArray[np.bool_]]:
    """Return masks (m,) of the data sets of each table rate, neighbouring ones together where there are many."""
    rates = np.round(data.channels.table_rate_dps(), 3)
    levels = np.unique(rates)
    if len(levels) < 2:
        return []
    groups = np.array_split(levels, min(len(levels), RATE_FOLDS))
    return [np.isin(rates, group) for group in groups]


def _left_out(
    data: FitData, preset: Preset, masks: list[NDArray[np.bool_]], noise: Mapping[str, Noise],
    prior: CoefficientPrior | None,
) -> dict[str, Array]:  # fmt: skip
    """Return axis -> (m,) residuals of each data set by the fit without its fold, NaN where there is none."""
    residual_dps = {axis: np.full(len(data), np.nan) for axis in data.outputs}
    for mask in masks:
        data_used = data.take(~mask)
        if mask.all():
            continue
        try:
            model, rows = preset.build(data_used)
            if prior is None:
                require_enough_data(data_used.take(rows), model)
            solved = solve_axes(data_used.take(rows), model, noise, prior)
            without = residuals(FittedModel(model, solved.fits), data.take(mask), solved.nuisance)
        except LabctlError:  # too little is left, or a law that cannot be inverted: this fold says nothing
            continue
        for axis, values in without.items():
            residual_dps[axis][mask] = values
    return residual_dps


#: Of a calibration that an earlier version of labctl has made.
HALVED = "an earlier version of labctl took half the figure of the data sheet, whatever its convention: fit it again"


@dataclass(frozen=True)
class AxisEvidence:
    """What a recording shows of one axis' errors beside those of the coefficients."""

    model_error: LocalModelError
    repeatability: Repeatability | None  #: None where nothing tells how far a later power-on is off
    correlation: Mapping[str, float] = field(default_factory=dict)  #: of its residuals with those of other outputs

    def to_json(self) -> AxisEvidenceJson:
        """Return this as JSON, the variances in (deg/s)^2."""
        local = self.model_error
        evidence_json: AxisEvidenceJson = {
            "rate_dps": local.rate_dps.tolist(),
            "temperature_c": local.temperature_c.tolist(),
            "left_var": plain_list(local.left_var),
            "white_var": local.white_var.tolist(),
            "repeatability_dps": self.repeatability.u_dps if self.repeatability else None,
            "repeatability_freedom": self.repeatability.freedom if self.repeatability else None,
            "repeatability_source": self.repeatability.source if self.repeatability else "none",
        }
        if self.repeatability and self.repeatability.convention:
            evidence_json["repeatability_convention"] = self.repeatability.convention
            evidence_json["repeatability_text"] = self.repeatability.text
        if local.across_dps is not None:
            evidence_json["across_dps"] = {axis: rates.tolist() for axis, rates in local.across_dps.items()}
        if self.correlation:
            evidence_json["correlation"] = dict(self.correlation)
        return evidence_json

    @staticmethod
    def from_json(record: AxisEvidenceJson) -> AxisEvidence:
        """Return what `to_json` described."""
        columns = (record["rate_dps"], record["temperature_c"], record["left_var"], record["white_var"])
        rate, temperature_c, residual_var, white = (np.asarray(column, dtype=np.float64) for column in columns)
        across_values = record.get("across_dps")
        across = (
            None
            if across_values is None
            else {axis: np.asarray(across_value, dtype=np.float64) for axis, across_value in across_values.items()}
        )
        local = LocalModelError(rate, temperature_c, residual_var, white, across)
        u_dps, correlation = record["repeatability_dps"], record.get("correlation", {})
        if u_dps is None:
            return AxisEvidence(local, None, correlation)
        source = record["repeatability_source"]
        text = record.get("repeatability_text", HALVED if source == "data sheet" else "")
        convention = record.get("repeatability_convention")
        repeatability = Repeatability(u_dps, source, record["repeatability_freedom"], text, convention)
        return AxisEvidence(local, repeatability, correlation)


@single_threaded
def use_evidence(
    data: FitData, preset: Preset, instability_dps: Mapping[str, float | None] | None = None,
    prior: CoefficientPrior | None = None,
) -> dict[str, AxisEvidence]:  # fmt: skip
    """Return axis -> what a recording shows of a model's errors in use.

    `instability_dps` is each axis' bias instability by a static record, `prior` what is known of the coefficients.
    Raises NotEnoughData where the data sets do not determine the model.
    """
    model, rows = preset.build(data)
    solutions = solve_axes(data.take(rows), model, prior=prior)
    residual_var = left_variance(data, preset, prior)
    inside = residuals(FittedModel(model, solutions.fits), data, solutions.nuisance)
    repeatability = repeatability_of(data, inside, instability_dps or {})
    correlation = _correlation({axis: within_runs(data, values) for axis, values in inside.items()})
    return {
        axis: AxisEvidence(
            LocalModelError(
                data.true_rate_dps(axis),
                data.channels.temperature_c(axis),
                residual_var[axis],
                data.white_var[axis] if data.white_var is not None else np.zeros(len(data)),
                _turned_across(data, axis),
            ).thinned(),
            repeatability[axis],
            correlation[axis],
        )
        for axis in data.outputs
    }


def _turned_across(data: FitData, axis: str) -> dict[str, Array]:
    """Return the rates about the body axes beside one, those about which the table turned the unit."""
    turned_about = {name for name in BODY_AXES if np.any(data.channels.up(name) * data.channels.table_rate_dps())}
    return {name: data.true_rate_dps(name) for name in BODY_AXES if name in turned_about - {axis}}


def _correlation(residual_dps: Mapping[str, Array]) -> dict[str, dict[str, float]]:
    """Return axis -> other axis -> correlation coefficient of their residuals, where both scatter."""
    by_pair: dict[str, dict[str, float]] = {axis: {} for axis in residual_dps}
    for one, other in permutations(residual_dps, 2):
        in_both = np.isfinite(residual_dps[one]) & np.isfinite(residual_dps[other])
        pair = np.array([residual_dps[one][in_both], residual_dps[other][in_both]])
        if np.all(np.ptp(pair, axis=1) > 0):
            by_pair[one][other] = float(np.atleast_2d(np.corrcoef(pair))[0, 1])
    return by_pair


def evidence_of(
    recording: Recording, model: str | None, effects: list[str] | None, fixed: Fixed | None = None
) -> dict[str, AxisEvidence]:
    """Return what a recording shows of a model's errors in use, by axis.

    Nothing for a table of coefficients, and in poses, where no error at a single rate is seen.

    Raises what `fit` raises.
    """
    if recording.info.kind == "coefficients" or recording.info.motion == "poses":
        return {}
    data = fit_data_of(recording)
    return use_evidence(data, with_shapes(data, with_held(data, preset_for(model, effects or []), fixed)))
