"""The stored plan of a campaign, with the outcome of each step."""

from __future__ import annotations

from collections.abc import Sequence

from labctl.answers.plans import CampaignPlanResponse, RunColumns, StepState
from labctl.services.planning.recipe_text import recipe_text
from labctl.services.planning.timeline import timeline_columns
from labctl.store import StepRow, Store
from procedures.planning.turn_steps import DATA_SETS_OF_TURN


def campaign_plan(store: Store, campaign: int) -> CampaignPlanResponse:
    """Return the stored steps of a campaign with the outcome of each. Raises NotFound."""
    row = store.campaigns.get(campaign)
    steps = store.campaigns.steps(campaign)
    columns = timeline_columns([step.body for step in steps])
    timeline = RunColumns(
        **dict(columns),
        state=[_state(step.state) for step in steps],
        started_s=[step.started_s for step in steps],
        ended_s=[step.ended_s for step in steps],
        forecast_s=_forecast(steps),
    )
    return CampaignPlanResponse(
        campaign=campaign, recipe=row.recipe_name, text=recipe_text(row.recipe), bench=row.bench_name, state=row.state,
        schedule_hash=row.schedule_hash, steps=len(steps),
        datasets=sum(DATA_SETS_OF_TURN if step.kind == "turn" else 1 for step in steps if "dataset" in step.body),
        expected_s=row.expected_s,
        timeline=timeline,
    )  # fmt: skip


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
    forecasts: list[float] = []
    free_s = 0.0
    for step in steps:
        begun = step.started_s if step.started_s is not None and step.state != "planned" else free_s
        forecasts.append(begun)
        if step.state == "skipped":
            continue
        over = step.ended_s is not None and step.state in {"done", "failed"}
        free_s = step.ended_s if over and step.ended_s is not None else begun + step.expected_s
    return forecasts
