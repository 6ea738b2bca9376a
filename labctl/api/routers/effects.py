"""The catalogue of physical effects."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from labctl.services.effects import catalogue

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/effects", summary="The catalogue of physical effects")
def effects() -> dict[str, Any]:
    """Every effect a model can be made of: its standard term, sentence, origin, channels, coefficients and ranges."""
    return catalogue()
