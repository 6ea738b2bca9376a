"""Plans to look at: the recipes there are, a plan's steps as columns, and what became of a campaign's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomli_w
from pydantic import ValidationError

from instruments.bench_config import BenchFile
from labctl.errors import BadInput
from labctl.services.planning.loading import (
    bench_for,
    limits_of,
    load_bench,
    load_recipe,
    plan_answer,
    recipe_document,
)
from labctl.services.schemas.plans import (
    CampaignPlanResponse,
    PlannedResponse,
    PlanRequest,
    RecipeResponse,
    RunColumns,
    StepState,
    TimelineColumns,
)
from labctl.services.simulation.walk import visibility
from labctl.store import StepRow, Store
from procedures.contracts.errors import PlanRefused
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe, shipped_recipes

#: What a plan could find is worked out by walking through it second by second; a longer one is refused.
LONGEST_LOOK_S = 14 * 86_400.0


def list_recipes(bench: BenchFile | None) -> list[RecipeResponse]:
    """Return the shipped recipes, each planned on a bench; without one on the simulated bench that fits it best."""
    return [_recipe(name, path.read_text(encoding="utf-8"), bench) for name, path in shipped_recipes().items()]


def _recipe(name: str, text: str, bench: BenchFile | None) -> RecipeResponse:
    recipe = load_recipe(name)
    on = bench or load_bench(bench_for(recipe))
    remark = _lacking(recipe.positions, on)
    said: dict[str, Any] = {
        "name": name, "description": recipe.description, "text": text, "bench": on.name, "remark": remark,
    }  # fmt: skip
    try:
        plan = make_plan(recipe, limits_of(on))
    except PlanRefused as refused:
        return RecipeResponse(**said, refused=str(refused))
    return RecipeResponse(**said, steps=len(plan.steps), datasets=plan.datasets, expected_s=plan.expected_s)


def _lacking(positions: Sequence[str], bench: BenchFile) -> str:
    """Say which axes a recipe turns that no unit of the bench records, if any; it would run, and show little."""
    recorded = {axis for gyro in bench.gyros for axis in gyro.axes}
    if lacking := sorted({position.lstrip("-") for position in positions} - recorded):
        return f"it turns the units about {', '.join(lacking)}, which none of bench {bench.name} records"
    return ""


def plan_steps(request: PlanRequest, bench: BenchFile | None) -> PlannedResponse:
    """Plan a recipe on a bench, or on the simulated one that fits it best.

    Raises RecipeError, PlanRefused, BadInput.
    """
    recipe = load_recipe(request.recipe)
    on = bench or load_bench(bench_for(recipe))
    plan = make_plan(recipe, limits_of(on), clip=request.clip)
    if request.visibility and plan.expected_s > LONGEST_LOOK_S:
        raise BadInput(
            f"visibility: the plan takes {plan.expected_s / 86_400:.0f} days; what it could find is worked out for up "
            f"to {LONGEST_LOOK_S / 86_400:.0f}"
        )
    answer = plan_answer(plan, on, visibility if request.visibility else None)
    columns = _columns([step.model_dump(mode="json") for step in plan.steps])
    return PlannedResponse(**answer.model_dump(), timeline=TimelineColumns(**columns))


def campaign_plan(store: Store, campaign: int) -> CampaignPlanResponse:
    """Return a campaign's steps as they were written down, with what became of each. Raises NotFound."""
    row = store.campaigns.get(campaign)
    steps = store.campaigns.steps(campaign)
    columns = _columns([step.body for step in steps])
    timeline = RunColumns(
        **columns,
        state=[_state(step.state) for step in steps],
        started_s=[step.started_s for step in steps],
        ended_s=[step.ended_s for step in steps],
        forecast_s=_forecast(steps),
    )
    return CampaignPlanResponse(
        campaign=campaign, recipe=row.recipe_name, text=_text(row.recipe), bench=row.bench_name, state=row.state,
        schedule_hash=row.schedule_hash, steps=len(steps),
        datasets=sum(number is not None for number in columns["dataset"]), expected_s=row.expected_s,
        timeline=timeline,
    )  # fmt: skip


def _text(recipe: Mapping[str, Any]) -> str:
    """Return a recipe as text; nothing where it was written by a labctl whose recipes had other keys."""
    try:
        return tomli_w.dumps(recipe_document(Recipe.model_validate(dict(recipe))))
    except ValidationError:
        return ""


def _state(word: str) -> StepState:
    match word:
        case "planned":
            return "to come"
        case "running" | "done" | "failed" | "skipped":
            return word
        case _:
            return "interrupted"


def _forecast(steps: Sequence[StepRow]) -> list[float]:
    """Return when each step began or will begin, campaign time in s."""
    found: list[float] = []
    free_s = 0.0
    for step in steps:
        begun = step.started_s if step.started_s is not None and step.state != "planned" else free_s
        found.append(begun)
        if step.state == "skipped":
            continue
        over = step.ended_s is not None and step.state in {"done", "failed"}
        free_s = step.ended_s if over and step.ended_s is not None else begun + step.expected_s
    return found


def _columns(steps: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Return the steps of a plan (JSON) as columns; set point and position stay in force until the next."""
    found: dict[str, list[Any]] = {name: [] for name in TimelineColumns.model_fields}
    start_s, temperature_c, position = 0.0, None, None
    for number, step in enumerate(steps, start=1):
        temperature_c, position = step.get("temperature_c", temperature_c), step.get("position", position)
        row = {
            "number": number, "kind": step["kind"], "start_s": start_s, "expected_s": step["expected_s"],
            "temperature_c": temperature_c, "rate_dps": step.get("rate_dps"), "position": position,
            "dataset": step.get("dataset"),
        }  # fmt: skip
        for name, value in row.items():
            found[name].append(value)
        start_s += step["expected_s"]
    return found
