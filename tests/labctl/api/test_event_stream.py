"""A stream of events ends as a whole response when its server or its client ends it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Any

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from labctl.api.connection_limits import ConnectionLimits
from labctl.api.event_stream import EventStream
from tests.helpers.bounded_server import bounded_server, request, rest_of

LAST_CHUNK = b"\r\n0\r\n\r\n"


async def lasting() -> AsyncIterator[bytes]:
    yield b"data: 1\n\n"
    await asyncio.Event().wait()  # until it is cancelled


def with_events(_: ASGIApp) -> ASGIApp:
    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        await EventStream(lasting())(scope, receive, send)

    return app


def test_a_server_that_ends_leaves_no_broken_transfer() -> None:
    with bounded_server(ConnectionLimits(), within=with_events) as server:
        client = server.connect(request("/events"))
        begun = b""
        while b"data: 1\n\n" not in begun:
            begun += client.recv(1 << 16)
    with client:
        assert (begun + rest_of(client)).endswith(LAST_CHUNK)


def test_a_client_that_leaves_ends_its_stream(in_a_loop: Callable[[Coroutine[Any, Any, Any]], Any]) -> None:
    ended = asyncio.Event()

    async def watched() -> AsyncIterator[bytes]:
        try:
            async for event in lasting():
                yield event
        finally:
            ended.set()

    async def leave() -> None:
        begun = asyncio.Event()

        async def receive() -> Message:
            await begun.wait()
            return {"type": "http.disconnect"}

        async def send(message: Message) -> None:
            if message.get("body"):
                begun.set()

        await EventStream(watched())({"type": "http"}, receive, send)
        assert ended.is_set()

    in_a_loop(leave())
