"""The keys in force, from memory: a stop checks its key without a database, which may be what does not answer."""

from __future__ import annotations

import threading
from collections.abc import Callable

from labctl.errors import StoreError
from labctl.log import get_logger
from labctl.services.admin.api_keys import SCHEME, digest_of
from labctl.services.schemas.admin import Caller, Role
from labctl.store import Store

log = get_logger()

#: How often the keys are read again: for so long a stop is taken from a key that was just revoked, s.
READ_S = 2.0

#: Digest -> (name, role) of the keys in force.
Digests = dict[str, tuple[str, str]]


class KeyMemory:
    """The keys in force as they were when the database answered last."""

    def __init__(self, store: Store, on_change: Callable[[Digests], None] = lambda _: None) -> None:
        """`on_change` is called with the keys whenever they are others than before."""
        self._store, self._on_change = store, on_change
        self._digests: Digests = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._keep, name="keys", daemon=True)

    def start(self) -> None:
        """Read the keys now, then again and again in a thread. Raises StoreError."""
        self.read()
        self._thread.start()

    def read(self) -> None:
        """Read the keys. Raises StoreError."""
        found: Digests = {row.digest: (row.name, row.role) for row in self._store.keys.all() if row.revoked_at is None}
        if found != self._digests:
            self._digests = found
            self._on_change(found)

    def _keep(self) -> None:
        while not self._over.wait(READ_S):
            try:
                self.read()
            except (StoreError, OSError) as error:  # what was read last stays in force
                log.debug("keys.not_read", error=str(error))

    def caller_of(self, authorization: str) -> Caller | None:
        """Return whose key an Authorization header carries; None for one that is not known here."""
        scheme, _, key = authorization.partition(" ")
        found = self._digests.get(digest_of(key.strip())) if scheme.lower() == SCHEME else None
        return None if found is None else Caller(found[0], Role(found[1]), "key")

    def close(self) -> None:
        """End the thread."""
        self._over.set()
