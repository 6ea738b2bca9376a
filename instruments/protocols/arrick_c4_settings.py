"""Settings of an Arrick table on a C4 controller, as a bench file gives them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from instruments.bench_config import TableSettings


class StepperSettings(TableSettings):
    """Step clock of a table whose rates are whole divisors of it."""

    step_clock_hz: float = Field(default=2_000_000.0, gt=0)  #: the step rate is this frequency over a whole divisor


class ArrickC4Settings(StepperSettings):
    """Serial port and command templates of a C4."""

    #: Required here; a frozen model is never assigned to, so a narrower type is sound.
    port: str  # pyright: ignore[reportGeneralTypeIssues, reportIncompatibleVariableOverride]
    baudrate: int = 9600
    direction: Literal[1, -1] = 1  #: 1: `f` turns the table counter-clockwise seen from above
    clock_u_ppm: float = Field(default=50.0, ge=0)  #: standard uncertainty of the step clock
    #: The C4's speed command is not public. Without the manual's template the driver refuses a constant rate.
    speed_template: str | None = None
    ramp_template: str | None = None
    terminator: str = "\r"
