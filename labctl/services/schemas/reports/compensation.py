"""Result of correcting a file of readings."""

from __future__ import annotations

from pydantic import Field

from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.common_fields import FileName


class CompensationResponse(ResponseModel):
    """How many rows were corrected, how many of them lay outside the calibration, and where they are."""

    rows: int = Field(description="Number of rows that were corrected.")
    outside: int = Field(description="Number of rows outside the calibrated rates or temperatures.")
    file: FileName
    warning: str = Field(
        default="", description="Warning that the calibration is overdue or was revoked; empty: neither."
    )
    left_out: str = Field(
        default="",
        description="Effects that were not corrected because the file has no columns of specific force, with their "
        "size in deg/s; empty: none.",
    )
