"""The keys in force, from memory: a stop checks its key without a database, which may be what does not answer."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress

from labctl.answers.admin import Caller, Role
from labctl.errors import StoreError
from labctl.log import get_logger
from labctl.services.admin.api_keys import SCHEME, digest_of, unknown_key
from labctl.store import Store

log = get_logger()

#: How often the keys are read again: for so long a stop is taken from a key that was just revoked, s.
READ_S = 2.0
#: So long a request with an unknown key waits for the keys to be read again, as its key may be new, s.
NEW_KEY_S = 1.0

#: Digest -> (name, role) of the keys in force.
Digests = dict[str, tuple[str, str]]
_Waiting = tuple[asyncio.AbstractEventLoop, asyncio.Event]


class KeyMemory:
    """The keys in force as they were when the database answered last."""

    def __init__(self, store: Store, on_change: Callable[[Digests], None] = lambda _: None) -> None:
        """`on_change` is called with the keys whenever they are others than before."""
        self._store, self._on_change = store, on_change
        self._digests: Digests = {}
        self._over, self._wanted = threading.Event(), threading.Event()
        self._waiting: set[_Waiting] = set()
        self._thread = threading.Thread(target=self._keep, name="keys", daemon=True)

    def start(self) -> None:
        """Read the keys now, then again and again in a thread. Raises StoreError."""
        self.read()
        self._thread.start()

    def read(self) -> None:
        """Read the keys. Raises StoreError."""
        digests: Digests = {
            row.digest: (row.name, row.role) for row in self._store.keys.all() if row.revoked_at is None
        }
        if digests != self._digests:
            self._digests = digests
            self._on_change(digests)

    def _keep(self) -> None:
        while not self._over.is_set():
            self._wanted.wait(READ_S)
            self._wanted.clear()
            waiting = tuple(self._waiting)
            try:
                self.read()
            except (StoreError, OSError) as error:  # what was read last stays in force
                log.debug("keys.not_read", error=str(error))
            for loop, read in waiting:
                with suppress(RuntimeError):  # the loop has ended
                    loop.call_soon_threadsafe(read.set)

    async def caller_of(self, authorization: str) -> Caller:
        """Return whose key an Authorization header carries, within `NEW_KEY_S` also where the database is frozen.

        Raises NotIdentified for a key that is not in force.
        """
        known_caller = self._known(authorization)
        if known_caller is None:
            await self._read_again()
            known_caller = self._known(authorization)
        if known_caller is None:
            raise unknown_key()
        return known_caller

    def _known(self, authorization: str) -> Caller | None:
        scheme, _, key = authorization.partition(" ")
        known_key = self._digests.get(digest_of(key.strip())) if scheme.lower() == SCHEME else None
        return None if known_key is None else Caller(known_key[0], Role(known_key[1]), "key")

    async def _read_again(self) -> None:
        """Wait until the thread has read the keys once more, however many requests wait for that, or `NEW_KEY_S`."""
        waiting = asyncio.get_running_loop(), asyncio.Event()
        self._waiting.add(waiting)
        self._wanted.set()
        try:
            with suppress(TimeoutError):
                await asyncio.wait_for(waiting[1].wait(), NEW_KEY_S)
        finally:
            self._waiting.discard(waiting)

    def close(self) -> None:
        """End the thread."""
        self._over.set()
        self._wanted.set()
