"""A person beside a running campaign: questions, pauses, impatience, and passive listeners."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from labctl.api import create_app
from labctl.services.campaigns import preparation
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from procedures.contracts.operator import HumanOperator
from tests.helpers.service import service_of
from tests.helpers.waiting import wait_until


@pytest.fixture
def runner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> BenchRunner:
    """A bench on which a person turns and switches the units."""
    monkeypatch.setattr(preparation, "operator_of", lambda _: HumanOperator())
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    return BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)


@pytest.fixture
def client(runner: BenchRunner) -> Iterator[TestClient]:
    with TestClient(create_app(LabService(runner._store, SystemClock(), runner))) as opened:
        yield opened


def until(client: TestClient, wanted: Any) -> Any:
    """Poll campaign 1, whenever its runner reports a change, until it is as wanted."""
    runner = service_of(client).bench_access
    return wait_until(runner.listen, lambda: client.get("/api/campaigns/1").json(), wanted)


def post(client: TestClient, act: str, **body: Any) -> Any:
    return client.post(f"/api/campaigns/1/{act}", json=body)


@pytest.mark.slow
def test_questions_are_answered_by_id_and_old_ids_are_refused(client: TestClient) -> None:
    client.post("/api/campaigns", json={"recipe": "short"})
    first = until(client, lambda answer: answer["prompt"])
    assert (first["state"], first["prompt"]["kind"], first["prompt"]["position"]) == ("waiting", "mount", "z")
    assert post(client, "confirm", prompt=first["prompt"]["id"], by="Ada").status_code == 200
    second = until(client, lambda answer: answer["prompt"] and answer["prompt"]["id"] != first["prompt"]["id"])
    late = post(client, "confirm", prompt=first["prompt"]["id"], by="Bob")
    assert (late.status_code, late.json()["type"]) == (409, "urn:labctl:problem:stale-prompt")
    assert post(client, "pause", reason="coffee", by="Ada").json()["wish"] == "pause"
    assert post(client, "confirm", prompt=second["prompt"]["id"], by="Ada").status_code == 200
    held = until(client, lambda answer: answer["state"] == "paused")
    assert (held["wish"], held["reason"]) == (None, "coffee (Ada)")
    assert post(client, "resume", by="Ada").status_code == 200
    done = until(client, lambda answer: answer["state"] == "done")
    assert done["progress"] == 1.0
    for act, body in (("pause", {"reason": "x"}), ("confirm", {"prompt": "1", "by": "Ada"}), ("resume", {})):
        assert post(client, act, **body).status_code == 409


def test_a_person_declines(client: TestClient) -> None:
    client.post("/api/campaigns", json={"recipe": "short"})
    prompt = until(client, lambda answer: answer["prompt"])["prompt"]
    post(client, "confirm", prompt=prompt["id"], by="Ada", confirmed=False, reason="the cube is hot")
    answer = until(client, lambda answer: answer["state"] == "failed")
    assert "Ada declined" in answer["reason"]
    assert "the cube is hot" in answer["reason"]


@pytest.mark.slow
def test_who_answered_is_recorded_and_listeners_that_are_gone_hold_nobody_up(
    client: TestClient, runner: BenchRunner
) -> None:
    heard: list[int] = []

    def dead() -> None:
        raise RuntimeError("Event loop is closed")

    runner.listen(dead)
    runner.listen(lambda: heard.append(1))
    client.post("/api/campaigns", json={"recipe": "short"})
    for _ in range(2):
        prompt = until(client, lambda answer: answer["prompt"])["prompt"]
        post(client, "confirm", prompt=prompt["id"], by="Ada")
        until(client, lambda answer, asked=prompt["id"]: not answer["prompt"] or answer["prompt"]["id"] != asked)
    until(client, lambda answer: answer["state"] == "done")
    assert len(heard) > 10
    assert dead not in runner._listeners
    said = [event.message for event in runner._store.campaigns.events(1) if event.kind.startswith("operator.")]
    assert sum("confirmed by Ada" in message for message in said) == 2


def test_a_bench_that_is_not_confirmed_safe_is_on_its_status_until_it_is_cleared(
    client: TestClient, runner: BenchRunner
) -> None:
    client.post("/api/campaigns", json={"recipe": "short"})
    post(client, "abort", reason="tea")
    runner._store.benches.mark("single-axis-sim", "table to rest: no answer", SystemClock().utc())
    assert client.get("/health").json()["status"] == "look at the bench"
    assert client.get("/api/benches").json()[0]["unconfirmed"] == "table to rest: no answer"
    refused = client.post("/api/campaigns", json={"recipe": "short"})
    assert (refused.status_code, "labctl bench clear" in refused.json()["detail"]) == (409, True)
    cleared = client.post("/api/benches/single-axis-sim/clear", json={"by": "Ada"})
    assert (cleared.status_code, cleared.json()["unconfirmed"]) == (200, "")
    assert client.get("/health").json()["status"] == "ok"
    assert client.post("/api/benches/nobody/clear", json={"by": "Ada"}).status_code == 404
