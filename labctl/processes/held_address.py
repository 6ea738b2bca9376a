"""The listening socket of a service, held by another process too, and the page that answers there in its place."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable

from labctl.log import get_logger
from labctl.stop.latch import StopRequest
from labctl.stop.page import BenchNow, PageAccess, StopPage
from labctl.stop.wire import Stopping

log = get_logger()


class HeldAddress:
    """One listening socket at most; any thread may use it."""

    def __init__(
        self, respond: Callable[[StopRequest], Stopping], describe: Callable[[], BenchNow], *, relays: bool = False
    ) -> None:
        """Answer stops with `respond`, and requests for the page with what `describe` says.

        With `relays` a web process will answer there again: what is no stop waits for it.
        """
        self._respond, self._describe, self._relays = respond, describe, relays
        self._guard = threading.Lock()
        self._listener: socket.socket | None = None
        self._page: StopPage | None = None

    def take(self, listener: socket.socket) -> None:
        """Hold a socket from now on, in place of the one before."""
        self.give_back()
        with self._guard:
            self._listener = listener

    def open_page(self, access: PageAccess) -> None:
        """Answer at the address from now on; nothing happens without a socket, or while the page is open."""
        with self._guard:
            if self._listener is None or self._page is not None:
                return
            self._page = StopPage(self._listener, access, self._respond, self._describe, relays=self._relays)
            self._page.start()
            log.warning("stop_page.opened", address="{}:{}".format(*self._listener.getsockname()[:2]))

    def close_page(self) -> None:
        """Leave the address to the process that serves there. Safe to call twice."""
        with self._guard:
            if self._page is not None:
                self._page.close()
                self._page = None
                log.info("stop_page.closed")

    def give_back(self) -> None:
        """Close page and socket: another service wants to listen there. Safe to call twice."""
        self.close_page()
        with self._guard:
            if self._listener is not None:
                self._listener.close()
                self._listener = None
