"""The catalogue of physical effects."""

from __future__ import annotations

from fastapi import APIRouter

from labctl.services.effects import catalogue
from labctl.services.schemas.calibrations import CatalogueResponse

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/effects", summary="The catalogue of physical effects")
def effects() -> CatalogueResponse:
    """Every effect that a model can contain: its standard term, description, origin, channels, coefficients and
    ranges."""
    return catalogue()
