"""What a calibration's document says of its uncertainty: bounds over the calibrated range, and each coefficient's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from labctl.answers.budget import AxisBoundJson, ExpandedJson, UncertaintyJson
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.degrees_of_freedom import COVERAGE_PROBABILITY
from labctl.fitting.uncertainty.budget import Budget
from labctl.fitting.uncertainty.coefficient_budget import coefficient_budgets
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.grid import grid_rates, grid_temperatures
from labctl.fitting.uncertainty.rate import RateUncertainty, rate_uncertainty
from labctl.fitting.uncertainty.use import AxisEvidence
from labctl.fitting.uncertainty.vector_bound import cross_rates, vector_bounds


@dataclass(frozen=True)
class Covered:
    """The calibrated range; infinite where there is no limit."""

    rate_dps: tuple[float, float]
    temperature_c: tuple[float, float]

    def rates(self, evidence: Mapping[str, AxisEvidence]) -> list[float]:
        """Return the rates of the grid, deg/s; of a model without a limit those that were measured, else 0."""
        low, high = self.rate_dps
        if abs(low) < float("inf") and abs(high) < float("inf"):
            return grid_rates(low, high)
        measured = [rate for one in evidence.values() for rate in one.model_error.rate_dps.tolist()]
        return grid_rates(min(measured, default=0.0), max(measured, default=0.0))

    def reach_dps(self, evidence: Mapping[str, AxisEvidence]) -> float:
        """Return the fastest rate of the grid, deg/s: the radius of the ball of rate vectors."""
        return max(map(abs, self.rates(evidence)))

    def temperatures(self) -> list[float]:
        """Return the temperatures of the grid, deg C."""
        return grid_temperatures(*self.temperature_c)


@single_threaded
def uncertainty_json(
    fitted: FittedModel, covered: Covered, evidence: Mapping[str, AxisEvidence], bench: BenchConditions
) -> UncertaintyJson | None:
    """Return what the document says; None where no uncertainty at a rate and a temperature alone is defined."""
    name, temperatures_c = "calibration", covered.temperatures()
    try:
        places = [
            (
                rate,
                temperature_c,
                rate_uncertainty(fitted, rate, temperature_c, evidence=evidence, name=name, bench=bench),
            )
            for temperature_c in temperatures_c
            for rate in covered.rates(evidence)
        ]
        at_c = temperatures_c[len(temperatures_c) // 2]
        coefficients = coefficient_budgets(fitted, at_c, evidence=evidence, name=name, bench=bench)
        reach = covered.reach_dps(evidence)
        vectors = vector_bounds(fitted, reach, temperatures_c, evidence=evidence, name=name, bench=bench)
    except (BadInput, NotEnoughData):
        return None
    axes = {
        axis: _bound([(r, t, uncertainty[axis]) for r, t, uncertainty in places], coefficients[axis])
        for axis in fitted.axes
    }
    for axis, bound in axes.items():
        bound["vector"], bound["cross_rates"] = vectors[axis], cross_rates(fitted, coefficients[axis])
    unstated = [source for one in axes.values() for source in one["budget"]["not_stated"]]
    return {
        "coverage": COVERAGE_PROBABILITY,
        "coefficients_at_c": at_c,
        "not_stated": list(dict.fromkeys(unstated)),
        "overdue": any(one["budget"]["overdue"] for one in axes.values()),
        "axes": axes,
    }


def _bound(places: list[tuple[float, float, RateUncertainty]], coefficients: Mapping[str, Budget]) -> AxisBoundJson:
    """Return the place with the largest U; where it is unknown somewhere, the first such place and why."""
    unknown = next((place for place in places if place[2].expanded_dps is None), None)
    rate, temperature_c, bound = unknown or max(places, key=lambda place: place[2].expanded_dps or 0.0)
    return {
        "bound_dps": bound.expanded_dps,
        "rate_dps": rate,
        "temperature_c": temperature_c,
        "why": "; ".join(f"{part}: {reason}" for part, reason in bound.unknown.items()),
        "budget": bound.budget.to_json(),
        "coefficients": {name: _expanded(coefficient) for name, coefficient in coefficients.items()},
    }


def _expanded(budget: Budget) -> ExpandedJson:
    return {
        "value": budget.value, "unit": budget.unit, "combined": budget.combined,
        "effective_degrees_of_freedom": budget.freedom, "k": budget.k, "expanded": budget.expanded,
    }  # fmt: skip
