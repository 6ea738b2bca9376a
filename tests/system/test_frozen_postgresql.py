"""A stop while the PostgreSQL server is frozen and API keys are required: the table stops nevertheless.

What counts is what the table hears. The server keeps its connections open and answers nothing: whatever waits for it
waits until it goes on.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

import httpx
import pytest

from labctl.answers.admin import KeyRequest, Role
from labctl.services.admin.api_keys import create_key
from labctl.store import open_store
from studies.postgresql_cluster import Cluster
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess, running
from tests.helpers.simulator_process import Simulator
from tests.helpers.stopped_table import ended, stopped, stops, turning

#: More requests that wait for the database than any pool of threads of the web process has threads.
CROWD = 60


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[Simulator]:
    made = Simulator(tmp_path)
    try:
        yield made
    finally:
        made.close()


@pytest.fixture
def service(cluster: Cluster, simulator: Simulator) -> Iterator[ServiceProcess]:
    database = cluster.new_database()
    with open_store(database, write=True) as store:
        key = create_key(store, KeyRequest(name="ada", role=Role.OPERATOR), datetime.now(UTC)).key
    with running(database, "--bench", str(simulator.bench), "--require-keys") as made:
        made.http.headers["Authorization"] = f"Bearer {key}"
        try:
            yield made
        finally:
            cluster.thaw()  # before the service ends, whose end is looked up in its database


def abort_of(service: ServiceProcess, campaign: int) -> httpx.Response:
    asked = {"reason": "a hand in the bench", "by": "Ada"}
    answer = service.http.post(f"/api/campaigns/{campaign}/abort", json=asked)
    # 503: it is said how the table is, and that this is not recorded; what counts is what the table hears
    assert answer.status_code in {200, 503}, answer.text
    return answer


def recorded_once(service: ServiceProcess, campaign: int, reason: str) -> None:
    found = ended(service, campaign)
    assert (found["state"], reason in found["reason"]) == ("aborted", True), found["reason"]
    rows = stops(service)
    assert [row.detail["reason"] for row in rows] == [reason], [(row.id, row.who, row.detail) for row in rows]


@pytest.mark.slow
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
    abort_of(service, campaign)
    quiet = stopped(simulator)
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


@pytest.mark.slow
def test_requests_that_wait_for_the_frozen_database_keep_no_stop_from_the_table(
    cluster: Cluster, service: ServiceProcess, simulator: Simulator
) -> None:
    campaign = turning(service, simulator)
    cluster.freeze()
    with crowd(service):
        abort_of(service, campaign)
        stopped(simulator)
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
