"""Uncertainty of a corrected rate vector: the covariance of the three corrected rates at any rate and temperature.

The estimate v of a true rate w is off by v - w = -(dE w + db) to first order, where dE and db are the errors of the
coefficients; they come from the fit and from the standards of the bench. A clock that is off by c gives dE = c I; a
mounting that is off by a small rotation f gives a column f x a of dE, across its axis a and never along it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import permutations

import numpy as np

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.mounting_angles import ANGLE_QUANTITIES, AngleGains
from labctl.fitting.data.tilted_mountings import TILTED, leaning_mountings
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.budget import Budget, BudgetLine, budget_of
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.evaluated_lines import coefficient_line, model_line, repeatability_line
from labctl.fitting.uncertainty.sensitivity import correction_gain, error_at, response
from labctl.fitting.uncertainty.standard_lines import Sensitivities, SourceLines, standard_lines
from labctl.fitting.uncertainty.time_lines import time_lines
from labctl.fitting.uncertainty.use import AxisEvidence

#: Largest rate, deg/s, and temperature, deg C, that are taken for a gyro's.
LARGEST = 1e5
#: The line of rates about body axes that have no output: nothing corrects what they add.
CROSS_RATES = "cross_rates"


@dataclass(frozen=True)
class RateVectorUncertainty:
    """Uncertainty of the corrected rates of a unit at one rate vector; noise of single readings is not included."""

    rates_dps: Mapping[str, float]  #: true rate about each body axis
    temperature_c: float
    outputs: tuple[str, ...]
    sources: tuple[SourceLines, ...]  #: in the frame of the case
    aligned_sources: tuple[SourceLines, ...]  #: up to a rotation of the frame: for a unit that is aligned in use

    @cached_property
    def budgets(self) -> dict[str, Budget]:
        """Output -> budget of its corrected rate in the frame of the case."""
        return {axis: _budget(self.sources, row) for row, axis in enumerate(self.outputs)}

    @cached_property
    def aligned_budgets(self) -> dict[str, Budget]:
        """Output -> budget of its corrected rate up to a rotation of the frame."""
        return {axis: _budget(self.aligned_sources, row) for row, axis in enumerate(self.outputs)}

    @property
    def unknown(self) -> dict[str, dict[str, str]]:
        """Output -> line of type A that is unknown -> why."""
        return {
            axis: {line.source: line.why for line in budget.lines if line.kind == "A" and line.contribution is None}
            for axis, budget in self.budgets.items()
        }

    @property
    def covariance(self) -> Array:
        """The covariance of the corrected rates, (n, n) (deg/s)^2 over the outputs; NaN where a part is unknown."""
        return _covariance(self.sources)

    @property
    def aligned_covariance(self) -> Array:
        """The same up to a rotation of the frame."""
        return _covariance(self.aligned_sources)


def rate_vector_uncertainty(
    fitted: FittedModel,
    rates_dps: Mapping[str, float],
    temperature_c: float,
    *,
    evidence: Mapping[str, AxisEvidence],
    name: str,
    bench: BenchConditions | None = None,
) -> RateVectorUncertainty:
    """Return the uncertainty of the corrected rates at a true rate about each body axis, deg/s (0 where not named).

    It holds for use on later days. `evidence` is what the calibration's recording shows by axis (`use_evidence`); an
    output without it is uncertain by an unknown amount. `bench` states the reference standards; None: not known. `name`
    identifies the calibration in messages. What a rate about an axis without output adds is not known from the other
    outputs, so it counts in full.
    Raises BadInput for a number that no gyro measures, and where the model needs more than rate and temperature;
    NotEnoughData where the coefficients have no uncertainty.
    """
    _require_numbers(rates_dps, temperature_c)
    require_law_of_rate_and_temperature(fitted, name)
    place = _Place(fitted, {axis: float(rates_dps.get(axis, 0.0)) for axis in BODY_AXES}, temperature_c)
    evaluated = place.evaluated(evidence)
    evaluated += place.of_time(bench)
    sensitivities = place.sensitivities(bench)
    stated_lines = standard_lines(bench, sensitivities)
    aligned = standard_lines(bench, replace(sensitivities, angles=place.mounting_angles(bench, aligned=True)))
    return RateVectorUncertainty(
        place.rates_dps, temperature_c, place.outputs, (*evaluated, *stated_lines), (*evaluated, *aligned)
    )


def require_law_of_rate_and_temperature(fitted: FittedModel, name: str) -> None:
    """Raise BadInput where a model needs more than these; NotEnoughData where its coefficients have no uncertainty."""
    if fitted.model.needs:
        raise BadInput(
            f"{name}: its model also needs {', '.join(fitted.model.needs)};"
            " an uncertainty at a rate and a temperature alone is not defined; use a version whose model does "
            "not need them"
        )
    if any(np.isnan(f.covariance).any() and not fitted.model.held.without_u(a) for a, f in fitted.axes.items()):
        raise NotEnoughData(
            f"{name} has as many coefficients as data sets: no residual is left to estimate the uncertainty from; "
            "measure more data sets"
        )


def _require_numbers(rates_dps: Mapping[str, float], temperature_c: float) -> None:
    if strange := set(rates_dps) - set(BODY_AXES):
        raise BadInput(
            f"rate about {', '.join(sorted(strange))}: a unit has the body axes x, y and z; name one of them"
        )
    numbers = [(f"rate_dps about {axis}", rate, "deg/s") for axis, rate in rates_dps.items()]
    for name, value, unit_symbol in [*numbers, ("temperature_c", temperature_c, "deg C")]:
        if not abs(value) <= LARGEST:  # also false for NaN
            raise BadInput(
                f"{name} = {value} {unit_symbol}: give a number between {-LARGEST:g} and {LARGEST:g} {unit_symbol}"
            )


@dataclass(frozen=True)
class _Place:
    """A model at one rate vector and temperature."""

    fitted: FittedModel
    rates_dps: Mapping[str, float]
    temperature_c: float

    @property
    def outputs(self) -> tuple[str, ...]:
        return tuple(self.fitted.axes)

    @cached_property
    def response(self) -> Array:
        """The slopes of the outputs along the rates about x, y and z, (n, 3)."""
        return response(self.fitted, self.rates_dps, self.temperature_c)

    @cached_property
    def gain(self) -> Array:
        """How errors of the outputs appear in the corrected rates, (n, n)."""
        return correction_gain(self.fitted, self.response)

    def evaluated(self, evidence: Mapping[str, AxisEvidence]) -> list[SourceLines]:
        """Return the lines that come from the recording, and that of rates which the user does not know."""
        fitted, temperature_c, alone = self.fitted, self.temperature_c, np.eye(len(self.outputs))
        related = _correlation(self.outputs, evidence)
        coefficients = [
            coefficient_line(fitted, error_at(axis, self.rates_dps), temperature_c, evidence.get(axis), "deg/s")
            for axis in self.outputs
        ]
        model = [model_line(fitted, axis, evidence.get(axis), self.rates_dps, temperature_c) for axis in self.outputs]
        later = [repeatability_line(fitted, evidence.get(axis)) for axis in self.outputs]
        evaluations = [
            _propagated(coefficients, related, self.gain),
            _propagated(model, related, alone),
            _propagated(later, alone, alone),
        ]
        unread = [axis for axis in BODY_AXES if axis not in self.outputs and self.rates_dps[axis]]
        return [*evaluations, self._cross_rates(unread)] if unread else evaluations

    def of_time(self, bench: BenchConditions | None) -> list[SourceLines]:
        """Return the lines of the time of a reference rate that changed."""
        laws = [error_at(axis, self.rates_dps) for axis in self.outputs]
        return time_lines(self.fitted, laws, self.temperature_c, bench, self.gain)

    def _cross_rates(self, unread: Sequence[str]) -> SourceLines:
        read = {axis: rate for axis, rate in self.rates_dps.items() if axis not in unread}
        added = [
            error_at(axis, self.rates_dps).value(self.fitted, self.temperature_c)
            - error_at(axis, read).value(self.fitted, self.temperature_c)
            for axis in self.outputs
        ]
        about = " and ".join(unread)
        reason = f"the unit has no output about {about}, so the correction cannot take it off"
        lines = tuple(
            BudgetLine(
                CROSS_RATES, f"rate about {about}", "B", "normal", None, "deg/s", None, 0.0, uncorrected=float(error),
                why=reason,
            )
            for error in self.gain @ np.array(added)
        )  # fmt: skip
        return SourceLines(lines, np.zeros((len(lines), len(lines))))

    def sensitivities(self, bench: BenchConditions | None) -> Sensitivities:
        """Return how the corrected rates follow errors of the bench, apart from the sign."""
        rates = np.array([[self.rates_dps[axis]] for axis in self.outputs])
        slopes = [error_at(a, self.rates_dps).temperature_slope(self.fitted, self.temperature_c) for a in self.outputs]
        return Sensitivities(
            relative_rate=rates,
            rate_dps=np.sign(rates),
            temperature=self.gain @ np.array(slopes)[:, None],
            angles=self.mounting_angles(bench, aligned=False),
            angle_squared=rates[:, 0] / 2,  # along its own axis only the cosine is lost
            level=self.gain @ np.ones((len(rates), 1)),
        )

    def mounting_angles(self, bench: BenchConditions | None, *, aligned: bool) -> dict[str, Array]:
        """Return quantity -> d corrected rate / d such an angle of mountings, (n, 6) deg/s per radian.

        There is one for each body axis up and each other axis towards which it leans.

        With axis p up, a mounting that leans towards axis r turns the unit about r as well. Output r gets a part of the
        rate about p in its misalignment; where r has no output, the others get its part by their own misalignment.
        `aligned` is without what a rotation of the frame takes off: of two outputs the mean of both parts is left, and
        of the part about an axis without output nothing. What the mountings with one axis up separate is not in it.
        """
        if bench is not None and bench.has_tilted:
            return self._tilted_angles(bench, aligned=aligned)
        columns_by_quantity: dict[str, list[Array]] = {quantity: [] for quantity in ANGLE_QUANTITIES}
        gains = {axis: AngleGains() if bench is None else bench.angle_gains(axis) for axis in BODY_AXES}
        for up, towards in permutations(BODY_AXES, 2):
            each = np.zeros(len(self.outputs))
            if towards not in self.outputs:
                each += self.rates_dps[up] * self.response[:, BODY_AXES.index(towards)]
            elif not aligned:
                each[self.outputs.index(towards)] = self.rates_dps[up]
            elif up in self.outputs:
                each[self.outputs.index(towards)] = self.rates_dps[up] / 2
                each[self.outputs.index(up)] = self.rates_dps[towards] / 2
            for quantity, columns in columns_by_quantity.items():
                columns.append(each * gains[up].of(quantity))
        columns_by_quantity[TILTED] = [np.zeros(len(self.outputs))]
        return {quantity: np.column_stack(columns) for quantity, columns in columns_by_quantity.items()}

    def _tilted_angles(self, bench: BenchConditions, *, aligned: bool) -> dict[str, Array]:
        """Return the same for mountings of which some are tilted: two angles of each, which change the whole matrix.

        An antisymmetric change is a rotation of the frame, which `aligned` takes off where all three axes have outputs.
        """
        rates = np.array([self.rates_dps[axis] for axis in BODY_AXES])
        columns: dict[str, list[Array]] = {quantity: [] for quantity in (*ANGLE_QUANTITIES, TILTED)}
        for mounting in leaning_mountings(bench.mountings):
            for change in mounting.matrices:
                matrix = (change + change.T) / 2 if aligned and len(self.outputs) == len(BODY_AXES) else change
                added = matrix @ rates  # to the rate about each body axis
                each = sum(
                    (added[row] * self._shown_by(axis) for row, axis in enumerate(BODY_AXES)),
                    np.zeros(len(self.outputs)),
                )
                of_fixture = TILTED if mounting.is_tilted else "fixture_angle"
                for quantity in (of_fixture, "tilt", "mounting_repeatability"):
                    columns[quantity].append(each)
        none = np.zeros(len(self.outputs))
        return {quantity: np.column_stack(stacked or [none]) for quantity, stacked in columns.items()}

    def _shown_by(self, axis: str) -> Array:
        """Return how a rate about a body axis that nothing knows shows in the corrected rates, (n,)."""
        if axis not in self.outputs:
            return self.response[:, BODY_AXES.index(axis)]
        return np.array([float(axis == output) for output in self.outputs])


def _budget(sources: Sequence[SourceLines], row: int) -> Budget:
    return budget_of("corrected_rate", "deg/s", [source.lines[row] for source in sources])


def _covariance(sources: Sequence[SourceLines]) -> Array:
    total = np.sum([source.covariance for source in sources], axis=0)
    for row in range(len(total)):
        if any(source.lines[row].kind == "A" and source.lines[row].contribution is None for source in sources):
            total[row, :] = total[:, row] = np.nan
    return np.asarray(total)


def _correlation(outputs: Sequence[str], evidence: Mapping[str, AxisEvidence]) -> Array:
    """Return the correlation of the outputs' errors, (n, n), by their residuals in the fit.

    Outputs that were measured together have the same noise and drift in the same data sets, so that their coefficients
    are correlated as these are.
    """
    matrix = np.eye(len(outputs))
    for row, axis in enumerate(outputs):
        if axis in evidence:
            for other, value in evidence[axis].correlation.items():
                if other in outputs:
                    matrix[row, outputs.index(other)] = value
    return matrix


def _propagated(lines: Sequence[BudgetLine], correlation: Array, gain: Array) -> SourceLines:
    """Return lines of the outputs' errors as they are in the corrected rates (GUM eq. 16)."""
    u = np.array([np.nan if line.u is None else line.u for line in lines])
    finite_u = np.nan_to_num(u)
    covariance = gain @ (np.outer(finite_u, finite_u) * correlation) @ gain.T
    propagated = tuple(
        line if line.u is None else replace(line, u=float(s), contribution=float(s))
        for line, s in zip(lines, np.sqrt(np.maximum(np.diag(covariance), 0.0)), strict=True)
    )
    return SourceLines(propagated, covariance)
