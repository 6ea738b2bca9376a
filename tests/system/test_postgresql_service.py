"""Services on one PostgreSQL server: one driver for each bench, commands that find it, and deaths of either side."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator

import pytest

from labctl.store import AuditRow, open_store
from studies.postgresql_cluster import Cluster
from tests.helpers.paths import RECIPES
from tests.helpers.processes import ServiceProcess, end_of, running

#: At a hundred times its pace a bench takes a server that is away for a second for instruments silent for 100 s.
PATIENT = (RECIPES / "short.toml").read_text(encoding="utf-8").replace("[soak]", "[guards]\nstale_s = 6000\n[soak]")


@pytest.fixture
def service(cluster: Cluster) -> Iterator[ServiceProcess]:
    with running(cluster.new_database(), "--speed", "100") as made:
        yield made


def begin(service: ServiceProcess, recipe: str = "short") -> int:
    campaign = service.http.post("/api/campaigns", json={"recipe": recipe}).json()["id"]
    assert isinstance(campaign, int)
    return campaign


def test_a_second_service_on_the_bench_is_refused_and_leaves_its_campaign_alone(service: ServiceProcess) -> None:
    campaign = begin(service)
    refused = service.run("serve", "--bench", "single-axis-sim", "--port", "0", status=2)
    assert service.url in refused.stderr
    assert service.http.get(f"/api/campaigns/{campaign}").json()["state"] == "running"


def test_commands_about_a_bench_go_to_the_service_that_drives_it(service: ServiceProcess) -> None:
    started = json.loads(service.run("campaign", "start", "short", "--json").stdout)
    assert json.loads(service.run("campaign", "status", "--json").stdout)["state"] in {"planned", "running"}
    answer = json.loads(service.run("campaign", "abort", str(started["id"]), "--reason", "tea", "--json").stdout)
    assert (answer["state"], "tea" in answer["reason"]) == ("aborted", True)
    with open_store(service.database, write=False) as store:
        assert store.benches.unconfirmed("single-axis-sim") == ""


def test_another_process_ends_a_campaign_through_the_process_that_runs_it(service: ServiceProcess) -> None:
    campaign = begin(service)
    with open_store(service.database, write=True) as store:
        found = store.leases.holder("single-axis-sim")
        assert found is not None
        store.leases.note_address(found.machine, found.pid)  # a driver without a service, as a terminal is
    aborted = json.loads(service.run("campaign", "abort", str(campaign), "--reason", "tea", "--json").stdout)
    assert (aborted["state"], "tea" in aborted["reason"]) == ("aborted", True)
    rows = [row for row in _audit(service) if row.action == "campaign abort"]
    assert [row.detail["reason"] for row in rows] == ["tea"]


def _audit(service: ServiceProcess) -> list[AuditRow]:
    with open_store(service.database, write=False) as store:
        return store.audit.rows()


@pytest.mark.slow
def test_a_bench_process_that_was_killed_has_an_heir(service: ServiceProcess) -> None:
    campaign = begin(service)
    os.kill(service.bench_pid, signal.SIGKILL)
    ended = service.until_ended(campaign)
    assert ended["state"] == "done", ended["reason"]
    with open_store(service.database, write=False) as store:
        assert "taken_up" in {event.kind for event in store.campaigns.events(campaign)}


def test_a_restart_of_the_server_fails_no_campaign(cluster: Cluster, service: ServiceProcess) -> None:
    campaign = begin(service, PATIENT)
    cluster.stop()
    cluster.start()
    ended = service.until_ended(campaign)
    assert ended["state"] == "done", ended["reason"]
    assert end_of(service.database, campaign)[0] == "done"
