"""The step types: a plan is a list of these, written down whole before the first move.

Each is plain data with the time it is expected to take; `kind` names it in the database and in JSON.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from instruments.interfaces.rate_course import RateCourse


class StepBase(BaseModel):
    """What all steps share."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    expected_s: float = 0.0


class PowerOn(StepBase):
    """A powered session begins: gyro streams are opened. `run` counts the sessions."""

    kind: Literal["power_on"] = "power_on"
    run: int
    wait_s: float = 0.0  #: warm-up before anything else is done


class PowerOff(StepBase):
    """The powered session ends. By a person or a relay; the engine asks for confirmation where it cannot switch."""

    kind: Literal["power_off"] = "power_off"
    run: int
    off_s: float = 0.0


class Home(StepBase):
    """The table finds its home switch."""

    kind: Literal["home"] = "home"


class MeasureClock(StepBase):
    """The true step rate of a table without an encoder is measured: runs of equal speed and ramp, short and long."""

    kind: Literal["measure_clock"] = "measure_clock"
    rate_dps: float
    short_s: float  #: steady part of the shortest run
    runs_s: tuple[float, ...] = ()  #: steady part of each run; none in plans of earlier versions


class CheckHome(StepBase):
    """The table goes to where home was, and home is looked for there: a difference is missed steps."""

    kind: Literal["check_home"] = "check_home"
    temperature_c: float


class Mount(StepBase):
    """A person turns the unit so that body axis `position` points along the table axis, up."""

    kind: Literal["mount"] = "mount"
    position: str  #: "x", "-x", "y", ...; tilted "x+y+z"
    mounting: int
    run: int


class MoveChamber(StepBase):
    """A new set point for the chamber; ends when the air has arrived in the band, without `wait` at once."""

    kind: Literal["move_chamber"] = "move_chamber"
    temperature_c: float
    band_c: float
    timeout_s: float
    wait: bool = True  #: without: what follows is done while the temperature moves


class Soak(StepBase):
    """Hold a temperature until the unit has taken it. Time counts only inside the band."""

    kind: Literal["soak"] = "soak"
    temperature_c: float
    hold_s: float
    band_c: float
    max_drift_c: float  #: how much the gyro's own temperature may change over the last `drift_window_s`
    drift_window_s: float
    timeout_s: float


class Acquire(StepBase):
    """One data set: spin the table up, let it settle, read every unit for `duration_s`, let it come to rest."""

    kind: Literal["acquire"] = "acquire"
    dataset: int  #: number in the plan, from 1
    rate_dps: float
    temperature_c: float
    position: str
    run: int
    mounting: int
    settle_s: float
    duration_s: float
    verification: bool = False  #: measured to verify a calibration, and never fitted
    #: a rate that changes, in place of `rate_dps`, which is then 0; the data set lasts as long as the course
    course: RateCourse | None = Field(default=None, discriminator="kind")


class Turn(StepBase):
    """A person turns the units by a known angle: a rest, the turn, and another rest, each of them a data set.

    `dataset` is the number of the turn; the rests have the numbers before and after it.
    """

    kind: Literal["turn"] = "turn"
    dataset: int
    position: str  #: the body axis that points up, about which the units are turned
    run: int
    mounting: int
    turn_deg: float  #: positive counter-clockwise seen from above
    turn_u_deg: float  #: its standard uncertainty
    rest_s: float
    within_s: float  #: from the question to the answer that it is done


class SetSupply(StepBase):
    """A new voltage of the units' supply; ends when the measured voltage has arrived and was held for `settle_s`."""

    kind: Literal["set_supply"] = "set_supply"
    voltage_v: float
    settle_s: float = 0.0
    timeout_s: float = 30.0


class Rest(StepBase):
    """Nothing moves for a while; the environment is recorded."""

    kind: Literal["rest"] = "rest"
    duration_s: float


class SafeState(StepBase):
    """Table at rest, chamber at its safe set point, streams closed."""

    kind: Literal["safe_state"] = "safe_state"


Step = Annotated[
    PowerOn
    | PowerOff
    | Home
    | MeasureClock
    | CheckHome
    | Mount
    | MoveChamber
    | Soak
    | Acquire
    | Turn
    | SetSupply
    | Rest
    | SafeState,
    Field(discriminator="kind"),
]


class StepResult(BaseModel):
    """How a step ended, with the figures that say so (a soak: time held, band, drift of the gyro's temperature)."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    outcome: Literal["done", "failed", "interrupted", "skipped"]
    reason: str = ""
    figures: dict[str, float] = Field(default_factory=dict)
