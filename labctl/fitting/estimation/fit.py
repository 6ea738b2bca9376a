"""From a recording to a fitted model with its errors: the one way in for every model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from labctl.errors import NotEnoughData
from labctl.fitting.data.earth import turning_columns, turning_size_dps, up_rate_dps, with_known_size
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.temperature_channel import is_chambers
from labctl.fitting.data.temperature_levels import folds
from labctl.fitting.effects import kind_of
from labctl.fitting.estimation.error_metrics import ErrorFigures, floor_from_repeats, rms
from labctl.fitting.models.error_model import AxisFit, ErrorModel, FittedModel
from labctl.fitting.models.presets import Preset, preset_for
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.least_squares import Solution, rank_of, solve
from labctl.recording import Recording

#: A polynomial of order q in temperature wants at least this span per order.
SPAN_PER_ORDER_C = 1.0


@dataclass(frozen=True)
class FitResult:
    """A fitted model, its errors, the noise it was weighed with, and what of the Earth was taken out."""

    fitted: FittedModel
    error: ErrorFigures
    temperature_c: tuple[float, float]
    rate_dps: tuple[float, float]
    noise: Mapping[str, Any] = field(default_factory=dict)
    environment: Mapping[str, Any] = field(default_factory=dict)
    residual_dps: Mapping[str, Array] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return what `labctl fit --json` says of the model, besides serial and version."""
        model = self.fitted.model
        return {
            "model": {
                "name": model.name,
                "effects": model.effect_ids,
                "argument": model.argument,
                **{key: model.to_dict()[key] for key in ("terms", "temperature", "reference")},
            },
            "axes": {axis: {"coefficients": coefficients_json(model, fit)} for axis, fit in self.fitted.axes.items()},
            "error": self.error.to_dict(),
            "validity": {"temperature_c": list(self.temperature_c), "rate_dps": list(self.rate_dps)},
            "noise": dict(self.noise),
            "environment": dict(self.environment),
            "reference_temperature_c": model.reference.temperature_c,
        }


def coefficients_json(model: ErrorModel, fit: AxisFit) -> dict[str, Any]:
    """Return named coefficients with standard uncertainty and unit; over nodes for a temperature table.

    The uncertainty is None where there were no more data than coefficients.
    """
    u = np.where(np.isnan(fit.u), None, fit.u)  # type: ignore[call-overload]
    if isinstance(model.temperature, LagrangeTable):
        table: dict[str, Any] = {"temperature_c": list(model.temperature.nodes_c)}
        for name, unit, values, us in zip(fit.names, fit.units, fit.values, u, strict=True):
            table[name] = {"value": values.tolist(), "u": us.tolist(), "unit": unit}
        return table
    return {
        name: {"value": float(values[0]), "u": us[0], "unit": unit}
        for name, unit, values, us in zip(fit.names, fit.units, fit.values, u, strict=True)
    }


def fit(recording: Recording, model: str | None = None, effects: list[str] | None = None) -> FitResult:
    """Fit a preset, or effects, to a recording.

    Raises BadInput for unknown names, NotEnoughData when the recording cannot carry the model (and how much more it
    takes).
    """
    preset = preset_for(model, effects or [])
    if recording.info.kind == "coefficients" and preset.name == "weiss1995":
        from labctl.fitting.models.coefficient_tables import from_coefficients  # noqa: PLC0415  it builds on FitResult

        return from_coefficients(recording)
    return fit_context(fit_data_of(recording), preset)


@single_threaded
def fit_context(context: FitData, preset: Preset) -> FitResult:
    """Fit a preset to data sets and judge it, also on temperatures that it has not seen."""
    error_model, rows = preset.build(context)
    used = context.take(rows)
    _demand(used, error_model)
    fits, solutions, turning = _solve_axes(used, error_model)
    fitted = FittedModel(error_model, fits)
    residual = residuals(fitted, context, turning)
    raw = {axis: context.outputs[axis] - context.true_rate_dps(axis) for axis in context.outputs}
    floor, source = _floor(context, solutions, residual)
    error = ErrorFigures(rms(raw), rms(residual), rms(_held_out(context, preset, solutions)), floor, source)
    rates = np.concatenate([context.true_rate_dps(axis) for axis in context.outputs])
    return FitResult(
        fitted,
        error,
        (float(context.temperature_c.min()), float(context.temperature_c.max())),
        (float(rates.min()), float(rates.max())),
        {axis: _noise_json(solution) for axis, solution in solutions.items()},
        _environment(context, turning),
        residual,
    )


def residuals(fitted: FittedModel, context: FitData, turning: Mapping[str, Array] | None = None) -> dict[str, Array]:
    """Return corrected minus true rate, axis -> (m,) deg/s; `turning` holds the fitted once-per-turn Earth rate."""
    outputs = {a: v - _turned(context, a, (turning or {}).get(a)) for a, v in context.outputs.items()}
    corrected = fitted.compensate(outputs, context.channels)
    return {axis: corrected[axis] - context.true_rate_dps(axis) for axis in outputs}


def fit_turning(fitted: FittedModel, context: FitData) -> dict[str, Array]:
    """Return the once-per-turn Earth rate, axis -> cosine and sine per position, that a recording shows by itself.

    For judging a calibration on a recording that it was not fitted to: where north lies there is not known in advance.
    """
    left = residuals(fitted, context)
    found: dict[str, Array] = {}
    for axis, values in left.items():
        columns = turning_columns(context.info, context.channels, axis)
        independent = columns.shape[1] > 0 and rank_of(columns) == columns.shape[1]
        found[axis] = np.asarray(np.linalg.lstsq(columns, values)[0] if independent else [], dtype=np.float64)
    return found


def _turned(context: FitData, axis: str, coefficients: Array | None) -> Array:
    if coefficients is None or len(coefficients) == 0:
        return np.zeros(len(context))
    columns = turning_columns(context.info, context.channels, axis)
    return np.asarray(columns @ coefficients if columns.shape[1] == len(coefficients) else np.zeros(len(context)))


@dataclass(frozen=True)
class AxisDesign:
    """One axis: columns (m, c) that are estimated, how they become a table's coefficients (k * nodes, c), whose."""

    columns: NDArray[np.float64]
    spread: NDArray[np.float64]
    names: list[tuple[str, str, str]]  #: (effect, name, unit) of the k
    turning: NDArray[np.float64]  #: the Earth's columns (m, e)


def design(context: FitData, model: ErrorModel, axis: str) -> AxisDesign:
    """Return what one axis is fitted by. Columns that are zero throughout were never exercised and are left out."""
    channels = context.channels if model.argument == "rate" else context.channels.with_rates(context.outputs)
    steady = model.steady
    found = [(owner, column) for owner, column in model.columns(channels, axis) if np.any(column.values)]
    basis = model.temperature.basis(context.channels.temperature_c(axis))
    nodes = basis.shape[1]
    columns, spread, names = [np.zeros((len(context), 0))], [], []
    for owner, column in found:
        added = column.values[:, None] if owner in steady else column.values[:, None] * basis
        if owner in steady and _is_there(np.concatenate(columns, axis=1), added):
            continue  # an added polynomial brings the powers that the model has already
        columns.append(added)
        spread.append(np.ones((nodes, 1)) if owner in steady else np.eye(nodes))
        names.append((owner, column.name, column.unit))
    return AxisDesign(
        np.concatenate(columns, axis=1),
        block_diag(*spread) if spread else np.zeros((0, 0)),
        names,
        turning_columns(context.info, context.channels, axis),
    )


def _is_there(columns: NDArray[np.float64], added: NDArray[np.float64]) -> bool:
    """Whether a column (m, 1) is a combination of others (m, c)."""
    if columns.shape[1] == 0:
        return False
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    solution, *_ = np.linalg.lstsq(scaled, added, rcond=1e-12)
    return float(np.linalg.norm(added - scaled @ solution)) < 1e-9 * float(np.linalg.norm(added))


def _solve_axes(
    context: FitData, model: ErrorModel, fixed: Mapping[str, Solution] | None = None
) -> tuple[dict[str, AxisFit], dict[str, Solution], dict[str, Array]]:
    fits, solutions, turning = {}, {}, {}
    for axis in context.outputs:
        made = design(context, model, axis)
        names, k = made.names, made.columns.shape[1]
        if k == 0:
            raise NotEnoughData(
                f"{context.info.serial}, axis {axis}: the recording exercises no effect of model {model.name} "
                f"({', '.join(model.effect_ids)}); turn the unit about its other axes too"
            )
        y = context.outputs[axis] - context.true_rate_dps(axis)
        together, y, scatter = with_known_size(
            made.columns, made.turning, y, context.scatter(axis), turning_size_dps(context.info)
        )
        try:
            solution = solve(together, y, scatter, fixed[axis].drift if fixed else None)
        except NotEnoughData as error:
            raise NotEnoughData(f"{context.info.serial}, axis {axis}, model {model.name}: {error}") from None
        fits[axis] = AxisFit(
            tuple(owner for owner, _, _ in names),
            tuple(name for _, name, _ in names),
            tuple(unit for _, _, unit in names),
            (made.spread @ solution.values[:k]).reshape(len(names), -1),
            made.spread @ solution.covariance[:k, :k] @ made.spread.T,
        )
        solutions[axis], turning[axis] = replace(solution, white_dps=context.white_dps(axis)), solution.values[k:]
    return fits, solutions, turning


def _demand(context: FitData, model: ErrorModel) -> None:
    """Refuse what the recording cannot carry, saying how much more it takes."""
    needs = [(term.effect, *kind_of(term).least(term)) for term in model.terms]
    temperatures, span = context.distinct_temperatures(), float(np.ptp(context.temperature_c))
    serial = context.info.serial
    for term in model.terms:
        if absent := context.channels.missing(kind_of(term).needs):
            raise NotEnoughData(f"{serial}: effect {term.effect} needs column {absent[0]!r}; the recording has none")
    for axis in context.outputs:
        rates = context.distinct_rates(axis)
        for name, least_rates, _ in needs:
            if rates < least_rates:
                raise NotEnoughData(
                    f"{serial}, axis {axis}: {name} needs at least {least_rates} different rates; the recording has "
                    f"{rates}, measure at {least_rates - rates} more"
                )
    for name, _, least in needs:
        if temperatures < least:
            raise NotEnoughData(
                f"{serial}: {name} needs at least {least} different temperatures; the recording has {temperatures}, "
                f"measure at {least - temperatures} more"
            )
        if span < SPAN_PER_ORDER_C * (least - 1):
            raise NotEnoughData(
                f"{serial}: the temperatures span {span:.2f} deg C, too little for order {least - 1} of {name}; "
                f"it takes at least {SPAN_PER_ORDER_C * (least - 1):.0f} deg C, or a lower order (`{name}:N`)"
            )


def _held_out(context: FitData, preset: Preset, solutions: Mapping[str, Solution]) -> dict[str, Array]:
    """Return the errors of each temperature under a fit that has not seen it; empty when that is impossible."""
    masks = folds(context.temperature_c)
    if preset.inner_only:
        masks = masks[1:-1]
    errors: dict[str, list[Array]] = {axis: [] for axis in context.outputs}
    for mask in masks:
        if mask.all():
            return {}
        seen = context.take(~mask)
        try:
            model, rows = preset.build(seen)
            _demand(seen.take(rows), model)
            fits, _, turning = _solve_axes(seen.take(rows), model, solutions)
        except NotEnoughData:
            return {}
        for axis, values in residuals(FittedModel(model, fits), context.take(mask), turning).items():
            errors[axis].append(values)
    return {axis: np.concatenate(found) for axis, found in errors.items() if found}


def _floor(
    context: FitData, solutions: Mapping[str, Solution], residual: Mapping[str, Array]
) -> tuple[float | None, str]:
    if all(solution.white_dps is not None for solution in solutions.values()):
        squares = [s.white_dps**2 + s.drift.drift_dps**2 for s in solutions.values() if s.white_dps is not None]
        return float(np.sqrt(np.mean(squares))), "within and between data sets"
    repeats = floor_from_repeats(context, residual)
    return (repeats, "repeats") if repeats is not None else (None, "none")


def _noise_json(solution: Solution) -> dict[str, Any]:
    drift = solution.drift
    return {
        "white_dps": solution.white_dps,
        "drift_dps": drift.drift_dps,
        "drift_tau_s": drift.tau_s if drift.drift_dps > 0 else None,
        "per_rate": drift.per_rate,
        "covariance_scale": None if np.isnan(solution.scale) else solution.scale,
    }


def _environment(context: FitData, turning: Mapping[str, Array]) -> dict[str, Any]:
    info = context.info
    said: dict[str, Any] = {}
    if is_chambers(context.channels.columns):
        said["temperature"] = "the chamber's: the recording has no thermometer of the unit's own"
    if info.latitude_deg is None:
        return {**said, "earth_rate": "not subtracted: the latitude of the bench is not known"}
    said |= {
        "earth_rate": "subtracted",
        "latitude_deg": info.latitude_deg,
        "along_table_axis_dps": up_rate_dps(info),
    }
    fitted = {a: np.hypot(c[0::2], c[1::2]).tolist() for a, c in turning.items() if len(c)}
    if fitted:
        said["once_per_turn_dps"] = fitted
        said["once_per_turn_expected_dps"] = turning_size_dps(info)
    return said
