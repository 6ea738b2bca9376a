"""Recordings: imports, data sets, traces and Allan deviations."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field, JsonValue

from instruments.bench_config import SERIAL
from labctl.json_types.noise import AllanJson
from labctl.recording.info import Motion
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
        description="EFFECT, or EFFECT=SIZE in the catalogue's coefficient unit, or EFFECT=z10: ten noise units.",
    )
    seed: int = Field(default=1, ge=0, lt=1 << 63, description="Same seed, same recording.")
    serial: str | None = Field(default=None, pattern=SERIAL, description="Of the unit; default: the simulated bench's.")
    clip: bool = Field(default=False, description="Leave out points that the bench or the unit cannot do.")


class ExampleRequest(Request):
    """Which of the recordings that come with labctl to import."""

    name: str = Field(
        max_length=100,
        description="osu-fog: a real fibre-optic gyro; freeimu-warmup: a MEMS gyro at rest; weiss-gyrostar: a table.",
    )


class ImportResponse(ResponseModel):
    """A recording that is now in the database."""

    serial: str
    recording: int
    datasets: int
    readings: int
    suggested_model: str = Field(default="bias_scale", description="A published model for such a recording.")
    warnings: list[DataWarning] = Field(default_factory=list, description=WARNINGS)


class SimulatedRecordingResponse(ImportResponse):
    """A simulated recording that is now in the database."""

    recipe: str
    bench: str
    seed: int
    hidden: dict[str, float] = Field(description="Effect -> size that is hidden in the unit.")


class RecordingResponse(ResponseModel):
    """One line of the list of recordings."""

    id: int
    serial: str
    kind: str = Field(description="samples, points or coefficients.")
    campaign: int | None = Field(description="The campaign that made it; null: it was imported.")
    datasets: int
    readings: int
    created_at: datetime
    notes: str = ""
    motion: Motion = Field(default="rates", description="What moved the unit: a table, nothing, turns, poses.")
    simulated_time: bool = Field(default=False, description="`created_at` is of a simulated bench's clock.")


class RecordingFacts(ResponseModel):
    """What a recording is."""

    id: int
    serial: str
    campaign: int | None
    kind: str = Field(description="samples, points or coefficients.")
    info: dict[str, JsonValue] = Field(description="Its `recording.toml`: unit, axes, bench, data sheet, notes.")
    created_at: str
    simulated_time: bool
    datasets: int
    readings: int


class RecordingAlone(RecordingFacts):
    """What a recording is, without the means of its data sets."""


class RecordingWithPoints(RecordingFacts):
    """What a recording is, with the means of its data sets."""

    points: Columns = Field(description="Column -> one value per data set, or piece of a long one.")


class SamplesResponse(ResponseModel):
    """The readings of one data set."""

    recording: int
    dataset: int
    readings: int
    columns: Columns = Field(description="Column -> one value per reading, as many as were asked for.")


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
    reason: list[str] = Field(description="Why it is not complete; empty where it is.")
    position: list[str]
    run: list[int]
    mounting: list[int]
    table_rate_dps: list[float]
    t_from_s: list[float | None]
    t_until_s: list[float | None]
    n: list[int]
    lost: list[int]
    damaged: list[int]
    chamber_setpoint_c: list[float | None]
    channels: dict[str, ChannelColumns]


class TraceResponse(ResponseModel):
    """One channel over a window of time, in bins that hold readings, as lists of equal length."""

    recording: int
    channel: str
    unit: str
    from_s: float | None
    until_s: float | None
    raw: bool = Field(description="Binned from the readings themselves; else from envelopes of each data set.")
    t_s: list[float] = Field(description="Mean time of the bin's readings.")
    min: list[float]
    max: list[float]
    mean: list[float]
    n: list[int]
    channels: list[str] = Field(description="What can be asked for.")


class AllanResponse(ResponseModel):
    """An overlapping Allan deviation, axis by axis, and the figures of IEEE Std 952 that it shows."""

    recording: int | None = Field(description="null: of a file that is not in the database.")
    datasets: list[int] = Field(description="First and last data set of the section at rest.")
    temperature_c: float | None
    duration_s: float | None
    axes: dict[str, AllanJson] = Field(
        description="tau_s, deviation_dps with its 95 % interval low_dps and high_dps, model_dps, and N, B, K."
    )
    datasheet: dict[str, float] = Field(default_factory=dict, description="Figures of the data sheet, if it is known.")


class LogColumn(ResponseModel):
    """One column of a log."""

    name: str
    unit: str = Field(description="That the format of the file states; empty: none.")
    is_text: bool
    target: str = Field(description="Column of the recording that it becomes; empty: it is not used.")


class LogTarget(ResponseModel):
    """A column that a recording may have."""

    name: str
    meaning: str
    unit: str = Field(description="Of the recording's column; empty: none.")
    units: list[str] = Field(description="Units that a log may have it in.")


class LogTrace(ResponseModel):
    """Least and largest value of a column in bins of equal count, in the file's own unit."""

    name: str
    x: list[float] = Field(description="Middle of each bin: time in s, or the row where time is not known.")
    low: list[float | None]
    high: list[float | None]


class LogPreview(ResponseModel):
    """A log, its column map, and the recording that it would become; nothing of it was kept."""

    file: str
    importer: str
    title: str = Field(description="Title of the format.")
    rows: int
    columns: list[LogColumn]
    first_rows: list[list[str]]
    column_map: dict[str, JsonValue] = Field(description="The map: keys and values of a MAP.toml.")
    map_toml: str = Field(description="The same as TOML.")
    guesses: list[str] = Field(
        description="Assumptions inferred from the data, such as units that no column name states."
    )
    problems: list[str] = Field(description="Everything that is wrong; empty: it can be imported.")
    unused: list[str] = Field(description="Columns of the file that nothing uses.")
    serial: str | None
    motion: str | None = Field(description="What moved the unit; null: not known while something is wrong.")
    datasets: int | None
    duration_s: float | None
    traces: list[LogTrace]
    targets: list[LogTarget]
