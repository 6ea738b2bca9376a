"""Recordings by what moved the unit: at rest, in turns, of a profile, in poses."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request

from labctl.answers.comparison import MotionResponse
from labctl.api.computation import while_connected
from labctl.api.dependencies import ServiceDep
from labctl.services.criticism.by_motion import recording_by_motion, version_by_motion

router = APIRouter(prefix="/api")


@router.get(
    "/recordings/{recording}/motion",
    summary="A recording in the form that suits its kind of motion",
    tags=["recordings"],
)
async def recording_motion(request: Request, recording: int, service: ServiceDep) -> MotionResponse:
    """Bias by temperature at rest, the integral of each turn, the course of a profile, or gravity about each move."""
    return await while_connected(request, service, recording_by_motion, recording)


@router.get(
    "/units/{serial}/calibrations/{version}/motion",
    summary="A version applied to a recording, in the form that suits its kind of motion",
    tags=["calibrations"],
)
async def version_motion(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    recording: Annotated[
        int | None, Query(description="Number of the recording; default: the unit's newest recording.")
    ] = None,
    other_unit: Annotated[
        bool, Query(description="Accept a recording of another unit than the one in the address.")
    ] = False,
) -> MotionResponse:
    """The same, with what the version leaves; nothing is refitted."""
    return await while_connected(request, service, version_by_motion, serial, version, recording, other_unit=other_unit)
