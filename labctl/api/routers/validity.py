"""Validity of results: check gyros, comparisons of laboratories, and the environment of the room."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import AwareDatetime

from labctl.answers.validity import (
    CheckGyroRequest,
    CheckGyroResponse,
    LaboratoryComparison,
    RoomEnvironmentRequest,
    RoomEnvironmentResponse,
)
from labctl.api.computation import while_connected
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.check_gyros import check_gyro, list_check_gyros
from labctl.services.commands.requests import ToUnit
from labctl.services.commands.standards import ADD_ENVIRONMENT, SET_CHECK_GYRO
from labctl.services.interlaboratory import compare, pair_of
from labctl.services.room_environment import environment

router = APIRouter(prefix="/api", tags=["standards"])
DAY = timedelta(days=1)
Temperature = Annotated[float | None, Query(description="Temperature, deg C; default: the one of the unit.")]


@router.get("/check-gyros", summary="Check gyros")
async def check_gyros(request: Request, service: ServiceDep) -> list[CheckGyroResponse]:
    """Every unit that is measured in each campaign to check the bench, with its control charts and alarms."""
    return await while_connected(request, service, list_check_gyros)


@router.get("/check-gyros/{serial}", summary="Control charts of a unit")
async def one_check_gyro(
    request: Request, serial: str, service: ServiceDep, temperature_c: Temperature = None
) -> CheckGyroResponse:
    """Bias at one temperature and scale factor of each campaign, with limits from the history."""
    return await while_connected(request, service, check_gyro, serial, temperature_c)


@command_route(router, SET_CHECK_GYRO, "Make a unit a check gyro, or end that")
def set_check_gyro(serial: str, request: CheckGyroRequest, service: ServiceDep) -> CheckGyroResponse:
    """Its charts are then listed, and a monitor counts its alarms."""
    return service.execute(SET_CHECK_GYRO, ToUnit(serial, request))


@router.get("/comparisons", summary="Compare two laboratories or benches")
async def comparison(
    request: Request,
    service: ServiceDep,
    first: Annotated[str, Query(description="SERIAL:VERSION")],
    second: Annotated[str, Query(description="SERIAL:VERSION of the same unit.")],
    temperature_c: Annotated[float | None, Query(description="deg C; default: the middle of what both cover.")] = None,
) -> LaboratoryComparison:
    """En number and zeta score (ISO 13528) of each coefficient of two calibrations of one unit."""
    return await while_connected(request, service, compare, pair_of(first), pair_of(second), temperature_c)


@command_route(router, ADD_ENVIRONMENT, "Enter the environment of the room")
def add_environment(request: RoomEnvironmentRequest, service: ServiceDep) -> RoomEnvironmentResponse:
    """Temperature, humidity and pressure of the room, logged or typed; certificates state them of their campaign."""
    return service.execute(ADD_ENVIRONMENT, request)


@router.get("/environment", summary="The environment of the room")
def read_environment(
    service: ServiceDep,
    begin: Annotated[AwareDatetime | None, Query(description="Default: a day before `end`.")] = None,
    end: Annotated[AwareDatetime | None, Query(description="Default: now.")] = None,
    bench: Annotated[str, Query(description="Name of the bench; empty: what holds for all benches.")] = "",
) -> RoomEnvironmentResponse:
    """Least and largest of each quantity between two times, and the newest readings."""
    last = end or service.clock.utc()
    return environment(service.store, begin or last - DAY, last, bench)
