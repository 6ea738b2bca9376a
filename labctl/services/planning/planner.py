"""Plans before anything moves: the shipped recipes, and the steps of a plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from instruments.bench_config import BenchFile
from instruments.positions import Position
from labctl.answers.plans import PlannedResponse, PlanRequest, RecipeResponse, TimelineColumns
from labctl.errors import BadInput
from labctl.services.planning.earlier_campaigns import times_on_bench
from labctl.services.planning.loading import Check, bench_for, limits_of, load_bench, load_recipe, no_check
from labctl.services.planning.plan_answer import LocalStart, Look, plan_answer
from labctl.services.planning.timeline import step_json, timeline_columns
from procedures.contracts.errors import PlanRefused
from procedures.planning.earlier_times import EarlierTimes
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import shipped_recipes

if TYPE_CHECKING:
    from labctl.store import Store

#: What a plan could find is worked out by walking through it second by second; a longer one is refused.
MAX_VISIBILITY_S = 14 * 86_400.0


def list_recipes(store: Store, bench: BenchFile | None) -> list[RecipeResponse]:
    """Return the shipped recipes, each planned on a bench; without one on the simulated bench that fits it best."""
    earlier = None if bench is None else times_on_bench(store, bench)
    return [_recipe(name, path.read_text(encoding="utf-8"), bench, earlier) for name, path in shipped_recipes().items()]


def _recipe(name: str, text: str, bench: BenchFile | None, earlier: EarlierTimes | None) -> RecipeResponse:
    recipe = load_recipe(name)
    on = bench or load_bench(bench_for(recipe, driven=True))
    remark = _lacking(recipe.positions, on)
    answer: dict[str, Any] = {
        "name": name, "description": recipe.description, "text": text, "bench": on.name, "remark": remark,
        "by_hand": recipe.turns is not None,
    }  # fmt: skip
    try:
        plan = make_plan(recipe, limits_of(on, driven=True, earlier=earlier))
    except PlanRefused as refused:
        return RecipeResponse(**answer, refused=str(refused))
    return RecipeResponse(**answer, steps=len(plan.steps), datasets=plan.datasets, expected_s=plan.expected_s)


def _lacking(positions: Sequence[str], bench: BenchFile) -> str:
    """Return which axes a recipe turns that no unit of the bench records, if any; it would run, and show little."""
    recorded = {axis for gyro in bench.gyros for axis in gyro.axes}
    if lacking := sorted({axis for position in positions for axis in Position.of(position).axes} - recorded):
        return (
            f"the recipe turns the units about {', '.join(lacking)}, but no unit of bench {bench.name} "
            "measures that axis"
        )
    return ""


def plan_steps(
    store: Store,
    request: PlanRequest,
    bench: BenchFile | None,
    look: Look,
    start: LocalStart | None = None,
    check: Check = no_check,
) -> PlannedResponse:
    """Plan a recipe on a bench, or on the simulated one that fits it best; `look` returns what the plan could find.

    With `start` the answer says when a person is needed. `check` may refuse the plan. The times are those of
    earlier campaigns where there are any.

    Raises RecipeError, PlanRefused, BadInput.
    """
    recipe = load_recipe(request.recipe)
    on = bench or load_bench(bench_for(recipe, driven=True))
    earlier = times_on_bench(store, on)
    plan = make_plan(recipe, limits_of(on, driven=True, earlier=earlier), clip=request.clip)
    check(plan, on)
    if request.visibility and plan.expected_s > MAX_VISIBILITY_S:
        raise BadInput(
            f"visibility: the plan takes {plan.expected_s / 86_400:.0f} days, but the effects that a plan can "
            f"detect are computed only up to {MAX_VISIBILITY_S / 86_400:.0f} days; leave visibility out, or "
            "shorten the plan"
        )
    answer = plan_answer(plan, on, look if request.visibility else None, start, earlier)
    columns = timeline_columns([step_json(step) for step in plan.steps])
    return PlannedResponse(**answer.model_dump(), timeline=TimelineColumns(**dict(columns)))
