"""Reads that many requests ask for at the same time, joined: those that come while a statement is under way are
answered by the next one.

A statement begins after each request that it answers, so none gets what was true before it asked. One request alone
waits for nothing; the more there are, the fewer statements each of them costs.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from itertools import islice
from typing import Any, Generic, TypeVar

KeyT = TypeVar("KeyT")
ValueT = TypeVar("ValueT")
#: Keys of one statement, at most.
MAX_JOINED = 64


class JointReads(Generic[KeyT, ValueT]):
    """Reads of one kind, for the requests of one event loop."""

    def __init__(self, read: Callable[[Sequence[KeyT]], Awaitable[Mapping[KeyT, ValueT]]]) -> None:
        """`read` returns what it finds of some keys; it is called once at a time."""
        self._read = read
        self._waiting: dict[KeyT, asyncio.Future[ValueT | None]] = {}
        self._reading: asyncio.Task[None] | None = None

    async def get(self, key: KeyT) -> ValueT | None:
        """Return what is read of a key from now on, None where there is nothing. Raises what `read` raises."""
        loop = asyncio.get_running_loop()
        waiting = self._waiting.get(key)
        if waiting is None:
            waiting = self._waiting[key] = loop.create_future()
            waiting.add_done_callback(_retrieved)
        if self._reading is None:
            self._reading = loop.create_task(self._read_on())
        return await asyncio.shield(waiting)  # another request may wait for it too

    async def _read_on(self) -> None:
        """Read until nothing more is asked for."""
        try:
            while self._waiting:
                joined = dict(islice(self._waiting.items(), MAX_JOINED))
                for key in joined:
                    del self._waiting[key]
                await self._answer(joined)
        finally:
            self._reading = None
            for waiting in self._waiting.values():  # the service ends
                waiting.cancel()
            self._waiting.clear()

    async def _answer(self, joined: Mapping[KeyT, asyncio.Future[ValueT | None]]) -> None:
        try:
            answers = await self._read(list(joined))
        except Exception as error:  # noqa: BLE001  it is raised in the requests
            for waiting in joined.values():
                if not waiting.done():
                    waiting.set_exception(error)
            return
        for key, waiting in joined.items():
            if not waiting.done():
                waiting.set_result(answers.get(key))


def _retrieved(waiting: asyncio.Future[Any]) -> None:
    """Take note of an error: every request that waited for it may have been cancelled."""
    if not waiting.cancelled():
        waiting.exception()
