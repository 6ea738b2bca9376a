"""No connection lasts or grows without an end, whatever its client does."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from time import monotonic

import pytest

from labctl.api.connection_limits import ConnectionLimits
from tests.helpers.bounded_server import BoundedServer, bounded_server, request, rest_of
from tests.helpers.patience import WAIT_S

SHORT = ConnectionLimits(header_s=0.4, stalled_s=0.6, idle_s=1, look_s=0.05, refused_s=0.3)
POST = request("/body", "Content-Length: 100", method="POST")


@pytest.fixture(params=["uvloop", "asyncio"])
def server(request: pytest.FixtureRequest) -> Iterator[BoundedServer]:
    with bounded_server(SHORT, request.param) as made:
        yield made


def sent_for_ever(client: socket.socket, piece: bytes, most: int) -> bytes:
    """Send a piece again and again until the server closes; returns its answer."""
    try:
        for _ in range(most // len(piece)):
            client.sendall(piece)
    except OSError:
        pass
    else:
        pytest.fail(f"{most} bytes were taken")
    return rest_of(client)


@pytest.mark.parametrize(
    "begun",
    [
        b"GET / HTTP/1.1\r\nX: ",
        b"GET /",
        b"GET / HTTP/1.1\r\n",
        b"",
        request("/body", "Transfer-Encoding: chunked", method="POST") + b"5\r\nhello\r\n0\r\nX: ",
        request("/body", "Transfer-Encoding: chunked", method="POST") + b"5;",
    ],
    ids=["value", "path", "name", "lines", "trailer", "extension"],
)
def test_a_header_that_never_ends_is_closed_with_64_kib(server: BoundedServer, begun: bytes) -> None:
    piece = b"\r\n" * 2048 if not begun else b"a" * 4096
    with server.connect(begun) as client:
        sent_for_ever(client, piece, 1 << 26)
    assert server.get() == "fine"


def test_headers_are_bounded_in_all_and_in_number(server: BoundedServer) -> None:
    wide = [f"X{number}: {'a' * 1000}" for number in range(70)]
    many = [f"X{number}: a" for number in range(200)]
    fits = [f"X{number}: {'a' * 1000}" for number in range(60)]
    for headers in (wide, many):
        with server.connect(request("/", *headers)) as client:
            answer = rest_of(client)
            assert answer.startswith(b"HTTP/1.1 431 Request Header Fields Too Large\r\n")
            assert b"larger than 65536 bytes, or more than 128" in answer
    with server.connect(request("/", "Connection: close", *fits)) as client:
        assert rest_of(client).startswith(b"HTTP/1.1 200")


def test_a_large_header_of_a_further_request_is_refused_too(server: BoundedServer) -> None:
    with server.connect(request("/")) as client:
        assert client.recv(1000).startswith(b"HTTP/1.1 200")
        client.sendall(request("/", "X: " + "a" * 70_000))
        assert b"HTTP/1.1 431" in rest_of(client)


@pytest.mark.parametrize("begun", [b"GET / HTTP/1.1\r\n", b"no request at all\r\n"])
def test_what_the_parser_has_refused_is_refused_once(
    server: BoundedServer, caplog: pytest.LogCaptureFixture, begun: bytes
) -> None:
    with server.connect(begun + b"X-A: a\r\n" * 30_000) as client:
        rest_of(client)
    assert server.get() == "fine"
    assert not [record for record in caplog.records if record.levelname == "ERROR"]


@pytest.mark.parametrize("sent", [b"", b"GET / HT", b"\r\n", request("/", "Connection: keep-alive") + b"GET"])
def test_headers_have_to_be_complete_in_time(server: BoundedServer, sent: bytes) -> None:
    with server.connect(sent) as client:
        answer = rest_of(client)
    assert (b" 408 " in answer) == (sent in {b"GET / HT", b"\r\n"})


def test_a_header_that_drips_has_no_more_time(server: BoundedServer) -> None:
    """Each byte follows a whole request of another client, so the drip goes on for as long as it is taken."""
    with server.connect(b"GET / HTTP/1.1\r\nX: ") as client:
        client.setblocking(False)
        answer = b""
        while not answer:
            assert server.get() == "fine"
            try:
                client.send(b"a")
                answer = client.recv(1000) or b"closed"
            except BlockingIOError:
                continue
            except OSError:
                answer = b"closed"
    assert answer == b"closed" or answer.startswith(b"HTTP/1.1 408 ")


def test_a_body_that_stalls_is_closed(server: BoundedServer) -> None:
    with server.connect(POST + b"half") as client:
        assert b"no part of the request's body arrived for 0.6 s" in rest_of(client)
    with server.connect(POST) as client:
        for _ in range(50):
            client.sendall(b"aa")
            assert server.get() == "fine"
        assert client.recv(1000).startswith(b"HTTP/1.1 200")


def test_a_kept_connection_is_closed_after_a_time(server: BoundedServer) -> None:
    with server.connect(request("/")) as client:
        assert rest_of(client).startswith(b"HTTP/1.1 200")
    early = request("/", "Content-Length: 4", method="POST")
    with server.connect(early) as client:  # answered before its body
        assert client.recv(1000).startswith(b"HTTP/1.1 200")
        client.sendall(b"body")
        rest_of(client)


def test_a_client_that_never_reads_is_cut_with_a_bounded_buffer(server: BoundedServer) -> None:
    with server.connect(request("/endless"), receive_buffer=4096):
        assert server.app.left.wait(WAIT_S)
    assert server.app.sent < 16 << 20  # most of it in the system's own buffers


@pytest.mark.slow
@pytest.mark.parametrize("loop", ["uvloop", "asyncio"])
def test_a_client_that_reads_slowly_is_not(loop: str) -> None:
    """It reads for longer than a client may stand still; a busy machine holds it up for less than that."""
    limits = replace(SHORT, stalled_s=2.0)
    with bounded_server(limits, loop) as server, server.connect(request("/endless"), receive_buffer=4096) as client:
        begun_s = monotonic()
        while monotonic() - begun_s < 1.2 * limits.stalled_s:
            assert client.recv(1 << 16)
            assert server.get() == "fine"
        assert not server.app.left.is_set()


def test_requests_sent_ahead_are_few(server: BoundedServer) -> None:
    with server.connect(request("/") * 5) as client:
        assert rest_of(client).count(b"HTTP/1.1 200") == 5
    with server.connect(request("/endless") + request("/") * 5000):
        assert server.app.left.wait(WAIT_S)


def test_another_protocol_is_answered_in_this_one(server: BoundedServer) -> None:
    upgrade = request("/", "Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Key: x")
    with server.connect(upgrade) as client:
        assert rest_of(client).startswith(b"HTTP/1.1 200")


FEW = replace(SHORT, total=8, local=6, reserve=2, header_s=WAIT_S, stalled_s=WAIT_S)


@pytest.mark.parametrize("half", [b"", b"GET / HTTP/1.1\r\nX: ", POST + b"half", request("/")])
def test_a_new_client_comes_in_and_the_oldest_that_waits_goes(half: bytes) -> None:
    with bounded_server(FEW) as server, ExitStack() as stack:
        clients = [stack.enter_context(server.connect(half)) for _ in range(60)]
        assert server.get() == "fine"
        for client in clients[:54]:
            rest_of(client)
        assert len(server.table) <= FEW.local


def test_what_is_being_answered_stays_and_the_reserve_takes_what_acts() -> None:
    with bounded_server(FEW) as server, ExitStack() as stack:
        for _ in range(FEW.local):
            stack.enter_context(server.connect(request("/endless")))
            assert server.app.streams.acquire(timeout=WAIT_S)
        assert server.get() == "reserved"
        for _ in range(20):
            stack.enter_context(server.connect(b"GET"))
        assert server.get() == "reserved"
        assert not server.app.left.is_set()
