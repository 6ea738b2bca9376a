"""Uncertainty of a corrected rate at one rate and temperature, from a fitted model and its error figures alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.uncertainty.budget import Budget, budget_of, without_repeatability
from labctl.fitting.uncertainty.combination import combined_u
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.evaluated_lines import coefficient_line, model_line, repeatability_line
from labctl.fitting.uncertainty.sensitivity import corrected_rate
from labctl.fitting.uncertainty.standard_lines import Sensitivities, no_conditions, standard_lines
from labctl.fitting.uncertainty.use import AxisEvidence

#: Factor between the expanded uncertainty and the standard one that is given beside it.
COVERAGE = 2.0
#: Largest rate, deg/s, and temperature, deg C, that are taken for a gyro's.
LARGEST = 1e5


@dataclass(frozen=True)
class RateUncertainty:
    """Uncertainties of one axis' corrected rate, deg/s; the noise of a single reading is not included."""

    coefficients_dps: float | None  #: standard, of the coefficients, through the inverted law (GUM 5.2); None: unknown
    model_dps: float | None  #: standard, error of the model and drift near there, by held-out data sets; None: unknown
    repeatability_dps: float | None  #: standard, from one power-on to the next; None: unknown
    repeatability_source: str  #: "between runs", "data sheet", "static record" or "none"
    standards_dps: float | None  #: standard, of all stated reference standards; None: none is stated
    same_run_dps: float | None  #: of all but repeatability: without another power-on
    combined_dps: float | None  #: expanded over the coverage factor; None where one of the first three is unknown
    expanded_dps: float | None  #: U of the budget
    unknown: Mapping[str, str]  #: "coefficients", "model" and "repeatability", those that are unknown -> why
    budget: Budget


def rate_uncertainty(
    fitted: FittedModel,
    rate_dps: float,
    temperature_c: float,
    *,
    evidence: Mapping[str, AxisEvidence],
    name: str,
    bench: BenchConditions | None = None,
) -> dict[str, RateUncertainty]:
    """Return axis -> the uncertainty of a corrected rate of `rate_dps` about that axis, the other axes at rest.

    It holds for use on later days. `evidence` is what the calibration's recording shows by axis (`use_evidence`); an
    axis without it is uncertain by an unknown amount. `bench` states the reference standards; None: not known. `name`
    identifies the calibration in messages.
    Raises BadInput for a number that no gyro measures, and where the model needs more than rate and temperature;
    NotEnoughData where the coefficients have no uncertainty.
    """
    for what, value, unit in (("rate_dps", rate_dps, "deg/s"), ("temperature_c", temperature_c, "deg C")):
        if not abs(value) <= LARGEST:  # also false for NaN
            raise BadInput(f"{what} = {value} {unit}: give a number between {-LARGEST:g} and {LARGEST:g} {unit}")
    require_law_of_rate_and_temperature(fitted, name)
    return {axis: _of_axis(fitted, axis, rate_dps, temperature_c, evidence.get(axis), bench) for axis in fitted.axes}


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


def _of_axis(
    fitted: FittedModel,
    axis: str,
    rate_dps: float,
    temperature_c: float,
    evidence: AxisEvidence | None,
    bench: BenchConditions | None,
) -> RateUncertainty:
    law = corrected_rate(fitted, axis, rate_dps, temperature_c)
    coefficients = coefficient_line(fitted, law, temperature_c, evidence, "deg/s")
    model = model_line(fitted, evidence, rate_dps, temperature_c)
    later = repeatability_line(fitted, evidence)
    sensitivities = Sensitivities(
        relative_rate=rate_dps,
        rate_dps=float(np.sign(rate_dps)),
        temperature=law.temperature_slope(fitted, temperature_c),
        angle=0.0,  # what a tilt adds across the axis is a misalignment; along it only the cosine is lost
        angle_squared=rate_dps / 2,
        level=1.0 / law.divisor,
    )
    standards = standard_lines(bench, sensitivities) if bench is not None else [no_conditions()]
    lines = [coefficients, model, later, *standards]
    budget = budget_of("corrected_rate", "deg/s", lines)
    known = [line.contribution for line in standards if line.contribution is not None]
    return RateUncertainty(
        coefficients.contribution,
        model.contribution,
        later.contribution,
        evidence.repeatability.source if evidence and evidence.repeatability else "none",
        combined_u(np.array(known)) if known else None,
        without_repeatability(lines),
        None if budget.expanded is None else budget.expanded / COVERAGE,
        budget.expanded,
        {line.source: line.why for line in (coefficients, model, later) if line.contribution is None},
        budget,
    )
