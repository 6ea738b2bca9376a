"""A calibration version without refitting beside a recording: of constant rates, rest, turns, a profile or poses."""

from __future__ import annotations

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import (
    MOTION,
    POSITION,
    DatasetNumbers,
    OutputAxis,
    RecordingNumber,
    Serial,
    TableRates,
    VersionNumber,
)
from labctl.answers.fitted_model import LeftOutEffect
from labctl.answers.recording_head import Motion

AXIS = "The gyro axis whose output is compared."
CORRECTED = "null: no version is applied."


class ModelLines(ResponseModel):
    """The model's error (output minus true rate) of one output axis in one position.

    A row for each level, a number for each `at` in it.
    """

    axis: OutputAxis
    position: str = Field(description=POSITION)
    level: list[float] = Field(
        description="Temperature, deg C, of each line over the rate; table rate, deg/s, of "
        "each line over the temperature."
    )
    levels: int = Field(
        description="Number of temperatures (for lines over the rate) or rates (for lines over the temperature) in the "
        "recording; if there are more of these than model lines, the lines are drawn for evenly spaced ones."
    )
    at: list[float] = Field(
        description="Points of the lines: table rate, deg/s, of lines over the rate; "
        "temperature, deg C, of lines over the temperature."
    )
    error_dps: list[list[float]] = Field(
        description="Error (output minus true rate), deg/s: one row for each `level`, one value for each `at` in "
        "each row."
    )


class ComparisonColumns(ResponseModel):
    """One row per data set (or piece of a long one) and output axis, as lists of equal length."""

    recording: list[int] = Field(default_factory=list, description="Number of the recording.")
    dataset: DatasetNumbers = Field(default_factory=list)
    axis: list[str] = Field(default_factory=list, description="The output axis.")
    position: list[str] = Field(default_factory=list, description="The body axis that pointed along the table axis.")
    table_rate_dps: TableRates = Field(default_factory=list)
    own_rate_dps: list[float] = Field(default_factory=list, description="True rate along the output axis, deg/s.")
    temperature_c: list[float] = Field(
        default_factory=list, description="Mean temperature of the unit during the data set, deg C."
    )
    temperature_level_c: list[float] = Field(
        default_factory=list, description="Centre of the temperature level that the data set belongs to, deg C."
    )
    rate_level_dps: list[float] = Field(
        default_factory=list, description="Centre of the table-rate level that the data set belongs to, deg/s."
    )
    measured_error_dps: list[float] = Field(
        default_factory=list, description="Error of the output: output minus true rate along the axis, deg/s."
    )
    modelled_error_dps: list[float] = Field(
        default_factory=list, description="Error that the version subtracts: output minus corrected rate, deg/s."
    )
    residual_dps: list[float] = Field(
        default_factory=list, description="Residual: corrected rate minus true rate along the axis, deg/s."
    )
    turn_before_deg: list[float | None] = Field(
        default_factory=list,
        description="Error of the integrated angle after a full turn with only the static bias subtracted, deg; "
        "null: the rate is too low, the turn is about another axis, or the recording has no data set at rest.",
    )
    turn_after_deg: list[float | None] = Field(
        default_factory=list,
        description="Error of the integrated angle after a full turn with the calibration applied, deg; null: the rate "
        "is too low, the turn is about another axis, or the recording has no data set at rest.",
    )


class ComparisonResponse(ResponseModel):
    """A version applied without refitting, and a recording."""

    serial: Serial
    version: VersionNumber
    recording: RecordingNumber
    recordings: list[int] = Field(
        default_factory=list, description="All recordings that the version is compared with; `recording` is the newest."
    )
    fitted_to: int | None = Field(description="The recording that the version was fitted to.")
    source: str = Field(
        description="A sentence that names the model and the data from which the numbers were computed."
    )
    held: dict[str, float] = Field(
        description="Other channels that the lines depend on, held constant at their mean in this recording."
    )
    left_out: list[LeftOutEffect] = Field(description="Effects of the fit that are not exported with the calibration.")
    least_turn_rate_dps: float = Field(
        description="The error per turn is computed where the magnitude of the rate is at least this, deg/s."
    )
    earth_turning_dps: float | None = Field(
        description="Size of the horizontal part of the Earth's rate, deg/s, which goes round with the table: it is in "
        "the errors here, as nothing is fitted; a fit takes it off. null: the latitude is not known."
    )
    at_rest_dps: float = Field(
        description="A data set counts as at rest if the magnitude of its table rate is below this, deg/s."
    )
    columns: ComparisonColumns = Field(description="Measured and modelled error of each data set and output axis.")
    over_rate: list[ModelLines] = Field(description="A line over the table rate for each temperature level.")
    over_temperature: list[ModelLines] = Field(description="A line over temperature for each level of the table rate.")


class RestColumns(ResponseModel):
    """At rest: one row per data set, or piece of a long one, and output axis, as lists of equal length."""

    axis: list[str] = Field(default_factory=list, description=AXIS)
    dataset: DatasetNumbers = Field(default_factory=list)
    t_s: list[float | None] = Field(
        default_factory=list, description="Time since the recording began, s; null: not known."
    )
    temperature_c: list[float | None] = Field(
        default_factory=list, description="Temperature, deg C; null: there was no thermometer."
    )
    leg: list[str] = Field(
        default_factory=list,
        description="Whether the temperature rises (heating) or falls (cooling); empty where it is constant.",
    )
    bias_dps: list[float] = Field(
        default_factory=list,
        description="Output minus the Earth's rate, deg/s; where the latitude is not known, nothing is subtracted.",
    )
    u_dps: list[float | None] = Field(
        default_factory=list, description="Standard uncertainty of the mean due to white noise, deg/s; null: not known."
    )
    modelled_dps: list[float | None] = Field(
        default_factory=list,
        description="Error that the version subtracts, lag and hysteresis of the temperature "
        f"included, deg/s; {CORRECTED}",
    )
    residual_dps: list[float | None] = Field(
        default_factory=list, description=f"Bias that remains after the correction, deg/s; {CORRECTED}"
    )


class TurnColumns(ResponseModel):
    """Turns by known angles: one row per turn and output axis, as lists of equal length."""

    axis: list[str] = Field(default_factory=list, description=AXIS)
    dataset: DatasetNumbers = Field(default_factory=list)
    about: list[str] = Field(default_factory=list, description="Body axis that pointed up, with its sign.")
    asked_deg: list[float] = Field(default_factory=list, description="True angle that the output axis turned by, deg.")
    output_deg: list[float] = Field(default_factory=list, description="Integral of the uncorrected output, deg.")
    corrected_deg: list[float | None] = Field(
        default_factory=list, description=f"Integral of the corrected rate, deg; {CORRECTED}"
    )
    residual_deg: list[float | None] = Field(
        default_factory=list, description="`corrected_deg` minus `asked_deg`, deg."
    )
    u_deg: list[float | None] = Field(
        default_factory=list,
        description="Standard uncertainty of the integral minus the true angle, from angle, time stamps and noise, "
        "deg; null: unknown.",
    )


class ProfileColumns(ResponseModel):
    """A rate that changes: one row per window of readings and output axis, as lists of equal length."""

    axis: list[str] = Field(default_factory=list, description=AXIS)
    dataset: DatasetNumbers = Field(default_factory=list)
    t_s: list[float] = Field(
        default_factory=list, description="Mean time of the readings of the window, s since the recording began."
    )
    true_dps: list[float] = Field(
        default_factory=list, description="Component of the table's rate along the axis, deg/s."
    )
    output_dps: list[float] = Field(
        default_factory=list, description="Mean of the uncorrected output in the window, deg/s."
    )
    residual_dps: list[float | None] = Field(
        default_factory=list,
        description=f"Corrected rate minus true rate, as a user of the calibration obtains it, deg/s; {CORRECTED}",
    )
    followed_dps: list[float | None] = Field(
        default_factory=list,
        description="Corrected rate minus the true rate filtered by the version's delay and bandwidth, deg/s; null: "
        "the version has neither.",
    )


class AxisResponse(ResponseModel):
    """Delay and bandwidth of one axis, as a version has them."""

    delay_s: float | None = Field(default=None, description="Delay of the output, s; null: not part of the model.")
    u_delay_s: float | None = Field(
        default=None, description="Standard uncertainty of the delay, s; null: not part of the model, or not known."
    )
    bandwidth_hz: float | None = Field(
        default=None, description="Frequency at which the power is halved, 1/(2 pi time constant), Hz."
    )
    u_bandwidth_hz: float | None = Field(
        default=None,
        description="Standard uncertainty of the bandwidth, Hz; null: not part of the model, or not known.",
    )
    expanded_delay_s: float | None = Field(
        default=None, description="Expanded uncertainty of the delay by its budget, s; it covers with 95.45 %."
    )
    expanded_bandwidth_hz: float | None = Field(
        default=None, description="Expanded uncertainty of the bandwidth by the budget of the time constant, Hz."
    )


class PoseColumns(ResponseModel):
    """Turns by hand between rests: one row per move, as lists of equal length."""

    from_s: list[float] = Field(default_factory=list, description="Start of the move, s since the recording began.")
    until_s: list[float] = Field(default_factory=list, description="End of the move, s since the recording began.")
    accelerometer_deg: list[float] = Field(
        default_factory=list,
        description="Angle between gravity before and after the move, from the accelerometer, deg.",
    )
    gyro_deg: list[float] = Field(
        default_factory=list,
        description="Angle between gravity before and after the move, from the integrated rates of the gyro, deg.",
    )
    residual_deg: list[float] = Field(
        default_factory=list,
        description="Angle between gravity after the move from the gyro and from the accelerometer, deg.",
    )


class MotionResponse(ResponseModel):
    """A recording by what moved the unit; exactly one of `rest`, `turns`, `profile` and `poses` is present."""

    serial: Serial
    recording: RecordingNumber
    version: int | None = Field(
        description="Version that is applied without refitting; null: none, the outputs are not corrected."
    )
    motion: Motion = Field(description=MOTION)
    source: str = Field(
        description="A sentence that names the version and the recording from which the numbers were computed."
    )
    rows: int = Field(description="Number of rows of each axis in this response.")
    of: int = Field(
        description="Number of rows of each axis in the recording; if larger than `rows`, evenly spaced "
        "rows were chosen."
    )
    rest: RestColumns | None = Field(
        default=None, description="Data sets at rest; null: the unit was moved in another way."
    )
    turns: TurnColumns | None = Field(
        default=None, description="Turns by known angles; null: the unit was moved in another way."
    )
    profile: ProfileColumns | None = Field(
        default=None, description="Windows of a rate profile; null: the unit was moved in another way."
    )
    poses: PoseColumns | None = Field(
        default=None, description="Turns by hand between rests; null: the unit was moved in another way."
    )
    responses: dict[str, AxisResponse] = Field(
        default_factory=dict, description="Delay and bandwidth of each axis; only for a rate profile."
    )
    left_out: list[str] = Field(
        default_factory=list, description="Parts of the recording that could not be used, each with the reason."
    )
