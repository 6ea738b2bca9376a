"""Units: which there are, and what is known of each."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request

from labctl.answers.datasheet import DatasheetResponse
from labctl.answers.units import TrendResponse, UnitResponse
from labctl.api.computation import while_connected
from labctl.api.dependencies import ServiceDep
from labctl.services.calibrations.due import span
from labctl.services.criticism.trend import trend_unit
from labctl.services.datasheet.sheet import datasheet
from labctl.services.units import list_units, unit

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/units", summary="All units")
def units(
    service: ServiceDep,
    due_within: Annotated[
        str | None, Query(max_length=20, description="Only units that are due within this span: 30d, 12h, 2w.")
    ] = None,
) -> list[UnitResponse]:
    """Every unit that was measured or imported, by serial number.

    With `due_within` those whose certification ends within that span or has ended, the earliest date first.
    """
    return list_units(service.store, service.clock.utc(), None if due_within is None else span(due_within))


@router.get("/units/{serial}", summary="One unit")
def one_unit(serial: str, service: ServiceDep) -> UnitResponse:
    """The unit, its recordings and calibrations, and which version is in force."""
    return unit(service.store, serial, service.clock.utc())


@router.get("/units/{serial}/trend", summary="A unit's calibrations over the years", tags=["criticism"])
async def trend(
    request: Request,
    serial: str,
    service: ServiceDep,
    version: Annotated[
        int | None, Query(description="Version that is compared with all recordings of the unit; default: the first.")
    ] = None,
    limit_dps: Annotated[
        float | None,
        Query(
            gt=0,
            description="Largest acceptable bias after correction, deg/s; "
            "default: twice the error stated in the calibration.",
        ),
    ] = None,
) -> TrendResponse:
    """As found and as left by recording, drift per year with its uncertainty, and when the bias leaves the limit."""
    return await while_connected(request, service, trend_unit, serial, version, limit_dps)


@router.get("/units/{serial}/datasheet", summary="A unit's data sheet", tags=["criticism"])
async def unit_datasheet(request: Request, serial: str, service: ServiceDep) -> DatasheetResponse:
    """Characteristics in the terms of IEEE Std 528 and 952 with uncertainty, conditions and recording, beside the
    specified values; what is not measured names the recipe that measures it."""
    return await while_connected(request, service, datasheet, serial)
