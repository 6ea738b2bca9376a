"""Units: who they are and what is known of them."""

from __future__ import annotations

from labctl.services.schemas.base import ResponseModel


class UnitResponse(ResponseModel):
    """Who a unit is and what is known of it."""

    serial: str
    model: str
    technology: str | None
    recordings: list[int]
    calibrations: list[int]
    certified_version: int | None
