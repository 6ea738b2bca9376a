"""Answers of the API travel compressed where the client takes it; files keep the bytes that their ETag stands for."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipResponder
from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: A shorter answer fits into a network packet as it is.
MIN_COMPRESSED_BYTES = 1400
EVENTS = "text/event-stream"
ACCEPTED = b"accept-encoding"
#: Events of a computation: some stages, then a large answer. Those that go on for hours pass as they are.
ENDING_STREAMS = ("/criticism/events",)
#: Half the time of the highest level, for a twentieth more bytes.
COMPRESSION_LEVEL = 5


class CompressionMiddleware:
    """Compresses by gzip what has no strong ETag: that is of exactly the bytes that are sent (RFC 9110, 8.8.1).

    Server-sent events that go on, pictures and archives pass as they are; what is large is compressed in a thread.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] == "http" and any(b"gzip" in value for name, value in scope["headers"] if name == ACCEPTED):
            ends = scope["path"].endswith(ENDING_STREAMS)
            passing = tuple(kind for kind in DEFAULT_EXCLUDED_CONTENT_TYPES if not (ends and kind == EVENTS))
            responder = _Responder(self._app, MIN_COMPRESSED_BYTES, COMPRESSION_LEVEL, exclude_content_types=passing)
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
