"""What a full disk or an interrupt inside a write leaves: a bench made safe, and an end that is written later."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest, StartRequest
from labctl.errors import DiskFull, Stopped, StoreError
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.execution import run, run_here
from labctl.services.campaigns.preparation import prepare
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from procedures.contracts.control import Control
from procedures.execution.signals import defer_signals

BENCH = load_bench("single-axis-sim")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def rest(runner: BenchRunner) -> None:
    job = runner._job
    if job is not None and job.thread is not None:
        job.thread.join()


class FullDisk:
    """A disk that takes nothing more while `full`."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.full = False
        real = Database.writing

        def writing(database: Database, *, synced: bool = True) -> Any:
            if self.full:
                raise DiskFull("the disk is full")
            return real(database, synced=synced)

        monkeypatch.setattr(Database, "writing", writing)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_end_that_could_not_be_written_is_written_before_anything_else_begins(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = FullDisk(monkeypatch)
    runner = BenchRunner(store, BENCH, VirtualClock)
    stop = runner.listen(lambda: setattr(disk, "full", True))
    campaign = runner.start(CampaignRequest(recipe="short")).id
    rest(runner)
    stop()
    assert store.campaigns.get(campaign).state == "planned"
    assert not runner.free
    with pytest.raises(StoreError, match="the disk is full"):
        runner.start(CampaignRequest(recipe="short"))
    disk.full = False
    runner.resume_interrupted()
    row = store.campaigns.get(campaign)
    assert (row.state, "the disk is full" in row.reason) == ("failed", True)
    assert f"campaign {campaign} ended while" in store.benches.unconfirmed(BENCH.name)
    assert runner.free


def test_a_bench_is_closed_even_if_what_is_wrong_with_it_cannot_be_written(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    prepared = prepare(store, "short", BENCH, VirtualClock(), clip=False)
    closed: list[str] = []
    monkeypatch.setattr(type(prepared.bench), "close", lambda bench: closed.append(bench.table.name))
    monkeypatch.setattr("procedures.execution.shutdown.make_safe", lambda *_, **__: ("table to rest: no answer",))

    def full(*_: Any) -> None:
        raise StoreError("the disk is full")

    monkeypatch.setattr(store.benches, "mark", full)
    monkeypatch.setattr("labctl.store.repositories.campaign_journal.benches.mark", full)
    control = Control()
    control.abort("enough")
    with pytest.raises(StoreError):
        run(store, prepared, control)
    assert closed == ["table"]


@pytest.mark.parametrize(("complaints", "said"), [
    ((), "bench single-axis-sim is safe, but that could not be recorded;"),
    (("table to rest: no answer",), "NOT confirmed safe, and that could not be recorded: table to rest: no answer"),
])  # fmt: skip
def test_a_disk_that_fills_up_below_a_campaign_says_what_is_left_and_how_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, complaints: tuple[str, ...], said: str
) -> None:
    disk, location = FullDisk(monkeypatch), str(tmp_path / "lab.sqlite")
    monkeypatch.setattr("procedures.execution.shutdown.make_safe", lambda *_, **__: complaints)

    def fills(answer: Any) -> None:
        disk.full = disk.full or answer.step == 5

    with pytest.raises(DiskFull) as caught:
        run_here(location, StartRequest(recipe="short", bench=BENCH.name), fills)
    text = str(caught.value)
    assert text.startswith("campaign 1 was interrupted: the disk is full; the data measured before are stored; ")
    assert said in text
    assert text.endswith("`labctl campaign resume 1` continues it")
    assert "nothing was stored" not in text


@pytest.mark.parametrize("at", [1, 2, 3])
def test_interrupts_inside_a_write_leave_a_database_that_can_be_written(store: Store, at: int) -> None:
    prepared = prepare(store, "short", BENCH, VirtualClock(), clip=False)
    engine, inserted = store.audit._database._engine, [0]

    def interrupt(*_: Any) -> None:
        signal.raise_signal(signal.SIGINT)

    def at_insert(_cursor: Any, statement: str, *_: Any) -> None:
        inserted[0] += statement.startswith("INSERT INTO events")
        if inserted[0] == at and statement.startswith("INSERT INTO events"):
            sa.event.listen(engine, "rollback", interrupt, once=True)  # impatient: while the first is being heeded
            sa.event.listen(engine.pool, "invalidate", interrupt, once=True)
            interrupt()

    sa.event.listen(engine, "do_execute", at_insert)
    with pytest.raises(Stopped, match="bench single-axis-sim is safe"):
        run(store, prepared)
    row = store.campaigns.get(prepared.id)
    assert (row.state, row.reason) == ("aborted", "interrupted (Ctrl-C or a signal)")


def interrupted_write(reached: list[str], error: Exception | None) -> None:
    with defer_signals():
        signal.raise_signal(signal.SIGINT)
        reached.append("the end")
        if error is not None:
            raise error


@pytest.mark.parametrize("error", [None, StoreError("the disk is full")])
def test_an_interrupt_waits_for_the_end_of_a_write_and_is_not_lost_when_that_fails(error: Exception | None) -> None:
    reached: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        interrupted_write(reached, error)
    assert reached == ["the end"]
