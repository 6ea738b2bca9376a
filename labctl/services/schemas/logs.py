"""Schemas of logs in formats of others: what one holds, the map of its columns, and what it would become."""

from __future__ import annotations

from pydantic import Field, JsonValue

from labctl.services.schemas.base import ResponseModel


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
    title: str = Field(description="What the format is called.")
    rows: int
    columns: list[LogColumn]
    first_rows: list[list[str]]
    column_map: dict[str, JsonValue] = Field(description="The map: keys and values of a MAP.toml.")
    map_toml: str = Field(description="The same as TOML.")
    guesses: list[str] = Field(description="What was taken from values, because no name says it.")
    problems: list[str] = Field(description="Everything that is wrong; empty: it can be imported.")
    unused: list[str] = Field(description="Columns of the file that nothing uses.")
    serial: str | None
    motion: str | None = Field(description="What moved the unit; null: not known while something is wrong.")
    datasets: int | None
    duration_s: float | None
    traces: list[LogTrace]
    targets: list[LogTarget]
