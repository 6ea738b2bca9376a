"""A calibration as an HTTP answer, and the short way to the one in force: the request that a service gets most."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from fastapi import Response
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.types import ASGIApp, Receive, Scope, Send

from labctl.answers.admin import Caller
from labctl.api.problems import as_problem
from labctl.errors import LabctlError
from labctl.services.calibrations.fetch_log import ANONYMOUS
from labctl.services.calibrations.served import CalibrationFile, calibration_file, own_file
from labctl.services.lab_service import LabService

#: Header of what an exported file does not carry.
LOST = "X-Labctl-Lost"


@dataclass(frozen=True)
class CalibrationRequest:
    """Which calibration a request asks for, in which form, and who asks."""

    serial: str
    method: str
    caller: Caller
    known_etags: str | None = None  #: the header If-None-Match
    version: int | None = None
    format: str = "json"
    options: Sequence[str] = ()


async def calibration_answer(service: LabService, request: CalibrationRequest) -> Response:
    """Return a calibration as a file, or status 304 where the caller has it; notes who fetched it. Raises LabctlError.

    What is in force, and whether it was withdrawn, is read from the database for each request.
    """
    file = await _file(service, request)
    now = service.clock.utc()
    headers = file.headers(now)
    is_known = request.known_etags and f'"{file.etag}"' in request.known_etags
    if is_known:
        answer = Response(status_code=304, headers=headers)
    else:
        answer = Response(file.content, headers=headers, media_type=file.media_type)
    for loss in file.losses:
        answer.headers.append(LOST, loss.text)
    who = request.caller.name if request.caller.via == "key" else ANONYMOUS
    if request.method == "GET" and service.fetches.note(file.serial, file.version, who, now):
        answer.background = BackgroundTask(service.fetches.write)
    return answer


async def _file(service: LabService, request: CalibrationRequest) -> CalibrationFile:
    # JSON from a file is a point read of tens of microseconds: it runs in the event loop, without a switch to a thread
    is_own = request.format == "json" and not request.options
    if is_own and not service.store.is_shared:
        return calibration_file(service.store, request.serial, request.version, request.format)
    if is_own and request.version is None:
        served = await service.in_force.get(request.serial)
        if served is not None and served.act is not None:
            return own_file(request.serial, served.act.version, served)
    return await run_in_threadpool(  # it computes, or says why there is none
        calibration_file, service.store, request.serial, request.version, request.format, request.options
    )


class InForceMiddleware:
    """Answers what asks for a calibration in force as JSON, without a query: nothing of it has to be validated.

    The described route of the same path answers the same, in four times the time, and takes every other request. What
    this passes by changes no such answer: files keep the bytes of their ETag, so none is compressed, and only pages
    have the headers of pages.
    """

    _PATH = re.compile(r"/api/units/([^/]+)/calibration")
    _METHODS = frozenset({"GET", "HEAD"})

    def __init__(self, app: ASGIApp, service: LabService) -> None:
        self._app, self._service = app, service

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on."""
        serial = self._serial_of(scope)
        if serial is None:
            await self._app(scope, receive, send)
            return
        known_etags = next((value for name, value in scope["headers"] if name == b"if-none-match"), None)
        request = CalibrationRequest(
            serial, scope["method"], scope["state"]["caller"],
            None if known_etags is None else known_etags.decode("latin-1"),
        )  # fmt: skip
        try:
            answer = await calibration_answer(self._service, request)
        except LabctlError as error:
            answer = as_problem(error, scope["path"])
        await answer(scope, receive, send)

    def _serial_of(self, scope: Scope) -> str | None:
        """Return the serial number of a request of this kind; None for another."""
        if scope["type"] != "http" or scope["query_string"] or scope["method"] not in self._METHODS:
            return None
        match = self._PATH.fullmatch(scope["path"])
        return None if match is None else match[1]
