"""A stop while processes of the service are frozen or dead, on a table at the end of a wire: by page, command, signal.

What counts is what the table hears: that it is stopped, and that nothing starts it again before a person does.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import pytest

from labctl.processes.supervisor import SILENT_S
from labctl.processes.supervisor_watch import is_stopped
from labctl.store import open_store
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess, running
from tests.helpers.simulator_process import Simulator
from tests.helpers.stopped_table import ABORT, START, turning, wait_until
from tests.helpers.waiting import before_next_request, eventually


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[Simulator]:
    made = Simulator(tmp_path)
    try:
        yield made
    finally:
        made.close()


@pytest.fixture
def service(simulator: Simulator, tmp_path: Path) -> Iterator[ServiceProcess]:
    with running(tmp_path / "lab.sqlite", "--bench", str(simulator.bench)) as made:
        yield made


def status(url: str, campaign: int) -> dict[str, Any]:
    """Ask until the service answers; returns the campaign."""
    while True:
        with contextlib.suppress(httpx.TransportError, ValueError):
            answer = httpx.get(f"{url}/api/campaigns/{campaign}", timeout=WAIT_S)
            if answer.status_code == 200:
                found: dict[str, Any] = answer.json()
                return found
        before_next_request()


def ended(url: str, campaign: int) -> dict[str, Any]:
    """Ask until the campaign has ended; returns it."""
    while (found := status(url, campaign))["state"] not in {"aborted", "failed", "done"}:
        before_next_request()
    return found


def starts_of(simulator: Simulator, after: int) -> list[dict[str, Any]]:
    """Return what the table has heard while it turned after a stop was carried out."""
    return [line for line in simulator.heard[after:] if line["table_turns"]]


def test_a_stop_asked_of_a_frozen_bench_process_is_carried_out_and_honoured_by_its_successor(
    service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    os.kill(service.bench_pid, signal.SIGSTOP)
    asked = service.http.post(f"/api/campaigns/{campaign}/abort", json={"reason": "a hand in the bench", "by": "Ada"})
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    assert "NOT STOPPED" not in asked.text, asked.text
    found = ended(service.url, campaign)
    assert (found["state"], "a hand in the bench (Ada)" in found["reason"]) == ("aborted", True)
    quiet = len(simulator.heard)
    bench = service.http.get("/api/benches").json()[0]
    assert (bench["campaign"], bench["stop"]["phase"]) == (None, "stopped")
    with open_store(str(service.database), write=False) as store:
        rows = [row for row in store.audit.rows() if row.action == "campaign abort"]
    assert [row.detail["reason"] for row in rows] == ["a hand in the bench (Ada)"]
    scheduled = service.http.post("/api/campaigns", json={**START, "at": "now"})
    assert scheduled.status_code == 202, scheduled.text
    for _ in range(20):
        before_next_request()
    assert starts_of(simulator, quiet) == []  # what is scheduled waits for a person
    assert service.http.post("/api/benches/single-axis-sim/clear", json={"by": "Ada"}).status_code == 200
    wait_until(simulator, lambda lines: lines[-1]["table_turns"])


def test_with_supervisor_and_bench_process_dead_the_command_goes_to_the_instruments(
    service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    service.process.kill()
    os.kill(service.bench_pid, signal.SIGKILL)
    service.process.wait()
    stopped = service.run("stop", "--json")
    (bench,) = json.loads(stopped.stdout)["benches"]
    assert (bench["stands"], "stopped directly: table at rest" in bench["text"]) == (True, True)
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    quiet = len(simulator.heard)
    with running(service.database, "--bench", str(simulator.bench)) as heir:
        assert ended(heir.url, campaign)["state"] == "aborted"
        assert heir.http.get("/api/benches").json()[0]["stop"]["phase"] == "stopped"
        assert starts_of(simulator, quiet) == []


def test_an_abort_with_no_process_left_stops_the_table_first(service: ServiceProcess, simulator: Simulator) -> None:
    campaign = turning(service, simulator)
    service.process.kill()
    os.kill(service.bench_pid, signal.SIGKILL)
    service.process.wait()
    assert json.loads(service.run("campaign", "abort", str(campaign), "--json").stdout)["state"] == "aborted"
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    wait_until(simulator, lambda lines: not lines[-1]["table_turns"])


def test_a_bench_process_without_its_service_answers_at_the_address_and_gives_it_back(
    service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    service.process.kill()
    service.process.wait()
    while True:  # the page opens once the bench process knows that it is alone
        with contextlib.suppress(httpx.TransportError):
            shown = httpx.get(service.url, timeout=WAIT_S)
            break
        before_next_request()
    assert (shown.status_code, f"Campaign {campaign} runs" in shown.text) == (503, True)
    at = service.url.rpartition(":")[2]
    with running(service.database, "--bench", str(simulator.bench), "--port", at) as heir:
        assert (heir.url, heir.bench_pid) == (service.url, service.bench_pid)
        assert heir.http.get(f"/api/campaigns/{campaign}").json()["state"] == "running"
        heir.process.kill()
        heir.process.wait()
        while True:
            with contextlib.suppress(httpx.TransportError):
                stopped = httpx.post(f"{service.url}/api/campaigns/{campaign}/abort", json={}, timeout=WAIT_S)
                break
            before_next_request()
        assert (stopped.status_code, stopped.json()["stands"]) == (200, True)
        wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))


def test_sigterm_with_a_frozen_bench_process_leaves_the_table_at_rest_and_says_so(
    service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    os.kill(service.bench_pid, signal.SIGSTOP)
    service.process.send_signal(signal.SIGTERM)
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    _, said = service.process.communicate(timeout=WAIT_S)
    assert (service.process.returncode, "table at rest" in said) == (0, True)
    quiet = len(simulator.heard)
    with running(service.database, "--bench", str(simulator.bench)) as heir:
        found = ended(heir.url, campaign)
        assert (found["state"], "the service stops" in found["reason"]) == ("aborted", True)
        assert heir.http.get("/api/benches").json()[0]["stop"] is None  # the end of a service holds nothing
        assert starts_of(simulator, quiet) == []


def test_a_frozen_web_process_keeps_no_stop_from_the_table(service: ServiceProcess, simulator: Simulator) -> None:
    campaign = turning(service, simulator)
    os.kill(service.web_pid, signal.SIGSTOP)
    asked = httpx.post(f"{service.url}/api/campaigns/{campaign}/abort", json={"reason": "smoke"}, timeout=WAIT_S)
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    assert asked.json()["stands"] is True
    assert ended(service.url, campaign)["state"] == "aborted"


def test_with_a_supervisor_that_stands_still_and_no_web_process_the_bench_process_answers(
    service: ServiceProcess, simulator: Simulator
) -> None:
    """The supervisor would start a web process again; until then, another process has to take a stop at the address."""
    campaign = turning(service, simulator)
    os.kill(service.process.pid, signal.SIGSTOP)
    os.kill(service.web_pid, signal.SIGKILL)
    while True:
        with contextlib.suppress(httpx.TransportError):
            stopped = httpx.post(f"{service.url}/api/campaigns/{campaign}/abort", json={}, timeout=WAIT_S)
            break
        before_next_request()
    assert (stopped.status_code, stopped.json()["stands"]) == (200, True)
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    os.kill(service.process.pid, signal.SIGCONT)
    assert ended(service.url, campaign)["state"] == "aborted"  # of a web process again


def test_a_signal_to_a_supervisor_that_stands_still_is_carried_out_by_the_others(
    service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    for pid in (service.process.pid, service.bench_pid):
        os.kill(pid, signal.SIGSTOP)
        eventually(partial(is_stopped, pid))  # a signal that comes before that may still be heard
    service.process.send_signal(signal.SIGTERM)
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    wait_until(simulator, lambda lines: not lines[-1]["table_turns"])
    quiet = len(simulator.heard)
    service.process.send_signal(signal.SIGCONT)
    service.process.communicate(timeout=WAIT_S)
    assert service.process.returncode == 0
    with running(service.database, "--bench", str(simulator.bench)) as heir:
        assert ended(heir.url, campaign)["state"] == "aborted"
        assert starts_of(simulator, quiet) == []


def named_by(log: Path, bench_pid: int) -> str:
    """Return which process said what a stop could not confirm, by the log of the service.

    The supervisor ends a bench process that it did not hear for its limit; the guardian one that did not stop the bench
    in time for the process that asked. Both then stop the bench themselves, and the log says which of them did.
    """
    lines = logged(log)
    silent = [line for line in lines if line["event"] == "child.silent"]
    ended = [line for line in lines if line["event"] == "guardian.ends_child"]
    assert {line["child_pid"] for line in silent + ended} <= {bench_pid}, silent + ended
    assert all(line["silent_s"] >= SILENT_S for line in silent), silent
    return "supervisor" if silent else "guardian" if ended else "bench process"


def logged(log: Path) -> list[dict[str, Any]]:
    """Return the lines of the log of a service."""
    return [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines() if line.startswith("{")]


@pytest.mark.slow
def test_instruments_that_do_not_answer_a_stop_are_named_until_they_do(simulator: Simulator, tmp_path: Path) -> None:
    log = tmp_path / "service.log"
    with running(tmp_path / "lab.sqlite", "--bench", str(simulator.bench), log=log) as service:
        campaign = turning(service, simulator)
        simulator.process.send_signal(signal.SIGSTOP)
        try:
            asked = service.http.post(f"/api/campaigns/{campaign}/abort", json={"reason": "a hand in the bench"})
            assert asked.status_code == 503
            assert "NOT STOPPED" in asked.text
            assert "Use the stop switch" in asked.text
            while "table" not in (bench := service.http.get("/api/benches").json()[0])["unconfirmed"]:
                before_next_request()
            assert service.http.get("/health").json()["status"] == "look at the bench"
            if (process := named_by(log, service.bench_pid)) == "bench process":
                assert bench["stop"]["phase"] in {"asked", "stopping"}
            while process == "bench process" and not status(service.url, campaign)["step_text"].startswith(
                "stopping: table"
            ):
                before_next_request()  # the bench is marked before the step's text is
                process = named_by(log, service.bench_pid)
            replaced = service.bench_was_replaced  # before the log is read, which says so first
            assert replaced <= (named_by(log, service.bench_pid) != "bench process")
            while process != "bench process" and not any(line["event"] == "guardian.stopped" for line in logged(log)):
                before_next_request()
            assert not any(line["stands"] for line in logged(log) if line["event"] == "guardian.stopped")
        finally:
            simulator.process.send_signal(signal.SIGCONT)
        assert "a hand in the bench" in ended(service.url, campaign)["reason"]
        wait_until(simulator, lambda lines: not lines[-1]["table_turns"])
