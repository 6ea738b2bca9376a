"""What the mountings of a plan are worth: how well misalignment can be known at best, and with opposite mountings."""

from __future__ import annotations

from datetime import date

from instruments.bench_config import BenchFile
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.mountings import fitted_shares, shares_of
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.standard_lines import Sensitivities, standards_u
from labctl.services.schemas.plans import MisalignmentOutlook
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Acquire
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.planning.point_order import upside_down
from procedures.recipe.recipe import Recipe
from procedures.recipe.rules import Inverted

#: Standards whose errors act as misalignment.
QUANTITIES = ("fixture_angle", "tilt")
#: Coverage factor of the figures.
K = 2.0
#: Whether a standard is overdue does not matter here.
ANY_DAY = date(1970, 1, 1)


def misalignment_outlook(plan: Plan, bench: BenchFile, limits: BenchLimits) -> MisalignmentOutlook | None:
    """Return U of a misalignment by fixture and table, of the plan and with its opposite mountings added.

    None where no unit turns about an axis across one of its outputs, or where the bench states neither standard.
    """
    shares = _shares(plan, bench)
    if not shares or not any(each.quantity in QUANTITIES for each in bench.standards):
        return None
    now = _expanded(bench, shares)
    wider = _with_opposite(plan.recipe)
    if wider is None:
        return MisalignmentOutlook(expanded=now)
    try:
        other = make_plan(wider, limits)
    except PlanRefused:
        return MisalignmentOutlook(expanded=now)
    rules = wider.inverted
    assert rules is not None
    return MisalignmentOutlook(
        expanded=now, with_opposite=_expanded(bench, _shares(other, bench)), more_s=other.expected_s - plan.expected_s,
        inverted_temperatures_c=list(rules.temperatures_c), inverted_rates_dps=list(rules.rates_dps),
    )  # fmt: skip


def _shares(plan: Plan, bench: BenchFile) -> dict[str, float]:
    """Return position -> its share in what is known of misalignments: where a unit has an output across the axis."""
    across = {axis for axis in BODY_AXES for gyro in bench.gyros if set(gyro.axes) - {axis}}
    weights: dict[str, float] = {}
    for step in plan.steps:
        if isinstance(step, Acquire) and not step.verification and step.position.lstrip("-") in across:
            weights[step.position] = weights.get(step.position, 0.0) + step.rate_dps**2
    return fitted_shares(shares_of(weights)) if any(weights.values()) else {}


def _expanded(bench: BenchFile, shares: dict[str, float]) -> float:
    """Return U of the misalignment towards the axis that was mounted in the fewest ways."""
    stated = tuple(each for each in bench.standards if each.quantity in QUANTITIES)
    conditions = BenchConditions(ANY_DAY, standards=stated, mountings=shares)
    axes = {position.lstrip("-") for position in shares}
    return max(
        K * standards_u(conditions, Sensitivities.of_one(angle=conditions.mountings_with(axis) ** -0.5))
        for axis in axes
    )


def _with_opposite(recipe: Recipe) -> Recipe | None:
    """Return the recipe with each position upside down at one temperature; None where that is so already."""
    listed = set(recipe.positions)
    if recipe.inverted is not None or all(upside_down(position) in listed for position in listed):
        return None
    fastest = max(recipe.rates_dps, key=abs)
    if fastest == 0:
        return None
    middle = sorted(recipe.temperatures_c)[len(recipe.temperatures_c) // 2]
    rules = Inverted(temperatures_c=(middle,), rates_dps=(fastest, -fastest, 0.0))
    return recipe.model_copy(update={"inverted": rules})
