"""Parts of the status of a campaign: the open question, the turn by hand, outputs, advice and drivers."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import Distribution, DistributionVersion, DriverName, ReadingCount


class PromptResponse(ResponseModel):
    """A question to a person; an answer names its id."""

    id: str = Field(description="Id of the question, to be named by the answer.")
    kind: str = Field(
        description="mount: mount or turn the units; power_on, power_off: switch them; turn: turn them by a known "
        "angle."
    )
    text: str = Field(description="The question in words.")
    position: str | None = Field(
        default=None,
        description="Position to which the units are to be turned; of a turn the axis that points up; null: they "
        "stay as they are.",
    )
    turn_deg: float | None = Field(
        default=None,
        description="Only for a turn by hand: angle to turn by, deg, positive counter-clockwise seen from above.",
    )
    within_s: float | None = Field(
        default=None, description="Time within which the answer must arrive, s by the campaign's clock; null: no limit."
    )


class WatchedLimitResponse(ResponseModel):
    """A value that a guard watches now, with its limits."""

    kind: str = Field(description="Guard, as in [guards] of a recipe.")
    device: str = Field(description="Instrument or unit that the value is of.")
    title: str = Field(description="What is watched, in words.")
    value: float = Field(description="Value at the last poll, in `unit`.")
    low: float | None = Field(description="Lowest value that is allowed, in `unit`; null: none.")
    high: float = Field(description="Highest value that is allowed, in `unit`.")
    unit: str = Field(description="Unit of value and limits; empty: a number of things.")
    action: str = Field(description="What the recipe does when it is passed: warn, take_back, suspend or fail.")
    is_beyond: bool = Field(
        description="The limit is passed. Of a share of readings, one more than the limit is needed: a single reading "
        "is no trend."
    )
    age_s: float | None = Field(
        description="How long ago the device answered, s by the campaign's clock; null: it is not asked."
    )


class TurnResponse(ResponseModel):
    """The turn by hand that is under way."""

    position: str = Field(description="The body axis that points up, about which the units are turned.")
    asked_deg: float = Field(description="Angle that is requested, deg, positive counter-clockwise seen from above.")
    phase: Literal["rest", "turn"] = Field(
        description="Whether the units must now be kept at rest (`rest`) or be turned (`turn`)."
    )
    attempt: int = Field(description="Number of this attempt, from 1; a turn that was refused is requested again.")
    came_deg: dict[str, float] = Field(
        default_factory=dict,
        description="For each unit: angle turned so far, deg, computed with the nominal scale factor.",
    )
    refused: str = Field(default="", description="Why the previous attempt was refused; empty for the first.")


class OutputResponse(ResponseModel):
    """What one channel of a unit put out in the last moment, in the channel's unit."""

    gyro: str = Field(description="The unit's name on the bench.")
    channel: str = Field(description="Name of the channel.")
    unit: str = Field(description="Unit of the channel.")
    mean: float = Field(description="Mean of the readings, in `unit`.")
    std: float = Field(description="Standard deviation of single readings.")
    n: ReadingCount
    t_s: float = Field(description="Time of the last reading, s since the campaign began.")


class AdviceResponse(ResponseModel):
    """A failed campaign in words: three short sentences."""

    happened: str = Field(description="What happened.")
    done: str = Field(description="What labctl did.")
    next: str = Field(description="What the operator must do next.")


class DriverResponse(ResponseModel):
    """The driver of an instrument, and the distribution that it came from."""

    driver: DriverName
    distribution: Distribution
    version: DistributionVersion
