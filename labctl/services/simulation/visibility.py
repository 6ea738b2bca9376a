"""Visibility of the effects on a plan before anything is measured, by a walk through it in the simulated world."""

from __future__ import annotations

from dataclasses import asdict

from instruments.bench_config import BenchFile
from labctl.answers.plans import PlannedResponse, PlanRequest, Visibility
from labctl.fitting.criticism import Schedule, effect_visibilities, schedule_of
from labctl.fitting.models.error_model import ErrorModel
from labctl.services.benches.stop_rules import check_stop_on
from labctl.services.cache import UNNAMED, compute
from labctl.services.planning.plan_answer import LocalStart
from labctl.services.planning.planner import plan_steps
from labctl.services.simulation.walks import walked
from labctl.store import Store
from procedures.planning.plan import Plan


def planned_schedule(plan: Plan, bench: BenchFile, model: ErrorModel | None = None) -> Schedule:
    """Return the schedule of a plan beside a model; default: the published model for such a recording."""
    return schedule_of(walked(plan, bench), model)


def visibility(plan: Plan, bench: BenchFile) -> list[Visibility]:
    """Return every effect with its visible share and smallest detectable size on a plan, most visible first."""
    visibilities = effect_visibilities(planned_schedule(plan, bench))
    return [Visibility(**{**asdict(one), "needs": list(one.needs)}) for one in visibilities]


def planned(
    store: Store, request: PlanRequest, bench: BenchFile | None, start: LocalStart | None = None
) -> PlannedResponse:
    """Plan a recipe on a bench, or on the simulated one that fits it best, and say what the plan could find.

    With `start` the answer says when a person is needed.

    Raises RecipeError, PlanRefused, BadInput.
    """

    def look(plan: Plan, on: BenchFile) -> list[Visibility]:
        compute(UNNAMED)
        return visibility(plan, on)

    return plan_steps(store, request, bench, look, start, check_stop_on)
