"""Least-squares solution of every axis of a model, and the residuals that it leaves."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.data.earth_rate import turning_columns, turning_size_dps
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.mounting_angles import leaning_rates
from labctl.fitting.data.response import TIME_CONSTANT
from labctl.fitting.data.shifts import KINDS, shown_shifts
from labctl.fitting.estimation.axis_design import AxisDesign, axis_design
from labctl.fitting.estimation.common_radius_error import with_radius_error
from labctl.fitting.estimation.common_turn_error import with_common_error
from labctl.fitting.estimation.delay_and_bandwidth import (
    first_response,
    next_response,
    response_at,
    response_of,
    with_response,
    without_response,
)
from labctl.fitting.estimation.held import considered, joint_covariance
from labctl.fitting.estimation.prior import CoefficientPrior, coefficient_names
from labctl.fitting.estimation.reference_time import TimeErrors, time_errors
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.error_part import ErrorPart
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Noise, Scatter
from labctl.fitting.numeric.least_squares import Solution, rank_of, solve
from labctl.fitting.numeric.prior_rows import PriorRows
from labctl.fitting.numeric.variance_components import RandomEffects

#: Steps after which a nonlinear coefficient is taken as it is.
GAUSS_NEWTON_STEPS = 30
#: Laws at a solution may differ from their tangents by this share of the residual. Where they differ by more, and
#: coefficients of two effects are correlated so much, the data do not determine both.
MAX_DEPARTURE, SAME_CORRELATION = 0.3, 0.999


@dataclass(frozen=True)
class Nuisance:
    """What one axis shows beside its model."""

    turning: Array  #: the Earth's rate that goes round: cosine and sine per position, deg/s
    shifts: Mapping[str, float] = field(default_factory=dict)  #: of several recordings, by name of the shift
    angles_rad: Mapping[str, float] = field(default_factory=dict)  #: of the mountings, as far as they are separated

    def plus(self, further: Nuisance) -> Nuisance:
        """Return what a further fit found, whose rates had these angles, with the sums of the angles."""
        angles = {name: self.angles_rad.get(name, 0.0) + angle for name, angle in further.angles_rad.items()}
        return replace(further, angles_rad=angles)

    def error_dps(self, data: FitData, axis: str) -> Array:
        """Return what it adds to the output of data sets, (m,) deg/s; a shift that they do not show adds nothing.

        Angles of the mountings are in the true rates (`leaning`).
        """
        error = np.zeros(len(data))
        if len(self.turning):
            columns = turning_columns(data.info, data.channels, axis)
            if columns.shape[1] == len(self.turning):
                error += columns @ self.turning
        for shift in shown_shifts(data.channels, axis) if self.shifts else ():
            error += self.shifts.get(shift.name, 0.0) * shift.values
        return error


@dataclass(frozen=True)
class AxisSolutions:
    """Solution of a model: coefficients, solver output and the Earth's rate that goes round, each by axis."""

    fits: Mapping[str, AxisFit]
    solutions: Mapping[str, Solution]
    nuisance: Mapping[str, Nuisance]  #: what is no part of the model: the Earth's rate, shifts between recordings

    @property
    def noise(self) -> dict[str, Noise]:
        """The noise that the data of each axis were weighted by."""
        return {axis: solution.noise for axis, solution in self.solutions.items()}

    @property
    def turning(self) -> dict[str, Array]:
        """The Earth's rate that goes round with the table, axis -> cosine and sine per position, deg/s."""
        return {axis: axis_nuisance.turning for axis, axis_nuisance in self.nuisance.items()}


def solve_axes(
    data: FitData,
    model: ErrorModel,
    noise: Mapping[str, Noise] | None = None,
    prior: CoefficientPrior | None = None,
) -> AxisSolutions:
    """Fit every axis of a model; `noise` is that of each axis by another fit, and then not searched for.

    `prior` is what is known of the coefficients beside the data.

    Where angles of the mountings are separated, all axes are fitted once more with the rates of a unit that leans so:
    each output shows the rates about the others by its own coefficients.

    Raises NotEnoughData where the data sets do not determine the coefficients.
    """
    solutions = _solve_each(data, model, noise, prior)
    if not any(each.angles_rad for each in solutions.nuisance.values()):
        return solutions
    rates = leaning(data, solutions.nuisance).channels.rates
    again = _solve_each(replace(data, channels=data.channels.with_rates(rates)), model, noise, prior)
    return replace(again, nuisance={axis: solutions.nuisance[axis].plus(each) for axis, each in again.nuisance.items()})


def _solve_each(
    data: FitData, model: ErrorModel, noise: Mapping[str, Noise] | None, prior: CoefficientPrior | None
) -> AxisSolutions:
    fits, solutions, nuisance = {}, {}, {}
    for axis in data.outputs:
        design, solution, late = _converged(data, model, axis, noise[axis] if noise else None, prior)
        solution = with_common_error(data, axis, design.columns, solution)
        solution = _with_radius_error(data, model, axis, design, solution)
        fits[axis] = _axis_fit(design, solution, late)
        solutions[axis], nuisance[axis] = replace(solution, white_dps=data.white_dps(axis)), _nuisance(design, solution)
    return AxisSolutions(fits, solutions, nuisance)


def _with_radius_error(data: FitData, model: ErrorModel, axis: str, design: AxisDesign, solution: Solution) -> Solution:
    at = _law_coefficients(design, solution)

    def columns_of(other: FitData) -> NDArray[np.float64]:
        return axis_design(other, model, axis, at).columns

    return with_radius_error(data, design.columns, columns_of, solution)


def _nuisance(design: AxisDesign, solution: Solution) -> Nuisance:
    """Return what stands behind the model's own columns in a solution: the Earth's rate, angles, then the shifts."""
    beside = solution.values[design.columns.shape[1] :]
    first_shift = len(beside) - len(design.shifts)
    turning, angles, shifts = np.split(beside, [first_shift - len(design.angles), first_shift])
    return Nuisance(
        turning,
        {shift.name: float(v) for shift, v in zip(design.shifts, shifts, strict=True)},
        design.angles.angles_rad(angles),
    )


def leaning(data: FitData, nuisance: Mapping[str, Nuisance]) -> FitData:
    """Return data sets with the true rates of a unit that leans by the angles of its mountings, as a fit found them.

    The angles are the fixture's and the table's: known from all data, they are no error of the model in a part that
    lacks the mountings which separate them.
    """
    rates = leaning_rates(data.channels, {axis: axis_nuisance.angles_rad for axis, axis_nuisance in nuisance.items()})
    return replace(data, channels=data.channels.with_rates(rates), angles_known=True)


def _converged(
    data: FitData, model: ErrorModel, axis: str, noise: Noise | None, prior: CoefficientPrior | None
) -> tuple[AxisDesign, Solution, TimeErrors | None]:
    """Return the design at the solution, the solution, and the errors of the reference's time that are in it.

    Laws are solved by Gauss-Newton steps at one noise, which is that at their solution, and their uncertainty is
    averaged over the noise. A delay and a bandwidth are laws of their own effect, and every other effect sees the rate
    that comes through both.
    """
    response = first_response(data, model, axis)
    data = data.through(response)
    known = frozenset[str]() if prior is None else prior.known(axis)
    design = axis_design(data, model, axis, known=known)
    solution = _solve_axis(data, model, axis, design, noise, prior=prior)
    weighting = noise or solution.noise
    for _ in range(GAUSS_NEWTON_STEPS if design.laws else 0):
        before, at = solution.values, _law_coefficients(design, solution)
        if data.channels.profile is not None:
            u_s = _axis_fit(design, solution).u_of(TIME_CONSTANT)
            response = next_response(response, response_at(at), model, u_s)
            data, at = data.through(response), with_response(at, response)
        design = axis_design(data, model, axis, at, known)
        solution = _solve_axis(data, model, axis, design, weighting, prior=prior)
        if len(solution.values) == len(before) and np.allclose(solution.values, before, rtol=1e-7, atol=1e-14):
            found = noise or _solve_axis(data, model, axis, design, None, prior=prior).noise
            if found.is_close(weighting):
                break
            weighting = found
    late = time_errors(data, axis)
    if not design.laws and late is None:
        return design, solution, late
    averaged = _solve_axis(data, model, axis, design, noise, late, prior)
    if design.laws:  # an average over the noise leaves a law along its tangent
        _require_settled(data, model, axis, design, averaged, known)
        averaged = replace(averaged, values=solution.values, residual=solution.residual)
    return design, averaged, late


def _require_settled(
    data: FitData, model: ErrorModel, axis: str, design: AxisDesign, solution: Solution, known: Collection[str]
) -> None:
    """Raise NotEnoughData where laws at the solution are not what their tangents are, for want of one effect or other.

    The last solution averages over what the drift may be. Coefficients that the data determine hardly move by that; two
    that the data hardly distinguish run far along each other, to where the tangent is not the law.
    """
    there = axis_design(data, model, axis, _law_coefficients(design, solution), known)
    if there.names != design.names:
        return
    values = solution.values[: design.columns.shape[1]]
    departs = there.offset_dps + there.columns @ values - design.offset_dps - design.columns @ values
    if np.linalg.norm(departs) <= MAX_DEPARTURE * np.linalg.norm(solution.residual):
        return
    pair = _least_distinguished(design, solution)
    if pair is not None:
        raise NotEnoughData(
            f"{data.info.serial}, axis {axis}, model {model.name}: {pair[0]} and {pair[1]} together are not determined "
            "by these data, in which they are nearly the same; leave one of them out, or fit the model to recordings "
            "that distinguish them"
        )


def _least_distinguished(design: AxisDesign, solution: Solution) -> tuple[str, str] | None:
    """Return the two effects whose coefficients are correlated most, where that is nearly 1."""
    c = design.columns.shape[1]
    covariance = design.spread @ solution.covariance[:c, :c] @ design.spread.T
    u = np.sqrt(np.diag(covariance))
    correlation = np.abs(covariance) / np.maximum(np.outer(u, u), 1e-300)
    owners = np.repeat([owner for owner, _, _ in design.names], len(u) // max(len(design.names), 1))
    correlation[owners[:, None] == owners] = 0.0
    if not correlation.size or correlation.max() < SAME_CORRELATION:
        return None
    one, other = np.unravel_index(int(np.argmax(correlation)), correlation.shape)
    return str(owners[one]), str(owners[other])


def _law_coefficients(design: AxisDesign, solution: Solution) -> dict[str, NDArray[np.float64]]:
    """Return name -> (nodes,) of the coefficients that enter by a law."""
    table = (design.spread @ solution.values[: design.columns.shape[1]]).reshape(len(design.names), -1)
    return {name: row for (_, name, _), row in zip(design.names, table, strict=True) if name in design.laws}


def _solve_axis(
    data: FitData,
    model: ErrorModel,
    axis: str,
    design: AxisDesign,
    noise: Noise | None,
    late: TimeErrors | None = None,
    prior: CoefficientPrior | None = None,
) -> Solution:
    if design.columns.shape[1] == 0:
        raise NotEnoughData(
            f"{data.info.serial}, axis {axis}: the rates in this recording cause none of the effects of model "
            f"{model.name} ({', '.join(model.effect_ids)}); record rates about the other axes of the unit too"
        )
    y = data.outputs[axis] - data.true_rate_dps(axis) - design.offset_dps
    scatter, random = data.scatter(axis), None
    if design.shifts or len(design.angles) or prior is not None:
        scatter = _with_white_noise(design, y, scatter)
    columns, known = design.columns, PriorRows.none(design.columns.shape[1])
    if scatter.white_var is not None:  # without it, what is known has no weight beside the data
        more, u = beside(data, design)
        columns, known = np.column_stack([columns, more]), known.with_coefficients(u)
        if prior is not None:
            known = known.plus(*prior_rows(design, model, axis, prior))
    if design.shifts:
        kinds = np.array([shift.kind for shift in design.shifts])
        random = RandomEffects(np.unique(kinds, return_inverse=True)[1], _largest(design))
    known_beside = considered(design.held, columns, knows_white=scatter.white_var is not None)
    if late is not None:
        known_beside = late.beside(known_beside)
    drift = noise.drift_beside(scatter) if noise else None
    try:
        return solve(columns, y, scatter, drift, random, known_beside, known)
    except NotEnoughData as error:
        raise NotEnoughData(f"{data.info.serial}, axis {axis}, model {model.name}: {error}") from None


def beside(data: FitData, design: AxisDesign) -> tuple[NDArray[np.float64], Array]:
    """Return what is fitted beside a model, columns (m, b), and the standard uncertainty of each coefficient, (b,).

    They are the Earth's rate that goes round, the angles of the mountings and the shifts between recordings. Of the
    Earth's rate only the direction of north is unknown: each of cosine and sine is 0 with the standard deviation that
    a vector of the known size has along a random direction.
    """
    turning_u = np.full(design.turning.shape[1], turning_size_dps(data.info) / np.sqrt(2.0))
    shifts = [shift.values[:, None] for shift in design.shifts]
    columns = np.concatenate([design.turning, design.angles.values, *shifts], axis=1)
    return columns, np.concatenate([turning_u, design.angles.size, _largest(design)])


def _largest(design: AxisDesign) -> Array:
    return np.array([KINDS[shift.kind].largest for shift in design.shifts])


def prior_rows(
    design: AxisDesign, model: ErrorModel, axis: str, prior: CoefficientPrior
) -> tuple[NDArray[np.float64], Array]:
    """Return what a prior says of the estimated columns of an axis, as whitened rows (q, c) and values (q,)."""
    owners, names = [owner for owner, _, _ in design.names], [name for _, name, _ in design.names]
    return prior.whitened(design.spread, coefficient_names(model, axis, owners, names))


def _with_white_noise(design: AxisDesign, y: Array, scatter: Scatter) -> Scatter:
    """Return a scatter whose white noise is known: where the readings do not say it, by what the design leaves."""
    if scatter.white_var is not None:
        return scatter
    columns = np.column_stack([design.columns, design.angles.values, *(shift.values for shift in design.shifts)])
    rank = rank_of(columns)
    if len(y) <= rank:
        raise NotEnoughData(
            f"{len(y)} data sets are too few to fit {rank} coefficients (including what differs between recordings and "
            f"mountings) and to estimate the error of the fit: at least {rank + 1} are needed; measure more data sets, "
            "or leave effects out"
        )
    coordinates, *_ = np.linalg.lstsq(columns, y, rcond=1e-12)
    residual = y - columns @ coordinates
    return replace(scatter, white_var=np.full(len(y), max(float(residual @ residual) / (len(y) - rank), 1e-20)))


def _axis_fit(design: AxisDesign, solution: Solution, late: TimeErrors | None = None) -> AxisFit:
    names = design.names
    values, covariance = joint_covariance(solution, design.held, design.spread)
    parts: tuple[ErrorPart, ...] = ()
    if late is not None and solution.along_held is not None:
        estimated, held = design.spread.shape[1], design.held.columns.shape[1]
        parts = late.parts(np.asarray(design.spread @ solution.along_held[:estimated, held:]))
    return AxisFit(
        tuple(owner for owner, _, _ in names),
        tuple(name for _, name, _ in names),
        tuple(unit_symbol for _, _, unit_symbol in names),
        values.reshape(len(names), -1),
        sum((part.covariance for part in parts), covariance),
        parts,
    )


def residuals(fitted: FittedModel, data: FitData, nuisance: Mapping[str, Nuisance] | None = None) -> dict[str, Array]:
    """Return corrected minus true rate, axis -> (m,) deg/s; `nuisance` is what was fitted beside the model.

    The table's rates about axes without an output are known, and enter the correction: what one output alone cannot
    correct is no error of the model (`RateVectorUncertainty` states it). No correction undoes a delay or a bandwidth,
    so the true rate is what comes through them.
    """
    if nuisance and not data.angles_known:
        data = leaning(data, nuisance)
    outputs = {a: v - nuisance[a].error_dps(data, a) if nuisance else v for a, v in data.outputs.items()}
    delayed = {axis: data.through(response_of(fitted.axes[axis])) for axis in outputs}
    across_dps = next(iter(delayed.values())).across_dps
    corrected = without_response(fitted).compensate(outputs, data.channels, across_dps)
    return {axis: corrected[axis] - delayed[axis].true_rate_dps(axis) for axis in outputs}


def fit_turning(fitted: FittedModel, data: FitData) -> dict[str, Nuisance]:
    """Return the once-per-turn Earth rate by axis that a recording shows.

    For judging a calibration on a recording that it was not fitted to: the direction of north is not known in advance.
    """
    residuals_dps = residuals(fitted, data)
    by_axis: dict[str, Nuisance] = {}
    for axis, values in residuals_dps.items():
        columns = turning_columns(data.info, data.channels, axis)
        independent = columns.shape[1] > 0 and rank_of(columns) == columns.shape[1]
        turning = np.asarray(np.linalg.lstsq(columns, values)[0] if independent else [], dtype=np.float64)
        by_axis[axis] = Nuisance(turning)
    return by_axis
