"""Work on many units: jobs, what came of each unit, and the report on a type."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from labctl.answers.fleet import (
    FleetCancelRequest,
    FleetChartResponse,
    FleetJobRequest,
    FleetJobResponse,
    FleetReportRequest,
    FleetReportResponse,
    FleetTypeResponse,
    FleetUnitResponse,
    FleetUnits,
    FleetUnitState,
)
from labctl.api.computation import while_connected
from labctl.api.dependencies import ServiceDep, command_route
from labctl.api.paging import AfterNumber, AfterSerial, Limit, Search, in_parts
from labctl.services.commands.fleet import CANCEL_FLEET_JOB, START_FLEET_JOB, ToFleetJob
from labctl.services.fleet.figures import fleet_chart, type_figures
from labctl.services.fleet.jobs import job_answer, job_answers, unit_answers
from labctl.services.fleet.report import fleet_report
from labctl.store.paging import PageRequest

router = APIRouter(prefix="/api", tags=["fleet"])


@command_route(router, START_FLEET_JOB, "Fit or criticise many units")
def start(request: FleetJobRequest, service: ServiceDep) -> FleetJobResponse:
    """Begin a job with one task for each unit; answered at once, and carried out by the service.

    Each result is written once; a fit becomes the next version of its unit and is not put in force. Units whose newest
    result has the same recordings, model and program are skipped.
    """
    return service.execute(START_FLEET_JOB, request)


@router.get("/fleet/jobs", summary="All fleet jobs")
def all_jobs(
    request: Request, response: Response, service: ServiceDep, limit: Limit = None, after: AfterNumber = None
) -> list[FleetJobResponse]:
    """Every job, the newest first."""
    page = job_answers(service.store, PageRequest(limit=limit, after=after), service.clock.utc())
    return in_parts(request, response, page)


@router.get("/fleet/jobs/{job}", summary="One fleet job")
def job(job: int, service: ServiceDep) -> FleetJobResponse:
    """How far it is, what it has cost, and how long it will still take."""
    return job_answer(service.store, job, service.clock.utc())


@router.get("/fleet/jobs/{job}/units", summary="Units of a fleet job")
def units(
    request: Request,
    response: Response,
    job: int,
    service: ServiceDep,
    state: Annotated[FleetUnitState | None, Query(description="Only units in this state; default: all.")] = None,
    search: Search = "",
    limit: Limit = None,
    after: AfterSerial = None,
) -> list[FleetUnitResponse]:
    """What came of each unit, by serial number; of one that could not be computed, the reason."""
    return in_parts(request, response, unit_answers(service.store, job, PageRequest(search, limit, after), state))


@command_route(router, CANCEL_FLEET_JOB, "Cancel a fleet job")
def cancel(job: int, request: FleetCancelRequest, service: ServiceDep) -> FleetJobResponse:
    """End a job before it is done; what was written stays, and the same request goes on there."""
    return service.execute(CANCEL_FLEET_JOB, ToFleetJob(job, request))


Type = Annotated[str, Query(alias="type", max_length=200, description="Only units of this type; empty: of any.")]
Batch = Annotated[str, Query(max_length=100, description="Only units of this batch; empty: of any.")]
Supplier = Annotated[str, Query(max_length=200, description="Only units of this supplier; empty: of any.")]


@router.get("/fleet/types", summary="All types of units in figures")
def types(
    service: ServiceDep, type_: Type = "", batch: Batch = "", supplier: Supplier = "", search: Search = ""
) -> list[FleetTypeResponse]:
    """For each type: error over noise floor, verdicts, effects that units are missing, due dates; by name."""
    wanted = FleetUnits(type=type_, batch=batch, supplier=supplier, search=search)
    return type_figures(service.store, wanted, service.clock.utc())


@router.get("/fleet/chart", summary="Control chart of a coefficient")
def chart(
    service: ServiceDep,
    type_: Type = "",
    axis: Annotated[str, Query(max_length=10, description="Output axis; empty: the first.")] = "",
    name: Annotated[str, Query(max_length=100, description="Name of the coefficient; empty: the first.")] = "",
    factor: Annotated[str, Query(max_length=10, description="What points are grouped by.")] = "batch",
    batch: Batch = "",
    supplier: Supplier = "",
    search: Search = "",
) -> FleetChartResponse:
    """A coefficient of the newest fits by fleet jobs over time: one point for each group and span of time."""
    wanted = FleetUnits(type=type_, batch=batch, supplier=supplier, search=search)
    return fleet_chart(service.store, wanted, axis, name, factor)


@router.get("/fleet/report", summary="Report on a type of units")
async def report(
    request: Request,
    service: ServiceDep,
    type_: Type = "",
    model: Annotated[
        str, Query(max_length=200, description="Only units whose newest version is of this error model; empty: any.")
    ] = "",
    batch: Batch = "",
    supplier: Supplier = "",
    search: Search = "",
) -> FleetReportResponse:
    """What the units of a type have in common, which batch, bench or unit differs, and what their model is missing."""
    asked = FleetReportRequest(type=type_, model=model, batch=batch, supplier=supplier, search=search)
    return await while_connected(request, service, fleet_report, asked, service.clock.utc())
