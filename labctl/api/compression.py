"""Answers of the API travel compressed where the client takes it; files keep the bytes that their ETag stands for."""

from __future__ import annotations

import sys

import anyio.to_thread
from starlette.datastructures import Headers
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipResponder
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from labctl.web.assets import accepted_codings

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

#: A shorter answer fits into a network packet as it is.
MIN_COMPRESSED_BYTES = 1400
EVENTS = "text/event-stream"
#: Events of a computation: some stages, then a large answer. Those that go on for hours pass as they are.
ENDING_STREAMS = ("/criticism/events",)
#: Half the time of the highest level, for a twentieth more bytes.
COMPRESSION_LEVEL = 5
#: Of zstd: a third of the time of gzip. It finds what an answer says twice, however far apart (400 kB became 170 kB).
ZSTD_LEVEL = 6


class CompressionMiddleware:
    """Compresses by zstd, else by gzip, what has no strong ETag: that is of exactly the bytes sent (RFC 9110, 8.8.1).

    Server-sent events that go on, pictures and archives pass as they are; what is large is compressed in a thread.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        accepted = (
            accepted_codings(Headers(scope=scope).get("accept-encoding", "")) if scope["type"] == "http" else set()
        )
        if made := next((each for each in (_ZstdResponder, _Responder) if each.content_encoding in accepted), None):
            ends = scope["path"].endswith(ENDING_STREAMS)
            passing = tuple(kind for kind in DEFAULT_EXCLUDED_CONTENT_TYPES if not (ends and kind == EVENTS))
            responder = made(self._app, MIN_COMPRESSED_BYTES, COMPRESSION_LEVEL, exclude_content_types=passing)
            await responder(scope, receive, send)
        else:
            await self._app(scope, receive, send)


class _Responder(GZipResponder):
    """One answer; compressed unless it has a strong ETag."""

    _is_file = False

    async def send_with_compression(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            etag = Headers(raw=message["headers"]).get("etag")
            self._is_file = etag is not None and not etag.startswith("W/")
        if self._is_file:
            await self.send(message)
        else:
            await super().send_with_compression(message)


class _ZstdResponder(_Responder):
    """The same by zstd; each part of a stream can be read as soon as it is there."""

    content_encoding = "zstd"
    _frame: zstd.ZstdCompressor | None = None

    async def apply_compression(self, body: bytes, *, more_body: bool) -> bytes:
        if len(body) >= self.thread_minimum_size:
            return await anyio.to_thread.run_sync(self._compressed, body, more_body)
        return self._compressed(body, more_body)

    def _compressed(self, body: bytes, more_body: bool) -> bytes:
        self._frame = self._frame or zstd.ZstdCompressor(level=ZSTD_LEVEL)
        return self._frame.compress(body, self._frame.FLUSH_BLOCK if more_body else self._frame.FLUSH_FRAME)
