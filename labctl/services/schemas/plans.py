"""Recipes, plans and the steps of a campaign."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from instruments.toml_documents import shown
from labctl.services.schemas.base import Request, ResponseModel
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import RecipeError
from procedures.recipe.recipe import shipped_recipes


def never_a_path(recipe: str) -> str:
    """Refuse what would be looked for as a file: a request names a shipped recipe or brings its own text."""
    if "\n" in recipe or recipe in shipped_recipes():
        return recipe
    raise RecipeError(f"no recipe {shown(recipe)}: send its text, or one of {', '.join(shipped_recipes())}")


RecipeSource = Annotated[
    str, AfterValidator(never_a_path), Field(description="Name of a shipped recipe, or the recipe itself as TOML text.")
]


class PlanRequest(Request):
    """Which recipe to plan on the service's bench."""

    recipe: RecipeSource
    clip: bool = Field(default=False, description="Leave out points that the bench or a unit cannot do.")
    visibility: bool = Field(default=False, description="Also say what the plan could find; it takes some seconds.")
    at: str | None = Field(default=None, max_length=64, description="When it would begin, as of `POST /api/campaigns`.")
    cron: str | None = Field(default=None, max_length=200, description="The same as a cron line.")
    time_zone: str | None = Field(default=None, max_length=100, description="Of `at`, `cron` and `attendance`.")


class AttendanceResponse(ResponseModel):
    """When a plan needs a person at the bench, to turn or to switch the units."""

    start: datetime = Field(description="When it begins; all times are in `time_zone`.")
    time_zone: str
    needed_at: list[datetime] = Field(description="Expected; prompts close together count as one.")
    at_night: list[datetime] = Field(description="Those of them between 20:00 and 07:00.")
    text: str = Field(description="The same in words.")
    warning: str = Field(default="", description="A warning about times at night; empty when there are none.")
    better_start: datetime | None = Field(default=None, description="The next start with fewer of them at night.")


class Visibility(ResponseModel):
    """Whether a schedule could show an effect, and from which size on."""

    effect: str
    visible: bool
    share: float = Field(description="Share of the effect that the rest of the model does not absorb, 0 to 1.")
    smallest_size: float | None = Field(default=None, description="Just detectable, in the effect's unit.")
    unit: str = ""
    why: Literal["channel", "schedule"] | None = None
    needs: list[str] = Field(default_factory=list)
    experiment: str = ""


class PlanResponse(ResponseModel):
    """What a campaign would do, before anything moves."""

    recipe: str
    bench: str
    steps: int
    datasets: int
    expected_s: float
    clipped: list[str] = Field(description="Points left out because the bench or the unit cannot do them.")
    schedule_hash: str
    visibility: list[Visibility] | None = Field(default=None, description="What the plan could and could not find.")
    attendance: AttendanceResponse | None = Field(
        default=None, description="When it needs a person; null: the bench turns and switches the units itself."
    )


StepState = Literal["to come", "running", "done", "failed", "interrupted", "skipped"]


class RecipeResponse(ResponseModel):
    """A recipe that comes with labctl, and what it would take."""

    name: str
    description: str
    text: str = Field(description="The recipe itself, TOML.")
    bench: str
    steps: int | None = None
    datasets: int | None = None
    expected_s: float | None = None
    refused: str | None = Field(default=None, description="Why this bench cannot do it; then there are no figures.")
    remark: str = Field(default="", description="Objections to it although the bench can do it.")
    by_hand: bool = Field(default=False, description="A person turns the units; no table and no chamber is driven.")


class TimelineColumns(ResponseModel):
    """The steps of a plan in order, as lists of equal length."""

    number: list[int] = Field(description="From 1.")
    kind: list[str]
    start_s: list[float] = Field(description="From the beginning, if every step takes as long as expected.")
    expected_s: list[float]
    temperature_c: list[float | None] = Field(description="Set point in force; null: none was set yet.")
    rate_dps: list[float | None] = Field(description="Of data sets; null: the table is at rest.")
    turn_deg: list[float | None] = Field(
        description="Of turns by hand, positive counter-clockwise seen from above; null: no turn."
    )
    position: list[str | None] = Field(description="In which the units are; null: as they were found.")
    dataset: list[int | None]


class PlannedResponse(PlanResponse):
    """What a campaign would do, with its steps."""

    timeline: TimelineColumns


class RunColumns(TimelineColumns):
    """The steps of a campaign, with what became of each."""

    state: list[StepState]
    started_s: list[float | None] = Field(description="Campaign time.")
    ended_s: list[float | None]
    forecast_s: list[float] = Field(
        description="When it began, or will begin if the remaining steps take the expected time."
    )


class CampaignPlanResponse(ResponseModel):
    """The plan of a campaign, and how far it is."""

    campaign: int
    recipe: str
    text: str = Field(description="The recipe as it was run, TOML; empty: by an older labctl.")
    bench: str
    state: CampaignState
    schedule_hash: str
    steps: int
    datasets: int
    expected_s: float
    timeline: RunColumns
