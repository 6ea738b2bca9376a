"""What a plan answers: its figures, what it could find, and when it needs a person."""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import datetime
from zoneinfo import ZoneInfo

from instruments.bench_config import USUAL_AIR_TAU_S, BenchFile
from labctl.services.planning.attendance import attendance, visits_s
from labctl.services.planning.loading import limits_of, plan_for
from labctl.services.planning.mountings import misalignment_outlook
from labctl.services.schemas.plans import PlanResponse, Visibility
from procedures.contracts.steps import Acquire, Mount, MoveChamber
from procedures.planning.plan import Plan

Look = Callable[[Plan, BenchFile], list[Visibility]]
#: When a plan would begin, and the time zone of the people at the bench.
LocalStart = tuple[datetime, ZoneInfo]


def describe_plan(
    recipe: str, bench: str | None, *, clip: bool, look: Look | None = None, start: LocalStart | None = None
) -> PlanResponse:
    """Say what a campaign would do and how long it takes, as `plan_answer` does."""
    plan, bench_file = plan_for(recipe, bench, clip=clip)
    return plan_answer(plan, bench_file, look, start)


def plan_answer(
    plan: Plan, bench_file: BenchFile, look: Look | None = None, start: LocalStart | None = None
) -> PlanResponse:
    """Return a plan's figures; `look` also says what it could find, `start` when it needs a person."""
    return PlanResponse(
        recipe=plan.recipe.name,
        bench=bench_file.name,
        steps=len(plan.steps),
        datasets=plan.datasets,
        expected_s=plan.expected_s,
        guessed=_guessed(plan, bench_file),
        verification_datasets=sum(isinstance(step, Acquire) for step in plan.verification_steps),
        verification_s=math.fsum(step.expected_s for step in plan.verification_steps),
        clipped=list(plan.clipped),
        schedule_hash=plan.schedule_hash,
        misalignment=misalignment_outlook(plan, bench_file, limits_of(bench_file)),
        visibility=look(plan, bench_file) if look else None,
        attendance=attendance(visits_s(plan, bench_file), *start) if start else None,
    )


def _guessed(plan: Plan, bench: BenchFile) -> list[str]:
    """Return the figures of the expected time that no file states, in words."""
    found: list[str] = []
    if bench.air_tau_s is None and any(isinstance(step, MoveChamber) and step.expected_s for step in plan.steps):
        found.append(
            f"the air of the chamber follows a ramp with a time constant of {USUAL_AIR_TAU_S:g} s; state air_tau_s in "
            "[chamber] of the bench file"
        )
    mounts = [step.expected_s for step in plan.steps if isinstance(step, Mount) and step.expected_s]
    if mounts:
        found.append(f"a person takes {mounts[0] / 60:g} min to mount the units")
    return found
