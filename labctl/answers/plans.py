"""Recipes, plans and the steps of a campaign."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from instruments.toml_documents import shown
from labctl.answers.base import LongText, Request, ResponseModel
from labctl.answers.common_fields import (
    BenchName,
    CampaignNumber,
    Clip,
    DatasetCount,
    ExpectedDuration,
    RecipeName,
    ScheduleHash,
    Serial,
    StepCount,
)
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import RecipeError
from procedures.recipe.recipe import shipped_recipes


def never_a_path(recipe: str) -> str:
    """Refuse what would be looked for as a file: a request names a shipped recipe or brings its own text."""
    if "\n" in recipe or recipe in shipped_recipes():
        return recipe
    raise RecipeError(
        f"there is no recipe {shown(recipe)}; send the text of a recipe, or one of the names "
        f"{', '.join(shipped_recipes())}"
    )


RecipeSource = Annotated[
    LongText,
    AfterValidator(never_a_path),
    Field(description="Name of a shipped recipe, or the recipe itself as TOML text."),
]


class PlanRequest(Request):
    """Which recipe to plan on the service's bench."""

    recipe: RecipeSource
    clip: Clip = False
    visibility: bool = Field(
        default=False, description="Also compute which effects the plan could detect; takes some seconds."
    )
    unit: Serial | None = Field(
        default=None,
        max_length=200,
        description="Serial number of a unit that the plan is a next experiment for: `visibility` is then that of the "
        "plan together with the recordings that its version was fitted to, beside the model of the version.",
    )
    version: int | None = Field(default=None, description="Calibration version of `unit`; default: the newest.", ge=1)
    at: str | None = Field(
        default=None, max_length=64, description="Intended time of the start, as in `POST /api/campaigns`."
    )
    cron: str | None = Field(
        default=None, max_length=200, description="Cron line of the intended start, instead of `at`."
    )
    time_zone: str | None = Field(
        default=None, max_length=100, description="Time zone of `at`, `cron` and `attendance`, such as Europe/Berlin."
    )


class AttendanceResponse(ResponseModel):
    """When a plan needs a person at the bench, to turn or to switch the units."""

    start: datetime = Field(description="Start of the campaign; all times are in `time_zone`.")
    time_zone: str = Field(description="Time zone of all times, such as Europe/Berlin.")
    needed_at: list[datetime] = Field(
        description="Times at which a person is expected to be needed; questions close together count as one."
    )
    at_night: list[datetime] = Field(description="The times of `needed_at` between 20:00 and 07:00.")
    text: str = Field(description="When the campaign needs a person, as a sentence; the times are `needed_at`.")
    warning: str = Field(default="", description="A warning about times at night; empty when there are none.")
    better_start: datetime | None = Field(
        default=None,
        description="Next time of start for which fewer of these times are at night; null: no start is better.",
    )


class Visibility(ResponseModel):
    """Whether a schedule could show an effect, and from which size on."""

    effect: str = Field(description="Id of the effect in the catalogue.")
    visible: bool = Field(description="Whether the plan could show the effect.")
    share: float = Field(description="Share of the effect that the rest of the model does not absorb, 0 to 1.")
    smallest_size: float | None = Field(
        default=None,
        description="Smallest size of the effect that the plan can detect, in `unit`; where `why` is size, it is "
        "larger than the effect can be.",
    )
    unit: str = Field(default="", description="Unit of `smallest_size`; empty: none.")
    why: Literal["channel", "schedule", "size", "technology"] | None = Field(
        default=None,
        description="What hides the effect: a channel that is not logged; the schedule; its size, where the "
        "schedule shows it only from a size on that it cannot have; or the technology of the gyro, which does not "
        "have the effect; null: it is visible.",
    )
    needs: list[str] = Field(default_factory=list, description="Channels that would have to be logged; empty: none.")
    experiment: str = Field(
        default="", description="What would have to be measured to show the effect; empty: nothing more."
    )
    in_model: bool = Field(
        default=False,
        description="Whether the effect is part of the model beside which it is judged; a fit then estimates it.",
    )
    order: int | None = Field(
        default=None,
        description="Order of the term that `smallest_size` is of, where the model absorbs the lower orders; null: "
        "the first, or the effect has no orders.",
    )


class FurtherMountings(ResponseModel):
    """What further mountings of each position leave of the errors of fixture and table, and what they cost."""

    turned: str = Field(description="What is turned, in words.")
    expanded: float = Field(description="U of a misalignment with them, k = 2, rad.")
    mountings: int = Field(description="Number of mountings that this adds.")
    more_s: float = Field(description="Expected time that this adds, s.")
    recipe_toml: str = Field(description="The table of the recipe that adds them, in place of one of its name.")


class MisalignmentOutlook(ResponseModel):
    """How well a misalignment can be known at best: what fixture and table leave, whatever the noise; k = 2, rad."""

    expanded: float = Field(description="U of a misalignment with the mountings of the plan.")
    further: list[FurtherMountings] = Field(
        default_factory=list, description="Further mountings that make U smaller, the smallest U first."
    )
    not_stated: list[str] = Field(
        default_factory=list,
        description="Quantities of the mountings that the bench does not state; their errors are in no U.",
    )


class PlanResponse(ResponseModel):
    """What a campaign would do, before anything moves."""

    recipe: RecipeName
    bench: BenchName
    steps: StepCount
    datasets: DatasetCount
    expected_s: ExpectedDuration
    guessed: list[str] = Field(
        default_factory=list,
        description="Figures of the expected time that neither the bench file nor an earlier campaign states.",
    )
    learned: list[str] = Field(
        default_factory=list, description="Figures of the expected time that are from earlier campaigns on the bench."
    )
    verification_datasets: int = Field(description="Number of the data sets that verify and are never fitted.")
    verification_s: float = Field(description="Expected time of these, with their mountings and soaks, s.")
    clipped: list[str] = Field(description="Points left out because the bench or the unit cannot do them.")
    schedule_hash: ScheduleHash
    misalignment: MisalignmentOutlook | None = Field(
        default=None,
        description="How well a misalignment can be known at best; null: no unit turns across one of its outputs, or "
        "the bench states none of fixture_angle, tilt and mounting_repeatability.",
    )
    visibility: list[Visibility] | None = Field(
        default=None, description="Which effects the plan could and could not detect; null: not requested."
    )
    attendance: AttendanceResponse | None = Field(
        default=None,
        description="When the campaign needs a person; null: never, since the bench turns the units "
        "and switches them on and off itself.",
    )


StepState = Literal["to come", "running", "done", "failed", "interrupted", "skipped"]


class RecipeResponse(ResponseModel):
    """A recipe that comes with labctl, and what it would take."""

    name: RecipeName
    description: str = Field(description="What the recipe is for, in words.")
    text: str = Field(description="The recipe itself, TOML.")
    bench: str = Field(description="Name of the bench that the recipe was planned on.")
    steps: int | None = Field(default=None, description="Number of steps of the plan; null: see `refused`.")
    datasets: int | None = Field(default=None, description="Number of data sets of the plan; null: see `refused`.")
    expected_s: float | None = Field(
        default=None, description="Expected duration of the campaign, s; null: see `refused`."
    )
    refused: str | None = Field(
        default=None, description="Why this bench cannot run the recipe; steps, data sets and time are then null."
    )
    remark: str = Field(default="", description="Objections to the recipe although the bench can run it.")
    by_hand: bool = Field(default=False, description="A person turns the units; no table and no chamber is driven.")


class TimelineColumns(ResponseModel):
    """The steps of a plan in order, as lists of equal length."""

    number: list[int] = Field(description="From 1.")
    kind: list[str] = Field(description="Kind of step, such as soak, acquire or turn.")
    start_s: list[float] = Field(
        description="Start of the step, s from the beginning, if every step takes as long as expected."
    )
    expected_s: list[float] = Field(description="Expected duration of the step, s.")
    temperature_c: list[float | None] = Field(
        description="Set point of the chamber during the step, deg C; null: no set point was set yet."
    )
    rate_dps: list[float | None] = Field(
        description="Rate of the table in a data set, deg/s; null: the table is at rest."
    )
    turn_deg: list[float | None] = Field(
        description="Angle of a turn by hand, deg, positive counter-clockwise seen from above; null: no turn."
    )
    position: list[str | None] = Field(
        description="Body axis of the units that points along the table axis (by "
        "hand: up); null: not yet turned by the campaign."
    )
    dataset: list[int | None] = Field(
        description="Number of the data set that the step measures, from 1; null: it measures none."
    )


class PlannedResponse(PlanResponse):
    """What a campaign would do, with its steps."""

    timeline: TimelineColumns = Field(description="The steps of the plan, with expected times.")


class RunColumns(TimelineColumns):
    """The steps of a campaign, with what became of each."""

    state: list[StepState] = Field(description="What became of the step.")
    started_s: list[float | None] = Field(
        description="Start of the step, s since the start of the campaign; null: not yet started."
    )
    ended_s: list[float | None] = Field(
        description="End of the step, s since the start of the campaign; null: not yet ended."
    )
    forecast_s: list[float] = Field(
        description="Start of the step, s since the start of the campaign: measured, or for future steps computed "
        "from the expected times."
    )


class CampaignPlanResponse(ResponseModel):
    """The plan of a campaign, and how far it is."""

    campaign: CampaignNumber
    recipe: RecipeName
    text: str = Field(
        description="Text of the recipe that was run, TOML; empty: an older version of labctl ran the campaign "
        "and did not store the text."
    )
    bench: BenchName
    state: CampaignState = Field(description="State of the campaign.")
    schedule_hash: ScheduleHash
    steps: StepCount
    datasets: DatasetCount
    expected_s: ExpectedDuration
    timeline: RunColumns = Field(description="The steps of the campaign, with expected and real times.")
