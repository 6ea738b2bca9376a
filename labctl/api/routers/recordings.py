"""Recordings: import, simulate, list, read and download."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, File, Form, Query, Request, Response, UploadFile
from fastapi import Path as PathParameter
from fastapi.responses import PlainTextResponse, StreamingResponse

from labctl.answers.inspection import InspectionResponse
from labctl.answers.orientation import OrientationQuery, OrientationResponse
from labctl.answers.recording_head import Motion, RecordingKind
from labctl.answers.recordings import (
    AllanResponse,
    DataSetsResponse,
    ExampleRequest,
    ImportResponse,
    LogPreview,
    RecordingAlone,
    RecordingResponse,
    RecordingWithPoints,
    SamplesResponse,
    SimulatedRecordingResponse,
    SimulatedRequest,
    TraceResponse,
)
from labctl.api.computation import execute, while_connected, with_files
from labctl.api.dependencies import ServiceDep, command_route
from labctl.api.known_recording import OF_RECORDING
from labctl.api.paging import AfterNumber, Limit, Search, in_parts
from labctl.recording.column_map.templates import template
from labctl.services.calibrations.orientation import orientation_of_recording
from labctl.services.commands.registry import IMPORT_EXAMPLE, IMPORT_LOG, IMPORT_RECORDING, SIMULATE_RECORDING
from labctl.services.commands.requests import LogFile, RecordingFolder
from labctl.services.recordings import catalogue
from labctl.services.recordings.allan import allan_unit
from labctl.services.recordings.examination import inspection_of_recording
from labctl.services.recordings.importers import parsed_options
from labctl.services.recordings.log_preview import preview_log
from labctl.services.recordings.traces import trace as trace_of
from labctl.services.recordings.transfer import import_files, zip_recording
from labctl.services.recordings.uploads import sent_map, with_staged
from labctl.store.paging import PageRequest

MapField = Annotated[
    str,
    Form(
        max_length=1 << 20,
        description="Column map, as JSON or TOML: which column of the "
        "file is which quantity; empty: labctl proposes a map.",
    ),
]
ImporterField = Annotated[
    str,
    Form(
        max_length=100, description="Importer that reads the file; empty: the importer that recognises the file best."
    ),
]
OptionField = Annotated[
    list[str] | None, Form(max_length=20, description="Option of the importer, as KEY=VALUE; may be repeated.")
]
LeaveOutField = Annotated[
    list[str] | None,
    Form(
        max_length=20,
        description="Kind of finding whose readings are left out, such as spikes; all: every kind that can be left "
        "out; may be repeated. They are marked as bad, counted and stated in `left_out`.",
    ),
]
ModifiedField = Annotated[
    float | None, Form(ge=0, le=4e12, description="When the file was last written, ms since 1970-01-01 UTC.")
]
RecordingFiles = Annotated[
    list[UploadFile],
    File(
        description="The files of the recording: `recording.toml`, its data file and, if there is one, the environment "
        "file."
    ),
]
LogUpload = Annotated[
    UploadFile, File(description="The file in another format, such as CSV, Parquet, ULog or a ROS bag.")
]

router = APIRouter(prefix="/api/recordings", tags=["recordings"])


@command_route(router, IMPORT_RECORDING, "Import a recording")
async def import_recording(
    request: Request, files: RecordingFiles, service: ServiceDep, leave_out: LeaveOutField = None
) -> ImportResponse:
    """Import a recording in the interchange format: `recording.toml`, its data file and, if there is one, the
    environment file, as parts of one multipart form. Either the whole recording is stored or nothing; an error
    names file, column and row."""
    return await with_files(
        request,
        import_files,
        [(file.filename or "", file.file) for file in files],
        lambda folder: service.execute(IMPORT_RECORDING, RecordingFolder(folder, _kinds(leave_out))),
    )


@command_route(router, IMPORT_LOG, "Import a log")
async def import_log(
    request: Request,
    file: LogUpload,
    service: ServiceDep,
    column_map: MapField = "",
    importer: ImporterField = "",
    option: OptionField = None,
    leave_out: LeaveOutField = None,
    modified_ms: ModifiedField = None,
) -> ImportResponse:
    """Take in a file of another format (CSV, Parquet, ULog, ROS bag) by the map of its columns, or by the one that is
    proposed. All of it or nothing; an error lists everything that is wrong as `problems`."""
    map_document, options = sent_map(column_map), tuple(option or ())
    return await with_files(
        request,
        with_staged,
        file.filename or "",
        file.file,
        modified_ms,
        lambda path: service.execute(
            IMPORT_LOG, LogFile(path, map_document, importer or None, options, _kinds(leave_out))
        ),
    )


@router.post("/logs/preview", summary="Preview a log")
async def preview(
    request: Request,
    file: LogUpload,
    service: ServiceDep,
    column_map: MapField = "",
    importer: ImporterField = "",
    option: OptionField = None,
    leave_out: LeaveOutField = None,
    modified_ms: ModifiedField = None,
) -> LogPreview:
    """The proposed map of a log, or what it becomes by the map that is sent; its first rows, traces, and everything
    that is wrong, in the columns and in single readings. Nothing is stored."""
    map_document, options = sent_map(column_map), parsed_options(option or ())
    return await with_files(
        request,
        with_staged,
        file.filename or "",
        file.file,
        modified_ms,
        lambda path: service.computation.run(
            preview_log, path, importer or None, options, map_document, _kinds(leave_out)
        ),
    )


def _kinds(sent: list[str] | None) -> tuple[str, ...]:
    return tuple(kind for kind in sent or () if kind)


@router.get("/templates/{kind}", summary="A template", response_class=PlainTextResponse)
def template_file(
    kind: Annotated[
        Motion,
        PathParameter(
            description="How the unit is moved: at table rates, at "
            "rest, by turns, along a profile, or by hand between poses."
        ),
    ],
) -> PlainTextResponse:
    """A CSV file with the columns that a kind of data needs, units in their names."""
    headers = {"Content-Disposition": f'attachment; filename="{kind}.csv"'}
    return PlainTextResponse(template(kind), media_type="text/csv", headers=headers)


@command_route(router, SIMULATE_RECORDING, "Simulate a recording")
async def simulated(request: SimulatedRequest, service: ServiceDep) -> SimulatedRecordingResponse:
    """Simulate a recipe with effects hidden in the unit, and store the resulting recording."""
    return await execute(service, SIMULATE_RECORDING, request)


@command_route(router, IMPORT_EXAMPLE, "Import an example")
async def example(request: ExampleRequest, service: ServiceDep) -> ImportResponse:
    """Import one of the recordings of real gyros that come with labctl."""
    return await execute(service, IMPORT_EXAMPLE, request)


@router.get("", summary="All recordings")
def all_recordings(
    request: Request,
    response: Response,
    service: ServiceDep,
    unit: Annotated[
        str | None, Query(max_length=200, description="Only recordings of the unit of this number.")
    ] = None,
    kind: Annotated[
        RecordingKind | None,
        Query(description="Only recordings that hold every reading (samples), or only means (points, coefficients)."),
    ] = None,
    search: Search = "",
    limit: Limit = None,
    after: AfterNumber = None,
) -> list[RecordingResponse]:
    """Every recording, newest first; `search` in serial numbers and notes.

    `X-Total-Count` is how many match; `Link` with rel="next" names the next part of a list that `limit` has cut.
    """
    page = catalogue.page_of_recordings(service.store, PageRequest(search, limit, after), unit, kind)
    return in_parts(request, response, page)


@router.get("/{recording}", summary="One recording")
def recording(
    recording: int,
    service: ServiceDep,
    points: Annotated[bool, Query(description="Include the means of the data sets in the response.")] = True,
) -> RecordingAlone | RecordingWithPoints:
    """What the recording is: unit, axes, channels, data sets."""
    return catalogue.describe_recording(service.store, recording, points=points)


@router.get("/{recording}/datasets", summary="Data sets of a recording")
def datasets(recording: int, service: ServiceDep) -> DataSetsResponse:
    """One row per data set, as columns, with mean and standard deviation of every channel; also incomplete ones."""
    return catalogue.data_sets(service.store, recording)


@router.get("/{recording}/trace", summary="A channel over time", dependencies=[OF_RECORDING])
async def trace(
    request: Request,
    recording: int,
    service: ServiceDep,
    channel: Annotated[str, Query(description="Name of the channel, such as gyro_x or temperature_c.", max_length=60)],
    from_s: Annotated[
        float | None,
        Query(description="Beginning of the window, s since the recording began; default: the first reading."),
    ] = None,
    until_s: Annotated[
        float | None, Query(description="End of the window, s since the recording began; default: the last reading.")
    ] = None,
    points: Annotated[int, Query(ge=1, le=20_000, description="Largest number of bins.")] = 2000,
) -> TraceResponse:
    """Smallest, largest and mean reading of a channel in time bins of equal length; empty bins are left out."""
    return await while_connected(request, service, trace_of, recording, channel, from_s, until_s, points)


@router.get("/{recording}/inspection", summary="Inspection of a recording", dependencies=[OF_RECORDING])
async def inspection(request: Request, recording: int, service: ServiceDep) -> InspectionResponse:
    """What is wrong with the readings before anything is fitted to them, what was left out when they were imported, and
    a picture of every channel with the places of the findings."""
    return await while_connected(request, service, inspection_of_recording, recording)


@router.get("/{recording}/allan", summary="Noise of a recording at rest")
async def allan(
    request: Request,
    recording: int,
    service: ServiceDep,
    dataset: Annotated[
        int | None,
        Query(description="Number of the data set to use; default: the longest section of the recording at rest."),
    ] = None,
) -> AllanResponse:
    """The overlapping Allan deviation of each axis with 95 % intervals, and the coefficients N, B and K where they
    can be determined."""
    return await while_connected(request, service, allan_unit, recording, dataset)


@router.get("/{recording}/orientation", summary="Static bias and angle of a recording", tags=["calibrations"])
async def orientation(
    request: Request, recording: int, service: ServiceDep, query: Annotated[OrientationQuery, Query()]
) -> OrientationResponse:
    """The angle of one axis from its rate: static bias taken off (Ojeda et al. 2000, eqs. 15 and 16), offset renewed
    at standstill; of a record at rest, the drift between declared stops (Weiss)."""
    return await while_connected(request, service, orientation_of_recording, recording, query.version, query)


@router.get("/{recording}/file", summary="Download the recording", response_class=StreamingResponse)
async def file(
    request: Request,
    recording: int,
    service: ServiceDep,
    format: Annotated[  # noqa: A002
        Literal["parquet", "csv"], Query(description="Format of the tables in the zip file.")
    ] = "parquet",
) -> StreamingResponse:
    """The recording in the interchange format, every reading, as one zip; it imports again."""
    made = await with_files(request, zip_recording, service.store, recording, format)
    headers = {"Content-Disposition": f'attachment; filename="{made.name}"', "Content-Length": str(made.size)}
    return StreamingResponse(made.chunks(), media_type="application/zip", headers=headers)


@router.get("/{recording}/samples", summary="Readings of one data set")
def samples(
    recording: int,
    service: ServiceDep,
    dataset: Annotated[int, Query(description="Number of the data set.")],
    limit: Annotated[int, Query(ge=1, le=100_000, description="Largest number of readings in the response.")] = 10_000,
) -> SamplesResponse:
    """The readings of one data set, column by column, in the units named beside them."""
    return catalogue.dataset_samples(service.store, recording, dataset, limit)
