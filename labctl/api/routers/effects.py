"""The catalogue of physical effects."""

from __future__ import annotations

from fastapi import APIRouter

from labctl.services.effects import catalogue
from labctl.services.schemas.calibrations import CatalogueResponse

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/effects", summary="The catalogue of physical effects")
def effects() -> CatalogueResponse:
    """Every effect a model can be made of: its standard term, sentence, origin, channels, coefficients and ranges."""
    return catalogue()
