"""A number for every request, in its answer and in every record that it leads to; and one record of its end.

What acts is logged at INFO, what only reads at DEBUG: every open page asks once a second. What any client can send
without limit is bounded in number, and what is held back is counted.
"""

from __future__ import annotations

import logging
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from instruments.clock import Clock, SystemClock
from labctl.answers.admin import Role
from labctl.api.access_policy import role_needed
from labctl.log import get_logger
from labctl.log.context import begin_request, new_request_id
from labctl.log.repetition import RepetitionLimit

log = get_logger()

REQUEST_ID = "X-Request-ID"
_REQUEST_ID = REQUEST_ID.lower().encode()
#: Records in ten minutes: of requests that were done, and of those that were refused, by status.
MAX_DONE, MAX_REFUSED = 300, 30
LONGEST_PATH = 200


@dataclass
class RequestFigures:
    """How many requests ended, by method and status; one status for each hundred."""

    ended: Counter[tuple[str, str]] = field(default_factory=Counter)
    held_back: int = 0  #: records that were not written, as there were enough of their kind


#: Methods that are counted by name; a client may invent others.
METHODS = frozenset({"GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE"})


class RequestLogMiddleware:
    """The outermost part of the application."""

    def __init__(self, app: ASGIApp, figures: RequestFigures, clock: Clock | None = None) -> None:
        self._app, self._figures, self._clock = app, figures, clock or SystemClock()
        self._done, self._refused = RepetitionLimit(MAX_DONE), RepetitionLimit(MAX_REFUSED)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, and say how it ended."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request_id = next((value for name, value in scope["headers"] if name == _REQUEST_ID), b"")
        number = new_request_id(request_id.decode("latin-1"))
        begin_request(number)
        status, begun_s = 0, self._clock.now_s()

        async def numbered(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                message["headers"] = [*message.get("headers", ()), (_REQUEST_ID, number.encode())]
            await send(message)

        try:
            await self._app(scope, receive, numbered)
        except Exception as error:  # the server logs it with its traceback, and with this request's number
            self._ended(scope, 500, begun_s, error=type(error).__name__)
            raise
        self._ended(scope, status, begun_s)

    def _ended(self, scope: Scope, status: int, begun_s: float, **fields: Any) -> None:
        method = scope["method"] if scope["method"] in METHODS else "other"
        self._figures.ended[method, f"{status // 100}xx" if status else "none"] += 1
        level, limit = self._level_of(scope, status)
        key = status if status >= 400 else 0
        if limit is not None and not limit.admits(key):
            self._figures.held_back += 1
            return
        if limit is not None and (before := limit.take_count(key)):
            fields["held_back"] = before
        if not log.is_enabled_for(level):
            return
        caller = scope.get("state", {}).get("caller")
        if caller is not None:
            fields = {"by": caller.name, "via": caller.via, **fields}
        client = scope.get("client")
        log.log(
            level, "request.ended", method=method, path=scope["path"][:LONGEST_PATH], status=status,
            took_s=round(self._clock.now_s() - begun_s, 3), client=client[0] if client else None, **fields,
        )  # fmt: skip

    def _level_of(self, scope: Scope, status: int) -> tuple[int, RepetitionLimit | None]:
        """Return the level of a request's record, and the bound on records of its kind; None: no bound."""
        if status >= 400:
            return (logging.ERROR if status >= 500 else logging.INFO), self._refused
        if role_needed(scope["method"], scope["path"]) is Role.VIEWER:
            return logging.DEBUG, None
        return logging.INFO, self._done
