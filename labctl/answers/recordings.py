"""Recordings: imports, data sets, traces and Allan deviations."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field, JsonValue

from instruments.bench_config import SERIAL
from labctl.answers.base import Request, ResponseModel
from labctl.answers.common_fields import (
    KIND,
    MOTION,
    POSITION,
    BenchName,
    DatasetCount,
    ReadingCount,
    RecipeName,
    RecordingNumber,
    Serial,
    TableRates,
)
from labctl.answers.inspection import WARNINGS, DataWarning
from labctl.answers.noise import AllanJson
from labctl.answers.plans import RecipeSource
from labctl.answers.recording_head import LeftOut, Motion

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

    serial: Serial
    recording: RecordingNumber
    datasets: int = Field(description="Number of data sets; 0: a table of coefficients.")
    readings: int = Field(description="Number of readings; of means or coefficients, the number of rows.")
    suggested_model: str = Field(default="bias_scale", description="Name of a model that suits this kind of recording.")
    measured_at: datetime | None = Field(
        default=None, description="Date of the measurement; null: the file states none, and it is not known."
    )
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)
    left_out: list[LeftOut] = Field(
        default_factory=list, description="Readings that were left out by choice, with how many and why."
    )
    new_unit: bool = Field(default=False, description="Whether this is the first recording of its unit.")
    similar_unit: str | None = Field(
        default=None,
        description="Of a new unit: serial number of the known unit that differs from it by least, as if mistyped; "
        "null: none is nearly the same.",
    )


class SimulatedRecordingResponse(ImportResponse):
    """A simulated recording that is now in the database."""

    recipe: RecipeName
    bench: BenchName
    seed: int = Field(description="Seed of the random numbers; the same seed gives the same recording.")
    hidden: dict[str, float] = Field(
        description="For each effect that is hidden in the unit: its size, in the unit of the catalogue's coefficient."
    )


#: What made a recording of the database.
RecordingOrigin = Literal["campaign", "simulation", "import"]
ORIGIN = "What made the recording: a campaign, a simulation (`labctl simulate`, *Simulate*), or an import of files."


class RecordingResponse(ResponseModel):
    """One line of the list of recordings."""

    id: RecordingNumber
    serial: Serial
    kind: str = Field(description=KIND)
    campaign: int | None = Field(description="The campaign that made the recording; null: no campaign, see `origin`.")
    origin: RecordingOrigin = Field(description=ORIGIN)
    datasets: DatasetCount
    readings: ReadingCount
    created_at: datetime = Field(description="Time at which the recording was stored.")
    notes: str = Field(default="", description="Notes of recording.toml; empty: none.")
    motion: Motion = Field(default="rates", description=MOTION)
    simulated_time: bool = Field(
        default=False, description="Whether `created_at` is by the clock of a simulated bench."
    )
    unfinished: bool = Field(
        default=False, description="Whether its campaign has not ended, so that more data sets may be measured."
    )
    experiment: bool = Field(
        default=False,
        description="Whether its campaign was an experiment of a diagnosis: a few points, which rarely determine a "
        "model alone.",
    )


class RecordingFacts(ResponseModel):
    """What a recording is."""

    id: RecordingNumber
    serial: Serial
    campaign: int | None = Field(description="Campaign that made the recording; null: no campaign, see `origin`.")
    origin: RecordingOrigin = Field(description=ORIGIN)
    kind: str = Field(description=KIND)
    info: dict[str, JsonValue] = Field(
        description="Content of the file `recording.toml`: unit, axes, bench, data sheet, notes."
    )
    created_at: str = Field(description="Time at which the recording was stored, ISO 8601.")
    simulated_time: bool = Field(description="Whether `created_at` is by the clock of a simulated bench.")
    datasets: DatasetCount
    readings: ReadingCount


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

    recording: RecordingNumber
    dataset: int = Field(description="Number of the data set in the recording.")
    readings: int = Field(description="Number of readings of the data set, also of those that were not requested.")
    columns: Columns = Field(
        description="For each column: one value per reading, up to the number of readings that was requested."
    )


class ExportedRecording(ResponseModel):
    """A recording that was written to a folder."""

    recording: RecordingNumber
    folder: str = Field(description="Path of the folder.")
    files: list[str] = Field(description="Names of the files that were written.")


class ChannelColumns(ResponseModel):
    """A channel's figures by data set."""

    mean: list[float | None] = Field(description="Mean of each data set, in the unit of the channel; null: none.")
    std: list[float | None] = Field(
        description="Standard deviation of single readings in each data set, in the unit of the channel; null: none."
    )


class DataSetsResponse(ResponseModel):
    """The data sets of a recording, as lists of equal length."""

    recording: RecordingNumber
    number: list[int] = Field(description="Number of the data set in the recording.")
    state: list[str] = Field(
        description="State of the data set: open (being measured), complete or partial; only complete ones are fitted."
    )
    reason: list[str] = Field(description="Why the data set is not complete; empty if it is complete.")
    position: list[str] = Field(description=POSITION)
    run: list[int] = Field(description="Number of the run, a powered session of the unit.")
    mounting: list[int] = Field(description="Number of the mounting, one way in which the unit is fixed to the table.")
    table_rate_dps: TableRates
    t_from_s: list[float | None] = Field(
        description="Time of the first reading, s since the recording began; null: not known."
    )
    t_until_s: list[float | None] = Field(
        description="Time of the last reading, s since the recording began; null: not known."
    )
    n: list[int] = Field(description="Number of readings.")
    lost: list[int] = Field(
        description="Number of readings that are missing by the instrument's counter or by the clock."
    )
    damaged: list[int] = Field(description="Number of lines or frames that could not be read.")
    verification: list[bool] = Field(description="Whether it was measured to verify a calibration: never fitted.")
    chamber_setpoint_c: list[float | None] = Field(
        description="Set point of the chamber, deg C; null: none, or not known."
    )
    channels: dict[str, ChannelColumns] = Field(
        description="For each channel: mean and standard deviation by data set."
    )


class TraceResponse(ResponseModel):
    """One channel over a window of time, in bins that hold readings, as lists of equal length."""

    recording: RecordingNumber
    channel: str = Field(description="Name of the channel.")
    unit: str = Field(description="Unit of the channel; empty: none, or not known.")
    from_s: float | None = Field(
        description="Start of the window, s since the recording began; null: the recording has no times."
    )
    until_s: float | None = Field(
        description="End of the window, s since the recording began; null: the recording has no times."
    )
    raw: bool = Field(
        description="true: the bins were computed from all readings; false: from the stored minimum, "
        "maximum and mean of sections of each data set."
    )
    t_s: list[float] = Field(description="Mean time of the readings in each bin, s.")
    min: list[float] = Field(description="Smallest reading in each bin, in `unit`.")
    max: list[float] = Field(description="Largest reading in each bin, in `unit`.")
    mean: list[float] = Field(description="Mean of the readings in each bin, in `unit`.")
    n: list[int] = Field(description="Number of readings in each bin.")
    channels: list[str] = Field(description="All channels of the recording that have a trace.")


class AllanResponse(ResponseModel):
    """An overlapping Allan deviation, axis by axis, and the figures of IEEE Std 952 that it shows."""

    recording: int | None = Field(
        description="Number of the recording; null: the readings came from a file that is not in the database."
    )
    datasets: list[int] = Field(description="First and last data set of the section at rest.")
    temperature_c: float | None = Field(
        description="Mean temperature of the section at rest, deg C; null: there was no thermometer."
    )
    duration_s: float | None = Field(description="Duration of the section at rest, s; null: not known.")
    axes: dict[str, AllanJson] = Field(
        description="For each axis: averaging times tau_s, deviation_dps with its 95 % interval low_dps to high_dps, "
        "model_dps, and the terms N, B and K."
    )
    datasheet: dict[str, float] = Field(
        default_factory=dict, description="Figures of the unit's data sheet; empty if it is not known."
    )


class LogColumn(ResponseModel):
    """One column of a log."""

    name: str = Field(description="Name of the column in the file.")
    unit: str = Field(description="Unit that the file gives for the column; empty: none.")
    is_text: bool = Field(description="Whether the column holds text, not numbers.")
    target: str = Field(description="Column of the recording that this column becomes; empty: the column is not used.")


class LogTarget(ResponseModel):
    """A column that a recording may have."""

    name: str = Field(description="Name of the column in the recording.")
    meaning: str = Field(description="What the column holds, in words.")
    unit: str = Field(description="Unit of the column in the recording; empty: none.")
    units: list[str] = Field(description="Units that a log may use for this quantity.")
    aliases: dict[str, str] = Field(
        default_factory=dict, description="Other names of these units, in small letters, with the name in `units`."
    )


class LogTrace(ResponseModel):
    """Least and largest value of a column in bins of equal count, in the file's own unit."""

    name: str = Field(description="Name of the column in the file.")
    x: list[float] = Field(
        description="Middle of each bin: time in s, or the number of the row if the time is not known."
    )
    low: list[float | None] = Field(
        description="Smallest value in each bin, in the file's own unit; null: the bin has no number."
    )
    high: list[float | None] = Field(
        description="Largest value in each bin, in the file's own unit; null: the bin has no number."
    )


class LogPreview(ResponseModel):
    """A log, its column map, and the recording that it would become; nothing was imported."""

    file: str = Field(description="Name of the file.")
    importer: str = Field(description="Name of the importer that reads this format.")
    title: str = Field(description="Title of the format.")
    rows: int = Field(description="Number of rows of the file.")
    columns: list[LogColumn] = Field(description="Each column of the file.")
    first_rows: list[list[str]] = Field(
        description="First rows of the file as text, at most 8; one value for each column."
    )
    column_map: dict[str, JsonValue] = Field(description="The column map: keys and values of a MAP.toml.")
    map_toml: str = Field(description="The column map as TOML text.")
    guesses: list[str] = Field(
        description="Assumptions inferred from the data, such as units that no column name states."
    )
    problems: list[str] = Field(description="Everything that prevents the import; empty: the file can be imported.")
    warnings: list[DataWarning] = Field(
        description="What is wrong with the recording that the file becomes: rows, readings, and the gain against the "
        "table; those with `may_leave_out` can be left out by the "
        "field `leave_out` of the import, by their kind `what`."
    )
    unused: list[str] = Field(description="Columns of the file that are not used.")
    serial: str | None = Field(description="Serial number of the unit; null: not known because of `problems`.")
    motion: str | None = Field(
        description="How the unit was moved, as `motion` in recording.toml; null: not known because of `problems`."
    )
    datasets: int | None = Field(
        description="Number of data sets of the recording; null: not known because of `problems`."
    )
    duration_s: float | None = Field(
        description="Time from the first to the last reading, s; null: not known because of `problems`, or the "
        "file has no times."
    )
    traces: list[LogTrace] = Field(description="Course of the columns of numbers, in bins.")
    targets: list[LogTarget] = Field(description="Columns that a recording may have, for the column map.")
