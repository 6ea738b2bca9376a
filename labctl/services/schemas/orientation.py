"""How an angle is followed: the one definition of what the command line and HTTP ask for."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

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
