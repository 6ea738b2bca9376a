"""One thread accepts the callers at a Unix socket, and is woken to end: of the stops, and of the calls of a bench."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Generic, Protocol, TypeVar


class Caller(Protocol):
    """The connection to a caller."""

    def close(self) -> None:
        """Close it."""
        ...


CallerT = TypeVar("CallerT", bound=Caller)


class Acceptor(Generic[CallerT]):
    """Hands each caller that `accept` returns to `begin`, in the accepting thread, until it is closed.

    `accept` waits for the next caller at the socket `path`; where it raises OSError, that caller is gone.
    """

    def __init__(self, path: Path, name: str, accept: Callable[[], CallerT], begin: Callable[[CallerT], None]) -> None:
        self._path, self._next, self._begin = path, accept, begin
        self._over = False
        self._thread = threading.Thread(target=self._accept, name=name, daemon=True)

    def start(self) -> None:
        """Accept from now on."""
        self._thread.start()

    def close(self) -> None:
        """Accept no caller that comes from now on. Safe to call twice."""
        self._over = True
        with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as waker:
            waker.connect(str(self._path))  # a thread that waits for a caller gets this one
        if self._thread.is_alive():
            self._thread.join()

    def _accept(self) -> None:
        while not self._over:
            try:
                caller = self._next()
            except OSError:
                continue
            if self._over:
                caller.close()
                return
            self._begin(caller)
