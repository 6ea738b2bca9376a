"""From a point of a figure to the readings that it is made of."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request

from labctl.answers.points import FigurePointResponse, PointFigure, PointResponse, TrendQuantity
from labctl.api.computation import while_connected
from labctl.api.dependencies import ServiceDep
from labctl.services.criticism.point import point_unit
from labctl.services.criticism.trend_point import trend_point
from labctl.services.recordings.allan_point import allan_point
from labctl.services.recordings.trace_point import TraceWindow, mean_point, trace_point

router = APIRouter(prefix="/api", tags=["criticism"])


@router.get(
    "/units/{serial}/calibrations/{version}/point", summary="A point of a figure, computed again from its readings"
)
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


@router.get("/units/{serial}/trend/point", summary="A point of a trend, computed again from its readings")
async def point_of_trend(
    request: Request,
    serial: str,
    service: ServiceDep,
    recording: Annotated[int, Query(description="Number of the recording.")],
    quantity: Annotated[TrendQuantity, Query(description="What the point states.")],
    axis: Annotated[str, Query(description="Output axis: x, y or z; empty for an error over all axes.")] = "",
    version: Annotated[
        int | None, Query(description="Version that is compared with all recordings of the unit; default: the first.")
    ] = None,
) -> FigurePointResponse:
    """What a version leaves of one recording, and the same computed now from every reading of the recording."""
    return await while_connected(request, service, trend_point, serial, version, recording, axis, quantity)


@router.get("/recordings/{recording}/allan/point", summary="A point of an Allan deviation, computed again")
async def point_of_allan(
    request: Request,
    recording: int,
    service: ServiceDep,
    axis: Annotated[str, Query(description="Output axis: x, y or z.")],
    tau_s: Annotated[float, Query(gt=0, description="Averaging time, one of those of the figure, s.")],
    dataset: Annotated[
        int | None, Query(description="Number of the data set of the figure; default: the longest section at rest.")
    ] = None,
) -> FigurePointResponse:
    """The deviation at one averaging time with its interval and clusters, and the same computed now from readings."""
    return await while_connected(request, service, allan_point, recording, axis, tau_s, dataset)


@router.get("/recordings/{recording}/trace/point", summary="A bin of a trace, computed again from its readings")
async def point_of_trace(
    request: Request,
    recording: int,
    service: ServiceDep,
    channel: Annotated[str, Query(description="Name of the channel, such as gyro_x.", max_length=60)],
    t_s: Annotated[float, Query(description="Time of the bin, one of those of the figure, s.")],
    from_s: Annotated[float | None, Query(description="Beginning of the window of the figure, s.")] = None,
    until_s: Annotated[float | None, Query(description="End of the window of the figure, s.")] = None,
    points: Annotated[int, Query(ge=1, le=20_000, description="Largest number of bins of the figure.")] = 2000,
) -> FigurePointResponse:
    """Least, largest and mean reading of one bin of a trace, and the same computed now from its readings."""
    window = TraceWindow(channel, from_s, until_s, points)
    return await while_connected(request, service, trace_point, recording, window, t_s)


@router.get("/recordings/{recording}/datasets/{dataset}/mean", summary="The mean of a data set, computed again")
async def point_of_mean(
    request: Request,
    recording: int,
    dataset: int,
    service: ServiceDep,
    channel: Annotated[str, Query(description="Name of the channel, such as gyro_x.", max_length=60)],
) -> FigurePointResponse:
    """The kept mean of a channel in one data set, and the same computed now from the readings."""
    return await while_connected(request, service, mean_point, recording, dataset, channel)
