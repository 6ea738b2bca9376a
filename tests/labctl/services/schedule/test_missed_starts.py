"""Starts that no service could begin in time: the limit of an entry, and the default of a real bench."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from labctl.answers.campaigns import BENCH_CHECKS
from labctl.api import create_app
from labctl.cli.app import app
from labctl.errors import Conflict
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.lab_service import LabService
from labctl.services.local_bench import LocalBench
from labctl.services.schedule.queue import cancel_start, list_starts, start_status
from labctl.services.schedule.scheduler import REAL_BENCH_LATE_LIMIT_S
from labctl.store import NewCampaign, Store, StoreJournal, open_store
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.journal import Event
from tests.helpers.schedule_lab import BENCH, START, Lab

CONFIRMED: dict[str, Any] = {"confirmed_by": "Ann", "checks": list(BENCH_CHECKS)}
H = timedelta(hours=1)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def lab(store: Store) -> Lab:
    return Lab(store)


@pytest.fixture
def real(store: Store) -> Lab:
    """A bench that is not simulated."""
    return Lab(store, late_limit_s=REAL_BENCH_LATE_LIMIT_S)


def test_a_limit_on_lateness_is_kept(lab: Lab) -> None:
    at = "2026-01-05T10:00Z"
    patient, hasty, strict = (lab.enter(at=at, late_limit_s=limit) for limit in (7200, 3600, 0))
    lab.clock.sleep(2 * 3600 + 5400)  # 1.5 h late
    lab.scheduler.tick()
    assert [lab.outcomes(start)[0] for start in (patient, hasty, strict)] == ["refused", "missed", "missed"]
    assert lab.message(hasty) == (
        "missed: the start was 1 h 30 min late, and the limit is 1 h 00 min; check the bench, then start recipe short "
        "again, now or with --at TIME"
    )
    assert len(lab.begun) == 1


def test_a_start_that_may_not_be_late_begins_on_time(lab: Lab) -> None:
    lab.enter(at="2026-01-05T10:00Z", late_limit_s=0)
    lab.live(timedelta(hours=3), every_s=50.0)
    assert len(lab.begun) == 1


def test_waiting_behind_another_campaign_counts_as_late(lab: Lab) -> None:
    strict = lab.enter(at="now", late_limit_s=0)
    lab.free = False
    lab.live(timedelta(minutes=5))
    assert (lab.outcomes(strict), lab.begun) == (["missed"], [])


@pytest.mark.slow
def test_a_cron_line_that_may_not_be_late_goes_on_the_next_day(lab: Lab) -> None:
    daily = lab.enter(cron="0 2 * * *", time_zone="UTC", late_limit_s=0)
    lab.clock.sleep(86400)
    lab.live(timedelta(days=1))
    assert [at for at, _ in lab.begun] == [datetime(2026, 1, 7, 2, tzinfo=UTC)]
    assert lab.outcomes(daily) == ["missed", "refused"]


def test_a_real_bench_does_not_make_up_what_was_missed_by_more_than_an_hour(real: Lab) -> None:
    at = "2026-01-05T10:00Z"
    without, patient = real.enter(at=at), real.enter(at=at, late_limit_s=1e9)
    real.clock.sleep(2 * 3600 + 3700)  # no service for 1 h 02 min after that
    real.scheduler.tick()
    assert (real.outcomes(without), real.outcomes(patient)) == (["missed"], ["refused"])
    assert "1 h 02 min late, and the limit of a real bench is 1 h 00 min; check the bench" in real.message(without)
    real.live(H)
    assert len(real.begun) == 1


def test_a_real_bench_makes_up_what_was_missed_by_less(real: Lab) -> None:
    real.enter(at="2026-01-05T10:00Z")
    real.clock.sleep(2 * 3600 + 3500)
    real.scheduler.tick()
    assert len(real.begun) == 1


def test_what_queues_behind_a_campaign_was_not_missed(real: Lab) -> None:
    real.scheduler.tick()
    real.occupy(occupied=True)
    real.scheduler.tick()
    waits = real.enter(at="2026-01-05T10:00Z")
    real.live(12 * H)
    real.occupy(occupied=False)
    real.scheduler.tick()
    assert (len(real.begun), real.outcomes(waits)) == (1, ["refused"])


def test_what_queues_behind_a_campaign_through_a_pause_of_the_process_was_not_missed(real: Lab) -> None:
    real.occupy(occupied=True)
    real.scheduler.tick()
    real.enter(at="2026-01-05T10:00Z")
    real.clock.sleep(8 * 3600)  # the computer was suspended, and the campaign goes on
    real.live(H)
    real.occupy(occupied=False)
    real.scheduler.tick()
    assert len(real.begun) == 1


def test_a_campaign_that_a_new_service_resumes_does_not_excuse_what_was_missed_before(real: Lab) -> None:
    missed, fresh = real.enter(at="2026-01-05T10:00Z"), real.enter(at="2026-01-05T15:30Z")
    real.clock.sleep(8 * 3600)  # no service until 16:00
    real.occupy(occupied=True)  # by what it resumes
    real.live(5 * H)
    assert (real.outcomes(missed), real.outcomes(fresh)) == (["missed"], [])
    real.occupy(occupied=False)
    real.scheduler.tick()
    assert (real.outcomes(fresh), len(real.begun)) == (["refused"], 1)


def under_way(real: Lab) -> StoreJournal:
    """Write down a campaign on the bench that begins now, as its engine does."""
    at = real.clock.utc()
    new = NewCampaign("short", {}, BENCH.name, {}, "0" * 64, 1.0, [{"kind": "soak", "expected_s": 1.0}], [])
    journal = real.store.campaigns.journal(real.store.campaigns.create(new, at))
    journal.campaign_state(CampaignState.RUNNING, "", 0.0, at)
    real.occupy(occupied=True)
    return journal


@pytest.mark.slow
def test_a_restart_does_not_make_a_start_late_that_queues_behind_a_campaign(real: Lab) -> None:
    journal = under_way(real)
    waits = real.enter(at="2026-01-05T10:00Z")
    real.live(6 * H)
    journal.event(Event("soak", "a soak begins"), 6 * 3600.0, real.clock.utc())
    real.clock.sleep(600)  # no service for ten minutes
    real.scheduler = real.service()
    real.live(2 * H)  # the campaign is resumed
    assert real.outcomes(waits) == []
    journal.campaign_state(CampaignState.DONE, "", 8 * 3600.0, real.clock.utc())
    real.clock.sleep(600)  # again none, between the campaigns
    real.occupy(occupied=False)
    real.scheduler = real.service()
    real.scheduler.tick()
    assert (len(real.begun), real.outcomes(waits)) == (1, ["refused"])


def test_a_restart_after_hours_without_a_service_excuses_no_start(real: Lab) -> None:
    journal = under_way(real)
    missed = real.enter(at="2026-01-05T10:00Z")
    real.live(4 * H)
    journal.event(Event("soak", "a soak begins"), 4 * 3600.0, real.clock.utc())
    real.clock.sleep(2 * 3600)
    real.store.campaigns.close_unfinished(1, "not resumed", real.clock.utc())  # by the next service
    real.occupy(occupied=False)
    real.scheduler = real.service()
    real.scheduler.tick()
    assert (real.begun, real.outcomes(missed)) == ([], ["missed"])
    assert "4 h 00 min late, 2 h 00 min of it without a campaign on the bench" in real.message(missed)


def test_a_service_reads_the_past_before_it_resumes_a_campaign(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    local = LabService(store, VirtualClock(START), BenchRunner(store, BENCH, VirtualClock)).bench_access
    assert isinstance(local, LocalBench)
    assert local.runner is not None
    assert local.scheduler is not None
    monkeypatch.setattr(local.runner, "resume_unfinished", lambda: order.append("resume"))
    monkeypatch.setattr(local.scheduler, "read_the_past", lambda: order.append("past"))
    monkeypatch.setattr(local.scheduler, "start", lambda: None)
    local.start()
    local.close()
    assert order[:2] == ["past", "resume"]


def test_the_time_without_a_campaign_after_one_is_what_counts(real: Lab) -> None:
    real.occupy(occupied=True)
    real.scheduler.tick()
    held = real.enter(at="2026-01-05T10:00Z")
    real.live(6 * H)
    real.occupied = False  # aborted by a stop that is not taken back: nothing begins
    real.live(H / 2)
    assert real.outcomes(held) == []
    real.live(H)
    assert real.outcomes(held) == ["missed"]
    assert "5 h 00 min late, 1 h 01 min of it without a campaign on the bench" in real.message(held)
    real.free = True  # a person has taken the stop back
    real.live(H)
    assert real.begun == []


def test_without_a_supervisor_what_is_due_is_missed(real: Lab) -> None:
    real.scheduler.attended = lambda: False
    start = real.enter(at="now")
    real.live(2 * H)
    assert (real.begun, real.outcomes(start)) == ([], ["missed"])


def test_a_missed_start_stays_in_the_list_until_a_person_removes_it(real: Lab) -> None:
    once = real.enter(at="2026-01-05T10:00Z")
    daily = real.enter(cron="0 9 * * *", time_zone="UTC")
    real.clock.sleep(5 * 3600)
    real.scheduler.tick()
    listed = {entry.id: entry for entry in list_starts(real.store, ended=False)}
    assert {number: entry.state for number, entry in listed.items()} == {once: "missed", daily: "waiting"}
    assert (listed[once].due_at, listed[once].history[-1].outcome) == (None, "missed")
    assert listed[daily].due_at == datetime(2026, 1, 6, 9, tzinfo=UTC)
    assert cancel_start(real.store, once, real.clock.utc()).state == "cancelled"
    assert [entry.id for entry in list_starts(real.store, ended=False)] == [daily]
    with pytest.raises(Conflict, match="state: cancelled"):
        cancel_start(real.store, once, real.clock.utc())


@pytest.mark.slow
@pytest.mark.parametrize("simulated", [True, False])
def test_only_a_real_bench_of_a_service_has_the_default(
    tmp_path: Path, store: Store, monkeypatch: pytest.MonkeyPatch, simulated: bool
) -> None:
    monkeypatch.setattr(BenchFile, "is_simulated", property(lambda _: simulated))
    clock = VirtualClock(START)
    runner = BenchRunner(store, BENCH, VirtualClock)
    lab_service = LabService(store, clock, runner)
    assert isinstance(lab_service.bench_access, LocalBench)
    scheduler = lab_service.bench_access.scheduler
    assert scheduler is not None
    with TestClient(create_app(lab_service)) as client:
        asked = {"recipe": "short", "at": "2026-01-05T10:00Z", **({} if simulated else CONFIRMED)}
        made = client.post("/api/campaigns", json=asked).json()
        assert made["missed_after_s"] == (None if simulated else 3600)
        clock.sleep(6 * 3600)
        scheduler.tick()
        if (job := runner._job) is not None and job.thread is not None:
            job.thread.join()
        [event] = start_status(store, made["id"]).history
        assert event.outcome == ("started" if simulated else "missed")
        assert len(store.campaigns.all()) == int(simulated)
        listed = [(entry["state"], entry["history"][0]["outcome"]) for entry in client.get("/api/schedule").json()]
        assert listed == ([] if simulated else [("missed", "missed")])
    if not simulated:
        [told] = [row.detail for row in store.audit.rows() if row.action == "schedule start"]
        assert told["outcome"] == "missed"
        assert "check the bench, then start recipe short again" in told["message"]
        shown = CliRunner().invoke(app, ["campaign", "schedule", "list", "--database", str(tmp_path / "lab.sqlite")])
        assert "missed" in shown.stdout, shown.output
        assert "then start recipe short again" in " ".join(shown.stdout.split())
