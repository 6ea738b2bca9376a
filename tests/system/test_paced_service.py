"""A service with a simulated bench at a speed that a busy computer does not reach: it answers, stops and ends."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess, end_of, running
from tests.helpers.waiting import before_next_request

#: Campaigns that are far from their end when they are stopped.
RECIPES = {"triaxial-sim": "quick-triaxial", "single-axis-sim": "ojeda2000"}


def begin_campaign(service: ServiceProcess, bench: str) -> int:
    answer = service.http.post("/api/campaigns", json={"recipe": RECIPES[bench], "clip": True})
    assert answer.status_code == 201, answer.text
    return int(answer.json()["id"])


def described_at_speed(service: ServiceProcess) -> dict[str, Any]:
    """Return the bench once it is known which speed its simulated time reaches."""
    while True:
        (bench,) = service.http.get("/api/benches").json()
        assert bench["campaign"] is not None
        if bench["speed_reached"] is not None:
            return dict(bench)
        before_next_request()


@pytest.mark.parametrize("speed", ["1000", "0"])
@pytest.mark.parametrize("bench", list(RECIPES))
def test_a_fast_simulation_answers_says_its_speed_stops_and_ends(tmp_path: Path, bench: str, speed: str) -> None:
    database = tmp_path / "lab.sqlite"
    with running(database, "--bench", bench, "--speed", speed) as service:
        first = begin_campaign(service, bench)
        described = described_at_speed(service)
        assert described["speed"] == (float(speed) or None)
        assert 0 < described["speed_reached"] <= 1.2 * (float(speed) or float("inf"))
        assert service.http.get("/health").json()["bench"]["speed"] == described["speed"]
        answer = service.http.post(f"/api/campaigns/{first}/abort", json={"by": "Ann", "reason": "seen enough"})
        assert answer.status_code == 200, answer.text
        assert service.until_ended(first)["state"] == "aborted"
        second = begin_campaign(service, bench)
        described_at_speed(service)
        service.process.send_signal(signal.SIGTERM)
        assert service.process.wait(WAIT_S) == 0
        assert end_of(database, first)[0] == "aborted"
        assert end_of(database, second) == ("aborted", "aborted: the service stops")
