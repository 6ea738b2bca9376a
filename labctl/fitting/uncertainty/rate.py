"""Uncertainty of a corrected rate about one axis after the other, the others at rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.uncertainty.budget import Budget, without_repeatability
from labctl.fitting.uncertainty.combination import combined_u
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.rate_vector import CROSS_RATES, rate_vector_uncertainty
from labctl.fitting.uncertainty.use import AxisEvidence

#: Factor between the expanded uncertainty and the standard one that is given beside it.
COVERAGE = 2.0
#: Lines that come from the recording; the others are those of the bench.
EVALUATED = frozenset({"coefficients", "model", "repeatability"})


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

    It is that of `rate_vector_uncertainty` where the unit turns about the axis of the output alone; where it turns
    about others, U is larger. Arguments and errors raised are the same.
    """
    by_axis = {}
    for axis in fitted.axes:
        at = rate_vector_uncertainty(fitted, {axis: rate_dps}, temperature_c, evidence=evidence, name=name, bench=bench)
        by_axis[axis] = of_budget(at.budgets[axis], evidence.get(axis))
    return by_axis


def of_budget(budget: Budget, evidence: AxisEvidence | None) -> RateUncertainty:
    """Return the parts of one output's budget of a corrected rate."""
    evaluated = {line.source: line for line in budget.lines if line.source in EVALUATED}
    standards = [line for line in budget.lines if line.source not in {*EVALUATED, CROSS_RATES}]
    contributions = [line.contribution for line in standards if line.contribution is not None]
    return RateUncertainty(
        evaluated["coefficients"].contribution,
        evaluated["model"].contribution,
        evaluated["repeatability"].contribution,
        evidence.repeatability.source if evidence and evidence.repeatability else "none",
        combined_u(np.array(contributions)) if contributions else None,
        without_repeatability(budget.lines),
        None if budget.expanded is None else budget.expanded / COVERAGE,
        budget.expanded,
        {source: line.why for source, line in evaluated.items() if line.contribution is None},
        budget,
    )
