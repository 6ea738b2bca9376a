"""A criticism, its residuals and its plots."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, JsonValue

from labctl.json_types.criticism import (
    Advice,
    CriticisedErrors,
    CriticisedNoise,
    Experiment,
    FailingRange,
    LackOfFit,
    NotTestable,
    OutputStep,
    Remainder,
    ResidualMap,
    SlowProcess,
    Suspect,
    WorstDataSet,
)
from labctl.json_types.joint import JointJson
from labctl.json_types.models import ThermalFamilyJson, ThermalHintJson
from labctl.json_types.views import Views
from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.common_fields import (
    POSITION,
    DatasetNumbers,
    MaxError,
    MeanError,
    RecordingNumber,
    RmsError,
    Serial,
    TableRates,
    VersionNumber,
)
from labctl.services.schemas.warnings import WARNINGS, DataWarning


class AxisVerification(ResponseModel):
    """Corrected minus true rate of one axis over the data sets, deg/s."""

    rms_dps: RmsError
    max_dps: MaxError
    bias_dps: MeanError
    expected_dps: float | None = Field(
        default=None,
        description="RMS error that is expected of the version on this axis, deg/s: that over all axes times the share "
        "of the axis in what the version leaves of its own data; null: unknown.",
    )
    limit_dps: float | None = Field(
        default=None,
        description="Largest RMS error of an axis that holds, deg/s: twice `expected_dps`, or more where the "
        "recording or the data of the fit have few independent errors. In at most 5 % of the recordings of versions "
        "that hold is any axis beyond its limit.",
    )
    ok: bool | None = Field(default=None, description="Whether `rms_dps` is at most `limit_dps`; null: unknown.")


class VerificationResponse(ResponseModel):
    """A calibration version applied without refitting to a recording, nothing fitted. Errors: corrected minus true
    rate."""

    serial: Serial
    version: VersionNumber
    recording: RecordingNumber
    recorded_unit: str = Field(description="Serial number of the unit that was recorded.")
    seen: bool = Field(description="Whether the version was fitted to these data sets.")
    part: Literal["verification", "all"] = Field(
        description="verification: the data sets of the recording that were measured to verify, and are never fitted; "
        "all: the recording has none, so every data set."
    )
    datasets: int = Field(description="Number of data sets to which the version was applied.")
    rms_dps: RmsError
    max_dps: MaxError
    bias_dps: MeanError
    axes: dict[str, AxisVerification] = Field(
        description="For each axis: its error, what is expected of it, and its limit."
    )
    axes_off: list[str] = Field(
        default_factory=list, description="Axes whose RMS error is beyond the limit of the axis."
    )
    outside_validity: int = Field(
        description="Number of data sets outside the rates or temperatures of the calibration."
    )
    expected_dps: float | None = Field(
        description="RMS error that is expected of the version, deg/s: the larger of its held-out error and its "
        "error on the data of the fit; null: unknown."
    )
    ok: bool = Field(description="Whether the RMS error of each axis is at most the limit of the axis.")


class CriticismResponse(ResponseModel):
    """A model compared with a recording: the verdict in one of five forms, and its evidence."""

    serial: Serial
    version: VersionNumber
    recording: RecordingNumber
    recordings: list[int] = Field(
        default_factory=list, description="All recordings that the model is compared with; `recording` is the newest."
    )
    joint: JointJson | None = Field(
        default=None,
        description="Only for several recordings: repeatability, agreement between the recordings, and the error "
        "when each recording is predicted by a fit to the others.",
    )
    verdict: Literal["adequate", "missing", "ambiguous", "unexplained", "insufficient_data"] = Field(
        description="adequate: the residual is explained by noise; missing: the named effects are missing in the "
        "model; ambiguous: one of the named effects is missing, and the data do not distinguish them; unexplained: "
        "no effect of the catalogue explains the residual; insufficient_data: too little was measured for a "
        "verdict."
    )
    text: list[str] = Field(description="The verdict in sentences, the conclusion first.")
    error: CriticisedErrors = Field(
        description="Errors of the model as refitted for this comparison, and the noise floor, deg/s."
    )
    noise: CriticisedNoise = Field(description="The noise by which the residual is judged.")
    lack_of_fit: LackOfFit = Field(description="Test of whether the residual is larger than the noise explains.")
    where: list[FailingRange] = Field(description="Ranges of channels in which the residual is far from 0.")
    suspects: list[Suspect] = Field(
        description="Effects that may be missing in the model, each with its evidence and size."
    )
    named: list[str] = Field(description="The effects that the verdict is based on.")
    depends_on: list[str] = Field(description="Channels that the residual depends on, strongest first.")
    confounded_with: list[str] = Field(
        default_factory=list,
        description="Channels that changed together with the first of `depends_on`, so that "
        "this schedule cannot distinguish them.",
    )
    remainder: Remainder | None = Field(
        default=None, description="Share (0 to 1) of the residual above the noise floor that no named effect explains."
    )
    thermal_response: ThermalFamilyJson | None = Field(
        default=None, description="At rest, over several legs: the thermal response that predicts the legs left out."
    )
    thermal_hint: ThermalHintJson | None = Field(
        default=None, description="One that predicts them better than the model, but too little to be named, and why."
    )
    not_physical: list[str] = Field(
        default_factory=list,
        description="Effects that explain these data equally well, but at a size that the unit cannot have.",
    )
    named_axes: dict[str, list[str]] = Field(
        default_factory=dict, description="For each effect: the axes on which the effect was found."
    )
    further: list[list[str]] = Field(
        default_factory=list,
        description="Effects that could be tried although the model is adequate; equivalent effects are in one group.",
    )
    hypothesis: Literal["temperature_not_logged"] | None = Field(
        default=None,
        description="temperature_not_logged: the residual of a record at rest wanders slowly, in a way that the logged "
        "thermometer does not explain.",
    )
    slow_process: SlowProcess | None = Field(
        default=None, description="Slow process in the residual of a record at rest; null: none, or not at rest."
    )
    output_steps: dict[str, OutputStep] = Field(
        default_factory=dict,
        description="Axis -> step of an output whose steps the noise does not average out, read from its lattice.",
    )
    advice: list[Advice] = Field(
        default_factory=list,
        description="For each effect that the verdict is based on: whether to add it, by what would be exported.",
    )
    not_testable: list[NotTestable] = Field(description="Effects that this recording cannot show, and why.")
    experiments: list[Experiment] = Field(
        description="Measurements that would distinguish the effects in question, or show effects that cannot be "
        "seen here."
    )
    worst: list[WorstDataSet] = Field(default_factory=list, description="Data sets furthest from the model.")
    maps: list[ResidualMap] = Field(
        default_factory=list, description="Maps of the residual divided by the noise floor, over rate and temperature."
    )
    readings_left_out: int = Field(
        default=0, description="Number of readings left out because they are far from the others of their data set."
    )
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)
    applied: VerificationResponse | None = Field(
        default=None,
        description="Result of the version applied to this recording without refitting; all other figures are from a "
        "refit to this recording.",
    )
    views: Views = Field(
        default_factory=Views, description="The data of each picture of where and how the model fails."
    )


class StageResponse(ResponseModel):
    """The stage of a followed criticism that begins now."""

    stage: str = Field(description="The stage in words, such as `inspecting the recording`.")


class ResidualColumns(ResponseModel):
    """One row per data set and axis, as lists of equal length. A data set far longer than the others is in pieces."""

    recording: list[int] = Field(default_factory=list, description="Number of the recording.")
    dataset: DatasetNumbers = Field(default_factory=list)
    axis: list[str] = Field(default_factory=list, description="Output axis: x, y or z.")
    position: list[str] = Field(default_factory=list, description=POSITION)
    run: list[int] = Field(default_factory=list, description="Number of the run, a powered session of the unit.")
    table_rate_dps: TableRates = Field(default_factory=list)
    own_rate_dps: list[float] = Field(
        default_factory=list,
        description="True rate along the output axis, deg/s; it includes the Earth's rate where that is known.",
    )
    temperature_c: list[float] = Field(
        default_factory=list, description="Mean temperature of the unit during the data set, deg C."
    )
    t_s: list[float | None] = Field(
        default_factory=list, description="Mean time of the data set, s since the recording began; null: not known."
    )
    n: list[int | None] = Field(default_factory=list, description="Number of readings in the data set; null: unknown.")
    measured_error_dps: list[float] = Field(
        default_factory=list, description="Error of the output: output minus true rate along the axis, deg/s."
    )
    modelled_error_dps: list[float] = Field(
        default_factory=list, description="Error that the model states: output minus true rate along the axis, deg/s."
    )
    residual_dps: list[float] = Field(default_factory=list, description="Measured error minus modelled error, deg/s.")
    floor_dps: list[float | None] = Field(
        default_factory=list, description="Standard deviation of the data set's mean due to noise alone, deg/s."
    )
    over_floor: list[float | None] = Field(
        default_factory=list, description="Residual divided by the noise floor, as in the map."
    )


class ResidualsResponse(ResponseModel):
    """The residual of a version on a recording."""

    serial: Serial
    version: VersionNumber
    recording: RecordingNumber
    recordings: list[int] = Field(
        default_factory=list, description="All recordings that the model is compared with; `recording` is the newest."
    )
    columns: ResidualColumns = Field(description="Residual of each data set and axis.")


class PictureResponse(ResponseModel):
    """One picture."""

    id: str = Field(description="Identifier of the picture, for programs.")
    title: str = Field(description="Title of the picture.")
    how_to_read: str = Field(description="What the picture shows and how it is read, in words.")
    effects: list[str] = Field(description="Effects that would be visible in this picture.")
    figure: dict[str, JsonValue] = Field(description="A figure as Plotly describes it: data and layout.")


class PicturesResponse(ResponseModel):
    """All pictures, cached: drawing them takes a second."""

    pictures: list[PictureResponse] = Field(description="All pictures of a criticism.")
