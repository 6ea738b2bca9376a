"""Server-sent events as a response of the API, with the models of their data in its description."""

from __future__ import annotations

import asyncio

from fastapi.responses import StreamingResponse
from starlette.types import Send


class EventStream(StreamingResponse):
    """A response that goes on: events with a kind and one JSON document each; no cache keeps it.

    A server that ends cancels what still goes on. The response then ends as a whole one: a client sees the end of the
    stream and asks again, and no broken transfer.
    """

    media_type = "text/event-stream"

    async def stream_response(self, send: Send) -> None:
        """Send the events; see `StreamingResponse`."""
        try:
            await super().stream_response(send)
        except asyncio.CancelledError:
            await send({"type": "http.response.body", "body": b"", "more_body": False})
            raise
