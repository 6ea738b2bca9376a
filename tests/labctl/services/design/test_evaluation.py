"""A recipe whose points are moved: the plan's hours, and the U of the range that the recipe had."""

from __future__ import annotations

import pytest

from labctl.answers.design import DesignRequest, EvaluateRequest
from labctl.errors import BadInput
from labctl.services.design.design import design_campaign
from labctl.services.design.evaluation import evaluated
from labctl.services.planning.loading import limits_of, load_bench
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import parse_recipe

BENCH = load_bench("single-axis-sim")
RECIPE = "ojeda2000-121"


def test_the_recipe_as_it_is_has_the_figures_of_a_design_that_is_compared_with_it() -> None:
    answer = evaluated(None, EvaluateRequest(recipe=RECIPE, model="bias_scale"), BENCH)
    design = design_campaign(None, DesignRequest(like=RECIPE, model="bias_scale", u_dps=0.01), BENCH)
    assert answer.evaluated is not None
    assert design.reference is not None
    same = {"is_reaching"}  # of another goal
    assert answer.evaluated.model_dump(exclude=same) == design.reference.model_dump(exclude=same)
    assert (answer.use_rates_dps, answer.use_temperatures_c) == (design.rates_dps, design.temperatures_c)


def test_moved_points_are_those_of_the_plan_and_u_is_of_the_range_as_it_was() -> None:
    before = evaluated(None, EvaluateRequest(recipe=RECIPE), BENCH)
    rates = [0.5 * rate for rate in before.rates_dps]
    answer = evaluated(None, EvaluateRequest(recipe=RECIPE, rates_dps=rates), BENCH)
    plan = make_plan(parse_recipe(answer.recipe_toml), limits_of(BENCH, driven=True))
    assert sorted({step.rate_dps for step in plan.steps if step.kind == "acquire"}) == sorted(rates)  # type: ignore[union-attr]
    assert answer.evaluated is not None
    assert before.evaluated is not None
    assert plan.expected_s / 3600.0 == pytest.approx(answer.evaluated.hours)
    assert answer.use_rates_dps == before.use_rates_dps
    assert answer.evaluated.u_worst_dps > 1.2 * before.evaluated.u_worst_dps


def test_points_that_cannot_be_run_say_why_and_a_recipe_without_points_is_refused() -> None:
    beyond = evaluated(None, EvaluateRequest(recipe=RECIPE, temperatures_c=[25.0, 35.0, 999.0]), BENCH)
    assert beyond.evaluated is None
    assert "999" in beyond.why
    with pytest.raises(BadInput, match="has turns by hand, and no points of fixed rates and temperatures"):
        evaluated(None, EvaluateRequest(recipe="by-hand"), BENCH)
    text = evaluated(None, EvaluateRequest(recipe=RECIPE), BENCH).recipe_toml
    assert evaluated(None, EvaluateRequest(recipe=text), BENCH).evaluated is not None
