"""Work on many units: jobs, what came of each unit, and the report on a type."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from labctl.answers.fleet import (
    FleetCancelRequest,
    FleetChartRequest,
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
    """What came of each unit, by serial number in natural order; of one that could not be computed, the reason."""
    return in_parts(request, response, unit_answers(service.store, job, PageRequest(search, limit, after), state))


@command_route(router, CANCEL_FLEET_JOB, "Cancel a fleet job")
def cancel(job: int, request: FleetCancelRequest, service: ServiceDep) -> FleetJobResponse:
    """End a job before it is done; what was written stays, and the same request goes on there."""
    return service.execute(CANCEL_FLEET_JOB, ToFleetJob(job, request))


@router.get("/fleet/types", summary="All types of units in figures")
def types(service: ServiceDep, wanted: Annotated[FleetUnits, Query()]) -> list[FleetTypeResponse]:
    """For each type: error over noise floor, verdicts, effects that units are missing, due dates; by name."""
    return type_figures(service.store, wanted, service.clock.utc())


@router.get("/fleet/chart", summary="Control chart of a coefficient")
def chart(service: ServiceDep, wanted: Annotated[FleetChartRequest, Query()]) -> FleetChartResponse:
    """A coefficient of the newest fits by fleet jobs over time: one point for each group and span of time."""
    return fleet_chart(service.store, wanted)


@router.get("/fleet/report", summary="Report on a type of units")
async def report(
    request: Request, service: ServiceDep, wanted: Annotated[FleetReportRequest, Query()]
) -> FleetReportResponse:
    """What the units of a type have in common, which batch, bench or unit differs, and what their model is missing."""
    return await while_connected(request, service, fleet_report, wanted, service.clock.utc())
