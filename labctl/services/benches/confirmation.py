"""Benches that are not confirmed safe: the safe state is tried again until it is confirmed, and a person still looks.

Once labctl has confirmed the safe state, the attempts end, and a process no longer ends with a failure because of the
bench. That does not replace `labctl bench clear`: a link mostly comes back because a person put the cable in again, and
nothing may move on its own while that person stands at the table.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import closing, suppress
from logging import INFO, WARNING

from instruments.bench import open_bench
from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.acting_user import ITSELF, acting
from labctl.errors import LabctlError
from labctl.log import get_logger
from labctl.store import BenchRow, Store
from procedures.execution.safe_state import make_safe

log = get_logger()

#: From one attempt to the next.
RETRY_S = 30.0


def _always() -> bool:
    return True


class SafeStateRetry:
    """Tries the safe state of one bench again while that state is unconfirmed, no campaign runs on the bench, and
    it may be driven here.

    `guard` is held during an attempt: what else drives the bench waits for its end, at most some ten seconds.
    `is_idle` says, under that guard, whether the bench may be opened. A simulated bench ended with its process; there
    is nothing to be tried.
    """

    def __init__(
        self,
        store: Store,
        bench: BenchFile,
        make_clock: Callable[[], Clock],
        guard: threading.Lock | None = None,
        is_idle: Callable[[], bool] = _always,
    ) -> None:
        self._store, self._bench, self._make_clock = store, bench, make_clock
        self._guard = guard or threading.Lock()
        self._is_idle = is_idle
        self._unconfirmed = False  #: whether the safe state was unconfirmed when it was last read
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Try once now, then every `RETRY_S` in a thread, until `close`."""
        if self._bench.is_simulated:
            return
        self.attempt()
        self._thread = threading.Thread(target=self._watch, name=f"safe-state-{self._bench.name}", daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        while not self._over.wait(self._make_clock().wall_s(RETRY_S)):
            self.attempt()

    def end_soon(self) -> None:
        """Begin no further attempt before the last one; returns at once."""
        self._over.set()

    def close(self) -> None:
        """End the thread, and try a last time."""
        self.end_soon()
        if self._thread is not None:
            self._thread.join()
        self.attempt()

    def attempt(self) -> None:
        """Try the safe state once, without pauses, if it is unconfirmed. Raises nothing.

        What cannot be written does not keep the bench from being tried: it is written after the next attempt.
        """
        with self._guard:
            if not self._bench.is_simulated and self._is_idle() and self._is_unconfirmed():
                clock = self._make_clock()
                unconfirmed = self._try(clock)
                level = WARNING if unconfirmed else INFO
                log.log(level, "safe_state.retried", bench=self._bench.name, unconfirmed=unconfirmed)
                with acting(ITSELF), suppress(LabctlError):
                    self._store.benches.attempted(self._bench.name, unconfirmed, clock.utc())

    def _is_unconfirmed(self) -> bool:
        with suppress(LabctlError):  # a database that cannot be read: the last known state counts
            row = self._store.benches.get(self._bench.name)
            self._unconfirmed = row is not None and row.is_unconfirmed
        return self._unconfirmed

    def _try(self, clock: Clock) -> str:
        """Return what is not confirmed; empty when all is well."""
        complaints: tuple[str, ...] = ()
        try:
            with closing(open_bench(self._bench, clock)) as bench:
                complaints = make_safe(bench, clock, pauses_s=())
        except Exception as error:  # noqa: BLE001  whatever it is, the next attempt is made
            complaints = (*complaints, str(error) or type(error).__name__)
        return "; ".join(complaints)


def describe_safe_state(bench: str, unconfirmed: str) -> str:
    """Describe how a bench was left whose safe state was tried just now, and what to do where it is not confirmed."""
    if not unconfirmed:
        return f"bench {bench} is safe"
    return (
        f"bench {bench} is NOT confirmed safe: {unconfirmed}; inspect it, then `labctl bench clear {bench} --by NAME`"
    )


def describe_bench(row: BenchRow) -> str:
    """Describe the state of a bench and what a person has to do."""
    if row.confirmed_at is None:
        return describe_safe_state(row.name, row.unconfirmed)
    return (
        f"bench {row.name} was confirmed safe by labctl at {row.confirmed_at:%Y-%m-%d %H:%M:%S} UTC, attempt "
        f"{row.attempts}, after: {row.unconfirmed}; inspect the bench before anything moves, then `labctl bench clear "
        f"{row.name} --by NAME`"
    )
