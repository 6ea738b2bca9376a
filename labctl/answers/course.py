"""The course of a campaign: the temperatures that were logged while it ran."""

from __future__ import annotations

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import CampaignNumber


class CourseResponse(ResponseModel):
    """Temperatures of a campaign over its time, as lists of equal length."""

    campaign: CampaignNumber
    samples: int = Field(description="Number of times at which the environment was logged, from the asked time on.")
    t_s: list[float] = Field(
        description="Times, s since the start of the campaign; fewer than `samples` where those are too many to show: "
        "the first and last and, of each span between, the ones at which the temperature was lowest and highest."
    )
    chamber_c: list[float | None] = Field(description="Air of the chamber, deg C; null: not logged.")
    setpoint_c: list[float | None] = Field(description="Set point of the chamber, deg C; null: none, or not logged.")
    units_c: dict[str, list[float | None]] = Field(
        description="By serial number: temperature of the unit by its own thermometer or the one that stands for it, "
        "deg C; null: not logged at this time."
    )
