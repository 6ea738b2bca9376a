"""Units and their calibrations: fetched, checked, fitted, and compared with their data."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from datetime import datetime

import httpx

from labctl.answers.calibrations import CalibrationRow, FitRequest, FitResponse
from labctl.answers.certification import CalibrationStateResponse
from labctl.answers.common_fields import CriticismVerdict
from labctl.answers.units import UnitResponse, UnitState
from labctl.calibration import Calibration, read_calibration
from labctl.calibration.certification import warn
from labctl.client.connection import ClientPart, part
from labctl.errors import CalibrationWithdrawn
from labctl.service_connection import query_string
from labctl.withdrawal import HEADER, Withdrawn, read_withdrawn


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


class CalibrationMethods(ClientPart):
    """Requests about units and their calibrations."""

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
        return self._connection.get(f"/api/units/{part(serial)}", UnitResponse)

    def calibrations(self, serial: str) -> list[CalibrationRow]:
        """Return every calibration version of a unit, newest first, with its errors in deg/s."""
        return self._connection.get_list(f"/api/units/{part(serial)}/calibrations", CalibrationRow)

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
        path = f"/api/units/{part(serial)}/calibration"
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
        path = f"/api/units/{part(serial)}/calibration/state"
        answer = self._connection.get(path, CalibrationStateResponse, calibration_hash=calibration_hash)
        if (gone := answer.withdrawn) is not None:
            notice = Withdrawn(gone.at, gone.by, gone.reason, gone.certificate)
            raise _withdrawn(f"calibration of {serial} version {answer.version}", notice)
        return answer

    def fit(self, serial: str, request: FitRequest | None = None) -> FitResponse:
        """Fit a model to a recording of a unit; the result is the unit's next calibration version."""
        path = f"/api/units/{part(serial)}/calibrations"
        return self._ask(path, request or FitRequest(), FitResponse)


def _warning(field: str) -> str:
    """Return the text of a `Warning` field as the service writes it (RFC 7234, 5.5): 299 agent "text"."""
    match = re.fullmatch(r'299 \S+ "((?:[^"\\]|\\.)*)"', field)
    return re.sub(r"\\(.)", r"\1", match[1]) if match else field


def _withdrawn(what: str, notice: Withdrawn, content: bytes | None = None) -> CalibrationWithdrawn:
    text = f"{what} must not be used: {notice.text}; fetch the version in force, or have the unit calibrated again"
    return CalibrationWithdrawn(text, notice, content)
