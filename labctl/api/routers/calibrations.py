"""Calibrations: fit, list, certify, fetch."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response

from labctl.answers.calibrations import (
    CalibrationRow,
    FitRequest,
    FitResponse,
    ImprovedVersionResponse,
    ImproveRequest,
    ImproveResponse,
    PreviewResponse,
    VersionResponse,
)
from labctl.answers.certification import CalibrationStateResponse, FetchResponse
from labctl.answers.comparison import ComparisonResponse
from labctl.answers.criticism import CriticismResponse, StageResponse
from labctl.answers.ladder import LadderResponse
from labctl.answers.residuals import ResidualsResponse
from labctl.answers.uncertainty import SurfaceResponse, UncertaintyResponse
from labctl.answers.verification import VerificationResponse
from labctl.answers.views import PictureResponse
from labctl.api.calibration_answer import CalibrationRequest, calibration_answer
from labctl.api.computation import execute, follow, while_connected
from labctl.api.dependencies import ServiceDep, command_route
from labctl.api.event_stream import EventStream
from labctl.fitting.effects import read_formulas
from labctl.services.calibrations import fitting as services
from labctl.services.calibrations.fetch_log import fetched_by
from labctl.services.calibrations.revision import preview_unit
from labctl.services.calibrations.served import calibration_state as state_of
from labctl.services.calibrations.surface import surface_of
from labctl.services.calibrations.uncertainty import uncertainty_at
from labctl.services.commands.registry import FIT, IMPROVE
from labctl.services.commands.requests import ToNewestOrVersion, ToUnit
from labctl.services.criticism.comparison import comparison_of_version
from labctl.services.criticism.criticise import criticise_unit, residuals_unit
from labctl.services.criticism.ladder import ladder as ladder_of
from labctl.services.criticism.plots import pictures_unit
from labctl.services.criticism.verification.of_version import verify_unit

router = APIRouter(prefix="/api/units/{serial}", tags=["calibrations"])
OtherUnit = Annotated[bool, Query(description="Accept a recording of another unit than the one in the address.")]
RecordingNumber = Annotated[
    int | None, Query(description="Number of the recording; default: the unit's newest recording.")
]
RecordingNumbers = Annotated[
    list[int] | None, Query(description="Several recordings of the unit, used together; instead of `recording`.")
]
Formulas = Annotated[
    list[str] | None, Query(description="Your own effects to include in the comparison: 'name: expr'.")
]


@router.head("/calibration", include_in_schema=False)
@router.get("/calibration", summary="The calibration in force", response_class=Response)
async def calibration(
    request: Request,
    serial: str,
    service: ServiceDep,
    version: Annotated[
        int | None,
        Query(description="Number of the version; default: the certified version (status 404 if there is none)."),
    ] = None,
    format: Annotated[  # noqa: A002  the contract's name
        str, Query(description="Format of the file, such as json or c; `GET /api/units/{serial}` lists the formats.")
    ] = "json",
    option: Annotated[
        list[str] | None, Query(description="Option of the format, as KEY=VALUE; may be repeated.")
    ] = None,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """The calibration as a file; the ETag is its hash. 304 when the caller has it already.

    The file changes only with its certification, which it contains. `X-Labctl-State` is in-force, superseded, revoked
    or not-certified, `X-Labctl-Due` the date until which it is valid; `Warning` says that it is overdue or revoked.
    `X-Labctl-Withdrawn` says when, by whom and why the version was revoked or its certificate withdrawn. Who fetches is
    recorded, by the name of the key.
    What a format does not carry of it, with its largest size, is in the header `X-Labctl-Lost`, one for each.
    """
    wanted = CalibrationRequest(
        serial, request.method, request.state.caller, if_none_match, version, format, tuple(option or ())
    )
    return await calibration_answer(service, wanted)


@router.get("/calibration/state", summary="State of a calibration that was fetched")
def calibration_state(
    serial: str,
    service: ServiceDep,
    calibration_hash: Annotated[
        str, Query(max_length=64, description="Hash of the calibration: `calibration_hash` of its file.")
    ],
) -> CalibrationStateResponse:
    """Whether the calibration with this hash is in force, superseded or revoked, and whether it was withdrawn.

    For programs that keep a calibration file and ask from time to time; 404 for a hash that the unit does not have.
    """
    return state_of(service.store, serial, calibration_hash)


@router.get("/calibrations/{version}/fetches", summary="Who fetched a version")
def fetches(serial: str, version: int, service: ServiceDep) -> list[FetchResponse]:
    """Every key by which the version was fetched, with the first and the last time, the newest fetch first.

    They are those who have to be notified when the version is revoked.
    """
    service.fetches.write()
    return fetched_by(service.store, serial, version)


@router.head("/calibrations", include_in_schema=False)
@router.get("/calibrations", summary="All versions")
def calibrations(serial: str, service: ServiceDep) -> list[CalibrationRow]:
    """Every version of the unit, newest first, with its error figures."""
    return services.list_calibrations(service.store, serial)


@command_route(router, FIT, "Fit a model")
async def fit(serial: str, request: FitRequest, service: ServiceDep) -> FitResponse:
    """Fit a model to a recording; it becomes the unit's next version."""
    return await execute(service, FIT, ToUnit(serial, request))


@command_route(router, IMPROVE, "Change a model")
async def improve(serial: str, version: int, request: ImproveRequest, service: ServiceDep) -> ImproveResponse:
    """Add effects to a version, or remove some, and fit everything again; it becomes the unit's next version."""
    return await execute(service, IMPROVE, ToNewestOrVersion(serial, version, request))


@router.get("/calibrations/{version}", summary="One version")
def one_version(serial: str, version: int, service: ServiceDep) -> VersionResponse | ImprovedVersionResponse:
    """The result of the fit of a version, when and from which data it was made, and whether it is in force."""
    return services.one_version(service.store, serial, version)


@router.get("/calibrations/{version}/verification", summary="Apply a version to a recording")
async def verification(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    recording: RecordingNumber = None,
    other_unit: OtherUnit = False,
) -> VerificationResponse:
    """The residual of the version on the recording, without refitting, and whether it is as small as expected."""
    return await while_connected(request, service, verify_unit, serial, version, recording, other_unit=other_unit)


@router.get("/calibrations/{version}/criticism", summary="Compare a model with a recording")
async def criticism(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    recording: RecordingNumber = None,
    recordings: RecordingNumbers = None,
    other_unit: OtherUnit = False,
    formula: Formulas = None,
) -> CriticismResponse:
    """The residual of the model, where it is large, which effects may be missing, and which ones cannot be tested.

    The computation is cancelled when the client leaves.
    """
    competing = tuple(read_formulas(formula or []))
    return await while_connected(
        request, service, criticise_unit, serial, version, recording, competing, recordings=tuple(recordings or ()),
        other_unit=other_unit,
    )  # fmt: skip


@router.get(
    "/calibrations/{version}/criticism/events",
    summary="Follow a criticism while it is computed",
    response_class=EventStream,
    responses={200: {"model": StageResponse | CriticismResponse, "description": "Stages, then the criticism."}},
)
async def criticism_events(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    recording: RecordingNumber = None,
    recordings: RecordingNumbers = None,
    other_unit: OtherUnit = False,
    formula: Formulas = None,
) -> Response:
    """Server-sent events: `stage` as each stage begins, then `answer`, the criticism, or `problem`.

    The computation is cancelled when the client leaves. An answer that was computed before has an ETag: 304 when the
    caller has it already.
    """
    competing = tuple(read_formulas(formula or []))
    return await follow(
        request, service, criticise_unit, serial, version, recording, competing, recordings=tuple(recordings or ()),
        other_unit=other_unit,
    )  # fmt: skip


@router.get("/calibrations/{version}/residuals", summary="Residuals of a model, by data set")
async def residuals(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    recording: RecordingNumber = None,
    recordings: RecordingNumbers = None,
) -> ResidualsResponse:
    """The data of the residual map of the criticism, one row per data set and axis: measured error, modelled error
    and residual."""
    return await while_connected(request, service, residuals_unit, serial, version, recording, tuple(recordings or ()))


@router.get("/calibrations/{version}/pictures", summary="The pictures of a criticism")
async def pictures(
    request: Request, serial: str, version: int, service: ServiceDep, recording: RecordingNumber = None
) -> list[PictureResponse]:
    """Every picture of the criticism that has data, as a Plotly figure, with a caption that explains it."""
    return await while_connected(request, service, pictures_unit, serial, version, recording)


@router.get("/calibrations/{version}/comparison", summary="Compare a version with a recording, without refitting")
async def comparison(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    recording: RecordingNumber = None,
    recordings: RecordingNumbers = None,
    other_unit: OtherUnit = False,
) -> ComparisonResponse:
    """Measured and modelled error, data set by data set, and the version's model as lines; nothing is refitted."""
    return await while_connected(
        request, service, comparison_of_version, serial, version, recording, recordings=tuple(recordings or ()),
        other_unit=other_unit,
    )  # fmt: skip


@router.get("/calibrations/{version}/surface", summary="The modelled error over rate and temperature")
async def surface(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    rate_points: Annotated[int, Query(ge=2, le=401)] = 41,
    temperature_points: Annotated[int, Query(ge=2, le=201)] = 25,
) -> SurfaceResponse:
    """The error that the calibration subtracts from each axis, turned about itself, on a grid over the calibrated
    range."""
    return await while_connected(request, service, surface_of, serial, version, rate_points, temperature_points)


@router.post("/calibrations/{version}/preview", summary="Preview of a changed model")
async def preview(
    http: Request, serial: str, version: int, request: ImproveRequest, service: ServiceDep
) -> PreviewResponse:
    """The same change as `improve` makes, fitted, with its errors before and after; nothing is stored."""
    change = request.model_copy(update={"version": version})
    return await while_connected(http, service, preview_unit, serial, change)


@router.get("/calibrations/{version}/uncertainty", summary="Uncertainty of a corrected rate")
async def uncertainty(
    request: Request,
    serial: str,
    version: int,
    service: ServiceDep,
    rate_dps: Annotated[
        list[float],
        Query(
            min_length=1,
            max_length=3,
            description="True rate for which the uncertainty is computed, deg/s: given once, about one axis after the "
            "other, the others at rest; given three times, the rate vector about x, y and z.",
        ),
    ],
    temperature_c: Annotated[float, Query(description="Temperature by the gyro's thermometer, deg C.")],
    grid: Annotated[
        bool, Query(description="Also compute the uncertainty on a small grid over the calibrated range.")
    ] = False,
) -> UncertaintyResponse:
    """GUM components of a corrected rate, or of a corrected rate vector, at one temperature, and whether that place
    lies in the calibrated range."""
    return await while_connected(request, service, uncertainty_at, serial, version, rate_dps, temperature_c, grid=grid)


@router.head("/ladder", include_in_schema=False)
@router.get("/ladder", summary="Errors of the versions")
async def ladder(
    request: Request,
    serial: str,
    service: ServiceDep,
    recording: Annotated[
        int | None,
        Query(
            description="Recording whose versions are listed; default: the recording "
            "that the newest version was fitted to."
        ),
    ] = None,
) -> LadderResponse:
    """The errors of the versions fitted to one recording, each after the version it was changed from, and the
    noise floor."""
    return await while_connected(request, service, ladder_of, serial, recording)
