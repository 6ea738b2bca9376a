"""Units: which there are, and what is known of each."""

from __future__ import annotations

from fastapi import APIRouter

from labctl.api.dependencies import ServiceDep
from labctl.services.schemas.units import UnitResponse
from labctl.services.units import list_units, unit

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/units", summary="All units")
def units(service: ServiceDep) -> list[UnitResponse]:
    """Every unit that was measured or imported, by serial number."""
    return list_units(service.store)


@router.get("/units/{serial}", summary="One unit")
def one_unit(serial: str, service: ServiceDep) -> UnitResponse:
    """The unit, its recordings and calibrations, and which version is in force."""
    return unit(service.store, serial)
