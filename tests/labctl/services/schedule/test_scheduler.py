"""The queue of a bench: times, cron lines, priorities, missed starts, refusals, restarts. All in virtual time."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from labctl.answers.campaigns import CampaignRequest
from labctl.api import create_app
from labctl.errors import BadInput, BenchBusy, Conflict, DiskFull
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.commands.acts.start import START_CAMPAIGN
from labctl.services.commands.requests import CampaignStart
from labctl.services.lab_service import LabService
from labctl.services.local_bench import LocalBench
from labctl.services.schedule.queue import cancel_start, is_scheduled, list_starts, start_status
from labctl.services.schedule.scheduler import Scheduler
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from procedures.contracts.errors import PlanRefused
from tests.helpers.schedule_lab import BENCH, START, Lab


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def lab(store: Store) -> Lab:
    return Lab(store)


def test_a_start_begins_at_its_time_and_once(lab: Lab) -> None:
    lab.enter(at="2026-01-05T12:00+01:00")
    lab.live(timedelta(hours=8))
    assert [at for at, _ in lab.begun] == [datetime(2026, 1, 5, 11, tzinfo=UTC)]
    assert list_starts(lab.store, ended=False) == []
    assert [answer.state for answer in list_starts(lab.store, ended=True)] == ["ended"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("day", "expected"),
    [
        (datetime(2026, 3, 28, 12, tzinfo=UTC), [(29, 1, 0), (30, 0, 30)]),  # 03:00 CEST, then 02:30 CEST
        (datetime(2026, 10, 24, 12, tzinfo=UTC), [(25, 0, 30), (26, 1, 30)]),  # 02:30 CEST, then 02:30 CET
    ],
)
def test_a_cron_line_on_the_days_on_which_the_clocks_change(
    store: Store, day: datetime, expected: list[tuple[int, int, int]]
) -> None:
    lab = Lab(store, day)
    lab.enter(cron="30 2 * * *", time_zone="Europe/Berlin")
    lab.live(timedelta(days=2))
    assert [at for at, _ in lab.begun] == [
        day.replace(day=number, hour=hour, minute=minute) for number, hour, minute in expected
    ]


def test_what_is_due_waits_while_a_campaign_runs_and_the_highest_priority_goes_first(lab: Lab) -> None:
    lab.free = False
    lab.enter("short", at="now")
    lab.enter("ojeda2000", at="now", priority=5)
    lab.enter("ojeda2000-121", at="now", priority=5)
    lab.live(timedelta(hours=1))
    assert lab.begun == []
    lab.free = True
    lab.scheduler.tick()
    assert [recipe for _, recipe in lab.begun] == ["ojeda2000", "ojeda2000-121", "short"]


def test_a_missed_start_begins_late_and_once_for_all_that_were_missed(lab: Lab) -> None:
    daily = lab.enter(cron="0 2 * * *", time_zone="UTC")
    lab.clock.sleep(3 * 86400)  # no service for three nights
    lab.scheduler.tick()
    assert len(lab.begun) == 1
    history = start_status(lab.store, daily).history
    assert [event.due_at for event in history] == [datetime(2026, 1, 8, 2, tzinfo=UTC)]
    assert start_status(lab.store, daily).due_at == datetime(2026, 1, 9, 2, tzinfo=UTC)


def test_a_refused_start_says_why_and_does_not_block_the_others(lab: Lab) -> None:
    lab.refusal = PlanRefused("short", ["rate 900 deg/s is beyond the limit of the table, 400 deg/s"], "ask for less")
    first, second = lab.enter(at="now"), lab.enter(at="now")
    lab.scheduler.tick()
    assert lab.outcomes(first) == lab.outcomes(second) == ["refused"]
    assert "beyond the limit of the table" in lab.message(first)
    lab.refusal = Conflict("bench single-axis-sim is not safe: the table still moves")
    third = lab.enter(at="now")
    lab.scheduler.tick()
    assert "not safe" in lab.message(third)


def test_a_mistake_in_the_program_costs_one_start_only(lab: Lab) -> None:
    lab.refusal = RuntimeError("a mistake")
    broken = lab.enter(at="now")
    with pytest.raises(RuntimeError):
        lab.scheduler.tick()
    assert lab.message(broken) == "RuntimeError: a mistake"
    lab.refusal = None
    lab.enter(at="now")
    lab.scheduler.tick()
    assert len(lab.begun) == 1


def test_what_could_not_be_written_down_is_settled_once_it_can(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    start = lab.enter(at="now")

    def full(*_: object) -> None:
        raise DiskFull("the disk is full")

    with monkeypatch.context() as there:
        there.setattr(lab.store.starts, "conclude", full)
        with pytest.raises(DiskFull):
            lab.scheduler.tick()
    assert lab.outcomes(start) == ["claimed"]
    lab.scheduler.tick()
    assert lab.outcomes(start) == ["refused"]


def test_somebody_was_quicker(lab: Lab) -> None:
    lab.refusal = BenchBusy("bench single-axis-sim runs campaign 7 now")
    waits = lab.enter(cron="0 2 * * *", time_zone="UTC")
    lab.clock.sleep(86400)
    lab.scheduler.tick()
    assert lab.outcomes(waits) == []
    lab.refusal = None
    lab.scheduler.tick()
    assert (len(lab.begun), lab.outcomes(waits)) == (1, ["refused"])


def test_what_was_cancelled_does_not_begin(lab: Lab) -> None:
    start = lab.enter(at="2026-01-05T10:00Z")
    assert cancel_start(lab.store, start, lab.clock.utc()).state == "cancelled"
    lab.live(timedelta(hours=4))
    assert lab.begun == []
    with pytest.raises(Conflict, match=r"has already ended \(state: cancelled\)"):
        cancel_start(lab.store, start, lab.clock.utc())


class SetClock(VirtualClock):
    """A virtual clock that is set."""

    def __init__(self) -> None:
        super().__init__(START)
        self.set_by = timedelta(0)

    def utc(self) -> datetime:
        return super().utc() + self.set_by


def test_setting_the_clock_back_begins_nothing_twice_and_forward_leaves_nothing_out(lab: Lab) -> None:
    lab.clock = clock = SetClock()
    lab.scheduler = lab.service()
    lab.enter(cron="0 10 * * *", time_zone="UTC")
    lab.live(timedelta(hours=2, minutes=5))
    assert len(lab.begun) == 1
    clock.set_by = timedelta(hours=-1)
    lab.live(timedelta(hours=2))
    assert len(lab.begun) == 1
    clock.set_by = timedelta(hours=23)
    lab.live(timedelta(minutes=5))
    assert len(lab.begun) == 2


def test_a_bench_takes_only_its_own_starts(lab: Lab) -> None:
    lab.enter(at="now")
    Scheduler(lab.store, lab.clock, lab, "another-bench").tick()
    assert lab.begun == []


def test_a_process_that_dies_between_claim_and_campaign_starts_it_after_all(lab: Lab) -> None:
    lab.refusal = SystemExit()  # the process ends here
    daily = lab.enter(cron="0 2 * * *", time_zone="UTC")
    lab.clock.sleep(86400)
    with pytest.raises(SystemExit):
        lab.scheduler.tick()
    assert lab.outcomes(daily) == ["claimed"]
    lab.refusal = None
    again = lab.service()
    again.settle()
    again.tick()
    again.tick()
    assert (len(lab.begun), lab.outcomes(daily)) == (1, ["refused"])


@pytest.mark.parametrize(
    "wrong",
    [
        {"at": "now", "cron": "0 2 * * *"},
        {"priority": 3},
        {"time_zone": "UTC"},
        {"late_limit_s": 0},
    ],
)
def test_a_request_that_contradicts_itself_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(BadInput):
        is_scheduled(CampaignRequest.model_validate({"recipe": "short", **wrong}))


def test_what_can_be_known_now_is_refused_now(lab: Lab) -> None:
    with pytest.raises(PlanRefused):
        lab.enter("table1-x-table2", at="now")
    assert list_starts(lab.store, ended=True) == []


class Served:
    """A service in virtual time, whose schedule is read by the test."""

    def __init__(self, location: str) -> None:
        self.clock = VirtualClock(START)
        self.store = Store(Database(location, write=True))
        self.runner = BenchRunner(self.store, BENCH, VirtualClock)
        self.lab_service = LabService(self.store, self.clock, self.runner)
        assert isinstance(self.lab_service.bench_access, LocalBench)
        assert self.lab_service.bench_access.scheduler is not None
        self.scheduler = self.lab_service.bench_access.scheduler

    def rest(self) -> None:
        job = self.runner._job
        if job is not None and job.thread is not None:
            job.thread.join()


@pytest.mark.slow
def test_a_scheduled_campaign_runs_and_a_restart_begins_it_no_second_time(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    first = Served(location)
    request = CampaignRequest(recipe="short", at="2026-01-05T10:00Z")
    entry = first.lab_service.execute(START_CAMPAIGN, CampaignStart(request))
    first.scheduler.tick()
    assert first.store.campaigns.all() == []
    first.clock.sleep(7200)
    first.scheduler.tick()
    first.rest()
    [campaign] = first.store.campaigns.all()
    assert campaign.state == "done"
    event = start_status(first.store, entry.id).history[0]
    assert (event.outcome, event.campaign) == ("started", campaign.id)
    # as if the process had died after writing the campaign down and before saying so
    [claim] = first.store.starts.events(entry.id)
    first.store.starts.conclude(claim, START, "claimed", "is being started")
    first.store.close()
    second = Served(location)
    second.clock.sleep(8000)
    second.scheduler.settle()
    second.scheduler.tick()
    assert len(second.store.campaigns.all()) == 1
    assert start_status(second.store, entry.id).history[0].campaign == campaign.id
    second.store.close()


def test_the_schedule_over_http(tmp_path: Path) -> None:
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    lab_service = LabService(store, SystemClock(), BenchRunner(store, BENCH, VirtualClock))
    with TestClient(create_app(lab_service)) as client:
        body = {"recipe": "short", "cron": "30 2 * * *", "time_zone": "Europe/Berlin", "priority": 3}
        made = client.post("/api/campaigns", json=body)
        assert made.status_code == 202
        assert made.json()["state"] == "waiting"
        assert made.json()["due_at"][11:16] in {"02:30", "03:00"}
        local = client.post("/api/campaigns", json={"recipe": "short", "at": "2199-01-01T00:00"}).json()
        assert "no time zone was given" in local["note"]
        assert [entry["id"] for entry in client.get("/api/schedule").json()] == [1, 2]
        assert client.delete("/api/schedule/1").json()["state"] == "cancelled"
        assert client.delete("/api/schedule/1").status_code == 409
        assert client.get("/api/schedule/9").status_code == 404
        assert [entry["id"] for entry in client.get("/api/schedule").json()] == [2]
        assert len(client.get("/api/schedule", params={"ended": True}).json()) == 2
        for wrong in ({"at": "never"}, {"cron": "* *"}, {"at": "now", "cron": "0 2 * * *"}, {"priority": 1}):
            answer = client.post("/api/campaigns", json={"recipe": "short", **wrong})
            assert (answer.status_code, answer.json()["type"]) == (400, "urn:labctl:problem:bad-input"), wrong
        assert isinstance(lab_service.bench_access, LocalBench)
        assert lab_service.bench_access.scheduler is not None
        now = client.post("/api/campaigns", json={"recipe": "short", "at": "now"}).json()["id"]
        lab_service.bench_access.scheduler.tick()
        assert client.get(f"/api/schedule/{now}").json()["history"][0]["outcome"] == "started"
