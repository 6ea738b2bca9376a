"""A writer that is held by another: the table stops, it is reported, and an abort does not wait for it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest

from instruments.clock import SystemClock, VirtualClock
from labctl.answers.campaigns import CampaignRequest, CampaignResponse, ReasonRequest
from labctl.errors import StoreError
from labctl.services.benches.lease import BenchHold
from labctl.services.campaigns import campaign_job
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.status import campaign_status
from labctl.services.commands.acts.abort import ABORT
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import ToCampaign
from labctl.services.commands.service_control import ServiceControl
from labctl.services.planning.loading import load_bench
from labctl.stop.latch import StopRequest
from labctl.store import Store, open_store
from labctl.store.connection import writer_turn
from labctl.store.repositories.campaign_journal import StoreJournal
from procedures.contracts.control import Control
from procedures.contracts.journal import StepResult
from procedures.execution import shutdown
from tests.helpers.held_writer import held_writer

BENCH = load_bench("single-axis-sim")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_engine_that_cannot_write_stops_its_table(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer_turn, "WRITER_DEADLINE_S", 0.2)
    monkeypatch.setattr(writer_turn, "OVERDUE_DEADLINE_S", 0.05)
    real, left = shutdown.make_safe, []

    def make_safe(bench: Any, clock: Any, note: Any) -> tuple[str, ...]:
        complaints = real(bench, clock, note=note)
        left.append((complaints, bench.table.is_moving()))
        return complaints

    monkeypatch.setattr(shutdown, "make_safe", make_safe)
    runner = BenchRunner(store, BENCH, VirtualClock)
    with held_writer(store) as hold:

        def at_the_first_data_set() -> None:
            job = runner._job
            if job is not None and job.progress is not None and job.progress.step_text.startswith("data set"):
                hold()

        stop = runner.listen(at_the_first_data_set)
        campaign = runner.start(CampaignRequest(recipe="short")).id
        job = runner._job
        assert job is not None
        assert job.thread is not None
        job.thread.join()
        stop()
        assert left == [((), False)]
        assert job.progress is not None
        assert job.progress.state.value == "failed"
        assert "hold in thread 'the-holder'" in job.progress.reason
        assert store.campaigns.get(campaign).state == "running"  # its end could not be written
    runner.resume_interrupted()
    row = store.campaigns.get(campaign)
    assert (row.state, "no write access within" in row.reason) == ("failed", True)
    assert runner.free


class Lease:
    """A lease on the bench that can be lost."""

    held = True

    def check(self) -> None:
        """Allow everything."""

    def control(self) -> Control:
        return Control(lambda: "" if self.held else "the lease is lost")


@pytest.mark.parametrize("by", ["a person", "a signal", "a lost lease"])
def test_a_stop_stops_the_table_while_the_engine_waits_for_the_writer(
    store: Store, monkeypatch: pytest.MonkeyPatch, by: str
) -> None:
    monkeypatch.setattr(campaign_job, "LEAVES_WITHIN_S", 0.1)
    monkeypatch.setattr(campaign_job, "LOSS_READ_S", 0.05)
    stopped = threading.Event()
    moved: list[bool] = []
    real = campaign_job.stop_table

    def stop_table(table: Any, clock: Any) -> str | None:
        moved.append(table.is_moving())
        complaint = real(table, clock)
        moved.append(table.is_moving())
        stopped.set()
        return complaint

    monkeypatch.setattr(campaign_job, "stop_table", stop_table)
    lease = Lease()
    runner = BenchRunner(store, BENCH, VirtualClock, cast(BenchHold, lease), safe_within_s=0.0)
    turns = threading.Event()
    with held_writer(store) as hold:

        def at_a_data_set_that_turns() -> None:
            job = runner._job
            progress = None if job is None else job.progress
            if progress is not None and progress.step_text.startswith("data set") and progress.rate_dps:
                hold()
                turns.set()

        stop = runner.listen(at_a_data_set_that_turns)
        campaign = runner.start(CampaignRequest(recipe="short")).id
        assert turns.wait(60.0)
        job = runner._job
        assert job is not None
        if by == "a signal":
            runner.end_soon()
        elif by == "a lost lease":
            lease.held = False
        else:
            runner.abort(campaign, StopRequest.new("Ada", "key", "a hand in the bench", campaign))
        assert stopped.wait(15.0)  # before the writer's deadline
        assert moved == [True, False]
        assert job.thread is not None
        assert job.thread.is_alive()
        stop()
    job.thread.join()
    assert store.campaigns.get(campaign).state == ("interrupted" if by == "a lost lease" else "aborted")


def test_what_a_stopped_step_writes_down_does_not_keep_the_table_turning(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine has heard the stop; the end of its step waits for a disk before it makes the bench safe."""
    stopped, waited = threading.Event(), []
    real_stop, real_end = campaign_job.stop_table, StoreJournal.step_ended

    def stop_table(table: Any, clock: Any) -> str | None:
        complaint = real_stop(table, clock)
        stopped.set()
        return complaint

    def step_ended(self: StoreJournal, index: int, result: StepResult, *when: Any) -> None:
        if result.outcome == "interrupted":
            waited.append(stopped.wait(15.0))
        real_end(self, index, result, *when)

    monkeypatch.setattr(campaign_job, "stop_table", stop_table)
    monkeypatch.setattr(StoreJournal, "step_ended", step_ended)
    runner = BenchRunner(store, BENCH, VirtualClock)

    def at_a_data_set_that_turns() -> None:
        job = runner._job
        progress = None if job is None else job.progress
        if progress is not None and progress.step_text.startswith("data set") and progress.rate_dps:
            runner.end_soon()

    stop = runner.listen(at_a_data_set_that_turns)
    campaign = runner.start(CampaignRequest(recipe="short")).id
    job = runner._job
    if job is not None and job.thread is not None:
        job.thread.join()
    stop()
    assert waited == [True]
    assert store.campaigns.get(campaign).state == "aborted"


def test_an_abort_is_written_down_after_it_is_done(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    prepared = prepare(store, "short", BENCH, VirtualClock(), clip=False)
    prepared.bench.close()
    runner = BenchRunner(store, BENCH, VirtualClock)
    done: list[str] = []

    def abort(campaign: int, stop: StopRequest) -> CampaignResponse:
        done.append(f"aborted: {stop.reason}")
        return campaign_status(store, campaign)

    monkeypatch.setattr(runner, "runs", lambda _: True)
    monkeypatch.setattr(runner, "abort", abort)
    real = store.audit.record
    monkeypatch.setattr(store.audit, "record", lambda *given, **who: (done.append(given[1]), real(*given, **who)))
    context = CommandContext(lambda: store, SystemClock(), ServiceControl(runner))
    asked = ToCampaign(prepared.id, ReasonRequest(reason="smoke", by="Ada"))
    assert context.control.perform(ABORT, context, asked).unrecorded == ""
    assert done == ["aborted: smoke (Ada)", "campaign abort"]
    last = store.audit.rows()[-1]
    assert (last.action, last.detail["reason"]) == ("campaign abort", "smoke (Ada)")

    def unwritable(*_: Any, **__: Any) -> None:
        raise StoreError("the disk is full; nothing was stored", cause="the disk is full")

    monkeypatch.setattr(store.audit, "record", unwritable)
    answer = context.control.perform(ABORT, context, asked)
    assert done[-1] == "aborted: smoke (Ada)"
    assert answer.unrecorded == "the campaign was aborted, but that is not in the audit trail: the disk is full"
