"""What pages ask to be truthful: a cheap sign of life, when a plan needs a person, and whose clock a time is of."""

from __future__ import annotations

from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from instruments.bench_config import BenchFile
from instruments.clock import SystemClock
from labctl.api import create_app
from labctl.api.access_policy import AccessPolicy
from labctl.services.lab_service import LabService
from labctl.store import Store
from labctl.store.connection.database import Database


def test_the_heartbeat_needs_no_key_and_no_database(tmp_path: Path) -> None:
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    with TestClient(create_app(LabService(store, SystemClock()), AccessPolicy(keys=True))) as client:
        assert client.get("/api/benches").status_code == 401
        store.close()
        first, second = (client.get("/health/heartbeat") for _ in range(2))
        assert first.status_code == 200
        assert first.json() == second.json()
        assert first.json()["status"] == "ok"
        assert client.post("/health/heartbeat").status_code in {401, 405}


def test_a_plan_says_when_a_start_needs_a_person(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = {"recipe": "short", "at": "2199-07-01T22:00", "time_zone": "Europe/Berlin"}
    assert client.post("/api/plans", json=asked).json()["attendance"] is None
    monkeypatch.setattr(BenchFile, "needs_person", property(lambda _: True))
    found = client.post("/api/plans", json=asked).json()["attendance"]
    assert found["text"].startswith("needs a person at Mon 22:0")
    assert found["text"].endswith("(Europe/Berlin)")
    assert found["at_night"] == found["needed_at"]
    assert found["better_start"] == "2199-07-02T07:00:00+02:00"
    assert "between 20:00 and 07:00; a start at Tue 07:00 needs no person at night" in found["warning"]
    weekly = {"recipe": "short", "cron": "0 9 * * FRI", "time_zone": "Europe/Berlin"}
    assert client.post("/api/plans", json=weekly).json()["attendance"]["warning"] == ""
    assert client.post("/api/plans", json={**asked, **weekly}).status_code == 400
    entered = client.post("/api/campaigns", json=asked).json()["attendance"]
    assert (entered["needed_at"], entered["warning"]) == (found["needed_at"], found["warning"])


@pytest.mark.slow
def test_the_date_of_a_recording_says_whose_clock_it_is_of(ran: TestClient) -> None:
    ran.post("/api/recordings/example", json={"name": "osu-fog"})
    assert {row["campaign"]: row["simulated_time"] for row in ran.get("/api/recordings").json()} == {
        1: True,
        None: False,
    }
    assert ran.get("/api/recordings/1").json()["simulated_time"] is True
    assert ran.get("/api/recordings/2").json()["simulated_time"] is False
