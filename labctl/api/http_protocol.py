"""uvicorn's HTTP protocol with bounds: on headers in size and time, on stalled bodies and readers, on connections.

The parser behind it (httptools) bounds nothing: a header that never ends is collected, piece after piece, without end.
uvicorn's own bounds are for its other parser, which is several times slower (`h11_max_incomplete_event_size`), or
count requests (`limit_concurrency`), or begin after a request (`timeout_keep_alive`): none ends a header that stands
still. So this module uses names of uvicorn that its documentation does not have. The tests list them
(tests/labctl/api/test_uvicorn_names.py), and pyproject.toml keeps uvicorn at the minor release that they are of.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from http import HTTPStatus
from typing import ClassVar, cast

from uvicorn.config import Config
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle
from uvicorn.server import ServerState

from labctl.api.connection_limits import RESERVED, ConnectionLimits
from labctl.api.connection_table import ConnectionTable, Phase, source_of
from labctl.api.problems import problem

TOO_LARGE, TIMED_OUT = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, HTTPStatus.REQUEST_TIMEOUT


class _Refused(Exception):
    """Ends the parser inside one of its callbacks."""


class BoundedHttpProtocol(HttpToolsProtocol):
    """One connection, of which no part lasts or grows without an end."""

    table: ClassVar[ConnectionTable]

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, object],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self.phase = Phase.HEADERS
        self.since = self.loop.time()
        self.source = ""
        self.reserved = False
        self._limits = self.table.limits
        self._received = 0  #: bytes since the parser understood something
        self._understood = False
        self._header_bytes = 0
        self._too_large = False
        self._refused = False
        self._unsent, self._taken_at = 0, self.since
        self._answered: RequestResponseCycle | None = None  #: the request that is being answered

    # Connection

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the connection in, or close it where there is no room."""
        super().connection_made(cast(asyncio.Transport, transport))
        self.source = source_of(self.client[0] if self.client else None)
        if not self.table.admit(self, self.loop):
            self.cut()

    def connection_lost(self, exc: Exception | None) -> None:
        """Release the connection's place, and tell the request that is being answered that its client is gone."""
        self.table.release(self)
        self._disconnect()
        super().connection_lost(exc)

    def _disconnect(self) -> None:
        """Tell the request that is being answered, which is not the newest where several were sent ahead."""
        if self._answered is not None and not self._answered.response_complete:
            self._answered.disconnected = True
            self._answered.message_event.set()

    def cut(self) -> None:
        """Close the connection at once, whatever has not been sent."""
        self.transport.abort()

    def check(self, now: float) -> None:
        """End the connection if its time is up."""
        waited = now - self.since
        if self._refused:
            if waited > self._limits.refused_s:
                self.cut()
        elif self._reader_stalled(now):
            self.cut()
        elif self.flow.read_paused or self.transport.is_closing():
            self.since = now  # nothing is awaited from the client
        elif self.phase is Phase.HEADERS and waited > self._limits.header_s:
            self._refuse(TIMED_OUT, f"the request's headers were not complete within {self._limits.header_s:g} s")
        elif self.phase is Phase.BODY and waited > self._limits.stalled_s:
            self._refuse(TIMED_OUT, f"no part of the request's body arrived for {self._limits.stalled_s:g} s")
        elif self.phase is Phase.IDLE and waited > self._limits.idle_s:
            self.transport.close()

    def _reader_stalled(self, now: float) -> bool:
        """Return whether the client has taken nothing off a full buffer, or off the last answer, for too long."""
        unsent = self.transport.get_write_buffer_size()
        waits = self.flow.write_paused or self.transport.is_closing()
        if not (waits and 0 < self._unsent <= unsent):
            self._taken_at = now
        self._unsent = unsent
        return now - self._taken_at > self._limits.stalled_s

    # What the client sends

    def data_received(self, data: bytes) -> None:
        """Take in a piece of what the client sends."""
        if self._refused:
            self._received += len(data)
            if self._received > self._limits.refused_bytes:
                self.cut()
            return
        if self.phase is Phase.IDLE:
            self._enter(Phase.HEADERS)
        elif self.phase is Phase.BODY:
            self.since = self.loop.time()
        self._understood = False
        super().data_received(data)
        if self._refused:  # by the parser
            return
        self._received = 0 if self._understood else self._received + len(data)
        if self._received > self._limits.header_bytes:
            self._refuse_headers()

    def on_message_begin(self) -> None:
        """Begin a request."""
        super().on_message_begin()
        self._header_bytes = 0
        if self.phase is not Phase.HEADERS:  # its time began with the connection, or with its first byte
            self._enter(Phase.HEADERS)

    def on_url(self, url: bytes) -> None:
        """Take in a piece of the request line."""
        super().on_url(url)
        self._count_header(len(url))

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take in a header, or a trailer of a body."""
        super().on_header(name, value)
        self._count_header(len(name) + len(value))

    def _count_header(self, size: int) -> None:
        self._header_bytes += size
        if self._header_bytes > self._limits.header_bytes or len(self.headers) > self._limits.headers:
            self._too_large = True
            raise _Refused

    def on_headers_complete(self) -> None:
        """Hand the request to the application."""
        if len(self.pipeline) >= self._limits.pipelined:
            raise _Refused
        self._understood = True
        self._enter(Phase.BODY)
        self.scope.setdefault("state", {})[RESERVED] = self.table.on_reserve(self)
        super().on_headers_complete()

    def _start_asgi_task(self, cycle: RequestResponseCycle, app: Callable[..., Awaitable[None]]) -> None:
        self._answered = cycle
        super()._start_asgi_task(cycle, app)

    def on_body(self, body: bytes) -> None:
        """Take in a piece of a body."""
        self._understood = True
        super().on_body(body)

    def on_message_complete(self) -> None:
        """Note that the request is whole."""
        self._understood = True
        self._enter(Phase.IDLE if self.cycle.response_complete else Phase.ANSWER)
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """Note that the answer is whole."""
        if self.phase is Phase.ANSWER and not self.pipeline:
            self._enter(Phase.IDLE)
        super().on_response_complete()

    def _enter(self, phase: Phase) -> None:
        self.phase, self.since = phase, self.loop.time()

    def _unsupported_upgrade_warning(self) -> None:
        """Log nothing: a request for another protocol is answered in this one."""

    # What is refused

    def send_400_response(self, msg: str) -> None:
        """Refuse what the parser could not read, or was kept from reading on."""
        if self._too_large:
            self._refuse_headers()
        else:
            self._refuse(HTTPStatus.BAD_REQUEST, msg)

    def _refuse_headers(self) -> None:
        limits = self._limits
        text = f"the request's headers are larger than {limits.header_bytes} bytes, or more than {limits.headers}"
        self._refuse(TOO_LARGE, text)

    def _refuse(self, status: HTTPStatus, text: str) -> None:
        """Answer with a problem document if nothing else is being answered, and close."""
        cycle = self.cycle
        answering = cycle is not None and not cycle.response_complete
        is_of_request = self.phase is Phase.BODY and not self.pipeline
        silent = self.phase is Phase.HEADERS and self._received == 0 and status is TIMED_OUT
        if silent or (answering and not (is_of_request and not cycle.response_started)):
            self.cut()
            return
        self._disconnect()
        self._refused, self.since = True, self.loop.time()
        body = bytes(problem(status, f"http-{status}", status.phrase, text, "").body)
        head = (
            f"HTTP/1.1 {status} {status.phrase}\r\ncontent-type: application/problem+json\r\n"
            f"content-length: {len(body)}\r\nconnection: close\r\n\r\n"
        )
        self.transport.write(head.encode() + body)
        with contextlib.suppress(OSError, RuntimeError):  # the client has left
            self.transport.write_eof()


def bounded_http(limits: ConnectionLimits) -> type[BoundedHttpProtocol]:
    """Return the protocol of one server, whose connections share these limits."""

    class LimitedHttpProtocol(BoundedHttpProtocol):
        table = ConnectionTable(limits)

    return LimitedHttpProtocol
