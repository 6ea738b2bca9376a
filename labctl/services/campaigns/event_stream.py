"""Following a campaign: any number of clients, and the bench is polled once for all of them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Hashable
from typing import Any, TypeVar

from labctl.answers.campaigns import CampaignResponse, EventResponse
from labctl.services.campaigns.status import event_answer
from labctl.store import Store
from procedures.contracts.campaign_state import ENDED, CampaignState

#: An open event stream says that it is alive after this long without an event.
HEARTBEAT_S = 10.0
#: What changes all the time, as a unit's output does, is read this often.
LIVE_S = 1.0
#: Changes within this time are one to a client: a bench in virtual time reports hundreds a second.
MIN_S = 0.05
#: What one client received counts for the others this long, unless the bench rings.
FRESH_S = 0.5

Listen = Callable[[Callable[[], None]], Callable[[], None]]
T = TypeVar("T")


class StatusCache:
    """What many clients request at the same moment is queried once. A moment ends when the bench rings, and after
    FRESH_S."""

    def __init__(self) -> None:
        self._rung = 0
        self._moment: tuple[Any, ...] = ()
        self._found: dict[Hashable, asyncio.Future[Any]] = {}

    def ring(self) -> None:
        """Note that something has changed; called by the bench's thread."""
        self._rung += 1

    async def at(self, what: Hashable, look: Callable[[], T]) -> T:
        """Return what `look` finds now, in a thread of its own; `what` names it among all that is looked up."""
        loop = asyncio.get_running_loop()
        moment = (loop, self._rung, int(loop.time() / FRESH_S))
        if moment != self._moment:
            self._moment, self._found = moment, {}
        pending = self._found.get(what)
        if pending is None:
            pending = self._found[what] = asyncio.ensure_future(asyncio.to_thread(look))
        status: T = await asyncio.shield(pending)  # one who leaves does not end it for the others
        return status


class Bell:
    """Rung by the bench's thread, waited for by one client: it rings MIN_S after the first change."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._event = asyncio.Event()
        self._rung = False

    def ring(self) -> None:
        """Note that something has changed. Raises RuntimeError where the client's event loop has ended."""
        if not self._rung:
            self._rung = True
            self._loop.call_soon_threadsafe(self._loop.call_later, MIN_S, self._event.set)

    def clear(self) -> None:
        """Ring again at the next change: what has changed until now is about to be read."""
        self._event.clear()
        self._rung = False

    async def rings(self) -> bool:
        """Wait LIVE_S for a change; returns whether there was one."""
        try:
            await asyncio.wait_for(self._event.wait(), LIVE_S)
        except TimeoutError:
            return False
        return True


class CampaignEventStream:
    """Tells clients the status of campaigns."""

    def __init__(self, store: Store, status: Callable[[int], CampaignResponse], listen: Listen | None) -> None:
        self._store = store
        self._status = status
        self._listen = listen
        self._status_cache = StatusCache()
        if listen is not None:
            listen(self._status_cache.ring)  # first of all: a client that is woken reads anew

    async def follow(
        self, campaign: int, after: int, over: Callable[[], bool]
    ) -> AsyncIterator[EventResponse | CampaignResponse | None]:
        """Yield a campaign's events after number `after`, where it stands whenever that has changed, and None to show
        that the stream lives, until the campaign has ended and its drafts are made, or it is `over` for another reason,
        which is asked in a thread: it may wait for another process.

        A client that reads slowly gets the newest status next, never a queue of old ones; the bench only rings a bell,
        at most every MIN_S.
        """
        bell = Bell()
        last_sent: CampaignResponse | None = None
        stop = self._listen(bell.ring) if self._listen is not None else None
        try:
            while True:
                bell.clear()
                ends, updates = await self._updates(campaign, after, over)
                for event in updates:
                    after = event.id
                    yield event
                now = await self._now(campaign)
                if now != last_sent:
                    last_sent = now
                    yield now
                if ends:
                    return
                async for live in self._meanwhile(campaign, bell):
                    if live is None or live != last_sent:
                        last_sent = live or last_sent
                        yield live
        finally:
            if stop is not None:
                stop()

    async def _updates(self, campaign: int, after: int, over: Callable[[], bool]) -> tuple[bool, list[EventResponse]]:
        """Return whether the stream ends, by the state in the database, not that of the live picture, and the events
        that came before. A campaign that is done and still awaits a draft goes on.

        The last event is written before the state there ends, so that a client that sees the end has seen every event.
        """

        def look() -> tuple[bool, list[EventResponse]]:
            ends = over() or self._has_ended(campaign)
            return ends, [event_answer(row) for row in self._store.campaigns.events(campaign, after)]

        return await self._status_cache.at(("updates", campaign, after), look)

    def _has_ended(self, campaign: int) -> bool:
        state = self._store.campaigns.state(campaign)
        return state in ENDED and not (state is CampaignState.DONE and self._store.drafts.is_awaited(campaign))

    async def _now(self, campaign: int) -> CampaignResponse:
        return await self._status_cache.at(("now", campaign), lambda: self._status(campaign))

    async def _meanwhile(self, campaign: int, bell: Bell) -> AsyncIterator[CampaignResponse | None]:
        """Yield where a campaign stands until the bell rings, or until it is time to show that the stream lives."""
        for _ in range(round(HEARTBEAT_S / LIVE_S)):
            if await bell.rings():
                return
            yield await self._now(campaign)
        yield None
