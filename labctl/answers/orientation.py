"""Options of the orientation, the same for the command line and HTTP, and its result."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import OutputAxis, ReadingCount

#: A declared stop lasts so long, s: 2 s until the offset is learned, and as many readings as make its noise small.
STOP_S = 10.0

Seconds = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]


class OrientationOptions(BaseModel):
    """Options with which the angle of one axis is integrated."""

    model_config = ConfigDict(frozen=True)

    axis: str | None = Field(
        default=None, max_length=1, description="Axis x, y or z; default: the only axis of the recording."
    )
    rest_s: Seconds = Field(
        default=0.0,
        description="Time for which the unit is at rest at the beginning, s; the mean rate of that time (static "
        "bias) is subtracted.",
    )
    instability_dps: Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)] = Field(
        default=0.0,
        description="Bias instability of the gyro, deg/s; it is part of the uncertainty of the static bias.",
    )
    standstill: bool = Field(
        default=True, description="While the unit stands still, hold the angle and estimate the offset again."
    )
    warm_up_s: Seconds = Field(default=0.0, description="Time from the beginning whose readings are left out, s.")
    stop_every_s: float | None = Field(
        default=None,
        le=1e6,
        allow_inf_nan=False,
        description=f"For a recording at rest: time from one stop to the next, s; {STOP_S:g} s of it count as a stop "
        "and the rest as motion, and the drift between stops is returned.",
    )


class OrientationQuery(OrientationOptions):
    """Options with which the angle in a recording is integrated."""

    version: int | None = Field(
        default=None,
        ge=0,
        description="Version of the calibration that corrects the readings; 0: no correction; default: the certified "
        "version, if any.",
    )


class StaticBiasResponse(ResponseModel):
    """The mean output at rest before a mission (Ojeda et al. 2000, eqs. 1, 15 and 16); it contains the Earth's rate."""

    bias_dps: float = Field(description="Mean output at rest, deg/s.")
    u_dps: float = Field(
        description="Standard uncertainty of the static bias, deg/s, from the white noise of "
        "the mean and the bias instability."
    )
    readings: ReadingCount
    seconds: float = Field(description="Duration of the rest, s.")


class OrientationResponse(ResponseModel):
    """The angle of one axis, positive counter-clockwise and never wrapped, from its rate."""

    axis: OutputAxis
    version: int | None = Field(
        description="Version of the calibration by which the rates were corrected; null: no correction."
    )
    readings: int = Field(description="Number of valid readings after the warm-up.")
    left_out: int = Field(
        description="Number of readings left out because they were marked invalid or were not numbers."
    )
    seconds: float = Field(description="Time over which the angle was integrated, s.")
    static_bias: StaticBiasResponse | None = Field(
        description="Static bias that was subtracted; null: no rest at the beginning was given."
    )
    angle_deg: float = Field(
        description="Angle at the end, deg; the angle is 0 at the end of the rest at the beginning."
    )
    drift_between_stops_deg_per_min: list[float] = Field(
        default_factory=list,
        description="For each leg between two declared stops: its drift, deg/min; empty: no stops were declared.",
    )
    drift_deg_per_min: float | None = Field(
        description="Angle divided by the time, deg/min: the drift if the unit was at rest; null: the time is 0."
    )
    offset_dps: float = Field(
        description="Offset that is subtracted at the end, deg/s: the static bias, or the "
        "offset estimated during the last standstill."
    )
    standing_s: float = Field(description="Time for which the unit was taken to stand still and its angle was held, s.")
    gap_s: float = Field(description="Time without readings, s; the angle is interpolated linearly over it.")
    t_s: list[float] = Field(description="Times of the values in `course_deg`, s.")
    course_deg: list[float] = Field(description="The angle at these times, deg; at most 2000 points.")
    warning: str = Field(
        default="", description="Warning that the calibration is overdue or was revoked; empty: neither."
    )
