"""Whether a campaign has measured enough: the U that its recipe asks for, and U of its fit so far."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import CampaignNumber

Known = Literal["of the fit", "at least", "unknown"]


class TargetUnitResponse(ResponseModel):
    """U of one unit by its newest evaluation."""

    gyro: str = Field(description="Name of the unit on the bench.")
    known: Known = Field(
        description="What `u_dps` is: U of the fit over the whole range; a lower bound of it, by the white noise of "
        "the readings and the reference standards alone, which is above the target or not over the whole range yet; "
        "or unknown."
    )
    u_dps: float | None = Field(
        description="Largest U (95.45 %) of a corrected rate about the axis of an output over the range, deg/s; null: "
        "unknown."
    )
    text: str = Field(description="The same in words, with the place, or why it is unknown.")


class TargetResponse(ResponseModel):
    """The U at which a campaign ends before its plan does ([stop] of its recipe), and U so far."""

    u_dps: float = Field(description="The U that ends the campaign, deg/s.")
    model: str | None = Field(description="The model that is fitted; null: the effects alone.")
    effects: list[str] = Field(description="Effects beside the model, or without one.")
    rates_dps: list[float] = Field(description="Lowest and highest rate of the range, deg/s.")
    temperature_c: list[float] = Field(description="Lowest and highest set point of the chamber in the range, deg C.")
    repeatability: bool = Field(description="Whether U counts the difference of a later power-on.")
    units: list[TargetUnitResponse] = Field(
        description="Each unit's newest evaluation; a unit that was not evaluated yet is left out."
    )


class UncertaintyCourse(ResponseModel):
    """U of one unit while the campaign ran, as lists of equal length."""

    datasets: list[int] = Field(description="Data sets to be fitted that were complete when U was known.")
    t_s: list[float] = Field(description="Campaign time at which U was known, s.")
    u_dps: list[float | None] = Field(description="U, or its lower bound, deg/s; null: unknown.")
    known: list[Known] = Field(description="What each `u_dps` is.")


class UncertaintyCourseResponse(ResponseModel):
    """U of a campaign's fit as it fell while the campaign ran; without units where its recipe has no [stop]."""

    campaign: CampaignNumber
    target_u_dps: float | None = Field(description="The U that ends the campaign, deg/s; null: its recipe has none.")
    planned: int = Field(description="Data sets of the plan that are fitted.")
    units: dict[str, UncertaintyCourse] = Field(description="By name of the unit on the bench.")
