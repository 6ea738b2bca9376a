"""A small application behind the bounded HTTP protocol, on loopback, in a thread of this process."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import uvicorn
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from labctl.api.connection_limits import RESERVED, ConnectionLimits
from labctl.api.connection_table import ConnectionTable
from labctl.api.http_protocol import bounded_http
from tests.helpers.patience import WAIT_S

CHUNK = bytes(1 << 16)


@dataclass
class SmallApp:
    """Answers `/` at once, `/body` after the body, `/endless` without end; fails at `/mistake`."""

    left: threading.Event = field(default_factory=threading.Event)  #: a client of `/endless` is gone
    streams: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))  #: one for each that began
    sent: int = 0  #: bytes of `/endless`

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        message: Message = {"more_body": scope["path"] == "/body"}
        while message.get("more_body"):
            message = await receive()
        if scope["path"] == "/mistake":
            raise RuntimeError("a mistake of the program")
        if scope["path"] == "/endless":
            await send({"type": "http.response.start", "status": 200, "headers": []})
            await self._stream(receive, send)
            return
        text = b"reserved" if scope["state"][RESERVED] else b"fine"
        length = [(b"content-length", str(len(text)).encode())]
        await send({"type": "http.response.start", "status": 200, "headers": length})
        await send({"type": "http.response.body", "body": text})

    async def _stream(self, receive: Receive, send: Send) -> None:
        await receive()
        gone = asyncio.ensure_future(receive())
        self.streams.release()
        while not gone.done():
            await send({"type": "http.response.body", "body": CHUNK, "more_body": True})
            self.sent += len(CHUNK)
            await asyncio.sleep(0)
        self.left.set()


@dataclass
class BoundedServer:
    """The server that listens, its application and its connections."""

    app: SmallApp
    port: int
    table: ConnectionTable

    def connect(
        self, sent: bytes = b"", receive_buffer: int | None = None, address: str = "127.0.0.1"
    ) -> socket.socket:
        """Open a connection and send something."""
        client = socket.socket()
        client.settimeout(WAIT_S)
        if receive_buffer is not None:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        client.connect(("127.0.0.1", self.port))
        client.sendall(sent)
        return client

    def get(self) -> str:
        """Ask for `/` on a connection of its own; returns the body."""
        with self.connect(request("/", "Connection: close")) as client:
            return rest_of(client).decode().rpartition("\r\n\r\n")[2]


def request(path: str, *headers: str, method: str = "GET") -> bytes:
    """Return a request without its body."""
    return "\r\n".join([f"{method} {path} HTTP/1.1", "Host: here", *headers, "", ""]).encode()


def rest_of(client: socket.socket) -> bytes:
    """Read until the server closes; raises TimeoutError when it does not."""
    pieces = []
    try:
        while piece := client.recv(1 << 16):
            pieces.append(piece)
    except (ConnectionResetError, BrokenPipeError):
        pass
    return b"".join(pieces)


@contextmanager
def bounded_server(
    limits: ConnectionLimits,
    loop: str = "auto",
    *,
    log_level: str = "critical",
    within: Callable[[ASGIApp], ASGIApp] = lambda app: app,
) -> Iterator[BoundedServer]:
    """Serve the small application while the block runs; what uvicorn logs goes where the test has it go.

    `within` puts the application into another one.
    """
    app, ready, protocol = SmallApp(), threading.Event(), bounded_http(limits)

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready.set()

        async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
            await super().shutdown(sockets)
            while self.server_state.tasks:  # what it has cancelled ends, as it does while a lifespan ends
                await asyncio.sleep(0)

    with socket.create_server(("127.0.0.1", 0), backlog=limits.backlog) as listener:
        config = uvicorn.Config(
            within(app), http=protocol, ws="none", lifespan="off", log_config=None, log_level=log_level,
            proxy_headers=False, loop=loop, backlog=limits.backlog, timeout_keep_alive=limits.idle_s,
            timeout_graceful_shutdown=1,
        )  # fmt: skip
        server = Server(config)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            assert ready.wait(WAIT_S)
            yield BoundedServer(app, listener.getsockname()[1], protocol.table)
        finally:
            server.should_exit = True
            thread.join(WAIT_S)
