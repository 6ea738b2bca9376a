"""A stop while the PostgreSQL server is frozen and API keys are required: the table stops nevertheless.

What counts is what the table hears. The server keeps its connections open and answers nothing: whatever waits for it
waits until it goes on.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest

from labctl.services.admin.api_keys import create_key
from labctl.services.schemas.admin import KeyRequest, Role
from labctl.services.schemas.campaigns import BENCH_CHECKS
from labctl.store import AuditRow, open_store
from studies.postgresql_cluster import Cluster
from tests.helpers.postgresql import running_cluster
from tests.helpers.processes import WAIT_S, ServiceProcess, running
from tests.helpers.simulator_process import FIRST_DPS, RECIPE, Simulator
from tests.helpers.waiting import before_next_request

pytestmark = pytest.mark.timeout(400)  # processes that start on a busy machine

ABORT = "!1a"
START = {"recipe": RECIPE.format(rate=FIRST_DPS), "confirmed_by": "Ada", "checks": list(BENCH_CHECKS)}
#: More requests that wait for the database than any pool of threads of the web process has threads.
CROWD = 60


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    with running_cluster() as made:
        yield made


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[Simulator]:
    made = Simulator(tmp_path)
    try:
        yield made
    finally:
        made.close()


@pytest.fixture
def thawed(cluster: Cluster) -> Iterator[None]:
    """Let the server go on before the service ends, whose end is looked up in its database."""
    yield
    cluster.thaw()


@pytest.fixture
def service(cluster: Cluster, simulator: Simulator, thawed: None) -> Iterator[ServiceProcess]:
    database = cluster.new_database()
    with open_store(database, write=True) as store:
        key = create_key(store, KeyRequest(name="ada", role=Role.OPERATOR), datetime.now(UTC)).key
    with running(database, "--bench", str(simulator.bench), "--require-keys") as made:
        made.http.headers["Authorization"] = f"Bearer {key}"
        yield made


def wait_until(simulator: Simulator, holds: Callable[[list[dict[str, Any]]], bool]) -> None:
    """Wait until what the instruments have heard is as expected."""
    while not (simulator.heard and holds(simulator.heard)):  # the test has a time-out
        before_next_request()


def turning(service: ServiceProcess, simulator: Simulator) -> int:
    """Start a campaign; returns its number once the table turns."""
    started = service.http.post("/api/campaigns", json=START)
    assert started.status_code == 201, started.text
    wait_until(simulator, lambda lines: lines[-1]["table_turns"])
    return int(started.json()["id"])


def stopped(simulator: Simulator) -> int:
    """Wait until the table was commanded to stop, and stands; returns how much the instruments have heard by then."""
    wait_until(simulator, lambda lines: any(ABORT in line["heard"] for line in lines))
    wait_until(simulator, lambda lines: not lines[-1]["table_turns"])
    return len(simulator.heard)


def abort_of(service: ServiceProcess, campaign: int) -> httpx.Response:
    asked = {"reason": "a hand in the bench", "by": "Ada"}
    return service.http.post(f"/api/campaigns/{campaign}/abort", json=asked)


def ended(service: ServiceProcess, campaign: int) -> dict[str, Any]:
    """Ask until the campaign has ended; returns it."""
    while True:
        with suppress(httpx.TransportError, ValueError):
            answer = service.http.get(f"/api/campaigns/{campaign}", timeout=WAIT_S)
            if answer.status_code == 200 and answer.json()["state"] in {"aborted", "failed", "done"}:
                found: dict[str, Any] = answer.json()
                return found
        before_next_request()


def stops(service: ServiceProcess) -> list[AuditRow]:
    """Wait until a stop is in the audit trail, and return all that are."""
    while True:
        with open_store(str(service.database), write=False) as store:
            found = [row for row in store.audit.rows() if row.action in {"campaign abort", "bench stop"}]
        if found:
            return found
        before_next_request()


def recorded_once(service: ServiceProcess, campaign: int, reason: str) -> None:
    found = ended(service, campaign)
    assert (found["state"], reason in found["reason"]) == ("aborted", True), found["reason"]
    assert [row.detail["reason"] for row in stops(service)] == [reason]


def test_a_stop_with_a_key_is_carried_out_while_the_database_is_frozen(
    cluster: Cluster, service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    cluster.freeze()
    refused = service.http.post(
        f"/api/campaigns/{campaign}/abort", json={}, headers={"Authorization": "Bearer labctl_not-a-key"}
    )
    assert refused.status_code == 401, refused.text
    assert simulator.heard[-1]["table_turns"]
    answer = abort_of(service, campaign)
    quiet = stopped(simulator)
    assert "NOT STOPPED" not in answer.text, answer.text
    cluster.thaw()
    recorded_once(service, campaign, "a hand in the bench (Ada)")
    assert not any(line["table_turns"] for line in simulator.heard[quiet:])


@contextmanager
def crowd(service: ServiceProcess) -> Iterator[None]:
    """Send many requests that wait for the database, with right and wrong keys, for the block."""
    right, wrong = service.http.headers["Authorization"], "Bearer labctl_not-a-key"

    def ask(number: int) -> None:
        paths = ("/api/campaigns", "/api/campaigns/1", "/api/campaigns/1/events", "/api/units", "/health")
        head = {"Authorization": wrong if number % 2 else right}
        with suppress(httpx.TransportError):
            if number % 6 == 1:
                httpx.post(f"{service.url}/api/campaigns/1/abort", json={}, headers=head, timeout=WAIT_S)
            else:
                httpx.get(f"{service.url}{paths[number % len(paths)]}", headers=head, timeout=WAIT_S)

    threads = [threading.Thread(target=ask, args=(number,), daemon=True) for number in range(CROWD)]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        service.process.kill()
        for thread in threads:
            thread.join(WAIT_S)


def test_requests_that_wait_for_the_frozen_database_keep_no_stop_from_the_table(
    cluster: Cluster, service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    cluster.freeze()
    with crowd(service):
        answer = abort_of(service, campaign)
        stopped(simulator)
        assert "NOT STOPPED" not in answer.text, answer.text
        cluster.thaw()
        recorded_once(service, campaign, "a hand in the bench (Ada)")


def test_the_command_stops_the_table_while_the_database_is_frozen(
    cluster: Cluster, service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    cluster.freeze()
    (bench,) = json.loads(service.run("stop", "--by", "Ada", "--json").stdout)["benches"]
    assert bench["stands"], bench["text"]
    quiet = stopped(simulator)
    cluster.thaw()
    recorded_once(service, campaign, "stopped from the command line (Ada)")
    assert not any(line["table_turns"] for line in simulator.heard[quiet:])
