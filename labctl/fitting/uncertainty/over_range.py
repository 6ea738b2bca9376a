"""The largest uncertainty of a corrected rate over a range, for a campaign that ends when it is small enough.

It is U of a calibration, at the places of the same grid as the bound of its document. While a campaign runs, a lower
bound is enough most of the time: the fit by the white noise of the readings alone. Drift and a lack of fit can only add
to the covariance of that fit, and the error of the model and the repeatability to its U, so a campaign whose lower
bound is above a limit need not be fitted to know that U is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from labctl.errors import LabctlError
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.mounting_angles import mountings_of
from labctl.fitting.data.temperature.channel import is_chambers
from labctl.fitting.estimation.axis_solutions import leaning, solve_axes
from labctl.fitting.estimation.fit import fit_preset, held_out_errors
from labctl.fitting.estimation.held import with_held
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.models.presets import Preset, preset_for
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.drift_noise import NO_DRIFT
from labctl.fitting.numeric.least_squares import Solution
from labctl.fitting.uncertainty.budget import Budget, BudgetLine, budget_of
from labctl.fitting.uncertainty.conditions import conditions_of
from labctl.fitting.uncertainty.evaluated_lines import NO_POWER_ON
from labctl.fitting.uncertainty.grid import MIN_SPAN_K, grid_rates, grid_temperatures
from labctl.fitting.uncertainty.local_model_error import LocalModelError
from labctl.fitting.uncertainty.rate import COVERAGE
from labctl.fitting.uncertainty.rate_vector import rate_vector_uncertainty
from labctl.fitting.uncertainty.repeatability import by_datasheet
from labctl.fitting.uncertainty.standard_lines import Sensitivities, standard_lines
from labctl.fitting.uncertainty.use import AxisEvidence, use_evidence
from labctl.recording import Recording, RecordingInfo

#: Name of what is fitted, in messages.
NAME = "the campaign"
#: Covers what a correlation between outputs, which the lower bound leaves out, can take off U.
MARGIN = 0.95


@dataclass(frozen=True)
class Range:
    """Rates about the axis of each output and temperatures of the unit over which U is wanted."""

    rates_dps: tuple[float, float]
    temperature_c: tuple[float, float]
    repeatability: bool = True  #: whether U counts the difference of a later power-on

    @property
    def places(self) -> list[tuple[float, float]]:
        """The rates, deg/s, and temperatures, deg C, of the grid on which a document bounds U."""
        return [
            (rate, temperature_c)
            for temperature_c in grid_temperatures(*self.temperature_c)
            for rate in grid_rates(*self.rates_dps)
        ]


@dataclass(frozen=True)
class LargestU:
    """The largest U over a range, and where it is."""

    u_dps: float | None  #: expanded, 95.45 %; None: unknown there
    axis: str = ""
    rate_dps: float = 0.0
    temperature_c: float = 0.0
    why: str = ""  #: why it is unknown
    parts_dps: Mapping[str, float] | None = None  #: source -> standard uncertainty that it adds there
    noise_dps: float = 0.0  #: of one data set more, standard deviation of its mean

    def more_sets(self, limit_dps: float) -> int | None:
        """Return how many data sets more at this place bring U there to a limit; None where no number of them does.

        They make the coefficients better known and leave every other part as it is.
        """
        if self.u_dps is None or not self.parts_dps or self.u_dps <= limit_dps:
            return None
        own = self.parts_dps.get("coefficients", 0.0) ** 2
        total = sum(part**2 for part in self.parts_dps.values())
        k = self.u_dps / math.sqrt(total)
        left = (limit_dps / k) ** 2 - (total - own)
        if left <= 0 or own <= 0:
            return None
        return max(math.ceil(self.noise_dps**2 * (1 / left - 1 / own)), 1)


def data_and_preset(recording: Recording, model: str | None, effects: Iterable[str]) -> tuple[FitData, Preset]:
    """Return what a fit works on and the model as it fits it. Raises BadInput, NotEnoughData."""
    data = fit_data_of(recording)
    return data, with_shapes(data, with_held(data, preset_for(model, list(effects)), None))


@single_threaded
def largest_u(data: FitData, preset: Preset, over: Range) -> LargestU:
    """Return the largest U over a range of the calibration that a fit to these data sets makes.

    Unknown, with the reason, where the data sets do not determine the model, and where one of them has no other near.
    """
    try:
        result = fit_preset(data, preset)
        seen = use_evidence(data, preset)
        evidence = {
            axis: AxisEvidence.from_json(one.to_json()) for axis, one in seen.items()
        }  # as a document rounds it
        exported, _ = result.exported()
        bench = conditions_of(data.info, result.environment, [], result.mountings, result.angles_rad)

        def budget(axis: str, rate_dps: float, temperature_c: float) -> Budget:
            at = rate_vector_uncertainty(
                exported, {axis: rate_dps}, temperature_c, evidence=evidence, name=NAME, bench=bench
            )
            return _counted(at.budgets[axis], over)

        return _with_noise(_largest(exported, over, budget), result)
    except LabctlError as error:
        return LargestU(None, why=str(error))


@single_threaded
def least_u(data: FitData, preset: Preset, over: Range) -> LargestU:
    """Return a lower bound of `largest_u`, in a small part of its time: by white noise and reference standards alone.

    Unknown where the data sets do not determine the model; 0 where the white noise of the readings is not known.
    """
    if data.white_var is None:
        return LargestU(0.0)
    try:
        model, rows = preset.build(data)
        training = data.take(rows)
        require_enough_data(training, model)
        solved = solve_axes(training, model, dict.fromkeys(data.outputs, NO_DRIFT))
        fits = {axis: _by_white(fit, solved.solutions[axis]) for axis, fit in solved.fits.items()}
        exported, _ = FittedModel(model, fits).exported()
        environment = {"temperature": NAME} if is_chambers(data.channels.columns) else {}
        bench = conditions_of(data.info, environment, [], mountings_of(data.channels))  # type: ignore[arg-type]

        def budget(axis: str, rate_dps: float, temperature_c: float) -> Budget:
            at = rate_vector_uncertainty(exported, {axis: rate_dps}, temperature_c, evidence={}, name=NAME, bench=bench)
            return _of_known(at.budgets[axis].lines)

        largest = _largest(exported, over, budget)
    except LabctlError as error:
        return LargestU(None, why=str(error))
    return replace(largest, u_dps=None if largest.u_dps is None else MARGIN * largest.u_dps)


#: Said of a fit whose lack of fit cannot be seen.
CANNOT_LEAVE_OUT = "no inner temperature can be left out of the fit yet, so a lack of fit could not be seen"


@single_threaded
def lack_of_fit(data: FitData, preset: Preset, over: Range, limit_dps: float) -> str:
    """Return why U may be too small because the model may be wrong between temperatures, in words; empty: it is not.

    U of a fit counts what the model leaves at data sets that it has not seen. Of a model with as many coefficients as
    temperatures nothing is left, whether it is right or wrong. Each inner temperature is therefore left out in turn:
    the error there beyond the noise of a mean, twice its root mean square, must not be above the limit either.
    """
    if over.temperature_c[1] - over.temperature_c[0] < MIN_SPAN_K:
        return ""
    try:
        model, rows = preset.build(data)
        solved = solve_axes(data.take(rows), model)
        errors = held_out_errors(leaning(data, solved.nuisance), replace(preset, inner_only=True), solved.noise)
    except LabctlError:
        return CANNOT_LEAVE_OUT
    if not errors:
        return CANNOT_LEAVE_OUT
    beyond_dps = {}
    for axis, values in errors.items():
        noise_dps = float(np.sqrt(np.mean(data.noise_floor.axes[axis].floor_dps ** 2)))
        beyond_dps[axis] = math.sqrt(max(float(np.mean(values**2)) - noise_dps**2, 0.0))
    worst = max(beyond_dps, key=lambda axis: beyond_dps[axis])
    if COVERAGE * beyond_dps[worst] <= limit_dps:
        return ""
    return (
        f"at inner temperatures left out of the fit the error about {worst} is {beyond_dps[worst]:.2g} deg/s RMS "
        "beyond the noise: the model may be wrong between the temperatures"
    )


def unreachable_below(info: RecordingInfo, over: Range, powered_runs: int) -> LargestU:
    """Return what U cannot fall below over a range, however long is measured: by reference standards and data sheet.

    For a unit without errors; its temperature dependence, which a thermometer of the bench would count by, is not known
    before it is measured. Unknown where one powered run is measured and nothing states how a later one differs.
    """
    bench = conditions_of(info, {}, [], {})
    later: list[BudgetLine] = []
    if over.repeatability and powered_runs < 2:
        sheet = by_datasheet(info)
        if sheet is None:
            return LargestU(None, why=NO_POWER_ON)
        later = [
            BudgetLine(
                "repeatability", sheet.name, "B", sheet.distribution, sheet.u_dps, "deg/s", 1.0, sheet.u_dps,
                sheet.freedom,
            )
        ]  # fmt: skip
    unreachable = []
    for axis in info.axes:
        for rate, temperature_c in over.places:
            lines = [source.lines[0] for source in standard_lines(bench, _of_ideal(rate))]
            unreachable.append(_placed(_of_known([*lines, *later]), axis, rate, temperature_c))
    return max(unreachable, key=lambda each: each.u_dps or 0.0)


def not_near(rates_dps: Array, temperatures_c: Array, over: Range) -> str:
    """Return a place of a range near which none of the planned data sets is, (n,) each, so that U stays unknown there.

    `rates_dps` are those about one axis, `temperatures_c` set points. Empty where each place has data sets near it.
    """
    planned = LocalModelError(rates_dps, temperatures_c, np.ones(len(rates_dps)), np.zeros(len(rates_dps)))
    for rate_dps, temperature_c in over.places:
        if reason := planned.unknown_at(rate_dps, temperature_c):
            return f"at {rate_dps:g} deg/s and {temperature_c:g} deg C {reason}"
    return ""


def _of_ideal(rate_dps: float) -> Sensitivities:
    """Return how a corrected rate of a unit without errors follows errors of the bench."""
    return Sensitivities.of_one(
        relative_rate=rate_dps, rate_dps=float(np.sign(rate_dps)), level=1.0, angle_squared=rate_dps / 2
    )


def _by_white(fit: AxisFit, solution: Solution) -> AxisFit:
    """Return a fit with the covariance by the white noise alone: a larger scatter about it may be drift."""
    return replace(fit, covariance=fit.covariance / solution.scale, parts=())


def _counted(budget: Budget, over: Range) -> Budget:
    if over.repeatability:
        return budget
    return budget_of("same_run", budget.unit, [line for line in budget.lines if line.source != "repeatability"])


def _of_known(lines: Iterable[BudgetLine]) -> Budget:
    return budget_of("least", "deg/s", [line for line in lines if line.contribution is not None])


def _largest(fitted: FittedModel, over: Range, budget: Callable[[str, float, float], Budget]) -> LargestU:
    """Return the place with the largest U; where it is unknown somewhere, the first such place."""
    largest: list[LargestU] = []
    for rate_dps, temperature_c in over.places:
        for axis in fitted.axes:
            place = _placed(budget(axis, rate_dps, temperature_c), axis, rate_dps, temperature_c)
            if place.u_dps is None:
                return place
            largest.append(place)
    return max(largest, key=lambda each: each.u_dps or 0.0)


def _placed(budget: Budget, axis: str, rate_dps: float, temperature_c: float) -> LargestU:
    unknown = [line for line in budget.lines if line.kind == "A" and line.contribution is None]
    reason = "; ".join(f"{line.source}: {line.why}" for line in unknown)
    parts = {line.source: line.contribution for line in budget.lines if line.contribution}
    return LargestU(budget.expanded, axis, rate_dps, temperature_c, reason, parts)


def _with_noise(largest: LargestU, result: FitResult) -> LargestU:
    """Return it with the noise of one data set more about its axis."""
    noise = result.noise.get(largest.axis)
    if noise is None:
        return largest
    drift_dps, white_dps = noise["drift_dps"] or 0.0, noise["white_dps"] or 0.0
    return replace(largest, noise_dps=math.hypot(white_dps, drift_dps, (noise["per_rate"] or 0.0) * largest.rate_dps))
