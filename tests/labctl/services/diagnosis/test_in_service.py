"""Diagnoses over HTTP: a service criticises, and its schedule begins each campaign on its bench, once."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from labctl.answers.campaigns import BENCH_CHECKS
from labctl.answers.criticism import CriticismResponse
from labctl.api import create_app
from labctl.client import Client
from labctl.services import lab_service
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.lab_service import LabService
from labctl.services.local_bench import LocalBench
from labctl.services.planning.loading import load_bench
from labctl.services.schedule.queue import list_starts
from labctl.services.schedule.scheduler import REAL_BENCH_LATE_LIMIT_S, Scheduler
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.diagnoses import NOW, UNIT, criticism, experiment
from tests.helpers.service import transport_to
from tests.helpers.waiting import eventually

EXPERIMENTS = [
    experiment("a temperature that the chamber does not reach", 1.0, temperatures_c=[500.0]),
    experiment("at rest at one temperature", 1.0),
]


def scripted(store: Store, serial: str, version: int, recordings: tuple[int, ...]) -> CriticismResponse:
    """Name one cause as soon as there are two recordings."""
    del store, serial, version
    if len(recordings) > 1:
        return criticism("missing", "warm_up", recordings=recordings)
    return criticism("ambiguous", "thermal_lag", "warm_up", experiments=EXPERIMENTS)


class Service:
    """A service whose schedule and diagnoses are advanced by the test, not by their threads."""

    def __init__(self, location: str) -> None:
        self.store = Store(Database(location, write=True))
        bench = load_bench("single-axis-sim")
        self.clock = VirtualClock(NOW)
        self.runner = BenchRunner(self.store, bench, lambda: VirtualClock(NOW))
        self.lab = LabService(self.store, self.clock, self.runner)
        self.http = TestClient(create_app(self.lab))

    @property
    def scheduler(self) -> Scheduler:
        """The schedule of the bench."""
        assert isinstance(self.lab.bench_access, LocalBench)
        assert self.lab.bench_access.scheduler is not None
        return self.lab.bench_access.scheduler

    def tick(self) -> None:
        """Make the moves that can be made now, and run what the schedule begins to its end."""
        self.lab._diagnoses.tick()
        self.scheduler.tick()
        eventually(lambda: not self.runner.busy)

    def post(self, path: str, status: int = 200, **body: object) -> Any:
        response = self.http.post(path, json=body)
        assert response.status_code == status, response.text
        return response.json()


@pytest.fixture
def service(location: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    monkeypatch.setattr(lab_service, "criticise_together", scripted)
    opened = Service(location)
    yield opened
    opened.lab.close()


@pytest.mark.slow
def test_a_diagnosis_for_the_night_judges_at_once_and_begins_no_experiment_before_its_time(service: Service) -> None:
    path = f"/api/units/{UNIT}/diagnoses"
    past = service.post(path, 400, at="2026-10-31T22:00Z")
    assert "is in the past" in past["detail"]
    started = service.post(path, 201, hours=8, at="2026-11-01T22:00", time_zone="Europe/Berlin")
    assert started["begins_at"] == "2026-11-01T21:00:00Z"
    campaigns = len(service.http.get("/api/campaigns").json())
    for _ in range(3):
        service.tick()
    waits = service.http.get(f"/api/diagnoses/{started['id']}").json()
    assert [each["came"] for each in waits["rounds"]] == ["cannot_be_done", None], "the bench does not reach 500 deg C"
    assert (waits["state"], waits["rounds"][1]["campaign"]) == ("measuring", None)
    assert waits["next"].startswith("have the service of bench single-axis-sim running")
    assert waits["next"].endswith("of round 2, not before 2026-11-01 21:00 UTC")
    assert len(service.http.get("/api/campaigns").json()) == campaigns
    [listed] = list_starts(service.store, ended=False)
    assert (listed.recipe, listed.state, listed.bench) == ("diagnosis-1-round-2", "waiting", "single-axis-sim")
    assert listed.due_at == datetime(2026, 11, 1, 21, tzinfo=UTC)
    assert [each["id"] for each in service.http.get("/api/schedule").json()] == [listed.id]
    service.clock.sleep(21 * 3600.0 + 1.0)
    for _ in range(4):
        service.tick()
    answer = service.http.get(f"/api/diagnoses/{started['id']}").json()
    assert (answer["state"], answer["outcome"], answer["named"]) == ("done", "one_cause", ["warm_up"])


def test_a_diagnosis_that_is_ended_before_its_time_leaves_the_schedule(service: Service) -> None:
    number = service.post(f"/api/units/{UNIT}/diagnoses", 201, at="2026-11-01T22:00Z")["id"]
    service.tick()
    assert [each.state for each in list_starts(service.store, ended=False)] == ["waiting"]
    service.post(f"/api/diagnoses/{number}/end", reason="not tonight")
    assert list_starts(service.store, ended=False) == []
    service.clock.sleep(23 * 3600.0)
    service.tick()
    assert service.store.campaigns.newest().id == 1


def test_a_confirmation_of_the_evening_does_not_begin_an_experiment_hours_late(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a real bench the confirmation is of the time that was given; the rule is that of every scheduled start."""
    monkeypatch.setattr(service.scheduler, "_late_limit_s", REAL_BENCH_LATE_LIMIT_S)
    monkeypatch.setattr(BenchFile, "is_simulated", property(lambda _: False))
    number = service.post(f"/api/units/{UNIT}/diagnoses", 201, at="2026-11-01T22:00Z")["id"]
    service.lab._diagnoses.tick()
    answer = {"round": 1, "by": "Ann", "checks": list(BENCH_CHECKS)}
    assert service.post(f"/api/diagnoses/{number}/confirm", **answer)["state"] == "measuring"
    service.lab._diagnoses.tick()
    refused = service.http.get(f"/api/diagnoses/{number}").json()
    assert [each["came"] for each in refused["rounds"]] == ["cannot_be_done", None]
    service.post(f"/api/diagnoses/{number}/confirm", **{**answer, "round": 2})
    service.lab._diagnoses.tick()
    assert [each.confirmed_by for each in list_starts(service.store, ended=False)] == ["Ann"]
    service.clock.sleep(24 * 3600.0)
    service.scheduler.tick()
    service.lab._diagnoses.tick()
    late = service.http.get(f"/api/diagnoses/{number}").json()
    assert (late["state"], late["rounds"][1]["confirmed_by"]) == ("awaiting_confirmation", "")
    assert service.store.campaigns.newest().id == 1


def test_a_service_carries_a_diagnosis_out(service: Service) -> None:
    started = service.post(f"/api/units/{UNIT}/diagnoses", 201, hours=8)
    assert (started["state"], started["rounds"]) == ("criticising", [])
    assert "has not ended" in service.post(f"/api/units/{UNIT}/diagnoses", 409)["detail"]
    for _ in range(4):
        service.tick()
    answer = service.http.get(f"/api/diagnoses/{started['id']}").json()
    assert (answer["state"], answer["outcome"], answer["named"]) == ("done", "one_cause", ["warm_up"])
    assert [each["came"] for each in answer["rounds"]] == ["cannot_be_done", "measured", None]
    assert "500" in answer["rounds"][0]["came_text"]
    campaign = service.store.campaigns.get(answer["rounds"][1]["campaign"])
    assert campaign.recipe_name == "diagnosis-1-round-2"
    assert campaign.bench["simulation"]["hidden"] == {"warm_up": 0.05}
    assert service.http.get(f"/api/units/{UNIT}/diagnoses").json() == [answer]
    assert service.store.campaigns.newest().id == campaign.id
    actions = [row.action for row in service.store.audit.rows()]
    assert [actions.count(each) for each in ("diagnosis start", "diagnosis round", "diagnosis experiment")] == [1, 3, 2]


def test_one_that_is_stopped_leaves_the_schedule_and_is_begun_again_when_it_is_resumed(service: Service) -> None:
    number = service.post(f"/api/units/{UNIT}/diagnoses", 201)["id"]
    service.lab._diagnoses.tick()
    assert [row.state for row in service.store.starts.all(ended=False)] == ["waiting"]
    service.lab._diagnoses.tick()
    assert len(service.store.starts.all(ended=True)) == 1
    stopped = service.post(f"/api/diagnoses/{number}/stop", reason="lunch", by="Ann")
    assert (stopped["state"], stopped["why"]) == ("stopped", "lunch (Ann)")
    assert service.store.starts.all(ended=False) == []
    service.tick()
    assert service.store.campaigns.newest().id == 1
    service.clock.sleep(60.0)
    assert service.post(f"/api/diagnoses/{number}/resume", reason="back")["state"] == "measuring"
    for _ in range(3):
        service.tick()
    assert service.http.get(f"/api/diagnoses/{number}").json()["outcome"] == "one_cause"


def test_one_that_is_ended_for_good_lets_another_begin(service: Service) -> None:
    number = service.post(f"/api/units/{UNIT}/diagnoses", 201)["id"]
    service.post(f"/api/diagnoses/{number}/stop", reason="lunch")
    service.post(f"/api/diagnoses/{number}/resume", reason="back")
    ended = service.post(f"/api/diagnoses/{number}/end", reason="enough")
    assert (ended["state"], ended["outcome"], ended["ended"]) == ("done", "ended_by_person", True)
    assert service.post(f"/api/units/{UNIT}/diagnoses", 201)["id"] == number + 1
    rows = [(row.action, row.detail.get("reason")) for row in service.store.audit.rows()]
    stop, resume, end = ("diagnosis stopped", "lunch"), ("diagnosis resume", "back"), ("diagnosis end", "enough")
    assert [row for row in rows if row[0] != "diagnosis start"][-3:] == [stop, resume, end]
    assert "was changed in the meantime" in service.post(f"/api/diagnoses/{number}/stop", 409, reason="x")["detail"]


def test_a_move_that_fails_again_and_again_waits_for_a_person(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> CriticismResponse:
        raise ValueError("no memory")

    monkeypatch.setattr(lab_service, "criticise_together", broken)
    number = service.post(f"/api/units/{UNIT}/diagnoses", 201)["id"]
    for _ in range(3):
        service.tick()
    answer = service.http.get(f"/api/diagnoses/{number}").json()
    assert (answer["state"], answer["why"]) == ("failed", "ValueError: no memory")


def test_the_client_has_a_method_for_each_path(service: Service) -> None:
    with Client("http://testserver", transport=transport_to(service.http)) as client:
        started = client.start_diagnosis(UNIT)
        assert client.diagnosis(started.id) == started
        assert client.act_on_diagnosis(started.id, "stop", "lunch").state == "stopped"
        assert client.act_on_diagnosis(started.id, "resume", "back").state == "criticising"
        assert client.act_on_diagnosis(started.id, "end", "enough").ended
        assert [each.id for each in client.diagnoses(UNIT)] == [started.id]
