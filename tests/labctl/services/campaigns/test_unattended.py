"""What a campaign leaves that no process resumes: its bench made safe, or reported unsafe, and its end written."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from typer.testing import CliRunner

from instruments.bench_config import BenchFile
from instruments.clock import SystemClock, VirtualClock
from instruments.errors import NoReply
from labctl.answers.campaigns import CampaignRequest, ReasonRequest, StartRequest
from labctl.cli.app import app
from labctl.errors import BenchBusy, Conflict, NotEnoughData
from labctl.processes.supervisor import Ready
from labctl.services.campaigns import recovery, resume
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.execution import run, run_here
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.status import campaign_status, page_of_campaigns
from labctl.services.commands.acts.abort import ABORT, ABORT_CAMPAIGN
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import ToCampaign
from labctl.services.commands.service_control import ServiceControl
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.services.recordings.catalogue import page_of_recordings
from labctl.services.recordings.loading import newest_row
from labctl.store import Store, open_store
from labctl.store.paging import PageRequest
from labctl.store.schema import tables
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.journal import NOT_SAFE, Event
from tests.helpers.commands import local_executor

BENCH = load_bench("single-axis-sim")
AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def real(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the bench be one that outlives the process that drove it."""
    monkeypatch.setattr(BenchFile, "is_simulated", property(lambda _: False))


def left_running(store: Store) -> int:
    """Leave a campaign as a process does that is killed."""
    prepared = prepare(store, "short", BENCH, VirtualClock(), clip=False)
    store.campaigns.journal(prepared.id).campaign_state(CampaignState.RUNNING, "started", 0.0, AT)
    prepared.bench.close()
    return prepared.id


def rest(runner: BenchRunner) -> None:
    job = runner._job
    if job is not None and job.thread is not None:
        job.thread.join()


@pytest.mark.usefixtures("real")
def test_a_bench_that_is_silent_when_its_campaign_is_to_be_resumed_is_not_reported_safe(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    left_running(store)

    def silent(*_: Any, **__: Any) -> None:
        raise NoReply("table", "no answer")

    monkeypatch.setattr(recovery, "open_bench", silent)
    monkeypatch.setattr(resume, "open_bench", silent)
    runner = BenchRunner(store, BENCH, VirtualClock)
    runner.resume_unfinished()
    assert store.campaigns.get(1).state == "failed"
    assert "no answer" in store.benches.unconfirmed(BENCH.name)
    with pytest.raises(Conflict, match="not confirmed safe"):
        runner.start(CampaignRequest(recipe="short"))


@pytest.mark.usefixtures("real")
def test_a_campaign_that_is_given_up_leaves_its_bench_safe_first(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    left_running(store)
    states: list[str] = []

    def safe(*_: Any, **__: Any) -> tuple[str, ...]:
        states.append(store.campaigns.get(1).state)
        return ("table to rest: it still moves",)

    monkeypatch.setattr(recovery, "retries_exhausted", lambda _: "resumed 5 times")
    monkeypatch.setattr(recovery, "make_safe", safe)
    BenchRunner(store, BENCH, VirtualClock).resume_unfinished()
    assert states == ["running"]
    assert store.campaigns.get(1).reason == "resumed 5 times"
    assert store.benches.unconfirmed(BENCH.name) == "table to rest: it still moves"


def test_what_is_not_safe_is_on_the_bench_before_the_campaign_ends(store: Store) -> None:
    """A process that is killed between the two leaves a bench that states so."""
    prepared = prepare(store, "short", BENCH, VirtualClock(), clip=False)
    prepared.bench.close()
    event = Event("safe_state", f"{NOT_SAFE}table to rest: no answer", level="error")
    store.campaigns.journal(prepared.id).event(event, 0.0, AT)
    assert store.benches.unconfirmed(BENCH.name) == "table to rest: no answer"


def test_a_recording_in_which_nothing_was_measured_yet_is_no_newest_one(store: Store) -> None:
    left_running(store)
    with pytest.raises(NotEnoughData, match="no complete data set yet"):
        newest_row(store, "FOG-0001", None)
    prepared = prepare(store, "short", BENCH, VirtualClock(), clip=False)
    run(store, prepared)
    left_running(store)
    assert newest_row(store, "FOG-0001", None).id == 2
    with pytest.raises(NotEnoughData, match="recording 3"):
        newest_row(store, "FOG-0001", 3)


def test_of_several_campaigns_on_one_bench_the_newest_goes_on_and_the_others_say_so(store: Store) -> None:
    older, newer = left_running(store), left_running(store)
    runner = BenchRunner(store, BENCH, VirtualClock)
    runner.resume_unfinished()
    rest(runner)
    assert store.campaigns.get(newer).state == "done"
    row = store.campaigns.get(older)
    assert (row.state, f"campaign {newer} on the same bench is resumed first" in row.reason) == ("failed", True)


@pytest.mark.usefixtures("real")
def test_ending_by_hand_what_no_process_runs_says_that_nobody_made_the_bench_safe(store: Store) -> None:
    campaign = left_running(store)
    answer = local_executor(store, VirtualClock()).execute(
        ABORT_CAMPAIGN, ToCampaign(campaign, ReasonRequest(reason="the computer died"))
    )
    assert (answer.state, "has not been made safe" in answer.reason) == ("aborted", True)
    assert f"campaign {campaign} ended before" in store.benches.unconfirmed(BENCH.name)


@pytest.mark.usefixtures("real")
def test_a_campaign_that_waits_to_be_resumed_is_stopped_at_the_bench_and_not_only_closed(store: Store) -> None:
    campaign = left_running(store)
    runner = BenchRunner(store, BENCH, VirtualClock)
    control = ServiceControl(runner)
    asked = ToCampaign(campaign, ReasonRequest(reason="smoke", by="Ada"))
    answer = control.perform(ABORT, CommandContext(lambda: store, VirtualClock(), control), asked)
    assert (answer.state, answer.reason) == ("aborted", "aborted: smoke (Ada)")
    assert (runner.stops.is_safe, runner.stop_latch.state.open) == (True, ())
    assert [row.detail["reason"] for row in store.audit.rows() if row.action == "campaign abort"] == ["smoke (Ada)"]
    runner.resume_unfinished()
    assert not runner.busy


def test_a_simulated_bench_ended_with_its_process(store: Store) -> None:
    answer = local_executor(store, VirtualClock()).execute(
        ABORT_CAMPAIGN, ToCampaign(left_running(store), ReasonRequest(reason="enough"))
    )
    assert (answer.state, store.benches.unconfirmed(BENCH.name)) == ("aborted", "")


def test_a_runner_that_stops_begins_nothing_and_waits_until_the_bench_is_safe(store: Store) -> None:
    runner = BenchRunner(store, BENCH, VirtualClock)
    campaign = runner.start(CampaignRequest(recipe="short")).id
    runner.end_soon()
    with pytest.raises(BenchBusy, match="the service stops"):
        runner.start(CampaignRequest(recipe="short"))
    assert not runner.free
    runner.close()
    row = store.campaigns.get(campaign)
    assert (row.state, "the service stops" in row.reason) == ("aborted", True)


def test_a_bench_that_was_not_used_is_not_called_safe(store: Store) -> None:
    lab_service = LabService(store, SystemClock(), BenchRunner(store, load_bench("single-axis-sim"), VirtualClock))
    lab_service.close()
    assert lab_service.left.text == "bench single-axis-sim was not used"


def labctl(location: str, *arguments: str) -> Any:
    return CliRunner().invoke(app, [*arguments, "--database", location])


@pytest.fixture
def left(tmp_path: Path) -> str:
    """A database in which a campaign was left half done by a process that is gone."""
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as opened:
        left_running(opened)
    return location


@pytest.mark.parametrize(
    "look", [lambda store: campaign_status(store, 1), lambda store: page_of_campaigns(store, PageRequest()).rows[0]]
)
def test_a_campaign_that_ends_while_it_is_looked_at_was_not_left(
    left: str, monkeypatch: pytest.MonkeyPatch, look: Any
) -> None:
    def ends(_store: Store) -> bool:
        with open_store(left, write=True) as writer:
            writer.campaigns.close_unfinished(1, "enough", AT, "aborted")
        return False

    monkeypatch.setattr(Store, "is_held", property(ends))
    with open_store(left, write=False) as reader:
        answer = look(reader)
    assert (answer.state, answer.abandoned, answer.reason) == ("aborted", False, "enough")


@pytest.mark.usefixtures("real")
def test_a_bench_whose_campaign_was_killed_says_so_and_begins_no_other(left: str) -> None:
    status = labctl(left, "bench", "status")
    assert (status.exit_code, "the safe state is confirmed" in status.stdout) == (1, False)
    what = (
        "campaign 1 was interrupted at 0 %; `labctl campaign resume 1` resumes the campaign, `labctl campaign abort 1` "
        "ends it"
    )
    assert what in status.stdout
    assert json.loads(labctl(left, "bench", "status", "--json").stdout)[0]["left"] == [what]
    refused = labctl(left, "campaign", "start", "short", "--bench", BENCH.name)
    assert (refused.exit_code, what in refused.stderr) == (2, True)
    with open_store(left, write=True) as opened:
        assert len(opened.campaigns.all()) == 1
        assert "labctl campaign" not in labctl(left, "bench", "status").stdout  # a process writes: it may be running
    aborted = labctl(left, "campaign", "abort", "1")  # whose instruments do not answer
    assert (aborted.exit_code, "NOT STOPPED: bench single-axis-sim" in aborted.stderr) == (1, True)
    again = json.loads(labctl(left, "bench", "status", "--json").stdout)[0]
    assert (again["left"], "before it could make the bench safe" in again["unconfirmed"]) == ([], True)


@pytest.mark.slow
def test_a_simulated_bench_only_says_that_a_campaign_was_left(left: str) -> None:
    assert labctl(left, "bench", "status").exit_code == 0
    started = labctl(left, "campaign", "start", "short", "--bench", BENCH.name, "--json")
    assert "campaign 1 was interrupted at 0 %; `labctl campaign resume 1` resumes the campaign" in started.stderr
    assert (json.loads(started.stdout)["id"], json.loads(started.stdout)["state"]) == (2, "done")


def test_a_service_that_starts_says_what_it_finds(left: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def serve(_request: Any, ready: Any) -> str:
        ready(Ready("http://127.0.0.1:1", 1, 2, (2,)))
        return ""

    monkeypatch.setattr("labctl.processes.supervisor.serve_forever", serve)
    assert (
        "campaign 1 was interrupted at 0 %; labctl sets the safe state and then resumes the campaign"
        in labctl(left, "serve", "--bench", BENCH.name).stdout
    )
    with open_store(left, write=True) as opened:
        opened.benches.mark(BENCH.name, "table to rest: no answer", AT)
    lines = labctl(left, "serve", "--bench", BENCH.name).stdout.splitlines()
    assert len(lines) == 3
    assert "is NOT confirmed safe: table to rest: no answer" in lines[1]
    assert lines[2].startswith("campaign 1 was interrupted at 0 % and is not resumed: ")
    received = json.loads(labctl(left, "serve", "--bench", BENCH.name, "--json").stdout)
    assert (received["url"], "no answer" in received["unconfirmed"]) == ("http://127.0.0.1:1", True)
    other = json.loads(labctl(left, "serve", "--bench", "triaxial-sim", "--json").stdout)
    assert (other["unconfirmed"], other["cut_short"]) == ("", "")


@pytest.mark.slow
def test_another_terminal_is_told_where_a_campaign_runs(tmp_path: Path) -> None:
    location, said = str(tmp_path / "lab.sqlite"), []

    def look(_answer: Any) -> None:
        if not said:
            said.extend(labctl(location, "campaign", act, "1") for act in ("pause", "abort", "resume"))

    run_here(location, StartRequest(recipe="short"), look)
    for result in said:
        assert result.exit_code == 2
        assert f"campaign 1 runs in process {os.getpid()}'s terminal: Ctrl-C there ends it safely" in result.stderr


@pytest.mark.usefixtures("real")
def test_a_recording_is_unfinished_until_its_campaign_has_ended(store: Store) -> None:
    left_running(store)
    assert [line.unfinished for line in page_of_recordings(store, PageRequest()).rows] == [True]
    with store.campaigns._database.writing() as connection:
        connection.execute(sa.update(tables.campaigns).values(state="done"))
    assert [line.unfinished for line in page_of_recordings(store, PageRequest()).rows] == [False]
