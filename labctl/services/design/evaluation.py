"""What a given recipe costs and gives on a bench, with its rates and temperatures where a person puts them."""

from __future__ import annotations

import tomli_w
from pydantic import ValidationError

from instruments.bench_config import BenchFile
from labctl.answers.design import DesignRequest, EvaluateRequest, EvaluateResponse
from labctl.errors import BadInput
from labctl.services.cache import UNNAMED, compute
from labctl.services.design.design import allowed_rates, allowed_temperatures, designed_campaign, pose
from labctl.services.design.problem import NOT_POSSIBLE, Goal
from labctl.services.planning.loading import load_recipe
from labctl.store import Store
from procedures.recipe.fit_rules import FitRules
from procedures.recipe.recipe import Recipe, recipe_document

#: The goal of a request without one: nothing is asked for.
NO_LIMIT_H = float("inf")


def evaluated(store: Store | None, request: EvaluateRequest, bench: BenchFile | None) -> EvaluateResponse:
    """Return hours and U of a recipe with other rates and temperatures.

    U is of the range of the recipe as it is, so that a point that is moved inwards shows what it costs outside.
    Raises RecipeError, BadBench, PlanRefused for the recipe as it is, BadInput for one without fixed levels.
    """
    compute(UNNAMED)
    like = load_recipe(request.recipe)
    _refuse_without_levels(like)
    rates = tuple(request.rates_dps or like.rates_dps)
    temperatures = tuple(request.temperatures_c or like.temperatures_c)
    design = DesignRequest(
        like=request.recipe, model=request.model, u_dps=request.u_dps, hours=None if request.u_dps else NO_LIMIT_H
    )
    posed = pose(store, design, bench)
    problem = posed.problem
    moved = _moved(like, rates, temperatures)
    fitted = moved.model_copy(update={"fit": FitRules(model=problem.model, effects=problem.effects)})
    campaign, why = None, ""
    try:
        goal = Goal(request.u_dps, design.hours)
        campaign = designed_campaign(problem.of_recipe(fitted, None, problem.effects), goal, posed.bench.units_at_once)
    except NOT_POSSIBLE as error:
        why = str(error)
    return EvaluateResponse(
        bench=posed.bench.name,
        model=problem.model,
        rates_dps=list(rates),
        temperatures_c=list(temperatures),
        allowed_rates_dps=allowed_rates(problem.limits),
        allowed_temperatures_c=allowed_temperatures(problem.limits),
        use_rates_dps=(-problem.span.rate_dps, problem.span.rate_dps),
        use_temperatures_c=(problem.span.low_c, problem.span.high_c),
        evaluated=campaign,
        why=why,
        recipe_toml=tomli_w.dumps(recipe_document(moved)),
    )


def _refuse_without_levels(recipe: Recipe) -> None:
    other = next(
        (
            text
            for is_other, text in (
                (recipe.turns is not None, "turns by hand"),
                (recipe.ramp is not None, "a moving temperature"),
                (bool(recipe.profiles), "courses of the rate"),
            )
            if is_other
        ),
        None,
    )
    if other is not None:
        raise BadInput(
            f"recipe {recipe.name} has {other}, and no points of fixed rates and temperatures that could be moved; "
            "choose a recipe of rates and temperatures"
        )


def _moved(recipe: Recipe, rates: tuple[float, ...], temperatures: tuple[float, ...]) -> Recipe:
    """Return a recipe at other points. Raises BadInput where they are none, such as one given twice."""
    document = {**recipe_document(recipe), "rates_dps": list(rates), "temperatures_c": list(temperatures)}
    try:
        return Recipe.model_validate(document)
    except ValidationError as error:
        what = "; ".join(str(each["msg"]).removeprefix("Value error, ") for each in error.errors())
        raise BadInput(
            f"recipe {recipe.name} with these rates and temperatures: {what}; give other rates_dps or temperatures_c"
        ) from None
