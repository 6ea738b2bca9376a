"""The lease on a bench: one bench, one campaign. Between processes only wall-clock time counts, never campaign time.

A holder renews every `RENEW_S`. When it could not for `STOP_S`, or another process has taken the bench, the control of
its campaign interrupts: the engine polls the control before each step and once a second, so the table is at rest before
the lease ends after `TERM_S` and another process may take the bench. The campaign is to be resumed.

Clocks of two computers differ and may jump. A lease that seems to have ended is therefore taken only after a whole term
in which its beat did not change, by this process's monotonic clock; a lease whose written expiry is not over yet is
not even watched.
"""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime, timedelta
from pathlib import Path
from uuid import uuid4

from instruments.bench_config import BenchFile
from instruments.clock import Clock, WallClock
from labctl.errors import BenchBusy, Conflict, LabctlError
from labctl.log import get_logger
from labctl.services.benches.power_failure import boot_id
from labctl.store import LeaseRow, Store, open_store
from labctl.store.connection.database import Database
from procedures.contracts.control import Control

log = get_logger()

TERM_S = 120.0
RENEW_S = 10.0
STOP_S = 60.0

#: Leases that this process holds.
_HELD_HERE: set[str] = set()


class BenchHold:
    """This process's hold on one bench. `take` and `renew` are for one thread at a time, `held` is for any."""

    def __init__(self, store: Store, bench_name: str, clock: Clock) -> None:
        self._store, self._bench, self._clock = store, bench_name, clock
        self._owner = uuid4().hex
        self._renewed_s: float | None = None
        self._why_lost = ""
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def held(self) -> bool:
        """Whether the bench may be driven now."""
        renewed_s = self._renewed_s
        return renewed_s is not None and self._clock.now_s() - renewed_s < STOP_S

    @property
    def why_not(self) -> str:
        """Why the bench may not be driven."""
        return self._why_lost or f"its reservation of the bench could not be renewed for {STOP_S:g} s"

    def check(self) -> None:
        """Raise BenchBusy when the bench may not be driven."""
        if not self.held:
            raise BenchBusy(f"this process may not drive bench {self._bench}: {self.why_not}")

    def take(self) -> None:
        """Take the bench. Raises Conflict naming the holder; waits a term for one that may be dead."""
        holder = self._store.leases.holder(self._bench)
        if holder is not None and not self._gone(holder):
            raise Conflict(f"{described(holder)}; wait until that process ends, or stop that process")
        begun_s, now = self._clock.now_s(), self._clock.utc()
        mine = LeaseRow(
            self._bench, self._owner, socket.gethostname(), this_machine(), os.getpid(), since=now,
            beat=1 if holder is None else holder.beat + 1, beat_at=now, expires_at=now + timedelta(seconds=TERM_S),
            url=self._store.leases.address.url, calls=self._store.leases.address.calls,
        )  # fmt: skip
        if not self._store.leases.claim(mine, replacing=holder):
            raise Conflict(f"bench {self._bench}: another process has just reserved the bench; try again")
        _HELD_HERE.add(self._owner)
        self._renewed_s, self._why_lost = begun_s, ""
        log.info("lease.taken", bench=self._bench, instead_of="" if holder is None else described(holder))

    def _gone(self, lease: LeaseRow) -> bool:
        """Return whether a holder can no longer drive the bench."""
        if lease.owner in _HELD_HERE:
            return False
        if self._store.is_sole_writer or _is_dead(lease):
            return True
        now = self._clock.utc()
        # An expiry further ahead than a lease lasts was written by a clock that is wrong.
        if now < lease.expires_at <= now + timedelta(seconds=2 * TERM_S):
            return False
        return self._is_silent(lease)

    def _is_silent(self, lease: LeaseRow) -> bool:
        """Watch a lease for a term; returns whether it stayed as it was."""
        until_s = self._clock.now_s() + TERM_S
        while self._clock.now_s() < until_s:
            self._clock.sleep(RENEW_S)
            if self._over.is_set():
                return False
            holder = self._store.leases.holder(self._bench)
            if holder is not None and (holder.owner, holder.beat) != (lease.owner, lease.beat):
                return False
        return True

    def renew(self) -> None:
        """Prolong the lease; a lease that is lost, or never was, is tried for again. Raises nothing."""
        begun_s, now = self._clock.now_s(), self._clock.utc()
        try:
            if self._renewed_s is None:
                self.take()
            elif self._store.leases.renew(self._bench, self._owner, now, now + timedelta(seconds=TERM_S)):
                self._renewed_s = begun_s
            else:
                self._renewed_s = None
                holder = self._store.leases.holder(self._bench)
                self._note_loss(
                    described(holder) if holder else "another process has taken its reservation of the bench"
                )
        except Exception as error:  # noqa: BLE001  the next try may do better; until then `held` counts the time
            self._note_loss(str(error) or type(error).__name__)

    def _note_loss(self, why: str) -> None:
        if why != self._why_lost:  # it is tried every RENEW_S
            log.error("lease.not_renewed", bench=self._bench, reason=why)
        self._why_lost = why

    def control(self) -> Control:
        """Return the control of a campaign that is interrupted when the bench may no longer be driven."""
        return Control(self.loss)

    def loss(self) -> str:
        """Return why the bench may no longer be driven; an empty text while it may."""
        return "" if self.held else f"this process may no longer drive the bench: {self.why_not}"

    def keep(self) -> None:
        """Renew from now on, in a thread, until `close`."""
        self._thread = threading.Thread(target=self._keep, name=f"lease-{self._bench}", daemon=True)
        self._thread.start()

    def _keep(self) -> None:
        while not self._over.wait(self._clock.wall_s(RENEW_S)):
            self.renew()

    def close(self) -> None:
        """Release the bench."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()
        if self._renewed_s is not None:
            self._renewed_s = None
            with suppress(LabctlError):  # the row stays and ends by itself
                self._store.leases.release(self._bench, self._owner)
        _HELD_HERE.discard(self._owner)


def hold_bench(store: Store, bench: BenchFile, clock: Clock | None = None) -> BenchHold | None:
    """Take the lease on a bench and keep it. Raises Conflict.

    None for a simulated bench of a database to which no other process writes: no other process can resume its campaign.
    """
    if bench.is_simulated and store.is_sole_writer:
        return None
    hold = BenchHold(store, bench.name, clock or WallClock())
    hold.take()
    hold.keep()
    return hold


@contextmanager
def holding(store: Store, bench: BenchFile) -> Iterator[Control]:
    """Hold the lease on a bench for one campaign; yields the campaign's control. Raises Conflict naming who has it."""
    hold = hold_bench(store, bench)
    try:
        yield Control() if hold is None else hold.control()
    finally:
        if hold is not None:
            hold.close()


@contextmanager
def open_for(bench: BenchFile, location: str) -> Iterator[Store]:
    """Open a database to run a campaign on a bench. Raises Conflict naming who holds the database, and the bench."""
    try:
        opened = Store(Database(location, write=True))
    except Conflict as lease:
        with open_store(location, write=False) as store:
            holder = store.leases.holder(bench.name)
        if holder is None:
            raise
        raise Conflict(f"{described(holder)}. {lease}") from lease
    try:
        opened.imports.discard_unfinished()
        yield opened
    finally:
        opened.close()


def driver_of(store: Store, bench_name: str, now: datetime) -> LeaseRow | None:
    """Return the lease of the process that drives a bench now; None where no process does."""
    holder = store.leases.holder(bench_name)
    return None if holder is None or is_over(holder, now) else holder


def is_over(lease: LeaseRow, now: datetime) -> bool:
    """Return whether the holder of a lease no longer drives the bench: its time is over, or its process."""
    return lease.expires_at <= now or _is_dead(lease)


def described(lease: LeaseRow) -> str:
    """Return a sentence that names the holder of a bench."""
    who = f"process {lease.pid} on {lease.host} since {lease.since:%Y-%m-%d %H:%M:%S} UTC"
    if lease.url is not None:
        who = f"the service at {lease.url}, {who}"
    return f"bench {lease.bench_name} is in use by {who}, last sign of life at {lease.beat_at:%H:%M:%S}"


def this_machine() -> str:
    """Return what names the start of this computer and the space of its process numbers; empty when not known."""
    try:
        boot = boot_id()
        return f"{boot} {Path('/proc/self/ns/pid').readlink()}" if boot else ""
    except OSError:
        return ""


def _is_dead(lease: LeaseRow) -> bool:
    """Return whether a holder is known to have ended: a process of this very machine that is no more."""
    if not lease.machine or lease.machine != this_machine():
        return False
    try:
        os.kill(lease.pid, 0)
        state = Path(f"/proc/{lease.pid}/stat").read_text(encoding="latin-1").rpartition(")")[2].split()[0]
    except ProcessLookupError:
        return True
    except (OSError, IndexError):
        return False
    return state in {"Z", "X"}  # it has ended, and its parent has not asked how (proc(5))
