"""What is certainly or probably wrong with data or with a fit to them, and what an inspection of readings shows."""

from __future__ import annotations

from typing import Literal

from pydantic import Field
from typing_extensions import TypedDict

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import KIND, MOTION, POSITION, Serial
from labctl.answers.recording_head import LeftOut, Motion
from labctl.answers.views import PictureResponse

#: "certain": a fit of such data is wrong and is refused; "likely": it may be meant so, and is said.
Severity = Literal["certain", "likely"]

#: The part of a recording: what a fit takes in, or what was measured to verify a calibration.
Part = Literal["fitted", "verification"]


class CourseJson(TypedDict):
    """The course of one channel, in bins in the order of time; null ends a data set."""

    channel: str
    """Name of the channel."""
    unit: str
    """Unit of the channel."""
    t_s: list[float | None]
    """Time of the first reading of each bin, s; null: a data set ends there."""
    low: list[float | None]
    """Least reading of each bin, in `unit`; null: no number, or a data set ends there."""
    high: list[float | None]
    """Largest reading of each bin, in `unit`; null: no number, or a data set ends there."""
    readings: int
    """Number of readings that are finite numbers; all of them are in the bins."""
    bins: int
    """Number of bins."""


class MarkJson(TypedDict):
    """Where one kind of finding is in a channel."""

    what: str
    """Kind of the finding."""
    channel: str
    """Name of the channel; empty: every channel."""
    from_s: list[float]
    """Time of the last reading before each of the longest stretches, at most 60, s."""
    until_s: list[float]
    """Time of the first reading after each of these stretches, s."""
    places: int
    """Number of all stretches; 0 where `whole` is true."""
    whole: bool
    """Whether it concerns all of the channel."""


WARNINGS = "Certain and probable errors of the data or of the fit, the certain errors first; empty if there are none."


class DataWarning(ResponseModel):
    """One thing that is wrong: what, where, its value, what was expected, and what to do."""

    what: str = Field(
        description="Kind of error, as a fixed word for programs: sign, unit, scale, axes, one_data_set, "
        "time_unit, worse ..."
    )
    severity: Severity = Field(
        description="How sure labctl is that the data are wrong. `certain`: labctl refuses to fit; `likely`: labctl "
        "fits and shows the warning."
    )
    where: str = Field(description="The axis, position, data sets or column that the warning concerns.")
    said: str = Field(description="What is the case, in words, with value and unit.")
    value: float | None = Field(description="Value that was found, in `unit`; null: the warning has no number.")
    unit: str = Field(description="Unit of `value`; empty: none.")
    expected: str = Field(description="What was expected, in words.")
    do: str = Field(description="What to do.")
    text: str = Field(description="The whole warning as one sentence.")
    part: Part = Field(
        default="fitted",
        description="The part of the recording that the warning concerns. `fitted`: what a fit takes in; "
        "`verification`: data sets measured to verify a calibration, whose errors refuse no fit but a certification.",
    )
    channel: str = Field(
        default="", description="Of single readings: the column that the warning concerns; empty: whole rows."
    )
    n: int | None = Field(
        default=None, description="How many readings the warning concerns; null: it is not about single readings."
    )
    may_leave_out: bool = Field(
        default=False, description="Whether those readings can be left out (`labctl import --leave-out`)."
    )


class RecordingInspection(ResponseModel):
    """What an inspection of all readings of a recording found, as it is cached."""

    warnings: list[DataWarning] = Field(description=WARNINGS)
    dataset: list[int] = Field(
        description="Numbers of the data sets; the other lists have one entry for each of these."
    )
    rate_low_dps: list[float] = Field(description="Smallest rate of the table in each data set, deg/s.")
    rate_high_dps: list[float] = Field(description="Largest rate of the table in each data set, deg/s.")
    temperature_low_c: list[float | None] = Field(
        description="Lowest temperature in each data set, deg C; null: not measured."
    )
    temperature_high_c: list[float | None] = Field(
        description="Highest temperature in each data set, deg C; null: not measured."
    )
    position: list[str] = Field(description=POSITION)
    quantisation_dps: dict[str, list[float]] = Field(
        description="For each axis: standard uncertainty of each mean due to the resolution of the readings, deg/s."
    )


class ReadingsExamined(ResponseModel):
    """What an examination of single readings found, as it is cached."""

    warnings: list[DataWarning] = Field(description="What is wrong with single readings; empty: nothing.")
    courses: list[CourseJson] = Field(description="Each channel in bins: least and largest reading.")
    marks: list[MarkJson] = Field(description="Where each finding about single readings is.")


class InspectionResponse(ResponseModel):
    """What is wrong with a recording or a file before anything is fitted to it, and where."""

    source: str = Field(description="The file, or `recording N`.")
    recording: int | None = Field(description="Number of the recording; null: a file that is not imported.")
    serial: Serial
    kind: str = Field(description=KIND)
    motion: Motion = Field(description=MOTION)
    readings: int = Field(description="Readings that were examined, also those that are marked as bad.")
    warnings: list[DataWarning] = Field(description=WARNINGS)
    left_out: list[LeftOut] = Field(description="Readings that were left out by choice when it was imported.")
    courses: list[CourseJson] = Field(
        description="Each channel in bins: least and largest reading; all readings are in them."
    )
    marks: list[MarkJson] = Field(description="Where each finding about single readings is.")
    picture: PictureResponse | None = Field(description="The courses and marks, drawn; null: there are no readings.")
