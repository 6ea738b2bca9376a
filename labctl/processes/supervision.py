"""How a bench process and its supervisor hear of each other."""

from __future__ import annotations

import contextlib
import os
import socket
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle
from typing import Literal

from labctl.errors import Conflict, StoreError
from labctl.log import get_logger
from labctl.processes.documents import BadDocument, Form, answer, receive
from labctl.processes.held_address import HeldAddress
from labctl.processes.liveness import Elapsed, Silence
from labctl.processes.settings import BenchSettings
from labctl.processes.waker import Waker
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.benches.lease import this_machine
from labctl.store import ServiceAddress, Store

log = get_logger()

#: What a supervisor says; `listener` comes with the socket that the service listens at.
SupervisorWord = Literal["listener", "begin", "end", "beat"]
SAID_BY_SUPERVISOR: Form[SupervisorWord] = Form(SupervisorWord, "what the supervisor says")
#: What a bench process says once a second, the second one while its table is known to stand; at its end, how the bench
#: was left.
BenchWord = Literal["beat", "at rest"] | BenchLeft
SAID_BY_BENCH: Form[BenchWord] = Form(BenchWord, "what the bench process says")

BEAT_S = 1.0
#: A supervisor that says nothing for so long guards nothing, s; on a busy computer so much longer at most.
SILENT_S, EXCUSED_S = 2.0, 10.0


class Supervision:
    """The bench process's side: one supervisor at a time, or none."""

    def __init__(
        self,
        settings: BenchSettings,
        store: Store,
        waker: Waker,
        is_stuck: Callable[[], bool],
        address: HeldAddress,
        is_at_rest: Callable[[], bool] = lambda: True,
        on_charge: Callable[[BenchSettings], None] = lambda _: None,
        on_end: Callable[[], None] = lambda: None,
    ) -> None:
        """`is_stuck`: whether this process lives and its engine does not; then no beat is sent, and it is replaced.

        A supervisor sends its listening socket, which `address` holds. Each beat says whether the table is known to
        stand (`is_at_rest`). `on_charge` is called with the settings of every supervisor that takes charge, `on_end`
        at once when it asks for the end: the main thread may be waiting for a disk.
        """
        self._settings, self._store, self._waker = settings, store, waker
        self._is_stuck, self._is_at_rest, self._on_charge, self._on_end = is_stuck, is_at_rest, on_charge, on_end
        self._address = address
        self._guard = threading.Lock()
        self._line: Connection | None = None
        self._alone = Elapsed()
        self._heard: Silence | None = None
        self.begin = False  #: whether a supervisor has said that the bench may be used

    @property
    def alone_s(self) -> float:
        """For how long there has been no supervisor, s."""
        return 0.0 if self._line is not None else self._alone.s

    @property
    def is_unguarded(self) -> bool:
        """Whether there is no supervisor, or one that has fallen silent."""
        heard = self._heard
        return self._line is None or (heard is not None and heard.s > SILENT_S)

    def take_charge(self, wanted: BenchSettings, line: Connection) -> None:
        """Obey a supervisor from now on. Raises Conflict while there is another, or for another bench."""
        with self._guard:
            if self._line is not None:
                raise Conflict(
                    f"the service at {self._settings.url} controls this bench process; stop that service first"
                )
            if wanted.drives != self._settings.drives:
                present = self._settings
                raise Conflict(
                    f"a bench process whose service has ended still drives bench {present.bench} at speed "
                    f"{present.speed:g} and uses this database; start the service with the same --bench, "
                    "--speed and --simulated-start, or stop that process"
                )
            self._line = line
            self._heard = Silence(wanted.guardian_pid, EXCUSED_S) if wanted.guardian_pid else None
        self._settings = wanted
        self._store.note_address(ServiceAddress(wanted.url, str(wanted.folder)))
        with contextlib.suppress(StoreError):  # a hint for other processes; a stop does not need it
            self._store.leases.note_address(this_machine(), os.getpid())
        self._address.close_page()
        self._on_charge(wanted)
        threading.Thread(target=self._hear, args=(line,), name="supervisor", daemon=True).start()
        threading.Thread(target=self._beat, args=(line,), name="beat", daemon=True).start()

    @property
    def settings(self) -> BenchSettings:
        """What the supervisor that is in charge, or was last, wants."""
        return self._settings

    def _hear(self, line: Connection) -> None:
        with contextlib.suppress(EOFError, OSError):
            while (message := self._said(line)) is not None:
                if self._heard is not None:
                    self._heard.restart()
                if message == "listener":
                    self._address.take(socket.socket(fileno=recv_handle(line)))
                elif message == "begin":
                    self.begin = True
                    self._waker.wake()
                elif message == "end":
                    self._on_end()
                    self._waker.end()
        self._let_go(line)

    @staticmethod
    def _said(line: Connection) -> SupervisorWord | None:
        """Return the next word of a supervisor, None where what it sent is none: it is then in charge no longer."""
        try:
            return SAID_BY_SUPERVISOR.decode(receive(line))
        except BadDocument as error:
            log.warning("supervisor.refused", error=str(error))
            line.close()
            return None

    def _beat(self, line: Connection) -> None:
        never = threading.Event()
        with contextlib.suppress(OSError):
            line.send_bytes(answer(SAID_BY_BENCH, "beat"))  # that it is in charge
            while self._line is line:
                never.wait(BEAT_S)
                if not self._is_stuck():
                    line.send_bytes(answer(SAID_BY_BENCH, "at rest" if self._is_at_rest() else "beat"))

    def _let_go(self, line: Connection) -> None:
        with self._guard:
            if self._line is line:
                self._line = None
                self._alone.restart()

    def say_left(self, left: BenchLeft) -> None:
        """Tell the supervisor, if there is one, how the bench was left."""
        line, self._line = self._line, None
        if line is not None:
            with contextlib.suppress(OSError):
                line.send_bytes(answer(SAID_BY_BENCH, left))
