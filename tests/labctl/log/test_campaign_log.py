"""A campaign is followed by its log alone: what happened, when, to what, and why it ended."""

from __future__ import annotations

import logging
import os
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignResponse, ResumeRequest, StartRequest
from labctl.errors import StoreError
from labctl.log.logged_journal import LoggedJournal
from labctl.log.setup import running_log
from labctl.services.campaigns.execution import run, run_here
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resume import resume_here
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.store import StoreJournal, open_store
from procedures.contracts.control import Control
from procedures.contracts.steps import StepResult
from procedures.monitoring.progress import Progress
from procedures.planning.plan import make_plan
from tests.helpers.log_records import Record, Records, logged
from tests.helpers.recording_journal import RecordingJournal

DAY_S, MAX_BYTES_A_DAY = 86_400.0, 10_000_000


def run_with(folder: Path, *, fault: tuple[str, float] | None = None, recipe: str = "short") -> CampaignResponse:
    """Run a campaign on the simulated single-axis bench, whose gyro may fall silent for good."""
    with open_store(str(folder / "lab.sqlite"), write=True) as store:
        prepared = prepare(store, recipe, load_bench("single-axis-sim"), VirtualClock(), clip=False)
        if fault is not None:
            simulation: Any = prepared.bench.simulation
            simulation.faults(fault[0]).arm("silence", from_s=fault[1])
        return run(store, prepared)


def states(records: Records) -> list[tuple[str, str]]:
    return [(record["state"], record["reason"]) for record in records.named("campaign.state")]


def steps(records: Records) -> list[tuple[int, str]]:
    return [(record["step"], record["outcome"]) for record in records.named("step.ended")]


@pytest.mark.slow
def test_a_campaign_that_is_done(tmp_path: Path) -> None:
    with logged(tmp_path) as records:
        assert run_with(tmp_path).state == "done"
    found = records.all()
    (planned,) = records.named("campaign.planned")
    assert (planned["recipe"], planned["units"], planned["datasets"]) == ("short", ["FOG-0001"], 15)
    assert states(records) == [("running", "started"), ("done", "all steps done")]
    assert steps(records) == [(number + 1, "done") for number in range(planned["steps"])]
    begun = records.named("step.started")
    assert [record["step"] for record in begun] == [number for number, _ in steps(records)]
    assert begun[6]["what"] == "data set 1 of 15: -40 deg/s at 24 deg C, z up"
    opened, closed = records.named("dataset.opened"), records.named("dataset.closed")
    assert [record["dataset"] for record in opened] == [record["dataset"] for record in closed] == list(range(1, 16))
    assert {record["state"] for record in closed} == {"complete"}
    assert all(record["units"] == ["FOG-0001"] for record in opened)
    about = [record for record in found if record["event"].startswith(("campaign.", "step.", "dataset.", "units."))]
    assert {(record["campaign"], record["bench"]) for record in about} == {(1, "single-axis-sim")}
    times = [record["t_s"] for record in about if "t_s" in record]
    assert times == sorted(times)
    moments = [datetime.fromisoformat(record["at"]) for record in about if "at" in record]
    assert moments == sorted(moments)
    assert all(moment.tzinfo is not None for moment in moments)


def silent(records: Records) -> list[Record]:
    """Return what is said of the gyro, in order."""
    return [each for each in records.named("campaign.event") if each.get("device") == "fog"]


def test_a_campaign_that_fails(tmp_path: Path) -> None:
    """The gyro is silent from its twelfth minute on: every attempt is logged, and why the campaign ended."""
    with logged(tmp_path) as records:
        answer = run_with(tmp_path, fault=("sim://kvh-rd2100/fog", 737.0))
    assert answer.state == "failed"
    last = states(records)[-1]
    assert last == ("failed", answer.reason)
    assert records.named("campaign.state")[-1]["level"] == "error"
    reported = silent(records)
    assert {each["unit"] for each in reported} == {"FOG-0001"}
    attempts = [each["message"] for each in reported if each["kind"] == "link.retry"]
    assert [text.split(" failed: ")[0] for text in attempts] == [f"attempt {n} of 5" for n in (1, 2, 3)]
    assert [each["kind"] for each in reported if each["kind"] != "link.retry"] == [
        "readings_lost", "link.degraded", "link.lost", "guard.stale",
    ]  # fmt: skip
    assert reported[-1]["limit"] < reported[-1]["value"]
    ended = [each for each in records.named("step.ended") if each["outcome"] != "done"]
    assert [(each["step"], each["outcome"]) for each in ended] == [(14, "interrupted"), (14, "failed")]
    assert ended[-1]["reason"] == answer.reason
    cut = [each for each in records.named("dataset.closed") if each["state"] == "partial"]
    assert [(each["dataset"], each["level"]) for each in cut] == [(6, "warning")]  # no further one is begun in silence
    assert records.all()[-1]["event"] == "campaign.state"  # nothing is said after why it ended


@pytest.mark.slow
def test_a_campaign_that_is_interrupted_and_resumed(tmp_path: Path) -> None:
    location, control = str(tmp_path / "lab.sqlite"), Control()

    def stop(progress: Progress) -> None:
        if progress.step_text.startswith("data set 3"):
            control.abort("tea")

    with logged(tmp_path) as records:
        with open_store(location, write=True) as store:
            prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
            run(store, prepared, control, stop)
        resume_here(location, 1, None, None, ResumeRequest(by="Ada"))
    assert [state for state, _ in states(records)] == ["running", "aborted", "running", "done"]
    assert states(records)[1] == ("aborted", "aborted: tea")
    (up,) = records.named("campaign.resumed")
    assert (up["campaign"], up["was"], up["units"]) == (1, "aborted", ["FOG-0001"])
    assert up["reason"].startswith("resumed by Ada")


def test_a_failing_journal_is_logged_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the database cannot say why a campaign ended, the log does."""

    def refuse(*_: object) -> None:
        raise StoreError("the disk is full")

    def fill(progress: Progress) -> None:
        if progress.step_text.startswith("data set 3"):
            for name in ("readings", "environment", "event", "campaign_state", "step_ended", "dataset_closed"):
                monkeypatch.setattr(StoreJournal, name, refuse)

    with logged(tmp_path) as records, open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
        with pytest.raises(StoreError):
            run(store, prepared, observe=fill)
    (refused,) = records.named("journal.refused")
    assert (refused["level"], refused["campaign"], refused["error"]) == ("error", 1, "the disk is full")


def test_a_repeated_step_is_logged_as_repeated(tmp_path: Path) -> None:
    plan = make_plan(load_recipe("short"), limits_of(load_bench("single-axis-sim")), clip=False)
    clock = VirtualClock()
    with logged(tmp_path) as records:
        journal = LoggedJournal(RecordingJournal([]), 1, "bench", plan, {"fog": "FOG-0001"})
        for outcome in ("interrupted", "failed", "done"):
            journal.step_started(6, clock.now_s(), clock.utc())
            journal.step_ended(6, StepResult(outcome=outcome, reason="why"), clock.now_s(), clock.utc())
        journal.step_started(7, clock.now_s(), clock.utc())
    assert [each.get("attempt") for each in records.named("step.started")] == [None, 2, 3, None]
    assert [each["level"] for each in records.named("step.ended")] == ["warning", "error", "info"]


@pytest.mark.slow
def test_a_day_of_a_bench_is_less_than_ten_megabytes(tmp_path: Path) -> None:
    """A campaign with soaks of minutes, which logs more in an hour than one with soaks of an hour; scaled to 24 h."""
    with logged(tmp_path) as records:
        answer = run_here(str(tmp_path / "lab.sqlite"), StartRequest(recipe="short"))
    assert answer.state == "done"
    assert answer.t_s is not None
    assert records.path.stat().st_size / answer.t_s * DAY_S < MAX_BYTES_A_DAY / 4


@pytest.mark.slow
def test_a_log_that_nobody_reads_does_not_hold_the_engine(tmp_path: Path) -> None:
    """Its pipe is full from the beginning: the campaign has the same readings and ends the same way."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    try:
        while True:
            os.write(writing, b"x" * 4096)
    except BlockingIOError:
        os.set_blocking(writing, True)
    try:
        with running_log("test", logging.DEBUG, descriptor=writing) as log:
            answer = run_here(str(tmp_path / "lab.sqlite"), StartRequest(recipe="short"))
            assert (answer.state, answer.reason) == ("done", "all steps done")
            assert log.writer.lost == 0  # what waits is bounded, and this is less
    finally:
        os.close(reading)
        os.close(writing)
