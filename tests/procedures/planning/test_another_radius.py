"""Units at another distance from the table's axis: in a recipe, on a bench that has it, and as it is asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.eccentricity import Eccentricity
from labctl.services.criticism.next_experiment import plans_of
from labctl.services.planning.loading import load_bench, load_recipe
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Acquire, Mount, PowerOn
from procedures.execution.step_handlers import mounting_text
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe

OTHER = {"temperatures_c": [20], "rates_dps": [5]}
STATED = Eccentricity(radius_m=0.06, other_radii_m=(0.05, 0.2), outward={"x": "y"})


def recipe(**changes: Any) -> Recipe:
    values: dict[str, Any] = {"temperatures_c": [20], "rates_dps": [0, 5], "positions": ["x", "y"]}
    return Recipe.model_validate({"name": "r", **values, **changes})


def mounted(plan: Plan) -> list[str]:
    return [step.position for step in plan.steps if isinstance(step, Mount)]


def test_the_plan_says_where_the_units_are_where_the_bench_file_does(limits: BenchLimits) -> None:
    assert mounted(make_plan(recipe(), limits)) == ["x", "y"]
    plan = make_plan(recipe(), replace(limits, eccentricity=STATED))
    assert mounted(plan) == ["xr60y", "yr60"]
    assert {step.position for step in plan.steps if isinstance(step, Acquire)} == {"xr60y", "yr60"}


def test_each_position_is_mounted_once_more_at_the_radius_that_differs_most(limits: BenchLimits) -> None:
    plan = make_plan(recipe(another_radius=OTHER), replace(limits, eccentricity=STATED))
    assert mounted(plan) == ["xr60y", "xr200y", "yr60", "yr200"]
    assert plan.recipe.another_radius is not None
    assert plan.recipe.another_radius.radius_m == 0.2
    assert sum(isinstance(step, PowerOn) for step in plan.steps) == 1  # in the same powered session
    named = make_plan(recipe(another_radius={**OTHER, "radius_m": 0.05}), replace(limits, eccentricity=STATED))
    assert mounted(named)[1] == "xr50y"


def test_a_bench_that_states_no_second_radius_refuses_it(limits: BenchLimits) -> None:
    asked = recipe(another_radius=OTHER)
    for stated in (None, Eccentricity(radius_m=0.06)):
        with pytest.raises(PlanRefused, match=r"states no second distance .* add \[eccentricity\] with radius_m"):
            make_plan(asked, replace(limits, eccentricity=stated))
    with pytest.raises(PlanRefused, match=r"radius_m 0.3: the bench file states other_radii_m = \[0.05, 0.2\] m"):
        make_plan(recipe(another_radius={**OTHER, "radius_m": 0.3}), replace(limits, eccentricity=STATED))
    with pytest.raises(PlanRefused, match=r"another_radius.rates_dps 5000: beyond the"):
        make_plan(recipe(another_radius={**OTHER, "rates_dps": [5, 5000]}), replace(limits, eccentricity=STATED))


def test_a_recipe_states_another_radius_in_its_table_only() -> None:
    with pytest.raises(ValidationError, match=r"another one in its table \[another_radius\]; write the position alone"):
        recipe(positions=["xr200"])


def test_a_diagnosis_may_ask_for_it_where_the_bench_has_it() -> None:
    quick, bench = load_recipe("quick-triaxial"), load_bench("triaxial-sim")
    has = bench.model_copy(update={"eccentricity": STATED})
    offered = [{each.block.id for each in plans_of(quick, on)} for on in (bench, has)]
    assert offered[1] - offered[0] == {"another_radius"}


def test_the_question_names_the_distance() -> None:
    asked = mounting_text("zr200x")
    where = "; the middle of each unit 200 mm from the axis of the table"
    assert asked.endswith(f"{where}, body axis x pointing away from it")
    assert mounting_text("zr200").endswith(where)
