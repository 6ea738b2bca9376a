"""Settings of an Arrick table on a C4 controller, as a bench file gives them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from instruments.bench_config import Strict, TableSettings
from instruments.protocols.serial_options import SerialOptions


class StepperSettings(TableSettings):
    """Step clock of a table whose rates are whole divisors of it."""

    step_clock_hz: float = Field(default=2_000_000.0, gt=0)  #: the step rate is this frequency over a whole divisor


class InitCommand(Strict):
    """A command that is sent once after the link is opened, before the table moves."""

    send: str = Field(min_length=1, max_length=79)  #: with its prefix, as `!1we11`
    expect: str | None = None  #: the line of the reply; without it, what comes within a second is dropped


class ArrickC4Settings(StepperSettings):
    """Serial port and command templates of a C4."""

    #: Required here; a frozen model is never assigned to, so a narrower type is sound.
    port: str  # pyright: ignore[reportGeneralTypeIssues, reportIncompatibleVariableOverride]
    baudrate: int = 9600
    line: SerialOptions = Field(default_factory=SerialOptions)  #: parity, echo, RS-485 direction
    direction: Literal[1, -1] = 1  #: 1: `f` turns the table counter-clockwise seen from above
    clock_u_ppm: float = Field(default=50.0, ge=0)  #: standard uncertainty of the step clock
    #: The C4's speed command is not public. Without the manual's template the driver refuses a constant rate.
    speed_template: str | None = None
    ramp_template: str | None = None
    terminator: str = "\r"
    #: Motors energised, limits removed and the like: once per opening of the link, before the table moves.
    init_commands: tuple[InitCommand, ...] = ()
    #: Difference in duration of the runs that measure the step clock, s; 0: the clock is not measured.
    clock_run_s: float = Field(default=60.0, ge=0, le=3600)
    #: Expanded uncertainty of the measured step clock from which on the runs are said to disagree, ppm.
    clock_limit_ppm: float = Field(default=1000.0, gt=0)
    #: Standard uncertainty of when a reply arrives, without what is common, s. None: by the latency of the adapter.
    reply_u_s: float | None = Field(default=None, gt=0)
    check_home: bool = True  #: look for missed steps at the home switch before and after each temperature
    home_limit_steps: float = Field(default=2.0, gt=0)  #: more missed steps end the campaign
