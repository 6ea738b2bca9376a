"""Visibility of the effects on a plan before anything is measured, by a walk through it in the simulated world."""

from __future__ import annotations

from dataclasses import asdict

from instruments.bench_config import BenchFile
from labctl.answers.plans import Visibility
from labctl.fitting.criticism import Schedule, effect_visibilities, schedule_of
from labctl.fitting.models.error_model import ErrorModel
from labctl.services.simulation.walks import walked
from procedures.planning.plan import Plan


def planned_schedule(plan: Plan, bench: BenchFile, model: ErrorModel | None = None) -> Schedule:
    """Return the schedule of a plan beside a model; default: the published model for such a recording."""
    return schedule_of(walked(plan, bench), model)


def visibility(plan: Plan, bench: BenchFile) -> list[Visibility]:
    """Return every effect with its visible share and smallest detectable size on a plan, most visible first."""
    return answer_of(planned_schedule(plan, bench))


def answer_of(schedule: Schedule) -> list[Visibility]:
    """Return the effects of a schedule as an answer, most visible first."""
    visibilities = effect_visibilities(schedule)
    return [Visibility(**{**asdict(one), "needs": list(one.needs)}) for one in visibilities]
