"""Recordings: imports, data sets, traces and Allan deviations."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field, JsonValue

from instruments.bench_config import SERIAL
from labctl.json_types.noise import AllanJson
from labctl.recording.info import LeftOut, Motion
from labctl.services.schemas.base import Request, ResponseModel
from labctl.services.schemas.plans import RecipeSource
from labctl.services.schemas.warnings import WARNINGS, DataWarning

#: Columns of equal length; null: not known.
Columns = dict[str, list[float | None] | list[int] | list[str] | list[bool]]


class SimulatedRequest(Request):
    """A recording to be made in simulation, with effects hidden in its unit."""

    recipe: RecipeSource
    hide: list[str] = Field(
        default_factory=list,
        max_length=20,
        description="Effects to hide in the unit: EFFECT, EFFECT=SIZE with SIZE in the unit of the catalogue's "
        "coefficient, or EFFECT=z10 for a signal of ten standard deviations of the noise.",
    )
    seed: int = Field(
        default=1, ge=0, lt=1 << 63, description="Seed of the random numbers; the same seed gives the same recording."
    )
    serial: str | None = Field(
        default=None,
        pattern=SERIAL,
        description="Serial number of the unit; default: the serial number in the simulated bench's file.",
    )
    clip: bool = Field(
        default=False, description="Leave out points that are beyond the limits of the bench or of the unit."
    )


class ExampleRequest(Request):
    """Which of the recordings that come with labctl to import."""

    name: str = Field(
        max_length=100,
        description="osu-fog: a real fibre-optic gyro; freeimu-warmup: a real MEMS gyro at rest; weiss-gyrostar: a "
        "published table of coefficients.",
    )


class ImportResponse(ResponseModel):
    """A recording that is now in the database."""

    serial: str
    recording: int
    datasets: int
    readings: int
    suggested_model: str = Field(default="bias_scale", description="Name of a model that suits this kind of recording.")
    measured_at: datetime | None = Field(
        default=None, description="Date of the measurement; null: the file states none, and it is not known."
    )
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)
    left_out: list[LeftOut] = Field(
        default_factory=list, description="Readings that were left out by choice, with how many and why."
    )


class SimulatedRecordingResponse(ImportResponse):
    """A simulated recording that is now in the database."""

    recipe: str
    bench: str
    seed: int
    hidden: dict[str, float] = Field(
        description="For each effect that is hidden in the unit: its size, in the unit of the catalogue's coefficient."
    )


class RecordingResponse(ResponseModel):
    """One line of the list of recordings."""

    id: int
    serial: str
    kind: str = Field(
        description="Kind of data: samples (every reading), points (one mean per data set) or "
        "coefficients (a published table)."
    )
    campaign: int | None = Field(description="The campaign that made the recording; null: the recording was imported.")
    datasets: int
    readings: int
    created_at: datetime
    notes: str = ""
    motion: Motion = Field(
        default="rates",
        description="How the unit was moved: at constant table rates, at rest, "
        "turned by known angles, along a rate profile, or by hand between poses.",
    )
    simulated_time: bool = Field(
        default=False, description="Whether `created_at` is by the clock of a simulated bench."
    )


class RecordingFacts(ResponseModel):
    """What a recording is."""

    id: int
    serial: str
    campaign: int | None
    kind: str = Field(
        description="Kind of data: samples (every reading), points (one mean per data set) or "
        "coefficients (a published table)."
    )
    info: dict[str, JsonValue] = Field(
        description="Content of the file `recording.toml`: unit, axes, bench, data sheet, notes."
    )
    created_at: str
    simulated_time: bool
    datasets: int
    readings: int


class RecordingAlone(RecordingFacts):
    """What a recording is, without the means of its data sets."""


class RecordingWithPoints(RecordingFacts):
    """What a recording is, with the means of its data sets."""

    points: Columns = Field(
        description="For each column: one value per data set; a long data set is divided into "
        "pieces with one value each."
    )


class SamplesResponse(ResponseModel):
    """The readings of one data set."""

    recording: int
    dataset: int
    readings: int
    columns: Columns = Field(
        description="For each column: one value per reading, up to the number of readings that was requested."
    )


class ExportedRecording(ResponseModel):
    """A recording that was written to a folder."""

    recording: int
    folder: str
    files: list[str]


class ChannelColumns(ResponseModel):
    """A channel's figures by data set, in the channel's unit; null: none."""

    mean: list[float | None]
    std: list[float | None]


class DataSetsResponse(ResponseModel):
    """The data sets of a recording, as lists of equal length."""

    recording: int
    number: list[int]
    state: list[str]
    reason: list[str] = Field(description="Why the data set is not complete; empty if it is complete.")
    position: list[str]
    run: list[int]
    mounting: list[int]
    table_rate_dps: list[float]
    t_from_s: list[float | None]
    t_until_s: list[float | None]
    n: list[int]
    lost: list[int]
    damaged: list[int]
    verification: list[bool] = Field(description="Whether it was measured to verify a calibration: never fitted.")
    chamber_setpoint_c: list[float | None]
    channels: dict[str, ChannelColumns]


class TraceResponse(ResponseModel):
    """One channel over a window of time, in bins that hold readings, as lists of equal length."""

    recording: int
    channel: str
    unit: str
    from_s: float | None
    until_s: float | None
    raw: bool = Field(
        description="true: the bins were computed from all readings; false: from the stored minimum, "
        "maximum and mean of sections of each data set."
    )
    t_s: list[float] = Field(description="Mean time of the readings in each bin, s.")
    min: list[float]
    max: list[float]
    mean: list[float]
    n: list[int]
    channels: list[str] = Field(description="All channels of the recording that have a trace.")


class AllanResponse(ResponseModel):
    """An overlapping Allan deviation, axis by axis, and the figures of IEEE Std 952 that it shows."""

    recording: int | None = Field(
        description="Number of the recording; null: the readings came from a file that is not in the database."
    )
    datasets: list[int] = Field(description="First and last data set of the section at rest.")
    temperature_c: float | None
    duration_s: float | None
    axes: dict[str, AllanJson] = Field(
        description="For each axis: averaging times tau_s, deviation_dps with its 95 % interval low_dps to high_dps, "
        "model_dps, and the terms N, B and K."
    )
    datasheet: dict[str, float] = Field(
        default_factory=dict, description="Figures of the unit's data sheet; empty if it is not known."
    )


class LogColumn(ResponseModel):
    """One column of a log."""

    name: str
    unit: str = Field(description="Unit that the file gives for the column; empty: none.")
    is_text: bool
    target: str = Field(description="Column of the recording that this column becomes; empty: the column is not used.")


class LogTarget(ResponseModel):
    """A column that a recording may have."""

    name: str
    meaning: str
    unit: str = Field(description="Unit of the column in the recording; empty: none.")
    units: list[str] = Field(description="Units that a log may use for this quantity.")


class LogTrace(ResponseModel):
    """Least and largest value of a column in bins of equal count, in the file's own unit."""

    name: str
    x: list[float] = Field(
        description="Middle of each bin: time in s, or the number of the row if the time is not known."
    )
    low: list[float | None]
    high: list[float | None]


class LogPreview(ResponseModel):
    """A log, its column map, and the recording that it would become; nothing was imported."""

    file: str
    importer: str
    title: str = Field(description="Title of the format.")
    rows: int
    columns: list[LogColumn]
    first_rows: list[list[str]]
    column_map: dict[str, JsonValue] = Field(description="The column map: keys and values of a MAP.toml.")
    map_toml: str = Field(description="The column map as TOML text.")
    guesses: list[str] = Field(
        description="Assumptions inferred from the data, such as units that no column name states."
    )
    problems: list[str] = Field(description="Everything that prevents the import; empty: the file can be imported.")
    warnings: list[DataWarning] = Field(
        description="What is wrong with single rows and readings; those with `may_leave_out` can be left out by the "
        "field `leave_out` of the import, by their kind `what`."
    )
    unused: list[str] = Field(description="Columns of the file that are not used.")
    serial: str | None
    motion: str | None = Field(
        description="How the unit was moved, as `motion` in recording.toml; null: not known because of `problems`."
    )
    datasets: int | None
    duration_s: float | None
    traces: list[LogTrace]
    targets: list[LogTarget]
