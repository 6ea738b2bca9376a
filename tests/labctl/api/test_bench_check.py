"""The check of a service's bench over HTTP: while no campaign runs, and kept for its page."""

from __future__ import annotations

from typing import Any

from fastapi.testclient import TestClient

PATH = "/api/benches/single-axis-sim/check"


def test_the_last_check_is_kept_with_its_time(client: TestClient) -> None:
    assert client.get("/api/benches").json()[0]["check"] is None
    answer = client.post(PATH, json={})
    assert answer.status_code == 200
    checked = answer.json()
    assert [(each["device"], each["kind"], each["state"]) for each in checked["devices"]] == [
        ("table", "table", "good"), ("chamber", "chamber", "good"), ("fog", "gyro", "good"),
    ]  # fmt: skip
    assert client.get("/api/benches").json()[0]["check"] == checked
    assert client.post(PATH, json={}).json()["checked_at"] > checked["checked_at"]


def test_another_bench_is_not_found_and_a_running_campaign_comes_first(client: TestClient) -> None:
    other = client.post("/api/benches/my-bench/check", json={})
    assert other.status_code == 404
    assert other.json()["detail"].startswith(
        "this service drives bench single-axis-sim, not 'my-bench', and can check only its own bench; name bench"
    )
    app: Any = client.app
    runner = app.state.service.bench_access.runner
    runner._job = type("Job", (), {"row": type("Row", (), {"id": 7})})
    busy = client.post(PATH, json={})
    runner._job = None
    assert busy.status_code == 409
    assert "runs campaign 7 now" in busy.json()["detail"]
