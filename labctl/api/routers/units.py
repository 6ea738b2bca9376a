"""Units: which there are, and what is known of each."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from labctl.answers.common_fields import CriticismVerdict
from labctl.answers.datasheet import DatasheetResponse
from labctl.answers.units import (
    BatchRequest,
    BatchResponse,
    CalibrationEventResponse,
    TrendResponse,
    UnitResponse,
    UnitState,
)
from labctl.api.computation import while_connected
from labctl.api.dependencies import ServiceDep, command_route
from labctl.api.paging import AfterSerial, Limit, Search, in_parts
from labctl.services.calibrations.due import span
from labctl.services.commands.registry import SET_BATCH
from labctl.services.criticism.trend import trend_unit
from labctl.services.datasheet.sheet import datasheet
from labctl.services.units import batches, calibration_events, list_units, unit
from labctl.store.paging import PageRequest

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/units", summary="All units")
def units(
    request: Request,
    response: Response,
    service: ServiceDep,
    due_within: Annotated[
        str | None, Query(max_length=20, description="Only units that are due within this span: 30d, 12h, 2w.")
    ] = None,
    calibration: Annotated[
        UnitState | None,
        Query(description="Only units with a version in force, with one that is overdue, or with none in force."),
    ] = None,
    verdict: Annotated[
        CriticismVerdict | None, Query(description="Only units whose version in force was certified with this verdict.")
    ] = None,
    batch: Annotated[str, Query(max_length=100, description="Only units of this batch.")] = "",
    search: Search = "",
    limit: Limit = None,
    after: AfterSerial = None,
) -> list[UnitResponse]:
    """Every unit that was measured or imported, by serial number in natural order (A-2 before A-10); `search` in serial
    number, model, technology, batch and supplier.

    With `due_within`, which takes none of `calibration`, `verdict` and `batch`, those whose certification ends within
    that span or has ended, the earliest date first.
    `X-Total-Count` is how many match; `Link` with rel="next" names the next part of a list that `limit` has cut.
    """
    now, wanted = service.clock.utc(), PageRequest(search, limit, after)
    within = None if due_within is None else span(due_within)
    return in_parts(request, response, list_units(service.store, now, wanted, within, calibration, verdict, batch))


@router.get("/calibration-events", summary="Newest calibrations and certifications")
def newest_calibration_events(
    service: ServiceDep, limit: Annotated[int, Query(ge=1, le=1000, description="Largest number of events.")] = 50
) -> list[CalibrationEventResponse]:
    """Versions of all units that were made, certified or revoked, the newest event first."""
    return calibration_events(service.store, limit)


@router.get("/batches", summary="All batches")
def all_batches(service: ServiceDep) -> list[BatchResponse]:
    """Every batch that a unit is of, by name."""
    return batches(service.store)


@command_route(router, SET_BATCH, "State the batch of units")
def state_batch(request: BatchRequest, service: ServiceDep) -> BatchResponse:
    """State the batch of some units, and their supplier: of all that are named, or of none where one is absent."""
    return service.execute(SET_BATCH, request)


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


@router.get("/units/{serial}/datasheet", summary="A unit's performance sheet", tags=["criticism"])
async def unit_datasheet(request: Request, serial: str, service: ServiceDep) -> DatasheetResponse:
    """Characteristics in the terms of IEEE Std 528 and 952 with uncertainty, conditions and recording, beside the
    specified values; what is not measured names the recipe that measures it."""
    return await while_connected(request, service, datasheet, serial)
