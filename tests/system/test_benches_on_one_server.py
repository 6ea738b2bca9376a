"""Three benches, each with its own service, on one PostgreSQL server: one is killed, and the server is restarted."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
import tomli_w

from instruments.bench_config import read_bench
from labctl.store import open_store
from labctl.store.connection.database import Database
from labctl.store.schema import tables
from studies.postgresql_cluster import Cluster
from tests.helpers.forked_commands import run_labctl
from tests.helpers.paths import RECIPES
from tests.helpers.processes import ServiceProcess
from tests.helpers.waiting import before_next_request

NAMES = ("bench-a", "bench-b", "bench-c")
KILLED = 1
#: At a hundred times its pace a bench takes a server that is away for a second for instruments silent for 100 s.
PATIENT = (RECIPES / "short.toml").read_text(encoding="utf-8").replace("[soak]", "[guards]\nstale_s = 6000\n[soak]")
DATA_SETS = 15


def bench_file(folder: Path, name: str) -> Path:
    """Write a bench like the shipped one, with a name and a unit of its own."""
    bench = read_bench("single-axis-sim").model_dump(exclude_none=True)
    bench["name"], bench["gyros"][0]["serial"] = name, f"FOG-{name}"
    path = folder / f"{name}.toml"
    path.write_text(tomli_w.dumps(bench))
    return path


class Laboratory:
    """The services, each on its bench, and one database."""

    def __init__(self, database: str, folder: Path) -> None:
        self.database = database
        self._benches = [bench_file(folder, name) for name in NAMES]
        self._opened = ExitStack()
        self.services = [self.serve(number) for number in range(len(NAMES))]

    def serve(self, number: int) -> ServiceProcess:
        """Start the service of a bench."""
        service = ServiceProcess(self.database, "--speed", "100", bench=self._benches[number])
        self._opened.callback(service.close)
        return service

    def close(self) -> None:
        """End all processes."""
        self._opened.close()


@pytest.fixture
def laboratory(url: str, tmp_path: Path) -> Iterator[Laboratory]:
    made = Laboratory(url, tmp_path)
    yield made
    made.close()


def get(service: ServiceProcess, path: str) -> Any:
    answer = service.http.get(path)
    assert answer.status_code == 200, answer.text
    return answer.json()


def command(database: str, *words: str) -> tuple[int, str]:
    done = run_labctl([*words, "--database", database])
    return done.returncode, done.stdout + done.stderr


def complete_data_sets(database: str) -> Counter[tuple[int, int]]:
    """Return how often each data set of each campaign's plan is there as a complete one."""
    r, d = tables.recordings.c, tables.data_sets.c
    opened = Database(database, write=False)
    query = sa.select(r.campaign_id, d.planned).where(d.state == "complete", d.recording_id == r.id)
    with opened.reading() as connection:
        found = Counter((row[0], row[1]) for row in connection.execute(query))
    opened.close()
    return found


@pytest.mark.slow
def test_a_service_that_is_killed_is_known_to_be_gone_and_resumes_alone(
    laboratory: Laboratory, cluster: Cluster
) -> None:
    services, database = laboratory.services, laboratory.database
    for service in services:  # before any campaign
        rows = get(service, "/api/benches/status")
        assert [(row["name"], row["last_used_at"], row["driver"]["url"]) for row in rows] == [
            (name, None, other.url) for name, other in zip(NAMES, services, strict=True)
        ]
    campaigns = [
        int(each.http.post("/api/campaigns", json={"recipe": PATIENT}).raise_for_status().json()["id"])
        for each in services
    ]
    for service in services:  # each answers for all
        rows = get(service, "/api/campaigns")
        assert {row["id"]: row["bench"] for row in rows} == dict(zip(campaigns, NAMES, strict=True))
        assert not any(row["abandoned"] for row in rows), rows
        assert all(row["active"] for row in rows), rows
        assert [unit["serial"] for unit in get(service, "/api/units")] == [f"FOG-{name}" for name in NAMES]
        drivers = [row["driver"] for row in get(service, "/api/benches/status")]
        assert [(each["url"], each["alive"]) for each in drivers] == [(other.url, True) for other in services]
    refused = services[0].http.post(f"/api/campaigns/{campaigns[2]}/pause", json={"reason": "tea"})
    assert (refused.status_code, f"service at {services[2].url}" in refused.text) == (409, True), refused.text

    services[KILLED].wait_for_data_set(campaigns[KILLED])
    services[KILLED].close()
    while not (gone := get(services[0], f"/api/campaigns/{campaigns[KILLED]}"))["abandoned"]:  # the test has a time-out
        before_next_request()
    assert (gone["abandoned"], gone["active"]) == (True, False)
    row = next(each for each in get(services[2], "/api/benches/status") if each["name"] == NAMES[KILLED])
    assert not row["driver"]["alive"]
    assert "is gone, last sign of life at" in row["driver"]["text"]
    status, said = command(database, "bench", "status")
    assert (status, "bench-b" in said, said.count("is gone, last sign")) == (1, True, 1), said
    resumed_elsewhere = services[0].http.post(f"/api/campaigns/{campaigns[KILLED]}/resume", json={"by": "Ada"})
    assert (resumed_elsewhere.status_code, "on its own bench only" in resumed_elsewhere.text) == (409, True)

    cluster.stop()
    cluster.start()
    services[KILLED] = laboratory.serve(KILLED)
    ended = [service.until_ended(campaign) for service, campaign in zip(services, campaigns, strict=True)]
    assert [each["state"] for each in ended] == ["done"] * 3, ended
    expected = {(campaign, number): 1 for campaign in campaigns for number in range(1, DATA_SETS + 1)}
    assert complete_data_sets(database) == expected
    with open_store(database, write=False) as store:
        assert store.audit.first_broken() is None
        taken_up = [any(e.kind == "taken_up" for e in store.campaigns.events(campaign)) for campaign in campaigns]
        assert taken_up == [number == KILLED for number in range(len(NAMES))]
        assert [row.unconfirmed for row in store.benches.all()] == [""] * 3
    status, said = command(database, "bench", "status", "--json")
    assert (status, [row["driver"]["alive"] for row in json.loads(said)]) == (0, [True] * 3), said
