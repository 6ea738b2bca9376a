"""The catalogue of physical effects."""

from __future__ import annotations

from fastapi import APIRouter

from labctl.answers.calibrations import CatalogueResponse
from labctl.services.effects import catalogue

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/effects", summary="The catalogue of physical effects")
def effects() -> CatalogueResponse:
    """Every effect that a model can contain: its standard term, description, origin, channels, coefficients and
    ranges."""
    return catalogue()
