"""Is the service well, and its figures for a monitor."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter
from fastapi.responses import PlainTextResponse

from labctl.api.rooms import HouseOf

router = APIRouter(tags=["service"])


@router.get("/health", summary="Is the service well?")
def health(house: HouseOf) -> dict[str, Any]:
    """Whether the database answers, which versions run, and what the bench is doing."""
    return house.health()


@router.get("/metrics", summary="Figures for a monitor", response_class=PlainTextResponse)
def metrics(house: HouseOf) -> str:
    """Counts in the text format that Prometheus reads."""
    return "".join(f"# TYPE {name} gauge\n{name} {value}\n" for name, value in house.metrics().items())
