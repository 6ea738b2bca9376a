"""Least-squares solution of every axis of a model, and the residuals that it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.data.earth import turning_columns, turning_size_dps, with_known_size
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.rate_profile import TIME_CONSTANT
from labctl.fitting.estimation.axis_design import AxisDesign, axis_design
from labctl.fitting.estimation.response import (
    first_response,
    next_response,
    response_at,
    response_of,
    with_response,
    without_response,
)
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.least_squares import Solution, rank_of, solve

#: Steps after which a nonlinear coefficient is taken as it is.
GAUSS_NEWTON_STEPS = 30


@dataclass(frozen=True)
class AxisSolutions:
    """Solution of a model: coefficients, solver output and the Earth's rate that goes round, each by axis."""

    fits: Mapping[str, AxisFit]
    solutions: Mapping[str, Solution]
    turning: Mapping[str, Array]  #: cosine and sine per position, deg/s


def solve_axes(data: FitData, model: ErrorModel, fixed: Mapping[str, Solution] | None = None) -> AxisSolutions:
    """Fit every axis of a model; with `fixed` the drift of each axis is that solution's and not searched for.

    Raises NotEnoughData where the data sets do not determine the coefficients.
    """
    fits, solutions, turning = {}, {}, {}
    for axis in data.outputs:
        design, solution = _converged(data, model, axis, fixed[axis] if fixed else None)
        k = design.columns.shape[1]
        fits[axis] = _axis_fit(design, solution)
        solutions[axis], turning[axis] = replace(solution, white_dps=data.white_dps(axis)), solution.values[k:]
    return AxisSolutions(fits, solutions, turning)


def _converged(data: FitData, model: ErrorModel, axis: str, fixed: Solution | None) -> tuple[AxisDesign, Solution]:
    """Return the design at the solution, and the solution: laws by Gauss-Newton steps at one drift, then once more.

    A delay and a bandwidth are laws of their own effect, and every other effect sees the rate that comes through both.
    """
    response = first_response(data, model, axis)
    data = data.through(response)
    design = axis_design(data, model, axis)
    solution = _solve_axis(data, model, axis, design, fixed)
    if not design.laws:
        return design, solution
    for _ in range(GAUSS_NEWTON_STEPS):
        before, at = solution.values, _law_coefficients(design, solution)
        if data.channels.profile is not None:
            u_s = _axis_fit(design, solution).u_of(TIME_CONSTANT)
            response = next_response(response, response_at(at), model, u_s)
            data, at = data.through(response), with_response(at, response)
        design = axis_design(data, model, axis, at)
        solution = _solve_axis(data, model, axis, design, fixed or solution)
        if np.allclose(solution.values, before, rtol=1e-7, atol=1e-14):
            break
    return design, _solve_axis(data, model, axis, design, fixed)


def _law_coefficients(design: AxisDesign, solution: Solution) -> dict[str, NDArray[np.float64]]:
    """Return name -> (nodes,) of the coefficients that enter by a law."""
    table = (design.spread @ solution.values[: design.columns.shape[1]]).reshape(len(design.names), -1)
    return {name: row for (_, name, _), row in zip(design.names, table, strict=True) if name in design.laws}


def _solve_axis(data: FitData, model: ErrorModel, axis: str, design: AxisDesign, fixed: Solution | None) -> Solution:
    if design.columns.shape[1] == 0:
        raise NotEnoughData(
            f"{data.info.serial}, axis {axis}: the recording exercises no effect of model {model.name} "
            f"({', '.join(model.effect_ids)}); record rates about the unit's other axes too"
        )
    y = data.outputs[axis] - data.true_rate_dps(axis) - design.offset_dps
    columns, y, scatter = with_known_size(
        design.columns, design.turning, y, data.scatter(axis), turning_size_dps(data.info)
    )
    try:
        return solve(columns, y, scatter, fixed.drift if fixed else None)
    except NotEnoughData as error:
        raise NotEnoughData(f"{data.info.serial}, axis {axis}, model {model.name}: {error}") from None


def _axis_fit(design: AxisDesign, solution: Solution) -> AxisFit:
    names, k = design.names, design.columns.shape[1]
    return AxisFit(
        tuple(owner for owner, _, _ in names),
        tuple(name for _, name, _ in names),
        tuple(unit for _, _, unit in names),
        (design.spread @ solution.values[:k]).reshape(len(names), -1),
        design.spread @ solution.covariance[:k, :k] @ design.spread.T,
    )


def residuals(fitted: FittedModel, data: FitData, turning: Mapping[str, Array] | None = None) -> dict[str, Array]:
    """Return corrected minus true rate, axis -> (m,) deg/s; `turning` holds the fitted once-per-turn Earth rate.

    No correction undoes a delay or a bandwidth, so the true rate is what comes through them.
    """
    outputs = {a: v - _turning_dps(data, a, (turning or {}).get(a)) for a, v in data.outputs.items()}
    corrected = without_response(fitted).compensate(outputs, data.channels)
    seen = {axis: data.through(response_of(fitted.axes[axis])) for axis in outputs}
    return {axis: corrected[axis] - seen[axis].true_rate_dps(axis) for axis in outputs}


def fit_turning(fitted: FittedModel, data: FitData) -> dict[str, Array]:
    """Return the once-per-turn Earth rate, axis -> cosine and sine per position in deg/s, that a recording shows.

    For judging a calibration on a recording that it was not fitted to: the direction of north is not known in advance.
    """
    left = residuals(fitted, data)
    found: dict[str, Array] = {}
    for axis, values in left.items():
        columns = turning_columns(data.info, data.channels, axis)
        independent = columns.shape[1] > 0 and rank_of(columns) == columns.shape[1]
        found[axis] = np.asarray(np.linalg.lstsq(columns, values)[0] if independent else [], dtype=np.float64)
    return found


def _turning_dps(data: FitData, axis: str, coefficients: Array | None) -> Array:
    if coefficients is None or len(coefficients) == 0:
        return np.zeros(len(data))
    columns = turning_columns(data.info, data.channels, axis)
    return np.asarray(columns @ coefficients if columns.shape[1] == len(coefficients) else np.zeros(len(data)))
