"""A calibration version without refitting beside a recording: of constant rates, rest, turns, a profile or poses."""

from __future__ import annotations

from pydantic import Field

from labctl.json_types.models import LeftOut
from labctl.recording.info import Motion
from labctl.services.schemas.base import ResponseModel

AXIS = "The output axis."
CORRECTED = "null: without a version."


class ModelLines(ResponseModel):
    """The model's error (output minus true rate) of one output axis in one position.

    A row for each level, a number for each `at` in it.
    """

    axis: str
    position: str
    level: list[float] = Field(description="Temperature, deg C, or table rate, deg/s, of each line.")
    levels: int = Field(description="How many levels the recording has; more than lines: evenly picked.")
    at: list[float] = Field(description="Table rate, deg/s, or temperature, deg C, along the lines.")
    error_dps: list[list[float]]


class ComparisonColumns(ResponseModel):
    """One row per data set (or piece of a long one) and output axis, as lists of equal length."""

    recording: list[int] = Field(default_factory=list, description="Number of the recording.")
    dataset: list[int] = Field(default_factory=list, description="Number of the data set in its recording.")
    axis: list[str] = Field(default_factory=list, description="The output axis.")
    position: list[str] = Field(default_factory=list, description="The body axis that lay along the table axis.")
    table_rate_dps: list[float] = Field(default_factory=list)
    own_rate_dps: list[float] = Field(default_factory=list, description="True rate along the output axis.")
    temperature_c: list[float] = Field(default_factory=list)
    temperature_level_c: list[float] = Field(default_factory=list, description="Centre of its temperature level.")
    rate_level_dps: list[float] = Field(default_factory=list, description="Centre of its level of the table rate.")
    measured_error_dps: list[float] = Field(default_factory=list, description="Output minus own rate.")
    modelled_error_dps: list[float] = Field(
        default_factory=list, description="What the version subtracts: output minus corrected rate."
    )
    residual_dps: list[float] = Field(default_factory=list, description="Residual: corrected rate minus own rate.")
    turn_before_deg: list[float | None] = Field(
        default_factory=list,
        description="Error after a full turn with the static bias alone taken off; null: too slow, another axis turns, "
        "or the recording has nothing at rest.",
    )
    turn_after_deg: list[float | None] = Field(default_factory=list, description="The same after the calibration.")


class ComparisonResponse(ResponseModel):
    """A version applied without refitting, and a recording."""

    serial: str
    version: int
    recording: int
    recordings: list[int] = Field(default_factory=list, description="All recordings; `recording` is the newest.")
    fitted_to: int | None = Field(description="The recording that the version was fitted to.")
    source: str = Field(description="Which model all numbers here come from, in words.")
    held: dict[str, float] = Field(description="Other channels that the lines need: their means in this recording.")
    left_out: list[LeftOut] = Field(description="Effects of the fit that are not exported with the calibration.")
    least_turn_rate_dps: float = Field(description="The error per turn is given from this rate on.")
    at_rest_dps: float = Field(description="Below this table rate a data set is at rest.")
    columns: ComparisonColumns
    over_rate: list[ModelLines] = Field(description="A line over the table rate for each temperature level.")
    over_temperature: list[ModelLines] = Field(description="A line over temperature for each level of the table rate.")


class RestColumns(ResponseModel):
    """At rest: one row per data set, or piece of a long one, and output axis, as lists of equal length."""

    axis: list[str] = Field(default_factory=list, description=AXIS)
    dataset: list[int] = Field(default_factory=list)
    t_s: list[float | None] = Field(default_factory=list, description="Since the recording began; null: not known.")
    temperature_c: list[float | None] = Field(default_factory=list, description="null: there was no thermometer.")
    leg: list[str] = Field(
        default_factory=list, description="heating or cooling; empty where the temperature does not move."
    )
    bias_dps: list[float] = Field(
        default_factory=list, description="Output minus the Earth's rate, which is 0 where the latitude is not known."
    )
    u_dps: list[float | None] = Field(
        default_factory=list, description="Standard uncertainty of the mean by white noise; null: not known."
    )
    modelled_dps: list[float | None] = Field(
        default_factory=list, description=f"What the version subtracts there, with what it remembers; {CORRECTED}"
    )
    residual_dps: list[float | None] = Field(default_factory=list, description=f"What it leaves; {CORRECTED}")


class TurnColumns(ResponseModel):
    """Turns by known angles: one row per turn and output axis, as lists of equal length."""

    axis: list[str] = Field(default_factory=list, description=AXIS)
    dataset: list[int] = Field(default_factory=list)
    about: list[str] = Field(default_factory=list, description="Body axis that pointed up, with its sign.")
    asked_deg: list[float] = Field(default_factory=list, description="Angle that the output axis turned by.")
    output_deg: list[float] = Field(default_factory=list, description="Integral of the output as it is.")
    corrected_deg: list[float | None] = Field(
        default_factory=list, description=f"Integral of the corrected rate; {CORRECTED}"
    )
    residual_deg: list[float | None] = Field(default_factory=list, description="Corrected minus asked.")
    u_deg: list[float | None] = Field(
        default_factory=list,
        description="Standard uncertainty of an integral minus the angle: angle, time stamps and noise; null: unknown.",
    )


class ProfileColumns(ResponseModel):
    """A rate that changes: one row per window of readings and output axis, as lists of equal length."""

    axis: list[str] = Field(default_factory=list, description=AXIS)
    dataset: list[int] = Field(default_factory=list)
    t_s: list[float] = Field(default_factory=list)
    true_dps: list[float] = Field(default_factory=list, description="Rate of the table along the axis.")
    output_dps: list[float] = Field(default_factory=list)
    residual_dps: list[float | None] = Field(
        default_factory=list, description=f"Corrected minus true rate, as a consumer has it; {CORRECTED}"
    )
    followed_dps: list[float | None] = Field(
        default_factory=list,
        description="Corrected rate minus the true rate through the version's delay and bandwidth; null: it has none.",
    )


class AxisResponse(ResponseModel):
    """Delay and bandwidth of one axis, as a version has them; null: not part of its model, or not known."""

    delay_s: float | None = None
    u_delay_s: float | None = None
    bandwidth_hz: float | None = Field(default=None, description="At half of the power: 1/(2 pi time constant).")
    u_bandwidth_hz: float | None = None


class PoseColumns(ResponseModel):
    """Turns by hand between rests: one row per move, as lists of equal length."""

    from_s: list[float] = Field(default_factory=list)
    until_s: list[float] = Field(default_factory=list)
    accelerometer_deg: list[float] = Field(
        default_factory=list, description="Angle between gravity before and after, by the accelerometer."
    )
    gyro_deg: list[float] = Field(default_factory=list, description="The same by the gyro's rates, integrated.")
    residual_deg: list[float] = Field(
        default_factory=list, description="Angle between gravity after the move by the gyro and by the accelerometer."
    )


class MotionResponse(ResponseModel):
    """A recording by what moved the unit; of `rest`, `turns`, `profile` and `poses` one is there."""

    serial: str
    recording: int
    version: int | None = Field(description="Version that is applied without refitting; null: the outputs as they are.")
    motion: Motion
    source: str = Field(description="What the numbers are of, in words.")
    rows: int = Field(description="Rows of each axis that are here.")
    of: int = Field(description="Rows that the recording has; more than `rows`: evenly picked.")
    rest: RestColumns | None = None
    turns: TurnColumns | None = None
    profile: ProfileColumns | None = None
    poses: PoseColumns | None = None
    responses: dict[str, AxisResponse] = Field(default_factory=dict, description="Of a profile, by axis.")
    left_out: list[str] = Field(default_factory=list, description="What could not be used, and why.")
