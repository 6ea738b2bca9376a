"""The processes of a service are killed and stopped: each is started again, and the campaign continues or is
resumed."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from labctl.store import holder_of
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess, begin_loaded, first_line, running
from tests.helpers.waiting import before_next_request

#: Slow enough that a campaign lasts while processes start again.
SPEED = ("--speed", "10")


@pytest.fixture
def service(tmp_path: Path) -> Iterator[ServiceProcess]:
    with running(tmp_path / "lab.sqlite", *SPEED) as made:
        yield made


def started(service: ServiceProcess) -> int:
    campaign: int = service.http.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    asked_until(service, f"/api/campaigns/{campaign}", lambda reported: reported["state"] == "running")
    return campaign


def holder(service: ServiceProcess) -> int:
    """Return the process that holds the database."""
    found = holder_of(str(service.database))
    assert found is not None
    return found.pid


def serve(service: ServiceProcess, *options: str) -> subprocess.Popen[str]:
    """Start another service on the same database."""
    return begin_loaded(["serve", "--json", *SPEED, *options, "--database", str(service.database)])


def is_replaced(service: ServiceProcess) -> bool:
    """Return whether another process than the service's first bench process holds the database."""
    found = holder_of(str(service.database))
    return found is not None and found.pid != service.bench_pid


def asked_until(service: ServiceProcess, path: str, holds: Callable[[Any], bool]) -> Any:
    """Ask until the answer is as expected; requests that find no process wait for the next one."""
    while True:  # the test has a time-out
        answer = None
        with contextlib.suppress(httpx.TransportError, ValueError):
            answer = service.http.get(path).json()
        if answer is not None and holds(answer):
            return answer
        before_next_request()


def test_a_campaign_does_not_notice_that_the_web_process_is_killed(service: ServiceProcess) -> None:
    campaign = started(service)
    os.kill(service.web_pid, signal.SIGKILL)
    answer = asked_until(service, f"/api/campaigns/{campaign}", lambda reported: reported["t_s"] is not None)
    assert (answer["state"], answer["abandoned"], answer["last_error"]) == ("running", False, None)
    assert holder(service) == service.bench_pid
    assert service.http.post(f"/api/campaigns/{campaign}/abort", json={"reason": "tea"}).status_code == 200
    asked_until(service, f"/api/campaigns/{campaign}", lambda reported: reported["state"] == "aborted")


def test_a_killed_bench_process_is_started_again_and_takes_its_campaign_up(service: ServiceProcess) -> None:
    campaign = started(service)
    os.kill(service.bench_pid, signal.SIGKILL)
    runs = {"state": "running", "abandoned": False, "last_error": None}
    asked_until(
        service,
        f"/api/campaigns/{campaign}",
        # until its end is noticed, the killed process is still what the answer is about
        lambda reported: runs.items() <= reported.items() and is_replaced(service),
    )
    assert service.http.post(f"/api/campaigns/{campaign}/abort", json={"reason": "tea"}).status_code == 200


def test_a_stopped_bench_process_is_told_of_and_replaced(service: ServiceProcess) -> None:
    campaign = started(service)
    os.kill(service.bench_pid, signal.SIGSTOP)
    reported = asked_until(service, "/health", lambda reported: reported["bench"]["heard_s"] > 3)
    assert reported["status"] == "look at the bench"
    assert "the bench may move" in reported["bench"]["unconfirmed"]
    asked_until(
        service, "/health", lambda reported: reported["status"] == "ok" and reported["bench"]["campaign"] == campaign
    )
    assert holder(service) != service.bench_pid


def test_processes_that_stand_still_are_replaced_by_the_next_service(service: ServiceProcess) -> None:
    campaign = started(service)
    for child in (service.bench_pid, service.web_pid):
        os.kill(child, signal.SIGSTOP)
    service.process.kill()
    service.process.wait()
    at = str(service.http.base_url.port)  # the web process that stood still has given the address back
    heir = serve(service, "--port", at, "--bench", "single-axis-sim")
    try:
        reported = json.loads(first_line(heir))
        assert reported["bench_pid"] != service.bench_pid
        with httpx.Client(base_url=reported["url"], timeout=WAIT_S) as http:
            while http.get(f"/api/campaigns/{campaign}").json()["state"] != "running":
                pass  # the test has a time-out
        heir.send_signal(signal.SIGTERM)
        _, said = heir.communicate(timeout=WAIT_S)
        lines = [json.loads(line) for line in said.splitlines() if line.startswith("{")]
        assert {line["child_pid"] for line in lines if line["event"] == "child.silent"} == {service.bench_pid}
        assert "bench single-axis-sim is safe" in said
    finally:
        heir.kill()
        heir.communicate()


def test_a_bench_process_outlives_its_supervisor_and_the_next_service_takes_charge_of_it(
    service: ServiceProcess,
) -> None:
    campaign = started(service)
    service.process.kill()
    service.process.wait()
    other = service.run("serve", "--port", "0", "--json", *SPEED, "--bench", "triaxial-sim", status=2)
    assert "drives bench single-axis-sim at speed 10" in other.stderr
    heir = serve(service, "--port", "0", "--bench", "single-axis-sim")
    try:
        reported = json.loads(first_line(heir))
        assert reported["bench_pid"] == service.bench_pid
        with httpx.Client(base_url=reported["url"], timeout=WAIT_S) as http:
            assert http.get(f"/api/campaigns/{campaign}").json()["state"] == "running"
        heir.send_signal(signal.SIGTERM)
        _, said = heir.communicate(timeout=WAIT_S)
        assert "bench single-axis-sim is safe" in said
        assert holder_of(str(service.database)) is None
    finally:
        heir.kill()
        heir.communicate()
