"""Units, benches and the catalogue: what there is."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from labctl.api.rooms import HouseOf
from labctl.services.answers import UnitAnswer
from labctl.services.catalogue import catalogue
from labctl.services.units import list_units, unit

router = APIRouter(prefix="/api", tags=["what there is"])


@router.get("/units", summary="All units")
def units(house: HouseOf) -> list[UnitAnswer]:
    """Every unit that was measured or imported, by serial number."""
    return list_units(house.store)


@router.get("/units/{serial}", summary="One unit")
def one_unit(serial: str, house: HouseOf) -> UnitAnswer:
    """Who the unit is, its recordings and calibrations, and which version is in force."""
    return unit(house.store, serial)


@router.get("/benches", summary="This service's bench")
def benches(house: HouseOf) -> list[dict[str, Any]]:
    """The bench that this service runs: its instruments, limits and what it is doing."""
    return house.benches()


@router.get("/effects", summary="The catalogue of physical effects")
def effects() -> dict[str, Any]:
    """Every effect a model can be made of: its standard term, sentence, origin, channels, coefficients and ranges."""
    return catalogue()
