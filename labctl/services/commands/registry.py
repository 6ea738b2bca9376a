"""Every command that changes the database."""

from __future__ import annotations

from typing import Any

from labctl.answers.admin import BackupNote, KeyRequest, KeyResponse, NewKeyResponse
from labctl.answers.benches import BenchStatus, ClearRequest
from labctl.answers.calibrations import FitRequest, FitResponse, ImproveRequest, ImproveResponse
from labctl.answers.campaigns import ReasonRequest
from labctl.answers.certificates import CertificateRequest, CertificateResponse, WithdrawRequest
from labctl.answers.certification import (
    CertificationResponse,
    CertifyRequest,
    ReleaseRequest,
    ReleaseRequestResponse,
    RevokeRequest,
)
from labctl.answers.drafts import DraftsRequest, DraftsResponse
from labctl.answers.recordings import ExampleRequest, ImportResponse, SimulatedRecordingResponse, SimulatedRequest
from labctl.answers.schedule import ScheduledResponse
from labctl.answers.units import BatchRequest, BatchResponse
from labctl.services.admin import api_keys
from labctl.services.calibrations import certification, fitting, revision
from labctl.services.campaigns.bench_status import clear_bench
from labctl.services.certificates import issue as certificates
from labctl.services.commands.acts.catalogue import CAMPAIGN_ACTS
from labctl.services.commands.acts.check import CHECK_BENCH
from labctl.services.commands.acts.live import END_LIVE, START_LIVE
from labctl.services.commands.acts.start import START_CAMPAIGN
from labctl.services.commands.command import Command, Newest, NoContent
from labctl.services.commands.context import CommandContext
from labctl.services.commands.diagnoses import (
    CONFIRM_EXPERIMENT,
    END_DIAGNOSIS,
    RESUME_DIAGNOSIS,
    START_DIAGNOSIS,
    STOP_DIAGNOSIS,
)
from labctl.services.commands.encoding import log_file, recording_files
from labctl.services.commands.fleet import CANCEL_FLEET_JOB, START_FLEET_JOB
from labctl.services.commands.requests import (
    LogFile,
    RecordingFolder,
    ToBench,
    ToCampaign,
    ToKey,
    ToNewestOrVersion,
    ToStart,
    ToUnit,
    ToVersion,
)
from labctl.services.commands.sensors import KEEP_ACCELEROMETER, KEEP_MAGNETOMETER
from labctl.services.commands.standards import (
    ADD_ENVIRONMENT,
    ADD_STANDARD,
    ADD_STANDARD_CERTIFICATE,
    ADD_STANDARD_CHECK,
    MARK_STANDARD_BAD,
    SET_CHECK_GYRO,
    WITHDRAW_FINDING,
)
from labctl.services.drafts.make import make_drafts
from labctl.services.recordings import examples, importers, transfer
from labctl.services.schedule import queue
from labctl.services.units import set_batch


def _import_recording(context: CommandContext, request: RecordingFolder) -> ImportResponse:
    with importers.as_interchange(request.folder, importers.INTERCHANGE, leave_out=request.leave_out) as folder:
        return transfer.import_folder(context.store, folder, context.now())


def _import_log(context: CommandContext, request: LogFile) -> ImportResponse:
    with importers.as_interchange(
        request.path, request.importer, request.options, request.column_map, leave_out=request.leave_out
    ) as folder:
        return transfer.import_folder(context.store, folder, context.now())


def _import_example(context: CommandContext, request: ExampleRequest) -> ImportResponse:
    return transfer.import_folder(context.store, examples.example(request.name), context.now())


def _simulate_recording(context: CommandContext, request: SimulatedRequest) -> SimulatedRecordingResponse:
    return examples.add_simulated(context.store, request, context.now())


def _fit(context: CommandContext, request: ToUnit[FitRequest]) -> FitResponse:
    return fitting.fit_unit(context.store, request.serial, request.body, context.now())


def _improve(context: CommandContext, request: ToNewestOrVersion[ImproveRequest]) -> ImproveResponse:
    change = request.body.model_copy(update={"version": request.version})
    return revision.improve_unit(context.store, request.serial, change, context.now())


def _certify(
    context: CommandContext, request: ToVersion[CertifyRequest]
) -> CertificationResponse | ReleaseRequestResponse:
    return certification.certify(context.store, request.serial, request.version, request.body, context.now())


def _release(context: CommandContext, request: ToVersion[ReleaseRequest]) -> CertificationResponse:
    return certification.release(context.store, request.serial, request.version, request.body, context.now())


def _revoke(context: CommandContext, request: ToVersion[RevokeRequest]) -> CertificationResponse:
    return certification.revoke(context.store, request.serial, request.version, request.body, context.now())


def _issue_certificate(context: CommandContext, request: ToVersion[CertificateRequest]) -> CertificateResponse:
    return certificates.issue(context.store, request.serial, request.version, request.body, context.now())


def _withdraw_certificate(context: CommandContext, request: WithdrawRequest) -> CertificateResponse:
    return certificates.withdraw(context.store, request, context.now())


def _cancel_start(context: CommandContext, request: ToStart) -> ScheduledResponse:
    return queue.cancel_start(context.store, request.start, context.now())


def _make_drafts(context: CommandContext, request: ToCampaign[DraftsRequest]) -> DraftsResponse:
    return make_drafts(context.store, request.campaign, request.body, context.now())


def _clear_bench(context: CommandContext, request: ToBench[ClearRequest]) -> BenchStatus:
    return clear_bench(context.store, request.bench, request.body, context.now())


def _create_key(context: CommandContext, request: KeyRequest) -> NewKeyResponse:
    return api_keys.create_key(context.store, request, context.now())


def _revoke_key(context: CommandContext, request: ToKey[ReasonRequest]) -> KeyResponse:
    return api_keys.revoke_key(context.store, request.name, request.body.reason, context.now())


def _set_batch(context: CommandContext, request: BatchRequest) -> BatchResponse:
    return set_batch(context.store, request, context.now())


def _note_backup(context: CommandContext, request: BackupNote) -> NoContent:
    detail = {"bytes": request.bytes, "sha256": request.sha256}
    context.store.audit.record(context.now(), "backup", request.file, detail)
    return NoContent()


_UNIT = "/api/units/{serial}/calibrations"
_CAMPAIGN = "/api/campaigns/{campaign}"

IMPORT_RECORDING = Command(
    method="POST",
    path="/api/recordings",
    handler=_import_recording,
    responses={201: ImportResponse},
    encode=recording_files,
    computes=True,
)
IMPORT_LOG = Command(
    method="POST",
    path="/api/recordings/logs",
    handler=_import_log,
    responses={201: ImportResponse},
    encode=log_file,
    computes=True,
)
IMPORT_EXAMPLE = Command(
    method="POST",
    path="/api/recordings/example",
    handler=_import_example,
    responses={201: ImportResponse},
    computes=True,
)
SIMULATE_RECORDING = Command(
    method="POST",
    path="/api/recordings/simulated",
    handler=_simulate_recording,
    responses={201: SimulatedRecordingResponse},
    computes=True,
)
FIT = Command(method="POST", path=_UNIT, handler=_fit, responses={201: FitResponse}, computes=True)
IMPROVE = Command(
    method="POST",
    path=_UNIT + "/{version}/improve",
    handler=_improve,
    responses={201: ImproveResponse},
    newest=Newest("version", _UNIT, "version", otherwise=1),
    computes=True,
)
CERTIFY: Command[ToVersion[CertifyRequest], CertificationResponse | ReleaseRequestResponse] = Command(
    method="POST",
    path=_UNIT + "/{version}/certify",
    handler=_certify,
    responses={200: CertificationResponse, 202: ReleaseRequestResponse},
    computes=True,
)
RELEASE = Command(
    method="POST",
    path=_UNIT + "/{version}/release",
    handler=_release,
    responses={200: CertificationResponse},
    computes=True,
)
REVOKE = Command(
    method="POST", path=_UNIT + "/{version}/revoke", handler=_revoke, responses={200: CertificationResponse}
)
ISSUE_CERTIFICATE = Command(
    method="POST",
    path=_UNIT + "/{version}/certificate",
    handler=_issue_certificate,
    responses={201: CertificateResponse},
    computes=True,
)
WITHDRAW_CERTIFICATE = Command(
    method="POST",
    path="/api/certificates/withdraw",
    handler=_withdraw_certificate,
    responses={200: CertificateResponse},
)
MAKE_DRAFTS = Command(
    method="POST",
    path=_CAMPAIGN + "/drafts",
    handler=_make_drafts,
    responses={200: DraftsResponse},
    computes=True,
)
CANCEL_START = Command(
    method="DELETE", path="/api/schedule/{start}", handler=_cancel_start, responses={200: ScheduledResponse}
)
CLEAR_BENCH = Command(
    method="POST", path="/api/benches/{bench}/clear", handler=_clear_bench, responses={200: BenchStatus}
)
CREATE_KEY = Command(method="POST", path="/api/keys", handler=_create_key, responses={201: NewKeyResponse})
REVOKE_KEY = Command(method="POST", path="/api/keys/{name}/revoke", handler=_revoke_key, responses={200: KeyResponse})
SET_BATCH = Command(method="POST", path="/api/batches", handler=_set_batch, responses={200: BatchResponse})
NOTE_BACKUP = Command(method="POST", path="/api/backups", handler=_note_backup, responses={204: NoContent})

_ELSEWHERE: tuple[Command[Any, Any], ...] = (
    START_CAMPAIGN, *(act.command for act in CAMPAIGN_ACTS), CHECK_BENCH, START_LIVE, END_LIVE,
    ADD_STANDARD, ADD_STANDARD_CERTIFICATE, ADD_STANDARD_CHECK, MARK_STANDARD_BAD, WITHDRAW_FINDING, SET_CHECK_GYRO,
    ADD_ENVIRONMENT, KEEP_ACCELEROMETER, KEEP_MAGNETOMETER,
    START_DIAGNOSIS, CONFIRM_EXPERIMENT, STOP_DIAGNOSIS, RESUME_DIAGNOSIS, END_DIAGNOSIS,
    START_FLEET_JOB, CANCEL_FLEET_JOB,
)  # fmt: skip
#: All of them, in the order above.
COMMANDS: tuple[Command[Any, Any], ...] = (
    *(each for each in list(vars().values()) if isinstance(each, Command) and each not in _ELSEWHERE),
    *_ELSEWHERE,
)
