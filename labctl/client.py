"""A client of a labctl service: calibrations by serial number, recordings, fits and campaigns.

Every method sends one HTTP request and returns a typed answer. Three errors are common to all of them:
`ServiceRefused` (the service refuses the request and says why), `labctl.errors.StoreError` (it does not answer) and
`pydantic.ValidationError` (a value of a request is wrong; nothing was sent).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Literal

import httpx
from httpx_sse import ServerSentEvent, connect_sse

from instruments.clock import Clock, SystemClock
from labctl.answers.base import Request
from labctl.answers.calibrations import CalibrationRow, FitRequest, FitResponse
from labctl.answers.campaigns import (
    CampaignRequest,
    CampaignResponse,
    ConfirmRequest,
    EventResponse,
    ReasonRequest,
    ResumeRequest,
)
from labctl.answers.certification import CalibrationStateResponse
from labctl.answers.common_fields import CriticismVerdict
from labctl.answers.design import DesignRequest, DesignResponse
from labctl.answers.diagnosis import ConfirmExperimentRequest, DiagnosisRequest, DiagnosisResponse
from labctl.answers.fixed_coefficients import FixedCoefficients
from labctl.answers.points import FigurePointResponse, PointResponse
from labctl.answers.recordings import AllanResponse, ImportResponse, RecordingResponse, TraceResponse
from labctl.answers.residuals import ResidualsResponse
from labctl.answers.schedule import ScheduledResponse
from labctl.answers.units import TrendResponse, UnitResponse, UnitState
from labctl.bundle import Bundle
from labctl.calibration import Calibration, read_calibration
from labctl.calibration.certification import warn
from labctl.errors import CalibrationWithdrawn
from labctl.figure_requests import FigureRequests
from labctl.recording.files import recording_parts
from labctl.service_connection import (
    TIMEOUT_S,
    ServiceConnection,
    ServiceRefused,
    json_of,
    part_of_path,
    query_string,
    refusal,
)
from labctl.withdrawal import HEADER, Withdrawn, read_withdrawn

__all__ = [
    "AllanResponse",
    "Bundle",
    "CalibrationFile",
    "CalibrationRow",
    "CalibrationStateResponse",
    "CalibrationWithdrawn",
    "CampaignRequest",
    "CampaignResponse",
    "Client",
    "ConfirmExperimentRequest",
    "DesignRequest",
    "DesignResponse",
    "DiagnosisRequest",
    "DiagnosisResponse",
    "EventResponse",
    "FigurePointResponse",
    "FitRequest",
    "FitResponse",
    "FixedCoefficients",
    "ImportResponse",
    "PointResponse",
    "RecordingResponse",
    "ResidualsResponse",
    "ResumeRequest",
    "ScheduledResponse",
    "ServiceRefused",
    "TraceResponse",
    "TrendResponse",
    "UnitResponse",
    "Withdrawn",
]

#: Address of `labctl serve` without options.
DEFAULT_URL = "http://127.0.0.1:8420"
#: Pauses before `Client.watch` connects again, s; after the last one it gives up.
RECONNECT_AFTER_S = (1.0, 2.0, 4.0, 8.0, 15.0)
#: An event stream that is silent for longer is broken, s: the service sends a sign of life every 10 s.
SILENT_S = 30.0


@dataclass(frozen=True)
class CalibrationFile:
    """A calibration as the service serves it: immutable bytes, and their ETag (the document's SHA-256, quoted)."""

    serial: str
    content: bytes
    etag: str
    media_type: str
    state: str = ""  #: in-force, superseded, revoked or not-certified; empty: an older service does not say
    due: datetime | None = None  #: until when it is valid, aware UTC; None: no date
    warning: str = ""  #: that it is overdue or was revoked, in the service's words; empty: it is neither
    withdrawn: Withdrawn | None = None  #: that it was revoked, or its certificate withdrawn; None: neither

    @property
    def calibration(self) -> Calibration:
        """The calibration in a JSON file. Raises BadCalibrationFile for another format."""
        return read_calibration(self.content)


class Client(FigureRequests):
    """A connection to one service, to be closed or used in a `with` statement.

    `url` is the address of the service. `api_key` defaults to the environment variable `LABCTL_KEY`; a service on
    loopback needs none unless it was started with `--require-keys`. `timeout_s` bounds each answer, in seconds, and for
    how long a service that computes for others (429) is asked again, each time when its `Retry-After` says.
    """

    def __init__(
        self,
        url: str = DEFAULT_URL,
        *,
        api_key: str | None = None,
        timeout_s: float = TIMEOUT_S,
        transport: httpx.BaseTransport | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._clock = clock or SystemClock()
        self._connection = ServiceConnection(url, api_key, timeout_s=timeout_s, transport=transport, clock=self._clock)

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def units(
        self, *, due_within: str | None = None, calibration: UnitState | None = None,
        verdict: CriticismVerdict | None = None, batch: str = "", search: str = "", limit: int | None = None,
    ) -> list[UnitResponse]:  # fmt: skip
        """Return every unit that was measured or imported, by serial number; at most `limit`.

        With `due_within`, such as "30d", those that are due within that span or overdue, the earliest date first; with
        `calibration` those whose version in force is such, with `verdict` those that were certified with it, with
        `batch` those of a batch, with `search` those whose serial number, model, technology, batch or supplier holds
        it.
        """
        query = query_string(
            due_within=due_within, calibration=calibration, verdict=verdict, batch=batch, search=search, limit=limit
        )
        return self._connection.get_list(f"/api/units{query}", UnitResponse)

    def unit(self, serial: str) -> UnitResponse:
        """Return one unit: its recordings, its calibration versions, and which version is certified."""
        return self._connection.get(f"/api/units/{part_of_path(serial)}", UnitResponse)

    def calibrations(self, serial: str) -> list[CalibrationRow]:
        """Return every calibration version of a unit, newest first, with its errors in deg/s."""
        return self._connection.get_list(f"/api/units/{part_of_path(serial)}/calibrations", CalibrationRow)

    def calibration(
        self, serial: str, version: int | None = None, *, file_format: str = "json",
        held: CalibrationFile | None = None, accept_withdrawn: bool = False,
    ) -> CalibrationFile:  # fmt: skip
        """Fetch a calibration file: the certified version, or the one with number `version`.

        With `held`, the file that the caller already has, its ETag is sent along; the same object is returned when it
        is still current, and nothing is downloaded. Raises ServiceRefused with slug `not-certified` when the unit has
        no certified version, `not-found` when it does not exist, CalibrationWithdrawn when the version was revoked or
        its certificate was withdrawn; with `accept_withdrawn` the file is returned, with the notice as `withdrawn`.
        Issues a CalibrationWarning for a calibration that is overdue or was revoked; the file then has the text as
        `warning`.
        """
        query = {"format": file_format} | ({} if version is None else {"version": str(version)})
        headers = {} if held is None else {"If-None-Match": held.etag}
        path = f"/api/units/{part_of_path(serial)}/calibration"
        response = self._connection.request("GET", path, params=query, headers=headers)
        due, warning = response.headers.get("x-labctl-due"), _warning(response.headers.get("warning", ""))
        header = response.headers.get(HEADER)
        notice = None if header is None else read_withdrawn(header)
        if notice is not None and not accept_withdrawn:
            known = held is not None and response.status_code == httpx.codes.NOT_MODIFIED
            content = held.content if known and held is not None else response.content
            raise _withdrawn(f"calibration of {serial}", notice, content)
        warn(warning)
        if held is not None and response.status_code == httpx.codes.NOT_MODIFIED:
            same = (warning, notice) == (held.warning, held.withdrawn)
            return held if same else replace(held, warning=warning, withdrawn=notice)
        return CalibrationFile(
            serial, response.content, response.headers["etag"], response.headers.get("content-type", ""),
            response.headers.get("x-labctl-state", ""), None if due is None else datetime.fromisoformat(due), warning,
            notice,
        )  # fmt: skip

    def check_calibration(self, serial: str, calibration_hash: str) -> CalibrationStateResponse:
        """Ask in which state a calibration is now that was fetched before, by `Calibration.calibration_hash`.

        Raises CalibrationWithdrawn when its version was revoked or its certificate was withdrawn, ServiceRefused with
        slug `not-found` for a hash that the unit does not have.
        """
        path = f"/api/units/{part_of_path(serial)}/calibration/state"
        answer = self._connection.get(path, CalibrationStateResponse, calibration_hash=calibration_hash)
        if (gone := answer.withdrawn) is not None:
            notice = Withdrawn(gone.at, gone.by, gone.reason, gone.certificate)
            raise _withdrawn(f"calibration of {serial} version {answer.version}", notice)
        return answer

    def recordings(
        self, *, unit: str | None = None, search: str = "", limit: int | None = None
    ) -> list[RecordingResponse]:
        """Return every recording, newest first, or those of one `unit`; at most `limit`.

        With `search` those whose serial number or notes hold it.
        """
        query = query_string(unit=unit, search=search, limit=limit)
        return self._connection.get_list(f"/api/recordings{query}", RecordingResponse)

    def import_recording(self, folder: Path | str) -> ImportResponse:
        """Send the recording in `folder` (interchange format) and return its number and the warnings about it.

        Raises BadRecording for a folder without a recording.
        """
        with ExitStack() as opened:
            files = recording_parts(opened, Path(folder))
            response = self._connection.request("POST", "/api/recordings", files=files)
        return ImportResponse.model_validate(json_of(response))

    def fit(self, serial: str, request: FitRequest | None = None) -> FitResponse:
        """Fit a model to a recording of a unit; the result is the unit's next calibration version."""
        path = f"/api/units/{part_of_path(serial)}/calibrations"
        return FitResponse.model_validate(json_of(self._post(path, request or FitRequest())))

    def start_campaign(self, request: CampaignRequest) -> CampaignResponse | ScheduledResponse:
        """Start a campaign now, or enter it into the schedule when the request has `at` or `cron`.

        A bench that is not simulated needs `confirmed_by` and `checks`; without them ServiceRefused has the slug
        `start-not-confirmed`.
        """
        response = self._post("/api/campaigns", request)
        kind = ScheduledResponse if response.status_code == httpx.codes.ACCEPTED else CampaignResponse
        return kind.model_validate(json_of(response))

    def design_campaign(self, request: DesignRequest) -> DesignResponse:
        """Return the cheapest recipe that reaches an uncertainty on the service's bench, or the best within hours."""
        return DesignResponse.model_validate(json_of(self._post("/api/designs", request)))

    def campaigns(self, *, search: str = "", limit: int | None = None) -> list[CampaignResponse]:
        """Return every campaign, newest first; at most `limit`.

        With `search` those whose recipe, bench, state or units' serial numbers hold it.
        """
        return self._connection.get_list(f"/api/campaigns{query_string(search=search, limit=limit)}", CampaignResponse)

    def campaign(self, campaign: int) -> CampaignResponse:
        """Return state, step, progress and temperatures of one campaign."""
        return self._connection.get(f"/api/campaigns/{campaign}", CampaignResponse)

    def watch(self, campaign: int, *, after: int = 0) -> Iterator[EventResponse | CampaignResponse]:
        """Yield the events of a campaign whose id is above `after`, and its status when it changes, until it ends.

        It also ends when the service stops, as the state in the last status shows. A connection that breaks is opened
        again after 1, 2, 4, 8 and 15 s and goes on behind the last event. Raises StoreError when the service stays
        silent.
        """
        pauses = iter(RECONNECT_AFTER_S)
        while True:
            try:
                for update in self._events(campaign, after):
                    after = update.id if isinstance(update, EventResponse) else after
                    pauses = iter(RECONNECT_AFTER_S)
                    yield update
                return
            except httpx.HTTPError as error:
                pause_s = next(pauses, None)
                if pause_s is None:
                    raise self._connection.silent(error) from error
                self._clock.sleep(pause_s)

    def pause(self, campaign: int, reason: str, *, by: str = "") -> CampaignResponse:
        """Ask a running campaign to hold after the present data set."""
        return self._act(campaign, "pause", ReasonRequest(reason=reason, by=by))

    def resume(self, campaign: int, request: ResumeRequest | None = None) -> CampaignResponse:
        """Continue a paused campaign, or resume one that was interrupted, failed or aborted."""
        return self._act(campaign, "resume", request or ResumeRequest())

    def abort(self, campaign: int, reason: str, *, by: str = "") -> CampaignResponse:
        """End a running campaign now, in the safe state; what was measured is kept.

        The answer comes within about a second; `wish` is `abort` until the campaign has ended.
        """
        return self._act(campaign, "abort", ReasonRequest(reason=reason, by=by))

    def confirm(
        self, campaign: int, prompt: str, *, by: str, confirmed: bool = True, again: bool = False, reason: str = ""
    ) -> CampaignResponse:
        """Answer the question with the id `prompt`. `confirmed=False`: it cannot be done, and the campaign ends.

        `again=True`: a turn by hand did not go well and is to be asked again.
        """
        answer = ConfirmRequest(prompt=prompt, by=by, confirmed=confirmed and not again, again=again, reason=reason)
        return self._act(campaign, "confirm", answer)

    def start_diagnosis(self, serial: str, request: DiagnosisRequest | None = None) -> DiagnosisResponse:
        """Run experiments on the service's bench until one missing effect is left; returns at once."""
        return self._diagnosis(f"/api/units/{part_of_path(serial)}/diagnoses", request or DiagnosisRequest())

    def diagnoses(self, serial: str) -> list[DiagnosisResponse]:
        """Return the diagnoses of a unit, newest first."""
        return self._connection.get_list(f"/api/units/{part_of_path(serial)}/diagnoses", DiagnosisResponse)

    def diagnosis(self, diagnosis: int) -> DiagnosisResponse:
        """Return a diagnosis with its rounds."""
        return self._connection.get(f"/api/diagnoses/{diagnosis}", DiagnosisResponse)

    def confirm_experiment(self, diagnosis: int, request: ConfirmExperimentRequest) -> DiagnosisResponse:
        """Confirm the experiment that waits for a person, or answer that it cannot be done."""
        return self._diagnosis(f"/api/diagnoses/{diagnosis}/confirm", request)

    def act_on_diagnosis(
        self, diagnosis: int, act: Literal["stop", "resume", "end"], reason: str, *, by: str = ""
    ) -> DiagnosisResponse:
        """Stop a diagnosis and abort its campaign, resume both, or end the diagnosis for good."""
        return self._diagnosis(f"/api/diagnoses/{diagnosis}/{act}", ReasonRequest(reason=reason, by=by))

    def _diagnosis(self, path: str, request: Request) -> DiagnosisResponse:
        return DiagnosisResponse.model_validate(json_of(self._post(path, request)))

    def _act(self, campaign: int, act: str, request: Request) -> CampaignResponse:
        return CampaignResponse.model_validate(json_of(self._post(f"/api/campaigns/{campaign}/{act}", request)))

    def _post(self, path: str, request: Request) -> httpx.Response:
        return self._connection.request("POST", path, json=request.model_dump(mode="json", exclude_unset=True))

    def _events(self, campaign: int, after: int) -> Iterator[EventResponse | CampaignResponse]:
        """Yield the updates of one connection to the event stream."""
        path = f"/api/campaigns/{campaign}/events"
        headers = {"Last-Event-ID": str(after)} if after else {}
        with connect_sse(self._connection.http, "GET", path, headers=headers, timeout=SILENT_S) as source:
            if source.response.is_error:
                source.response.read()
                raise refusal(source.response)
            yield from map(_update, source.iter_sse())


def _update(event: ServerSentEvent) -> EventResponse | CampaignResponse:
    kind = CampaignResponse if event.event == "progress" else EventResponse
    return kind.model_validate_json(event.data)


def _warning(field: str) -> str:
    """Return the text of a `Warning` field as the service writes it (RFC 7234, 5.5): 299 agent "text"."""
    match = re.fullmatch(r'299 \S+ "((?:[^"\\]|\\.)*)"', field)
    return re.sub(r"\\(.)", r"\1", match[1]) if match else field


def _withdrawn(what: str, notice: Withdrawn, content: bytes | None = None) -> CalibrationWithdrawn:
    text = f"{what} must not be used: {notice.text}; fetch the version in force, or have the unit calibrated again"
    return CalibrationWithdrawn(text, notice, content)
