"""What is answered while there is hardly room: acts and `/health` on the reserve, and a few uploads at once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive, Scope, Send

from instruments.clock import WallClock
from labctl.answers.admin import KeyRequest, Role
from labctl.api.access_policy import UPLOAD, AccessPolicy
from labctl.api.connection_limits import RESERVED
from labctl.api.middleware import MAX_UPLOADS, AccessMiddleware
from labctl.services.admin.api_keys import create_key
from labctl.services.lab_service import LabService
from labctl.store import open_store

Loop = Callable[[Coroutine[Any, Any, Any]], Any]
AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


class WaitingApp:
    """Answers 200 once it is let."""

    def __init__(self) -> None:
        self.go = asyncio.Event()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self.go.wait()
        await send({"type": "http.response.start", "status": 200, "headers": []})


@pytest.fixture
def service(tmp_path: Path) -> Iterator[LabService]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        yield LabService(store, WallClock())


async def answer(
    middleware: AccessMiddleware, method: str, path: str, key: str = "", reserved: bool = False, body: int = 0
) -> Any:
    """Return status and headers of the answer to a request."""
    headers = [(b"authorization", f"Bearer {key}".encode())] if key else []
    scope = {
        "type": "http", "method": method, "path": path, "query_string": b"", "headers": headers,
        "state": {RESERVED: reserved},
    }  # fmt: skip
    sent: list[Message] = []

    async def send(message: Message) -> None:
        sent.append(message)

    async def receive() -> Message:
        return {"type": "http.request", "body": b"x" * body, "more_body": False}

    await middleware(scope, receive, send)
    return sent[0]["status"], dict(sent[0]["headers"])


ABORT = "/api/campaigns/1/abort"


@pytest.mark.parametrize(
    ("role", "method", "path", "status"),
    [
        (Role.OPERATOR, "POST", ABORT, 200),
        (Role.APPROVER, "POST", ABORT, 200),
        (Role.VIEWER, "POST", ABORT, 403),
        (None, "POST", ABORT, 401),
        (None, "GET", "/health", 200),
        (Role.OPERATOR, "GET", "/api/campaigns/1/events", 503),
        (Role.OPERATOR, "GET", "/bench", 503),
        (Role.OPERATOR, "POST", "/api/plans", 503),
        (None, "GET", "/api/units", 401),
    ],
)
def test_the_reserve_is_for_operators_who_act(
    service: LabService, in_a_loop: Loop, role: Role | None, method: str, path: str, status: int
) -> None:
    key = create_key(service.store, KeyRequest(name="k", role=role), AT).key if role else ""

    async def ask(reserved: bool) -> Any:
        app = WaitingApp()
        app.go.set()
        return await answer(AccessMiddleware(app, service, AccessPolicy(keys=True)), method, path, key, reserved)

    found, headers = in_a_loop(ask(True))
    assert (found, headers.get(b"retry-after")) == (status, b"5" if status == 503 else None)
    assert in_a_loop(ask(False))[0] == (200 if status == 503 else status)


class ReadingApp(WaitingApp):
    """Reads one piece of a body, then waits."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await receive()
        await super().__call__(scope, receive, send)


def test_bodies_are_bounded_in_all(service: LabService, in_a_loop: Loop) -> None:
    async def ask() -> None:
        app = ReadingApp()
        middleware = AccessMiddleware(app, service, AccessPolicy(held_bytes=1000))
        first = [asyncio.ensure_future(answer(middleware, "POST", "/api/plans", body=500)) for _ in range(2)]
        await asyncio.sleep(0)  # each has begun
        with pytest.raises(HTTPException) as refused:
            await answer(middleware, "POST", "/api/plans", body=500)
        assert (refused.value.status_code, refused.value.headers) == (503, {"Retry-After": "5"})
        app.go.set()
        assert {status for status, _ in await asyncio.gather(*first)} == {200}
        for _ in range(5):
            assert (await answer(middleware, "POST", "/api/plans", body=500))[0] == 200

    in_a_loop(ask())


def test_few_recordings_come_at_once(service: LabService, in_a_loop: Loop) -> None:
    async def ask() -> None:
        app = WaitingApp()
        middleware = AccessMiddleware(app, service, AccessPolicy())
        first = [asyncio.ensure_future(answer(middleware, "POST", UPLOAD)) for _ in range(MAX_UPLOADS)]
        await asyncio.sleep(0)  # each has begun
        assert (await answer(middleware, "POST", UPLOAD))[0] == 503
        app.go.set()
        assert {status for status, _ in await asyncio.gather(*first)} == {200}
        assert (await answer(middleware, "POST", UPLOAD))[0] == 200

    in_a_loop(ask())
