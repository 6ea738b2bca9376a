"""Following a live calibration: any number of clients, and its process is asked once for all of them."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable

from labctl.answers.live import LiveStateResponse
from labctl.services.campaigns.event_stream import HEARTBEAT_S, LIVE_S, Bell, Listen, StatusCache

#: A session in one of these goes on.
GOES_ON = ("running", "storing")


class LiveEventStream:
    """Tells clients how the live calibration stands."""

    def __init__(self, state: Callable[[], LiveStateResponse], listen: Listen) -> None:
        """`state` returns the state, and notes that it is watched."""
        self._state, self._listen = state, listen
        self._cache = StatusCache()
        listen(self._cache.ring)  # first of all: a client that is woken reads anew

    async def follow(
        self, first: LiveStateResponse, over: Callable[[], bool]
    ) -> AsyncIterator[LiveStateResponse | None]:
        """Yield the state, `first` and whenever it has changed, and None to show that the stream lives, until it ends.

        A client that reads slowly gets the newest state next, never a queue of old ones.
        """
        bell, silent_s = Bell(), 0.0
        last_sent: LiveStateResponse | None = None
        now = first
        stop = self._listen(bell.ring)
        try:
            while True:
                if now != last_sent:
                    last_sent, silent_s = now, 0.0
                    yield now
                if now.stage not in GOES_ON or over():
                    return
                if not await bell.rings():
                    silent_s += LIVE_S
                if silent_s >= HEARTBEAT_S:
                    silent_s = 0.0
                    yield None
                bell.clear()
                now = await self._cache.at("live", self._state)
        finally:
            stop()
