"""Least-squares solution of every axis of a model, and the residuals that it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.earth import turning_columns, turning_size_dps, with_known_size, with_prior
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.mean_noise import response_dps
from labctl.fitting.data.mounting_angles import leaning_rates
from labctl.fitting.data.rate_profile import DELAY, TIME_CONSTANT
from labctl.fitting.data.shifts import KINDS, shifts_of
from labctl.fitting.estimation.axis_design import AxisDesign, axis_design
from labctl.fitting.estimation.held import considered, joint_covariance
from labctl.fitting.estimation.response import (
    first_response,
    next_response,
    response_at,
    response_of,
    with_response,
    without_response,
)
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.error_part import ErrorPart
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Scatter
from labctl.fitting.numeric.least_squares import Considered, Solution, rank_of, solve
from labctl.fitting.numeric.variance_components import RandomEffects
from labctl.recording.columns import TIME_COMMON_U_S, TIME_U_S

# The time of a reference rate that changes: an error of it moves a delay in full, and others by what it does to them.
#
# An encoder is read by request and reply. When in between the angle was taken is not known, so the whole course is
# early or late, and no number of readings averages that out: a consider covariance, as of coefficients that are held.


@dataclass(frozen=True)
class TimeErrors:
    """Errors of the time of the reference: one that all data sets have in common, then one of each data set's own."""

    columns: NDArray[np.float64]  #: (m, 1 + j) change of the output, deg/s, by one standard uncertainty of each
    common_u_s: float
    own_u_s: float  #: root mean square over the data sets

    def beside(self, known: Considered | None, rows: int) -> Considered:
        """Return these as considered columns behind those that are; a design has `rows`, priors below the data."""
        more = np.vstack([self.columns, np.zeros((rows - len(self.columns), self.columns.shape[1]))])
        if known is None:
            return Considered(more, np.zeros((rows, 0)))
        return replace(known, columns=np.column_stack([known.columns, more]))

    def parts(self, along: NDArray[np.float64]) -> tuple[ErrorPart, ...]:
        """Return the parts of a covariance; `along` (k, 1 + j) is the change of the coefficients by each."""
        found = (
            ErrorPart(TIME_COMMON_U_S.removesuffix("_u_s"), self.common_u_s, "s", along[:, :1]),
            ErrorPart(TIME_U_S.removesuffix("_u_s"), self.own_u_s, "s", along[:, 1:]),
        )
        return tuple(part for part in found if part.u > 0)


def time_errors(data: FitData, axis: str) -> TimeErrors | None:
    """Return the errors of the reference's time in one output; None where the rate is constant or nothing states them.

    Raises BadInput for an uncertainty below 0.
    """
    profile = data.channels.profile
    if profile is None or not (TIME_U_S in data.channels or TIME_COMMON_U_S in data.channels):
        return None
    own_s, common_s = (_stated(data, name) for name in (TIME_U_S, TIME_COMMON_U_S))
    slope = data.channels.up(axis) * profile.slope(DELAY, data.channels.response)
    sets = np.asarray(data.channels["dataset"], dtype=np.int64)
    here = [sets == number for number in np.unique(sets[own_s > 0])]
    columns = np.column_stack([slope * common_s, *(slope * own_s * rows for rows in here)])
    return TimeErrors(columns, _rms(common_s[common_s > 0]), _rms(np.array([own_s[rows].mean() for rows in here])))


def _stated(data: FitData, name: str) -> Array:
    """Return a column of uncertainties (m,) s, 0 where none is stated: of a rate that is constant no time matters."""
    if name not in data.channels:
        return np.zeros(len(data))
    values = np.asarray(data.channels[name], dtype=np.float64)
    if np.any(values < 0) or np.any(np.isinf(values)):
        worst = float(values[(values < 0) | np.isinf(values)][0])
        raise BadInput(
            f"{data.info.serial}: column {name!r} has {worst:g} s; give a standard uncertainty of at least 0 s, or "
            "leave the column out where none is known"
        )
    return np.nan_to_num(values)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def with_common_error(data: FitData, axis: str, columns: NDArray[np.float64], solution: Solution) -> Solution:
    """Return a solution whose covariance holds the turns' common error, `turn_common_u` of recording.toml.

    All angles too large by a share make the fitted response to the rate too small by that share, in scale factor and
    misalignment together (GUM F.1.2.3). `columns` (m, k) are the model's, the first k of the solution's.
    """
    share = data.info.turn_common_u
    if not share or data.info.motion != "turns":
        return solution
    along, *_ = np.linalg.lstsq(columns, response_dps(data.channels.rates, data.outputs[axis]), rcond=None)
    along = np.concatenate([along, np.zeros(len(solution.values) - columns.shape[1])])
    return replace(solution, covariance=solution.covariance + share**2 * np.outer(along, along))


#: Steps after which a nonlinear coefficient is taken as it is.
GAUSS_NEWTON_STEPS = 30


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
        for shift in shifts_of(data.channels, axis) if self.shifts else ():
            error += self.shifts.get(shift.name, 0.0) * shift.values
        return error


@dataclass(frozen=True)
class AxisSolutions:
    """Solution of a model: coefficients, solver output and the Earth's rate that goes round, each by axis."""

    fits: Mapping[str, AxisFit]
    solutions: Mapping[str, Solution]
    nuisance: Mapping[str, Nuisance]  #: what is no part of the model: the Earth's rate, shifts between recordings

    @property
    def turning(self) -> dict[str, Array]:
        """The Earth's rate that goes round with the table, axis -> cosine and sine per position, deg/s."""
        return {axis: found.turning for axis, found in self.nuisance.items()}


def solve_axes(data: FitData, model: ErrorModel, fixed: Mapping[str, Solution] | None = None) -> AxisSolutions:
    """Fit every axis of a model; with `fixed` the drift of each axis is that solution's and not searched for.

    Where angles of the mountings are separated, all axes are fitted once more with the rates of a unit that leans so:
    each output shows the rates about the others by its own coefficients.

    Raises NotEnoughData where the data sets do not determine the coefficients.
    """
    found = _solve_each(data, model, fixed)
    if not any(each.angles_rad for each in found.nuisance.values()):
        return found
    rates = leaning(data, found.nuisance).channels.rates
    again = _solve_each(replace(data, channels=data.channels.with_rates(rates)), model, fixed)
    return replace(again, nuisance={axis: found.nuisance[axis].plus(each) for axis, each in again.nuisance.items()})


def _solve_each(data: FitData, model: ErrorModel, fixed: Mapping[str, Solution] | None) -> AxisSolutions:
    fits, solutions, nuisance = {}, {}, {}
    for axis in data.outputs:
        design, solution, late = _converged(data, model, axis, fixed[axis] if fixed else None)
        solution = with_common_error(data, axis, design.columns, solution)
        fits[axis] = _axis_fit(design, solution, late)
        solutions[axis], nuisance[axis] = replace(solution, white_dps=data.white_dps(axis)), _nuisance(design, solution)
    return AxisSolutions(fits, solutions, nuisance)


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
    rates = leaning_rates(data.channels, {axis: found.angles_rad for axis, found in nuisance.items()})
    return replace(data, channels=data.channels.with_rates(rates), angles_known=True)


def _converged(
    data: FitData, model: ErrorModel, axis: str, fixed: Solution | None
) -> tuple[AxisDesign, Solution, TimeErrors | None]:
    """Return the design at the solution, the solution, and the errors of the reference's time that are in it.

    Laws are solved by Gauss-Newton steps at one drift, then once more. A delay and a bandwidth are laws of their own
    effect, and every other effect sees the rate that comes through both.
    """
    response = first_response(data, model, axis)
    data = data.through(response)
    design = axis_design(data, model, axis)
    solution = _solve_axis(data, model, axis, design, fixed)
    for _ in range(GAUSS_NEWTON_STEPS if design.laws else 0):
        before, at = solution.values, _law_coefficients(design, solution)
        if data.channels.profile is not None:
            u_s = _axis_fit(design, solution).u_of(TIME_CONSTANT)
            response = next_response(response, response_at(at), model, u_s)
            data, at = data.through(response), with_response(at, response)
        design = axis_design(data, model, axis, at)
        solution = _solve_axis(data, model, axis, design, fixed or solution)
        if np.allclose(solution.values, before, rtol=1e-7, atol=1e-14):
            break
    late = time_errors(data, axis)
    if design.laws or late is not None:
        solution = _solve_axis(data, model, axis, design, fixed, late)
    return design, solution, late


def _law_coefficients(design: AxisDesign, solution: Solution) -> dict[str, NDArray[np.float64]]:
    """Return name -> (nodes,) of the coefficients that enter by a law."""
    table = (design.spread @ solution.values[: design.columns.shape[1]]).reshape(len(design.names), -1)
    return {name: row for (_, name, _), row in zip(design.names, table, strict=True) if name in design.laws}


def _solve_axis(
    data: FitData,
    model: ErrorModel,
    axis: str,
    design: AxisDesign,
    fixed: Solution | None,
    late: TimeErrors | None = None,
) -> Solution:
    if design.columns.shape[1] == 0:
        raise NotEnoughData(
            f"{data.info.serial}, axis {axis}: the rates in this recording cause none of the effects of model "
            f"{model.name} ({', '.join(model.effect_ids)}); record rates about the other axes of the unit too"
        )
    y = data.outputs[axis] - data.true_rate_dps(axis) - design.offset_dps
    known, random = data.scatter(axis), None
    if design.shifts or len(design.angles):
        known = _with_white_noise(design, y, known)
    columns, y, scatter = with_known_size(design.columns, design.turning, y, known, turning_size_dps(data.info))
    columns, y, scatter = with_prior(columns, design.angles.values, y, scatter, design.angles.size**2)
    if design.shifts:
        wide = np.array([KINDS[shift.kind].largest for shift in design.shifts])
        values = np.column_stack([shift.values for shift in design.shifts])
        columns, y, scatter = with_prior(columns, values, y, scatter, wide**2)
        kinds = np.array([shift.kind for shift in design.shifts])
        random = RandomEffects(np.unique(kinds, return_inverse=True)[1], wide)
    columns, y, scatter, known_beside = considered(design.held, columns, y, scatter)
    if late is not None:
        known_beside = late.beside(known_beside, len(columns))
    try:
        return solve(columns, y, scatter, fixed.drift if fixed else None, random, known_beside)
    except NotEnoughData as error:
        raise NotEnoughData(f"{data.info.serial}, axis {axis}, model {model.name}: {error}") from None


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
    taken, *_ = np.linalg.lstsq(columns, y, rcond=1e-12)
    left = y - columns @ taken
    return replace(scatter, white_var=np.full(len(y), max(float(left @ left) / (len(y) - rank), 1e-20)))


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
        tuple(unit for _, _, unit in names),
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
    seen = {axis: data.through(response_of(fitted.axes[axis])) for axis in outputs}
    across_dps = next(iter(seen.values())).across_dps
    corrected = without_response(fitted).compensate(outputs, data.channels, across_dps)
    return {axis: corrected[axis] - seen[axis].true_rate_dps(axis) for axis in outputs}


def fit_turning(fitted: FittedModel, data: FitData) -> dict[str, Nuisance]:
    """Return the once-per-turn Earth rate by axis that a recording shows.

    For judging a calibration on a recording that it was not fitted to: the direction of north is not known in advance.
    """
    left = residuals(fitted, data)
    found: dict[str, Nuisance] = {}
    for axis, values in left.items():
        columns = turning_columns(data.info, data.channels, axis)
        independent = columns.shape[1] > 0 and rank_of(columns) == columns.shape[1]
        turning = np.asarray(np.linalg.lstsq(columns, values)[0] if independent else [], dtype=np.float64)
        found[axis] = Nuisance(turning)
    return found
