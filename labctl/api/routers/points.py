"""From a point of a figure to the readings that it is made of."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request

from labctl.answers.points import PointFigure, PointResponse
from labctl.api.computation import while_connected
from labctl.api.dependencies import ServiceDep
from labctl.services.criticism.point import point_unit

router = APIRouter(prefix="/api/units/{serial}", tags=["criticism"])


@router.get("/calibrations/{version}/point", summary="A point of a figure, computed again from its readings")
async def point(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    recording: Annotated[int, Query(description="Number of the recording.")],
    dataset: Annotated[int, Query(description="Number of the data set.")],
    axis: Annotated[str, Query(description="Output axis: x, y or z.")],
    figure: Annotated[
        PointFigure, Query(description="The figure: residuals of the fitted model, or the version without refitting.")
    ] = "residual",
    recordings: Annotated[
        list[int] | None, Query(description="All recordings that are drawn together; default: `recording` alone.")
    ] = None,
) -> PointResponse:
    """The readings of one data set, mean, rate, error and residual, and the same computed now from the raw readings."""
    return await while_connected(
        request, service, point_unit, serial, version, recording, dataset, axis, figure, tuple(recordings or ())
    )
