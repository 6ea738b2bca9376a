"""How an angle is followed, for the command line and HTTP alike, and what is found."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from labctl.services.schemas.base import ResponseModel

#: A declared stop lasts so long, s: 2 s until the offset is learned, and as many readings as make its noise small.
STOP_S = 10.0

Seconds = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]


class OrientationOptions(BaseModel):
    """How the angle of one axis is followed."""

    model_config = ConfigDict(frozen=True)

    axis: str | None = Field(default=None, max_length=1, description="x, y or z; default: the only one.")
    rest_s: Seconds = Field(default=0.0, description="At rest so long at first: its static bias is taken off, s.")
    instability_dps: Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)] = Field(
        default=0.0, description="Bias instability, for the uncertainty: what a mean does not remove, deg/s."
    )
    standstill: bool = Field(default=True, description="Hold the angle and learn the offset at standstill.")
    warm_up_s: Seconds = Field(default=0.0, description="Readings of the first so long are left out, s.")
    stop_every_s: float | None = Field(
        default=None,
        le=1e6,
        allow_inf_nan=False,
        description=f"Of a record at rest: a stop of {STOP_S:g} s is declared so often and motion between, s; the "
        "drift between stops is answered.",
    )


class OrientationQuery(OrientationOptions):
    """How the angle in a recording is followed."""

    version: int | None = Field(
        default=None, ge=0, description="Calibration that corrects it; 0: none; default: the certified one, if any."
    )


class StaticBiasResponse(ResponseModel):
    """The mean output at rest before a mission (Ojeda et al. 2000, eqs. 1, 15 and 16); it contains the Earth's rate."""

    bias_dps: float
    u_dps: float = Field(description="Standard uncertainty: white noise of the mean, and the bias instability.")
    readings: int
    seconds: float


class OrientationResponse(ResponseModel):
    """The angle of one axis, positive counter-clockwise and never wrapped, from its rate."""

    axis: str
    version: int | None = Field(description="Calibration that the rates were corrected by; null: none.")
    readings: int
    left_out: int = Field(description="Readings that were not valid, or no numbers.")
    seconds: float
    static_bias: StaticBiasResponse | None = Field(description="Taken off; null: no rest was named.")
    angle_deg: float = Field(description="At the end; 0 at the end of the rest.")
    drift_between_stops_deg_per_min: list[float] = Field(default_factory=list)  #: with declared stops, of each leg
    drift_deg_per_min: float | None = Field(
        description="Angle over time: the drift where the unit stood; null: no time."
    )
    offset_dps: float = Field(description="Taken off at the end: the static bias, or learned at standstill since.")
    standing_s: float = Field(description="Time for which the unit counted as standing, its angle held.")
    gap_s: float = Field(description="Time without readings, bridged in a straight line.")
    t_s: list[float] = Field(description="Times of the course below, s.")
    course_deg: list[float] = Field(description="The angle at these times, deg; at most 2000 points.")
    warning: str = Field(default="", description="That the calibration is overdue or was revoked; empty: it is not.")
