"""The figures of a lease, each from both sides of its limit, what its row holds, and what is said of a holder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from instruments.clock import VirtualClock
from labctl.errors import BenchBusy, Conflict, StoreError
from labctl.services.benches import lease as module
from labctl.services.benches.lease import (
    RENEW_S,
    STOP_S,
    TERM_S,
    BenchHold,
    described,
    driver_of,
    hold_bench,
    holding,
    open_for,
    this_machine,
)
from labctl.services.planning.loading import load_bench
from labctl.store import LeaseRow, Store, open_store
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import TRANSACTIONS
from labctl.store.connection.writer_lock import ServiceAddress

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
BENCH = "gyro-bench"
FAR = LeaseRow(BENCH, "f" * 32, "far-pc", "", 4321, AT, 7, AT, AT + timedelta(seconds=TERM_S))


class SharedStore(Store):
    """A database to which several processes write, as PostgreSQL is."""

    @property
    def is_sole_writer(self) -> bool:
        return False


@pytest.fixture
def shared(tmp_path: Path) -> Iterator[Store]:
    opened = SharedStore(Database(str(tmp_path / "lab.sqlite"), write=True))
    yield opened
    opened.close()


def test_a_table_has_a_minute_to_come_to_rest_before_its_lease_ends() -> None:
    assert (TERM_S, RENEW_S, STOP_S) == (120.0, 10.0, 60.0)  # docs/reference/schedule.md


def test_the_row_of_a_lease_says_who_holds_the_bench_and_until_when(shared: Store) -> None:
    clock = VirtualClock(AT)
    hold = BenchHold(shared, BENCH, clock)
    hold.take()
    row = shared.leases.holder(BENCH)
    assert row is not None
    assert (row.bench_name, row.machine, row.pid, row.beat) == (BENCH, this_machine(), os.getpid(), 1)
    assert (row.since, row.beat_at, row.expires_at) == (AT, AT, AT + timedelta(seconds=120))
    clock.sleep(RENEW_S)
    hold.renew()
    renewed = shared.leases.holder(BENCH)
    assert renewed == replace(row, beat=2, beat_at=clock.utc(), expires_at=clock.utc() + timedelta(seconds=120))


def test_a_lease_that_is_taken_over_goes_on_counting(shared: Store) -> None:
    clock = VirtualClock(AT + timedelta(days=1))
    shared.leases.claim(FAR, replacing=None)
    BenchHold(shared, BENCH, clock).take()
    row = shared.leases.holder(BENCH)
    assert row is not None
    assert row.beat == 8


@pytest.mark.parametrize("held_s", [STOP_S - 0.001, STOP_S])
def test_a_bench_is_held_for_less_than_a_minute_after_its_last_renewal(shared: Store, held_s: float) -> None:
    clock = VirtualClock(AT)
    hold = BenchHold(shared, BENCH, clock)
    assert not hold.held
    with pytest.raises(BenchBusy, match="may not drive bench gyro-bench"):
        hold.check()
    hold.take()
    clock.sleep(held_s)
    assert hold.held == (held_s < STOP_S)
    assert (hold.loss() == "") == hold.held
    if not hold.held:
        assert "could not be renewed for 60 s" in hold.loss()


@pytest.mark.parametrize(
    ("ahead_s", "is_watched"), [(-0.001, True), (0.0, True), (0.001, False), (240.0, False), (240.001, True)]
)
def test_only_an_expiry_that_a_right_clock_can_have_written_is_believed(
    shared: Store, ahead_s: float, is_watched: bool
) -> None:
    clock = VirtualClock(AT)
    shared.leases.claim(replace(FAR, expires_at=AT + timedelta(seconds=ahead_s)), replacing=None)
    hold = BenchHold(shared, BENCH, clock)
    if is_watched:
        hold.take()
        assert clock.now_s() == TERM_S
    else:
        with pytest.raises(Conflict, match="far-pc"):
            hold.take()
        assert clock.now_s() == 0


@pytest.mark.parametrize("change", [{"owner": "e" * 32}, {"beat": 8}])
def test_a_holder_or_a_beat_that_changes_while_it_is_watched_is_a_sign_of_life(
    shared: Store, change: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = VirtualClock(AT + timedelta(days=1))
    shared.leases.claim(FAR, replacing=None)
    found = iter([FAR, *[FAR] * 5, replace(FAR, **change)])
    monkeypatch.setattr(shared.leases, "holder", lambda _bench: next(found))
    with pytest.raises(Conflict, match="far-pc"):
        BenchHold(shared, BENCH, clock).take()
    assert clock.now_s() == 6 * RENEW_S


def test_a_holder_that_goes_while_it_is_watched_makes_room(shared: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = VirtualClock(AT + timedelta(days=1))
    shared.leases.claim(FAR, replacing=None)
    holder = shared.leases.holder
    found: Iterator[Any] = iter([FAR, None])
    monkeypatch.setattr(shared.leases, "holder", lambda bench: next(found, holder(bench)))
    hold = BenchHold(shared, BENCH, clock)
    hold.take()
    assert hold.held


def test_who_is_to_end_watches_no_longer(shared: Store) -> None:
    clock = VirtualClock(AT + timedelta(days=1))
    shared.leases.claim(FAR, replacing=None)
    hold = BenchHold(shared, BENCH, clock)
    hold.close()
    with pytest.raises(Conflict, match="far-pc"):
        hold.take()
    assert clock.now_s() == RENEW_S


def test_a_bench_that_was_reserved_meanwhile_is_refused(shared: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    assert shared.leases.claim(FAR, replacing=None) is True
    assert shared.leases.claim(FAR, replacing=None) is False
    monkeypatch.setattr(shared.leases, "holder", lambda _bench: None)
    with pytest.raises(Conflict, match="another process has just reserved the bench; try again"):
        BenchHold(shared, BENCH, VirtualClock(AT)).take()


def test_a_lease_is_kept_until_it_is_closed(shared: Store) -> None:
    class Counting(VirtualClock):
        def wall_s(self, duration_s: float) -> float:
            return duration_s / 1e4

    hold = BenchHold(shared, BENCH, Counting(AT))
    hold.take()
    beats = shared.leases.renew
    seen: list[str] = []
    shared.leases.renew = lambda *of: seen.append(of[1]) or beats(*of)  # type: ignore[method-assign]
    hold.keep()
    while len(seen) < 3:
        hold._over.wait(0.001)
    hold.close()
    assert not hold.held
    assert shared.leases.holder(BENCH) is None
    assert hold._thread is not None
    assert not hold._thread.is_alive()
    assert hold._thread.daemon  # a process that ends without `close` is not kept by it


def test_a_simulated_bench_needs_no_lease_where_no_other_process_writes(tmp_path: Path) -> None:
    bench = load_bench("single-axis-sim")
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        assert hold_bench(store, bench) is None
        with holding(store, bench) as control:
            assert not control.poll().abort
        assert store.leases.holder(bench.name) is None


def test_a_bench_of_a_shared_database_is_held_for_its_campaign(shared: Store) -> None:
    bench = load_bench("single-axis-sim")
    with holding(shared, bench) as control:
        row = shared.leases.holder(bench.name)
        assert row is not None
        assert row.pid == os.getpid()
        assert not control.poll().abort
    assert shared.leases.holder(bench.name) is None


def test_a_hold_for_a_campaign_is_renewed_and_forgotten_once_it_is_closed(
    shared: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[BenchHold] = []
    monkeypatch.setattr(BenchHold, "keep", lambda held: kept.append(held))  # noqa: PLW0108  bound as a method
    hold = hold_bench(shared, load_bench("single-axis-sim"), VirtualClock(AT))
    assert hold is not None
    assert kept == [hold]
    assert hold._owner in module._HELD_HERE
    hold.close()
    assert hold._owner not in module._HELD_HERE


def test_the_log_says_who_had_a_bench_before_and_once_why_a_lease_was_not_renewed(
    shared: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[tuple[Any, ...]] = []
    log = SimpleNamespace(info=lambda *what, **more: said.append((*what, more)), error=None)
    log.error = log.info
    monkeypatch.setattr(module, "log", log)
    free, taken = (BenchHold(shared, name, VirtualClock(AT + timedelta(days=1))) for name in ("free", BENCH))
    shared.leases.claim(FAR, replacing=None)
    free.take()
    taken.take()
    assert said == [
        ("lease.taken", {"bench": "free", "instead_of": ""}),
        ("lease.taken", {"bench": BENCH, "instead_of": described(FAR)}),
    ]
    said.clear()
    reasons = ["the disk is full", "the disk is full", "no answer", ""]

    def fail(*_: object) -> bool:
        raise StoreError(reasons.pop(0))

    monkeypatch.setattr(shared.leases, "renew", fail)
    for _ in range(4):
        taken.renew()
    assert said == [
        ("lease.not_renewed", {"bench": BENCH, "reason": reason})
        for reason in ("the disk is full", "no answer", "StoreError")
    ]


def test_an_import_that_a_process_left_unfinished_is_discarded_before_a_campaign(
    shared: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    discarded: list[object] = []
    monkeypatch.setattr(type(shared.imports), "discard_unfinished", lambda each: discarded.append(each))  # noqa: PLW0108
    with open_for(load_bench("single-axis-sim"), str(tmp_path / "other.sqlite")) as store:
        assert discarded == [store.imports]


def test_a_database_that_is_held_is_refused_with_who_drives_the_bench(tmp_path: Path) -> None:
    location, bench = str(tmp_path / "lab.sqlite"), load_bench("single-axis-sim")
    with open_for(bench, location) as store:
        with pytest.raises(Conflict, match="is writing to this database") as unknown, open_for(bench, location):
            pass
        assert "far-pc" not in str(unknown.value)
        store.leases.claim(replace(FAR, bench_name=bench.name), replacing=None)
        said = r"process 4321 on far-pc since 2026-01-05 08:00:00 UTC, .*is writing to this database"
        with pytest.raises(Conflict, match=said), open_for(bench, location):
            pass
    with open_for(bench, location) as store:  # closed in between
        assert store.leases.holder(bench.name) is not None


@pytest.mark.parametrize(("late_s", "drives"), [(-0.001, True), (0.0, False), (0.001, False)])
def test_a_lease_that_ends_now_drives_no_bench(shared: Store, late_s: float, drives: bool) -> None:
    assert driver_of(shared, BENCH, AT) is None
    shared.leases.claim(FAR, replacing=None)
    found = driver_of(shared, BENCH, FAR.expires_at + timedelta(seconds=late_s))
    assert found == (FAR if drives else None)


@pytest.mark.parametrize(
    ("error", "drives"), [(None, True), (ProcessLookupError(), False), (PermissionError(), True), (OSError(), True)]
)
def test_only_a_process_that_is_known_to_be_gone_drives_no_bench(
    shared: Store, monkeypatch: pytest.MonkeyPatch, error: OSError | None, drives: bool
) -> None:
    asked: list[tuple[int, int]] = []

    def kill(pid: int, number: int) -> None:
        asked.append((pid, number))
        if error is not None:
            raise error

    monkeypatch.setattr(module, "this_machine", lambda: "here")
    monkeypatch.setattr(os, "kill", kill)
    shared.leases.claim(replace(FAR, machine="here"), replacing=None)
    assert (driver_of(shared, BENCH, AT) is not None) == drives
    assert asked == [(4321, 0)]  # 0: nothing is sent to it
    shared.leases.claim(replace(FAR, bench_name="other", machine="there"), replacing=None)
    assert driver_of(shared, "other", AT) is not None
    assert len(asked) == 1


def test_a_computer_that_does_not_name_its_start_names_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "boot_id", lambda: None)
    assert this_machine() == ""
    monkeypatch.setattr(module, "boot_id", lambda: "boot")
    assert this_machine().startswith("boot ")

    def unreadable(_path: Path) -> Path:
        raise PermissionError

    monkeypatch.setattr(Path, "readlink", unreadable)
    assert this_machine() == ""


def test_a_holder_is_described_with_its_service(shared: Store) -> None:
    own = "process 4321 on far-pc since 2026-01-05 08:00:00 UTC, last sign of life at 08:00:00"
    assert described(FAR) == f"bench gyro-bench is in use by {own}"
    assert described(replace(FAR, url="http://lab:8000")) == (
        f"bench gyro-bench is in use by the service at http://lab:8000, {own}"
    )


def test_the_address_of_a_service_is_written_into_the_leases_of_its_process_only(shared: Store) -> None:
    shared.leases.claim(replace(FAR, machine="here"), replacing=None)
    shared.leases.claim(replace(FAR, bench_name="second", machine="here", pid=9), replacing=None)
    shared.leases.claim(replace(FAR, bench_name="third", machine="there"), replacing=None)
    shared._database.address = ServiceAddress("http://lab:8000", "/run/calls")
    shared.leases.note_address("here", 4321)
    rows = [shared.leases.holder(name) for name in (BENCH, "second", "third")]
    assert [(row.url, row.calls) for row in rows if row is not None] == [
        ("http://lab:8000", "/run/calls"), (None, None), (None, None),
    ]  # fmt: skip


def test_each_act_on_a_lease_can_be_done_by_the_process_that_holds_the_database() -> None:
    assert {f"Leases.{name}" for name in ("claim", "renew", "note_address", "release")} <= TRANSACTIONS.keys()


def test_only_the_owner_renews_and_releases_a_lease(shared: Store) -> None:
    shared.leases.claim(FAR, replacing=None)
    shared.leases.claim(replace(FAR, bench_name="second"), replacing=None)
    later = AT + timedelta(seconds=10)
    assert not shared.leases.renew(BENCH, "e" * 32, later, later)
    assert not shared.leases.renew("third", FAR.owner, later, later)
    shared.leases.release(BENCH, "e" * 32)
    assert shared.leases.holder(BENCH) == FAR
    assert shared.leases.renew(BENCH, FAR.owner, later, later)
    assert shared.leases.holder(BENCH) == replace(FAR, beat=8, beat_at=later, expires_at=later)
    assert shared.leases.holder("second") == replace(FAR, bench_name="second")
    shared.leases.release(BENCH, FAR.owner)
    assert shared.leases.holder(BENCH) is None
    assert shared.leases.holder("second") is not None
