"""One bench, one driver: who takes a lease, who is refused, and what a holder does that could not renew."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from instruments.clock import Clock, VirtualClock
from labctl.errors import Conflict, StoreError
from labctl.services.benches.lease import RENEW_S, STOP_S, TERM_S, BenchHold, this_machine
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.planning.loading import load_bench
from labctl.store import LeaseRow, Store, open_store
from labctl.store.connection.database import Database
from procedures.monitoring.progress import Progress

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
BENCH = "gyro-bench"


class SharedStore(Store):
    """A database to which several processes write, as PostgreSQL is."""

    @property
    def is_sole_writer(self) -> bool:
        return False


class BusyClock(VirtualClock):
    """A virtual clock; in each sleep `meanwhile` happens."""

    def __init__(self, start: datetime = AT) -> None:
        super().__init__(start)
        self.meanwhile = lambda: None

    def sleep(self, duration_s: float) -> None:
        super().sleep(duration_s)
        self.meanwhile()


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def shared(tmp_path: Path) -> Iterator[Store]:
    opened = SharedStore(Database(str(tmp_path / "lab.sqlite"), write=True))
    yield opened
    opened.close()


def far(clock: Clock, *, expires_in_s: float = TERM_S) -> LeaseRow:
    """The lease of a process on another computer."""
    now = clock.utc()
    return LeaseRow(BENCH, "f" * 32, "far-pc", "", 4321, now, 7, now, now + timedelta(seconds=expires_in_s))


def test_a_second_driver_is_told_who_holds_the_bench(store: Store) -> None:
    clock = VirtualClock(AT)
    first, second = (BenchHold(store, BENCH, clock) for _ in range(2))
    first.take()
    with pytest.raises(Conflict, match=rf"process {os.getpid()} on .* since 2026-01-05 08:00:00 UTC"):
        second.take()
    assert (first.held, second.held) == (True, False)
    BenchHold(store, "another-bench", clock).take()
    first.close()
    assert not first.held
    second.take()
    assert second.held


def test_who_alone_may_write_knows_that_another_holder_is_gone(store: Store) -> None:
    clock = VirtualClock(AT)
    store.leases.claim(far(clock), replacing=None)
    hold = BenchHold(store, BENCH, clock)
    hold.take()
    assert clock.now_s() == 0


def test_a_living_lease_is_respected_at_once(shared: Store) -> None:
    clock = VirtualClock(AT)
    shared.leases.claim(far(clock), replacing=None)
    with pytest.raises(Conflict, match="process 4321 on far-pc"):
        BenchHold(shared, BENCH, clock).take()
    assert clock.now_s() == 0


@pytest.mark.parametrize("expires_in_s", [-1.0, -86400.0, 86400.0])
def test_a_silent_lease_is_taken_after_a_term_of_watching_whatever_the_clocks_say(
    shared: Store, expires_in_s: float
) -> None:
    clock = VirtualClock(AT)
    shared.leases.claim(far(clock, expires_in_s=expires_in_s), replacing=None)
    hold = BenchHold(shared, BENCH, clock)
    hold.take()
    assert hold.held
    assert clock.now_s() >= TERM_S
    assert not shared.leases.renew(BENCH, "f" * 32, clock.utc(), clock.utc())


@pytest.mark.parametrize("expires_in_s", [-86400.0, 86400.0])
def test_a_lease_that_beats_is_respected_whatever_the_clocks_say(shared: Store, expires_in_s: float) -> None:
    clock = BusyClock()
    lease = far(clock, expires_in_s=expires_in_s)
    shared.leases.claim(lease, replacing=None)
    clock.meanwhile = lambda: shared.leases.renew(BENCH, lease.owner, clock.utc(), lease.expires_at) and None
    with pytest.raises(Conflict, match="far-pc"):
        BenchHold(shared, BENCH, clock).take()


def test_only_one_of_two_takeovers_succeeds(shared: Store) -> None:
    clock = VirtualClock(AT)
    lease = far(clock)
    shared.leases.claim(lease, replacing=None)
    heir = replace(lease, owner="a" * 32, beat=8)
    assert shared.leases.claim(heir, replacing=lease)
    assert not shared.leases.claim(replace(lease, owner="b" * 32, beat=8), replacing=lease)
    assert not shared.leases.claim(replace(lease, owner="b" * 32), replacing=None)
    assert shared.leases.holder(BENCH) == heir


@pytest.mark.parametrize("waited_for", [True, False])
def test_a_holder_of_this_machine_that_has_ended_is_replaced_at_once(shared: Store, waited_for: bool) -> None:
    clock = VirtualClock(AT)
    ended = subprocess.Popen([sys.executable, "-c", ""])
    os.waitid(os.P_PID, ended.pid, os.WEXITED | (0 if waited_for else os.WNOWAIT))
    lease = replace(far(clock), machine=this_machine(), pid=ended.pid)
    shared.leases.claim(lease, replacing=None)
    hold = BenchHold(shared, BENCH, clock)
    if not this_machine():
        pytest.skip("this system does not say where a process number means something")
    hold.take()
    ended.wait()
    assert clock.now_s() == 0
    living = replace(far(clock), bench_name="another", machine=this_machine(), pid=os.getpid())
    shared.leases.claim(living, replacing=None)
    with pytest.raises(Conflict):
        BenchHold(shared, "another", clock).take()


def test_a_lease_lasts_as_long_as_it_is_renewed(store: Store) -> None:
    clock = VirtualClock(AT)
    hold = BenchHold(store, BENCH, clock)
    hold.take()
    for _ in range(100):
        clock.sleep(RENEW_S)
        hold.renew()
        assert hold.held
    clock.sleep(STOP_S - 1)
    assert hold.held
    clock.sleep(1)
    assert not hold.held
    assert hold.control().poll().abort
    hold.renew()
    assert hold.held


def test_a_stolen_lease_ends_the_campaign_and_is_tried_for_again(shared: Store) -> None:
    clock = VirtualClock(AT)
    hold = BenchHold(shared, BENCH, clock)
    hold.take()
    control = hold.control()
    assert not control.poll().abort
    mine = shared.leases.holder(BENCH)
    assert mine is not None
    shared.leases.claim(far(clock), replacing=mine)
    hold.renew()
    assert control.poll().abort
    assert "far-pc" in control.request.reason
    with pytest.raises(Conflict, match="far-pc"):
        hold.check()
    shared.leases.release(BENCH, "f" * 32)
    hold.renew()
    hold.check()
    assert control.poll().abort


def test_reading_the_request_interrupts_nothing(store: Store) -> None:
    clock = VirtualClock(AT)
    hold = BenchHold(store, BENCH, clock)
    hold.take()
    control = hold.control()
    clock.sleep(STOP_S)
    assert not hold.held
    assert not control.request.abort  # a status that is read meanwhile takes nothing from the campaign
    hold.renew()
    assert not control.poll().abort


def test_a_database_that_cannot_be_written_counts_as_not_renewed(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = VirtualClock(AT)
    hold = BenchHold(store, BENCH, clock)
    hold.take()

    def fail(*_: object) -> bool:
        raise StoreError("the disk is full")

    monkeypatch.setattr(store.leases, "renew", fail)
    hold.renew()
    assert hold.held
    clock.sleep(STOP_S)
    assert not hold.held
    assert "the disk is full" in hold.control().poll().reason


def test_a_table_is_at_rest_before_a_lease_that_was_not_renewed_ends(store: Store) -> None:
    clock = VirtualClock(AT)
    hold = BenchHold(store, BENCH, clock)
    prepared = prepare(store, "short", load_bench("single-axis-sim"), clock, clip=False)

    cut_off = False

    def look(progress: Progress) -> None:
        nonlocal cut_off
        cut_off = cut_off or progress.step_text.startswith("data set 2 ")
        if not cut_off:
            hold.renew()

    hold.take()
    answer = run(store, prepared, hold.control(), look)
    lease = store.leases.holder(BENCH)
    assert lease is not None
    assert answer.state == "interrupted", answer.reason
    assert "could not be renewed" in answer.reason
    assert not prepared.bench.table.is_moving()
    assert clock.utc() < lease.expires_at


def test_a_service_that_lost_its_bench_begins_nothing(shared: Store) -> None:
    from labctl.answers.campaigns import CampaignRequest

    clock = VirtualClock(AT)
    hold = BenchHold(shared, BENCH, clock)
    hold.take()
    runner = BenchRunner(shared, load_bench("single-axis-sim"), VirtualClock, hold)
    clock.sleep(STOP_S)
    with pytest.raises(Conflict, match="may not drive bench"):
        runner.start(CampaignRequest(recipe="short"))
    assert shared.campaigns.all() == []
    runner.close()
    assert shared.leases.holder(BENCH) is None


def test_whatever_hinders_a_renewal_the_next_is_tried(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = VirtualClock(AT)
    hold = BenchHold(store, BENCH, clock)
    hold.take()

    def broken(*_: object) -> bool:
        raise OSError("no file descriptor is left")

    with monkeypatch.context() as meanwhile:
        meanwhile.setattr(store.leases, "renew", broken)
        clock.sleep(STOP_S)
        hold.renew()
    assert (hold.held, hold.why_not) == (False, "no file descriptor is left")
    hold.renew()
    assert hold.held
