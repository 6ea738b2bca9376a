"""A person beside a running campaign: questions, pauses, impatience, and whoever only listens."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from labctl.api import create_app
from labctl.errors import Conflict, StoreError
from labctl.services.campaigns import preparation
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from procedures.contracts.operator import HumanOperator
from tests.helpers.service import service_of
from tests.helpers.waiting import wait_until

PATIENCE = 2000  #: looks at a campaign before a test gives up
WAIT_S = 60.0  #: for the next sign of life


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
    """Look at campaign 1, whenever its runner says that something happened, until it is as wanted."""
    runner = service_of(client).bench_runner
    return wait_until(runner.listen, lambda: client.get("/api/campaigns/1").json(), wanted)


def post(client: TestClient, act: str, **body: Any) -> Any:
    return client.post(f"/api/campaigns/1/{act}", json=body)


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


def command(database: Path, *arguments: str) -> list[str]:
    return [sys.executable, "-m", "labctl", *arguments, "--database", str(database)]


def begun(database: Path) -> None:
    """Wait until the first data set of a campaign in another process is being taken."""
    for _ in range(PATIENCE):
        with contextlib.suppress(Conflict, StoreError):  # the other process is making the database
            if database.exists():
                with open_store(str(database), write=False) as store:
                    if any(step.kind == "acquire" and step.started_s for step in store.campaigns.steps(1)):
                        return
        SystemClock().sleep(0.05)  # another process has its own pace
    raise AssertionError("no data set was ever taken")


def ended(database: Path) -> tuple[str, str]:
    with open_store(str(database), write=False) as store:
        row = store.campaigns.get(1)
        return row.state, row.reason


@contextlib.contextmanager
def campaigning(database: Path) -> Iterator[subprocess.Popen[str]]:
    """A campaign at a terminal of its own that has begun to measure."""
    arguments = ("campaign", "start", "short", "--bench", "single-axis-sim", "--speed", "15", "--json")
    with subprocess.Popen(
        command(database, *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        begun(database)
        yield process


@pytest.mark.timeout(400)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ending_it_twice_in_a_row_still_leaves_the_bench_safe(tmp_path: Path, number: signal.Signals) -> None:
    database = tmp_path / "lab.sqlite"
    with campaigning(database) as process:
        process.send_signal(number)
        process.send_signal(number)
        _, said = process.communicate(timeout=100)
    if process.returncode == 130:
        assert "campaign 1 was stopped; bench single-axis-sim is safe" in said
    assert process.returncode in {130, 1}  # the second may come when the bench is safe and the command is at its end
    assert ended(database) == ("aborted", "interrupted (Ctrl-C or a signal)")


@pytest.mark.timeout(400)
def test_impatience_after_the_end_was_written_changes_nothing_any_more(tmp_path: Path) -> None:
    database = tmp_path / "lab.sqlite"
    with campaigning(database) as process:
        process.send_signal(signal.SIGINT)
        while process.poll() is None and ended(database)[0] != "aborted":
            SystemClock().sleep(0.01)  # another process has its own pace
        while process.poll() is None:
            process.send_signal(signal.SIGINT)
            SystemClock().sleep(0.002)
        _, said = process.communicate(timeout=100)
    assert process.returncode == 130, said
    assert said.count("\n") == 1
    assert "campaign 1 was stopped; bench single-axis-sim is safe" in said


@pytest.mark.timeout(400)
def test_a_service_that_is_interrupted_twice_ends_its_campaign_first(tmp_path: Path) -> None:
    database = tmp_path / "lab.sqlite"
    arguments = ("serve", "--bench", "single-axis-sim", "--speed", "15", "--port", "0", "--json")
    with subprocess.Popen(
        command(database, *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        subprocess.run(command(database, "campaign", "start", "short"), check=True, capture_output=True)
        begun(database)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=100)
    assert "stopped; bench single-axis-sim is safe" in said
    state, reason = ended(database)
    assert (state, "the service stops" in reason) == ("aborted", True)
