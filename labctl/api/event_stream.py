"""Server-sent events as a response of the API, with the models of their data in its description."""

from __future__ import annotations

from fastapi.responses import StreamingResponse


class EventStream(StreamingResponse):
    """A response that goes on: events with a kind and one JSON document each; no cache keeps it."""

    media_type = "text/event-stream"
