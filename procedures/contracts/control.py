"""How another thread asks a running campaign to pause, go on or end. The engine polls it at least once a second."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, SimpleQueue


@dataclass(frozen=True)
class ControlRequest:
    """What is asked of the campaign at present."""

    pause: bool = False
    abort: bool = False
    resumable: bool = False  #: after an abort: the campaign is only interrupted and is to be resumed
    reason: str = ""


def _no_loss() -> str:
    return ""


class Control:
    """A request that any thread may read and change. An abort is final.

    `loss` returns why the bench may no longer be driven from here, and an empty text while it may. Only `poll` and
    `interrupt_if_lost` call it; reading `request` changes nothing.
    """

    def __init__(self, loss: Callable[[], str] = _no_loss) -> None:
        self._lock = threading.RLock()  # a signal handler may run in the thread that holds it
        self._request = ControlRequest()
        self._end: ControlRequest | None = None  # beside the lock: an abort waits for nothing
        self._heard = threading.Event()
        self._left_step = threading.Event()
        self._at_rest = threading.Event()
        self._ending = SimpleQueue[None]()  # of all, only its `put` may be called by a signal handler at any moment
        self._loss = loss
        self._driver: int | None = None  # thread that drives the bench
        self.hindrance = ""  #: what keeps the bench from its safe state, in words; empty while nothing does
        self.polls = 0  #: number of polls by the thread that drives the bench: it rises while the thread runs

    @property
    def request(self) -> ControlRequest:
        """The present request."""
        return self._end or self._request

    def poll(self) -> ControlRequest:
        """Interrupt the campaign if the bench may no longer be driven; returns the present request.

        For the thread that drives the bench.
        """
        self.polls += 1
        self._driver = threading.get_ident()
        if reason := self._loss():
            self.interrupt(reason)
        request = self.request
        if request.abort:
            self._heard.set()
        return request

    def ends_here(self) -> ControlRequest | None:
        """Return the request to end, in the thread that drives the bench, until it has left its step; else None.

        What waits inside a driver call asks this, so that a stop does not wait for the end of a ramp or a homing.
        """
        request = self._end
        if request is None or self._left_step.is_set() or threading.get_ident() != self._driver:
            return None
        self._heard.set()
        return request

    def leave_step(self) -> None:
        """Note that the thread that drives the bench makes it safe from now on: no wait of it is interrupted."""
        self._left_step.set()
        self._heard.set()
        self._ending.put(None)

    def note_heard(self) -> None:
        """Note that another thread has the bench and stops its table, in place of the one that drives it."""
        self._heard.set()

    def note_safe_state(self, hindrance: str, *, at_rest: bool) -> None:
        """Note how far the safe state is: what keeps it, and whether the table is confirmed to stand."""
        self.hindrance = hindrance
        if at_rest:
            self._at_rest.set()

    def is_at_rest(self, within_s: float) -> bool:
        """Wait until the table is confirmed to stand after a request to end, s of wall time; returns whether it is."""
        return self._at_rest.wait(within_s)

    def wait_for_end(self, within_s: float) -> bool:
        """Wait until the end was asked for, or the campaign has come to its end by itself, s of wall time.

        Returns whether either came.
        """
        try:
            self._ending.get(timeout=within_s)
        except Empty:
            return False
        self._ending.put(None)  # for who else waits
        return True

    def interrupt_if_lost(self) -> None:
        """Interrupt the campaign if the bench may no longer be driven, for a thread that does not drive the bench.

        The one that drives it polls, but not while it waits for its database.
        """
        if reason := self._loss():
            self.interrupt(reason)

    def has_left_step(self, within_s: float) -> bool:
        """Wait until what drives the bench makes it safe, s of wall time; returns whether it does.

        It may have heard of the end long before: what it writes down first may wait for a disk.
        """
        return self._left_step.wait(within_s)

    def is_heard(self, within_s: float) -> bool:
        """Wait until the thread that drives the bench has seen the abort, s of wall time; returns whether it has."""
        return self._heard.wait(within_s)

    def pause(self, reason: str = "requested by a person") -> None:
        """Ask to hold after the data set that is being taken; the environment is still recorded."""
        self._change(pause=True, reason=reason)

    def resume(self, reason: str = "requested by a person") -> None:
        """Ask to go on."""
        self._change(pause=False, reason=reason)

    def abort(self, reason: str = "requested by a person") -> None:
        """Ask for the end, now and in the safe state. Waits for no lock."""
        self._final(ControlRequest(abort=True, reason=reason))

    def interrupt(self, reason: str) -> None:
        """Ask to release the bench, now and in the safe state; the campaign is to be resumed."""
        self._final(ControlRequest(abort=True, resumable=True, reason=reason))

    def _final(self, request: ControlRequest) -> None:
        if self._end is None:
            self._end = request
            self._ending.put(None)

    def _change(self, *, pause: bool, reason: str) -> None:
        with self._lock:
            self._request = ControlRequest(pause=pause, reason=reason)
