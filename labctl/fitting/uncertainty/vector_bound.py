"""The largest uncertainty of a corrected rate over all rate vectors up to the calibrated rate, whatever their axis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product

from labctl.answers.budget import CrossRatesJson, VectorBoundJson
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.uncertainty.budget import Budget
from labctl.fitting.uncertainty.combination import half_width
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.rate_vector import RateVectorUncertainty, rate_vector_uncertainty
from labctl.fitting.uncertainty.use import AxisEvidence

#: Signs of rate vectors: along the axes, the diagonals of the faces, and those of the cube.
_SIGNS = [signs for signs in product((-1, 0, 1), repeat=3) if any(signs)]
#: Places of the ball of radius 1: rest, those directions on the sphere, and half-way along the axes, as the own-axis
#: grid has them.
PLACES = (
    (0.0, 0.0, 0.0),
    *(tuple(sign / math.hypot(*signs) for sign in signs) for signs in _SIGNS),
    *(tuple(sign / 2 for sign in signs) for signs in _SIGNS if sum(map(abs, signs)) == 1),
)


def vector_bounds(
    fitted: FittedModel,
    reach_dps: float,
    temperatures_c: Sequence[float],
    *,
    evidence: Mapping[str, AxisEvidence],
    name: str,
    bench: BenchConditions | None,
) -> dict[str, VectorBoundJson]:
    """Return output -> where its U is largest among rate vectors up to `reach_dps`, deg/s.

    What the mountings and the coefficients add grows along each direction; what the model leaves need not, so that the
    axes, along which it was measured, are also compared half-way. Raises what `rate_vector_uncertainty` raises.
    """
    vectors: list[Mapping[str, float]] = [
        {axis: reach_dps * part for axis, part in zip(BODY_AXES, place, strict=True)}
        for place in (PLACES if reach_dps else PLACES[:1])
    ]
    bounds = [
        rate_vector_uncertainty(fitted, rates, temperature_c, evidence=evidence, name=name, bench=bench)
        for temperature_c in temperatures_c
        for rates in vectors
    ]
    return {axis: _bound(axis, bounds, reach_dps) for axis in fitted.axes}


def _bound(axis: str, uncertainties: Sequence[RateVectorUncertainty], reach_dps: float) -> VectorBoundJson:
    unknown = next((uncertainty for uncertainty in uncertainties if uncertainty.budgets[axis].expanded is None), None)
    place = unknown or max(uncertainties, key=lambda uncertainty: uncertainty.budgets[axis].expanded or 0.0)
    aligned = [uncertainty.aligned_budgets[axis].expanded or 0.0 for uncertainty in uncertainties]
    return {
        "bound_dps": None if unknown else place.budgets[axis].expanded,
        "aligned_bound_dps": None if unknown else max(aligned),
        "reach_dps": reach_dps,
        "rates_dps": dict(place.rates_dps),
        "temperature_c": place.temperature_c,
        "why": "; ".join(f"{part}: {reason}" for part, reason in place.unknown[axis].items()),
    }


def cross_rates(fitted: FittedModel, coefficients: Mapping[str, Budget]) -> CrossRatesJson | None:
    """Return what a rate about axes without an output adds to a corrected rate, per deg/s in the worst direction.

    `coefficients` are the budgets of one output. The figure covers with the probability of these budgets. None where
    every body axis has an output.
    """
    unread = [other for other in BODY_AXES if other not in fitted.axes]
    if not unread:
        return None
    misalignments = {other: coefficients.get(f"misalignment_{other}") for other in unread}
    expanded = {
        other: budget.expanded for other, budget in misalignments.items() if budget is not None and budget.expanded
    }
    if missing := [other for other in unread if other not in expanded]:
        return {"about": unread, "per_dps": None, "why": _not_measured_about(missing)}
    size = math.hypot(*(budget.value or 0.0 for budget in misalignments.values() if budget is not None))
    return {"about": unread, "per_dps": half_width(max(expanded.values()), size), "why": ""}


def _not_measured_about(axes: Sequence[str]) -> str:
    """Return that the misalignments towards body axes are not known, and in which mountings they are measured."""
    several = "s" if len(axes) > 1 else ""
    mountings = " and ".join(f"with {axis} up" for axis in axes)
    return (
        f"the misalignment{several} towards {' and '.join(axes)} {'are' if several else 'is'} not known: turn the unit "
        f"on the table {mountings} too, and fit misalignment to all of these data sets together"
    )
