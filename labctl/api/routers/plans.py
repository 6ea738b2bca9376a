"""Recipes and plans: what could be measured here, before anything moves."""

from __future__ import annotations

from fastapi import APIRouter, Request

from labctl.answers.design import DesignRequest, DesignResponse, EvaluateRequest, EvaluateResponse
from labctl.answers.plans import PlannedResponse, PlanRequest, RecipeResponse
from labctl.api.computation import while_connected
from labctl.api.dependencies import ServiceDep
from labctl.services.criticism.planned_visibility import planned
from labctl.services.design.design import designed
from labctl.services.design.evaluation import evaluated
from labctl.services.planning import planner as services
from labctl.services.schedule.planned_start import planned_start

router = APIRouter(prefix="/api", tags=["campaigns"])


@router.get("/recipes", summary="The recipes that come with labctl")
def recipes(service: ServiceDep) -> list[RecipeResponse]:
    """Each with its text, the time and data sets it needs on this service's bench, or why it cannot run there.

    A service without a bench answers for the simulated bench that suits the recipe best.
    """
    return services.list_recipes(service.store, service.bench)


@router.post("/plans", summary="Plan a recipe")
async def plan(http: Request, request: PlanRequest, service: ServiceDep) -> PlannedResponse:
    """The steps of a campaign, and which effects it could detect. Nothing moves, nothing is stored.

    `attendance` says when a person is needed if it begins now, at `at` or when `cron` is due next.
    """
    start = planned_start(request.at, request.cron, request.time_zone, service.clock.utc())
    return await while_connected(http, service, planned, request, service.bench, start)


@router.post("/designs", summary="Design a campaign")
async def design(http: Request, request: DesignRequest, service: ServiceDep) -> DesignResponse:
    """The cheapest recipe on this service's bench that reaches an uncertainty, or the best within given hours.

    Some seconds of computation; nothing moves, nothing is stored. `recipe_toml` can be sent to `POST /api/campaigns`.
    """
    return await while_connected(http, service, designed, request, service.bench)


@router.post("/designs/evaluation", summary="Evaluate a recipe at other points")
async def evaluation(http: Request, request: EvaluateRequest, service: ServiceDep) -> EvaluateResponse:
    """Hours and U of a recipe of fixed rates and temperatures on this service's bench, with its points moved.

    Nothing moves, nothing is stored. `recipe_toml` can be sent to `POST /api/campaigns` or `POST /api/plans`.
    """
    return await while_connected(http, service, evaluated, request, service.bench)
