"""From a recording to a fitted model with its error figures: the entry point for every model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.fitting.data.covered import Covered
from labctl.fitting.data.earth import turning_size_dps, up_rate_dps
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.mounting_angles import mountings_of
from labctl.fitting.data.noise_floor import AxisNoise
from labctl.fitting.data.temperature.channel import is_chambers
from labctl.fitting.data.temperature.history import TemperatureHistory
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.estimation.axis_solutions import leaning, residuals, solve_axes
from labctl.fitting.estimation.error_metrics import ErrorFigures, rms
from labctl.fitting.estimation.held.resolution import Fixed, refuse_fixed, with_held
from labctl.fitting.estimation.held_out import held_out_errors
from labctl.fitting.estimation.held_out_legs import errors_by_leg
from labctl.fitting.estimation.joint.findings import joint_findings
from labctl.fitting.estimation.of_poses import of_poses
from labctl.fitting.estimation.published.tables import from_coefficients
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.estimation.shape_uncertainty import shapes_of
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.estimation.validity import valid_rates_dps
from labctl.fitting.models.error_model import ErrorModel, is_exported
from labctl.fitting.models.fitted_model import AxisFit, FittedModel, without
from labctl.fitting.models.presets import POSES, Preset, preset_for
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.least_squares import Solution
from labctl.json_types.models import AxisNoiseJson, FitEnvironment
from labctl.recording import Recording


def fit(
    recording: Recording, model: str | None = None, effects: list[str] | None = None, *, covered: Covered | None = None,
    fixed: Fixed | None = None,
) -> FitResult:  # fmt: skip
    """Fit a preset, or effects, to a recording; `covered` is the range of the readings behind means, if known.

    Coefficients that are `fixed` are held at their values, and the others are estimated. Raises BadInput for unknown
    names and for what cannot be held, NotEnoughData when the recording cannot determine the model (and how much more it
    takes).
    """
    preset = preset_for(model, effects or [])
    refuse_fixed(recording.info, fixed)
    if recording.info.motion == "poses" or preset.name == POSES:
        return of_poses(recording, model, effects or [])
    if recording.info.kind == "coefficients":
        return from_coefficients(recording, model, effects or [])
    data = fit_data_of(recording, covered)
    return fit_preset(data, with_shapes(data, with_held(data, preset, fixed)))


@single_threaded
def fit_preset(data: FitData, preset: Preset) -> FitResult:
    """Fit a preset to data sets; its errors include those on temperatures left out of the fit.

    Raises NotEnoughData where the data sets do not determine the model, NotConverged where it cannot be inverted.
    """
    model, rows = preset.build(data)
    used = data.take(rows)
    require_enough_data(used, model)
    found = solve_axes(used, model)
    fitted = FittedModel(_with_shapes(model, found.fits, data.channels.history), found.fits)
    residual = residuals(fitted, data, found.nuisance)
    raw = {axis: data.outputs[axis] - data.true_rate_dps(axis) for axis in data.outputs}
    floor, leaned = data.noise_floor, leaning(data, found.nuisance)
    error = ErrorFigures(
        rms(raw), rms(residual), rms(held_out_errors(leaned, preset, found.solutions)), floor.rms_dps, floor.source,
        tuple(errors_by_leg(leaned, preset, found.solutions)),
    )  # fmt: skip
    return FitResult(
        fitted,
        error,
        data.covered.temperature_c,
        valid_rates_dps(fitted, data),
        {axis: _noise_json(floor.axes[axis], solution) for axis, solution in found.solutions.items()},
        _environment(data, found.turning),
        residual,
        left_out_dps=_left_out_dps(fitted, data),
        shapes=shapes_of(used, fitted, found.solutions),
        joint=joint_findings(data, model, preset, found),
        mountings=mountings_of(data.channels),
        angles_rad={axis: each.angles_rad for axis, each in found.nuisance.items() if each.angles_rad},
    )


def _left_out_dps(fitted: FittedModel, data: FitData) -> dict[str, float]:
    """Return effect -> what it does to the data sets, root mean square deg/s, of the effects that are not exported."""
    found = {}
    for term in fitted.model.terms:
        if not is_exported(term):
            rest = without(fitted, term.effect)
            channels = data.seen_by(fitted.model.argument)
            parts = {axis: fitted.error_dps(channels, axis) - rest.error_dps(channels, axis) for axis in data.outputs}
            found[term.effect] = rms(parts) or 0.0
    return found


def _with_shapes(model: ErrorModel, fits: Mapping[str, AxisFit], history: TemperatureHistory) -> ErrorModel:
    """Return the model whose effects have the shape that they were fitted with, for linear computations with it."""

    def shaped(term: Term) -> Term:
        first = {
            a: float(f.values[f.effects.index(term.effect)].mean()) for a, f in fits.items() if term.effect in f.effects
        }
        return kind_of(term).kept(kind_of(term).shaped_by(term, first), history)

    return model.with_terms(tuple(map(shaped, model.terms)))


def _noise_json(noise: AxisNoise, solution: Solution) -> AxisNoiseJson:
    drift = noise.drift
    return {
        "white_dps": noise.white_dps,
        "drift_dps": drift.drift_dps,
        "drift_tau_s": drift.tau_s if drift.drift_dps > 0 else None,
        "per_rate": drift.per_rate,
        "covariance_scale": None if np.isnan(solution.scale) else solution.scale,
    }


def _environment(data: FitData, turning: Mapping[str, Array]) -> FitEnvironment:
    """Return which thermometer the fit went by and how the Earth's rate was treated, as JSON."""
    info = data.info
    found: FitEnvironment = {}
    if is_chambers(data.channels.columns):
        found["temperature"] = "the thermometer of the chamber, because the recording has no thermometer of the unit"
    if info.latitude_deg is None:
        return {**found, "earth_rate": "not subtracted: the latitude of the bench is not known"}
    found |= {
        "earth_rate": "subtracted",
        "latitude_deg": info.latitude_deg,
        "along_table_axis_dps": up_rate_dps(info),
    }
    fitted = {a: np.hypot(c[0::2], c[1::2]).tolist() for a, c in turning.items() if len(c)}
    if fitted:
        found["once_per_turn_dps"] = fitted
        found["once_per_turn_expected_dps"] = turning_size_dps(info)
    return found
