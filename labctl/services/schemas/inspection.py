"""The inspection of a recording: what is wrong with it, and a picture of its channels."""

from __future__ import annotations

from pydantic import Field

from labctl.json_types.inspection import CourseJson, MarkJson
from labctl.recording.info import LeftOut, Motion
from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.common_fields import KIND, MOTION, Serial
from labctl.services.schemas.criticism import PictureResponse
from labctl.services.schemas.warnings import WARNINGS, DataWarning


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
