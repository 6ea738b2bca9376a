"""A file of readings that was corrected."""

from __future__ import annotations

from pydantic import Field

from labctl.services.schemas.base import ResponseModel


class CompensationResponse(ResponseModel):
    """How many rows were corrected, how many of them lay outside the calibration, and where they are."""

    rows: int
    outside: int = Field(description="Rows outside the calibrated rates or temperatures.")
    file: str
