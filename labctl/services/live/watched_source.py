"""A source that others may end: a person over HTTP, a stop, the end of the service, the page that went away."""

from __future__ import annotations

from instruments.clock import Clock
from labctl.fitting.live import PoseRequest
from labctl.recording import RecordingInfo
from labctl.services.live.source import Block, LiveSource, StreamEnded


class EndingSource:
    """A source that ends before its next block once it was asked to, or was not watched for too long."""

    def __init__(self, source: LiveSource, clock: Clock, unwatched_s: float | None) -> None:
        """`clock` is that of the service; `unwatched_s`: it ends without a watcher for so long; None: it does not."""
        self._source, self._watch_clock, self._unwatched_s = source, clock, unwatched_s
        self._why = ""
        self._watched_s = clock.now_s()
        self.name, self.serial, self.is_simulated = source.name, source.serial, source.is_simulated
        self.clock = source.clock

    def end(self, why: str) -> None:
        """End it before its next block; the first reason counts. Returns at once."""
        self._why = self._why or why

    def watched(self) -> None:
        """Note that a page follows it now."""
        self._watched_s = self._watch_clock.now_s()

    def start(self) -> RecordingInfo:
        """Open the stream."""
        return self._source.start()

    def read(self, duration_s: float) -> Block:
        """Return the next block. Raises StreamEnded where it is to end, and what the source raises."""
        unwatched_s = self._watch_clock.now_s() - self._watched_s
        if self._unwatched_s is not None and unwatched_s > self._unwatched_s:
            self.end(f"no page had followed it for {self._unwatched_s:.0f} s, and it was to end then")
        if self._why:
            raise StreamEnded(self._why, "interrupted")
        return self._source.read(duration_s)

    def ask(self, request: PoseRequest | None) -> None:
        """Pass on what the person is asked for."""
        self._source.ask(request)

    def stop(self) -> None:
        """Close the stream."""
        self._source.stop()
