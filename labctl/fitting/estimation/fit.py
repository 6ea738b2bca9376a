"""From a recording to a fitted model with its error figures: the entry point for every model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.answers.fitted_model import AxisNoiseJson, FitEnvironment, LegErrorJson
from labctl.errors import LabctlError, NotEnoughData
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.data.covered import Covered
from labctl.fitting.data.earth_rate import turning_size_dps, up_rate_dps
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.mounting_angles import mountings_of
from labctl.fitting.data.noise_floor import AxisNoise
from labctl.fitting.data.temperature.channel import is_chambers
from labctl.fitting.data.temperature.history import TemperatureHistory
from labctl.fitting.data.temperature.legs import legs_of
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.estimation.axis_design import TOLD_APART
from labctl.fitting.estimation.axis_solutions import AxisSolutions, leaning, residuals, solve_axes
from labctl.fitting.estimation.error_metrics import ErrorFigures, rms
from labctl.fitting.estimation.held import Fixed, refuse_fixed, with_held
from labctl.fitting.estimation.joint import joint_findings
from labctl.fitting.estimation.of_poses import of_poses
from labctl.fitting.estimation.prior import CoefficientPrior
from labctl.fitting.estimation.published.common import full_range_dps
from labctl.fitting.estimation.published.tables import from_coefficients
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.estimation.shape_uncertainty import shapes_of
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.error_model import ErrorModel, is_exported
from labctl.fitting.models.fitted_model import AxisFit, FittedModel, without
from labctl.fitting.models.inversion import NotConverged
from labctl.fitting.models.presets import POSES, Preset, preset_for
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.drift_noise import Noise
from labctl.fitting.numeric.least_squares import Solution
from labctl.recording import Recording

# Held-out errors by leg: fitted while the unit warms up and tested while it cools, and the other way round.
#
# The temperatures of a loop come twice. Leaving out a temperature leaves out both of its passages; leaving out a leg
# asks what a law of temperature alone can never answer: whether the way back is like the way there.

#: Data sets that a leg needs, and legs up to which each is left out in turn.
MIN_SETS, MAX_LEGS = 4, 12
#: A leg is tested within the temperatures that the others were fitted at, and so far beyond, K.
BEYOND_K = 1.0


def errors_by_leg(
    data: FitData, preset: Preset, noise: Mapping[str, Noise], prior: CoefficientPrior | None = None
) -> list[LegErrorJson]:
    """Return the error of legs by fits to others; none where the temperature goes one way only.

    The `noise` of each axis stays that of the fit to all data sets; `prior` is in each fit.
    """
    if not data.channels.history.thermometer or "t_s" not in data.channels:
        return []
    run = np.asarray(data.channels["run"], dtype=np.int64) if "run" in data.channels else np.ones(len(data), dtype=int)
    legs = legs_of(data.temperature_c, run)
    up, down = legs > 0, legs < 0
    if min(int(up.sum()), int(down.sum())) < MIN_SETS:
        return []
    leg_errors = [
        _tested(data, preset, noise, prior, [(up, down)], ("heating", "cooling")),
        _tested(data, preset, noise, prior, [(down, up)], ("cooling", "heating")),
    ]
    numbers, counts = np.unique(legs[legs != 0], return_counts=True)
    if 2 < len(numbers) <= MAX_LEGS and counts.min() >= MIN_SETS:
        pairs = [((legs != 0) & (legs != number), legs == number) for number in numbers]
        leg_errors.append(_tested(data, preset, noise, prior, pairs, ("all legs but one", "each leg in turn")))
    return leg_errors


def _tested(
    data: FitData, preset: Preset, noise: Mapping[str, Noise], prior: CoefficientPrior | None,
    pairs: list[tuple[NDArray[np.bool_], NDArray[np.bool_]]], names: tuple[str, str],
) -> LegErrorJson:  # fmt: skip
    """Return the error of each second part of the data sets by a fit to the first, pooled."""
    errors: dict[str, list[Array]] = {axis: [] for axis in data.outputs}
    tested = 0
    for fitted_to, left_out in pairs:
        data_used = data.take(fitted_to)
        low, high = float(data_used.temperature_c.min()) - BEYOND_K, float(data_used.temperature_c.max()) + BEYOND_K
        data_tested = data.take(left_out & (data.temperature_c >= low) & (data.temperature_c <= high))
        if len(data_tested) == 0:
            return _answer(names, None, 0, f"no data set of the {names[1]} is at a temperature of the {names[0]}")
        lost = [a for a in BODY_AXES if data_used.distinct_rates(a) < TOLD_APART <= data.distinct_rates(a)]
        if lost:
            return _answer(names, None, 0, f"the {names[0]} do not turn the unit about {' and '.join(lost)}")
        try:
            model, rows = preset.build(data_used)
            training = data_used.take(rows)
            solved = _solved(training, model, noise, prior)
            residuals_dps = residuals(FittedModel(model, solved.fits), data_tested, solved.nuisance)
        except LabctlError as error:
            return _answer(names, None, 0, f"the {names[0]} alone does not determine the model: {error}")
        tested += len(data_tested)
        for axis, values in residuals_dps.items():
            errors[axis].append(values)
    return _answer(names, rms({axis: np.concatenate(parts) for axis, parts in errors.items()}), tested, "")


def _answer(names: tuple[str, str], rms_dps: float | None, datasets: int, reason: str) -> LegErrorJson:
    return {"fitted": names[0], "tested": names[1], "rms_dps": rms_dps, "datasets": datasets, "why": reason}


#: Data sets at which regressors are compared, and rates, as shares of the fastest measured one.
MAX_ROWS, SHARES = 64, (-1.0, -0.5, 0.0, 0.5, 1.0)
#: A pair of rates in JSON: null means that there is no limit.
RateLimits = tuple[float | None, float | None]


def valid_rates_dps(fitted: FittedModel, data: FitData) -> RateLimits:
    """Return the range of true rates over all recorded axes, deg/s; (None, None) for a model without a rate in it.

    Only what is exported counts: the rest of the model is not applied where the unit is used. Where all that depends on
    the rate is held, it is valid at the rates of the unit, as published coefficients are.
    """
    exported, _ = fitted.exported()
    if not depends_on_rate(exported.model, data):
        return None, None
    ranges = [data.covered.rate_dps[axis] for axis in data.outputs]
    if exported.model.held.axes and not depends_on_rate(exported.model, data, held=False):
        ranges.append(full_range_dps(data.info))
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def depends_on_rate(model: ErrorModel, data: FitData, *, held: bool = True) -> bool:
    """Return whether a regressor of a model changes with the rate, on any recorded axis.

    Without `held`, the regressors of held coefficients do not count.
    """
    rows = np.unique(np.linspace(0, len(data) - 1, min(len(data), MAX_ROWS)).astype(np.int64))
    channels = data.channels.take(rows)
    fastest = max(1.0, *(abs(end) for axis in data.outputs for end in data.covered.rate_dps[axis]))
    channels_at_rates = [_at_rate(channels, share * fastest) for share in SHARES]
    for axis in data.outputs:
        first, *others = [
            [
                c.values
                for owner, c in model.columns(channels_at_rate, axis)
                if held or model.held.of(axis, owner, c.name) is None
            ]
            for channels_at_rate in channels_at_rates
        ]
        for other in others:
            if len(other) != len(first) or not all(map(np.array_equal, first, other)):
                return True
    return False


def _at_rate(channels: Channels, rate_dps: float) -> Channels:
    """Return channels in which the table and every body axis turn at one rate."""
    rate = np.full(len(channels), rate_dps)
    columns = {**channels.columns, "table_rate_dps": rate}
    return replace(channels, columns=columns, rates=dict.fromkeys(BODY_AXES, rate))


def held_out_errors(
    data: FitData, preset: Preset, noise: Mapping[str, Noise], prior: CoefficientPrior | None = None
) -> dict[str, Array]:
    """Return axis -> (m,) deg/s, corrected minus true rate of each part left out in turn (`held_out_pairs`).

    The `noise` of each axis stays that of the fit to all data sets; `prior` is in each fit. Empty where a
    fold leaves too little.
    """
    pairs = data.held_out_pairs
    if preset.inner_only:
        pairs = pairs[1:-1]
    errors: dict[str, list[Array]] = {axis: [] for axis in data.outputs}
    for data_used, left_out in pairs:
        if len(data_used) == 0:
            return {}
        try:
            model, rows = preset.build(data_used)
            solved = _solved(data_used.take(rows), model, noise, prior)
        except NotEnoughData:
            return {}
        try:
            residuals_dps = residuals(FittedModel(model, solved.fits), left_out, solved.nuisance)
        except NotConverged as error:
            at_c = float(left_out.temperature_c.mean())
            raise NotConverged(
                f"{error}; this fit left out the data sets near {at_c:.1f} deg C, to test the "
                "model at a temperature that it was not fitted to"
            ) from None
        for axis, values in residuals_dps.items():
            errors[axis].append(values)
    return {axis: np.concatenate(parts) for axis, parts in errors.items() if parts}


def _solved(
    data: FitData, model: ErrorModel, noise: Mapping[str, Noise] | None, prior: CoefficientPrior | None
) -> AxisSolutions:
    """Fit a model to data sets, which have to determine it where there is no prior. Raises NotEnoughData."""
    if prior is None:
        require_enough_data(data, model)
    return solve_axes(data, model, noise, prior)


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
def fit_preset(data: FitData, preset: Preset, prior: CoefficientPrior | None = None) -> FitResult:
    """Fit a preset to data sets; its errors include those on temperatures left out of the fit.

    `prior` is what is known of the coefficients beside the data, at the reference temperature of the preset.

    Raises NotEnoughData where the data sets do not determine the model, NotConverged where it cannot be inverted.
    """
    model, rows = preset.build(data)
    training = data.take(rows)
    solved = _solved(training, model, None, prior)
    fitted = FittedModel(_with_shapes(model, solved.fits, data.channels.history), solved.fits)
    residual = residuals(fitted, data, solved.nuisance)
    raw = {axis: data.outputs[axis] - data.true_rate_dps(axis) for axis in data.outputs}
    floor, leaned = data.noise_floor, leaning(data, solved.nuisance)
    error = ErrorFigures(
        rms(raw), rms(residual), rms(held_out_errors(leaned, preset, solved.noise, prior)), floor.rms_dps,
        floor.source, tuple(errors_by_leg(leaned, preset, solved.noise, prior)),
    )  # fmt: skip
    return FitResult(
        fitted,
        error,
        data.covered.temperature_c,
        valid_rates_dps(fitted, data),
        {axis: _noise_json(floor.axes[axis], solution) for axis, solution in solved.solutions.items()},
        _environment(data, solved.turning),
        residual,
        left_out_dps=_left_out_dps(fitted, data),
        shapes=shapes_of(training, fitted, solved.solutions),
        joint=joint_findings(data, model, preset, solved),
        mountings=mountings_of(data.channels),
        angles_rad={axis: each.angles_rad for axis, each in solved.nuisance.items() if each.angles_rad},
    )


def _left_out_dps(fitted: FittedModel, data: FitData) -> dict[str, float]:
    """Return effect -> what it does to the data sets, root mean square deg/s, of the effects that are not exported."""
    by_effect = {}
    for term in fitted.model.terms:
        if not is_exported(term):
            without_effect = without(fitted, term.effect)
            channels = data.seen_by(fitted.model.argument)
            parts = {
                axis: fitted.error_dps(channels, axis) - without_effect.error_dps(channels, axis)
                for axis in data.outputs
            }
            by_effect[term.effect] = rms(parts) or 0.0
    return by_effect


def _with_shapes(model: ErrorModel, fits: Mapping[str, AxisFit], history: TemperatureHistory) -> ErrorModel:
    """Return the model whose effects have the shape that they were fitted with, for linear computations with it."""

    def shaped(term: Term) -> Term:
        first = {
            a: float(f.values[f.effects.index(term.effect)].mean()) for a, f in fits.items() if term.effect in f.effects
        }
        return kind_of(term).kept(kind_of(term).shaped_by(term, first), history)

    return model.with_terms(tuple(map(shaped, model.terms)))


def _noise_json(noise: AxisNoise, solution: Solution) -> AxisNoiseJson:
    return {
        "white_dps": noise.white_dps,
        "drift_dps": noise.drift.drift_dps,
        **noise.correlation_times,
        "per_rate": noise.drift.per_rate,
        "covariance_scale": None if np.isnan(solution.scale) else solution.scale,
    }


def _environment(data: FitData, turning: Mapping[str, Array]) -> FitEnvironment:
    """Return which thermometer the fit went by and how the Earth's rate was treated, as JSON."""
    info = data.info
    environment_json: FitEnvironment = {}
    if is_chambers(data.channels.columns):
        environment_json["temperature"] = (
            "the thermometer of the chamber, because the recording has no thermometer of the unit"
        )
    if info.latitude_deg is None:
        return {**environment_json, "earth_rate": "not subtracted: the latitude of the bench is not known"}
    environment_json |= {
        "earth_rate": "subtracted",
        "latitude_deg": info.latitude_deg,
        "along_table_axis_dps": up_rate_dps(info),
    }
    fitted = {a: np.hypot(c[0::2], c[1::2]).tolist() for a, c in turning.items() if len(c)}
    if fitted:
        environment_json["once_per_turn_dps"] = fitted
        environment_json["once_per_turn_expected_dps"] = turning_size_dps(info)
    return environment_json
