"""Units: who they are and what is known of them."""

from __future__ import annotations

from pydantic import Field

from labctl.services.schemas.base import ResponseModel


class ExportFormatResponse(ResponseModel):
    """A format in which calibrations are available."""

    id: str = Field(description="The value of `format`.")
    title: str
    suffix: str = Field(description="Of a file name, without the dot.")


class UnitResponse(ResponseModel):
    """A unit, its recordings and its calibrations."""

    serial: str
    model: str
    technology: str | None
    recordings: list[int]
    calibrations: list[int]
    certified_version: int | None
    formats: list[ExportFormatResponse] = Field(description="Formats in which its calibrations are available.")
