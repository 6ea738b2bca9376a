"""Answers travel compressed where the client takes it, and files keep the bytes that their ETag stands for."""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Callable
from typing import Protocol

import httpx
import pytest
from backports import zstd
from fastapi import FastAPI, Response
from starlette.responses import StreamingResponse
from starlette.testclient import TestClient

from labctl.api.compression import CompressionMiddleware
from labctl.api.routers import effects

ROWS = [{"serial": f"A{number}", "rate_dps": number / 7} for number in range(500)]
BODY = json.dumps(ROWS).encode()


class Unpacking(Protocol):
    def decompress(self, part: bytes, /) -> bytes: ...


def events() -> StreamingResponse:
    return StreamingResponse(iter(["data: 1\n\n"] * 500), media_type="text/event-stream")


@pytest.fixture
def client() -> TestClient:
    app = FastAPI()
    app.add_middleware(CompressionMiddleware)
    app.add_api_route("/rows", lambda: ROWS)
    app.add_api_route("/short", lambda: ROWS[:2])
    app.add_api_route(
        "/file", lambda: Response(BODY, media_type="application/json", headers={"ETag": '"1"'}), methods=["GET"]
    )
    app.add_api_route("/events", events)
    app.add_api_route("/criticism/events", events)
    return TestClient(app)


def sent(client: TestClient, path: str, accepted: str) -> tuple[httpx.Headers, bytes]:
    """Return the headers of an answer and the bytes that travelled."""
    with client.stream("GET", path, headers={"accept-encoding": accepted}) as answer:
        return answer.headers, b"".join(answer.iter_raw())


@pytest.mark.parametrize(
    ("accepted", "coding", "unpack"),
    [
        ("gzip, deflate, br, zstd", "zstd", zstd.decompress),
        ("gzip, deflate", "gzip", gzip.decompress),
        ("gzip, zstd;q=0", "gzip", gzip.decompress),
    ],
)
def test_an_answer_is_compressed_for_a_client_that_takes_it(
    client: TestClient, accepted: str, coding: str, unpack: Callable[[bytes], bytes]
) -> None:
    headers, raw = sent(client, "/rows", accepted)
    assert headers["content-encoding"] == coding
    assert headers["vary"] == "Accept-Encoding"
    assert int(headers["content-length"]) == len(raw) < len(BODY) / 3
    assert json.loads(unpack(raw)) == ROWS


@pytest.mark.parametrize(("path", "accepted"), [("/rows", "identity"), ("/short", "gzip"), ("/file", "gzip")])
def test_what_gains_nothing_or_is_a_file_passes_as_it_is(client: TestClient, path: str, accepted: str) -> None:
    headers, raw = sent(client, path, accepted)
    assert "content-encoding" not in headers
    assert json.loads(raw) == ROWS[: len(json.loads(raw))]


@pytest.mark.parametrize(
    ("coding", "unpack"), [("gzip", zlib.decompressobj(16 + zlib.MAX_WBITS)), ("zstd", zstd.ZstdDecompressor())]
)
def test_events_that_end_with_an_answer_are_compressed_and_sent_one_by_one(
    client: TestClient, coding: str, unpack: Unpacking
) -> None:
    with client.stream("GET", "/criticism/events", headers={"accept-encoding": coding}) as answer:
        assert answer.headers["content-encoding"] == coding
        raw = list(answer.iter_raw())
    events = [unpack.decompress(part) for part in raw]
    assert b"".join(events) == b"data: 1\n\n" * 500
    assert events[0].startswith(b"data: 1\n\n"), "the first event is there before the last is made"


def test_events_are_sent_one_by_one(client: TestClient) -> None:
    headers, raw = sent(client, "/events", "gzip")
    assert "content-encoding" not in headers
    assert raw == b"data: 1\n\n" * 500


def test_the_catalogue_is_sent_once_and_compressed() -> None:
    """A weak ETag is of the content, not of its bytes: it may travel compressed."""
    app = FastAPI()
    app.add_middleware(CompressionMiddleware)
    app.include_router(effects.router)
    client = TestClient(app)
    first = client.get("/api/effects", headers={"Accept-Encoding": "gzip"})
    assert first.headers["Content-Encoding"] == "gzip"
    assert first.headers["Cache-Control"] == "no-cache"
    assert first.headers["ETag"].startswith('W/"')
    again = client.get("/api/effects", headers={"If-None-Match": first.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert client.get("/api/effects", headers={"If-None-Match": 'W/"other"'}).json() == first.json()
