"""A criticism over HTTP: followed stage by stage, and cancelled when its client leaves."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi.testclient import TestClient

from labctl.services.criticism import evaluation
from tests.helpers.browser import Service
from tests.helpers.held_criticism import HeldCriticism
from tests.helpers.patience import WAIT_S
from tests.helpers.service import add_recording
from tests.helpers.simulated_recordings import single_axis


def events_of(text: str) -> list[tuple[str, Any]]:
    found = []
    for message in text.strip().split("\n\n"):
        if not message.startswith(":"):
            kind, data = message.split("\n")
            found.append((kind.removeprefix("event: "), json.loads(data.removeprefix("data: "))))
    return found


@pytest.fixture
def path(client: TestClient) -> str:
    recording = single_axis(1)
    add_recording(client, recording)
    unit = f"/api/units/{recording.info.serial}/calibrations"
    assert client.post(unit, json={"model": "ojeda2000"}).status_code == 201
    return f"{unit}/1/criticism"


@pytest.mark.slow
def test_the_stages_come_first_and_the_answer_is_that_of_a_plain_get(client: TestClient, path: str) -> None:
    followed = client.get(f"{path}/events")
    assert followed.headers["content-type"].startswith("text/event-stream")
    *stages, (last, answer) = events_of(followed.text)
    names = [data["stage"] for kind, data in stages if kind == "stage"]
    assert len(names) == len(stages)
    assert names.index("fitting the model") < names.index("reducing the recording")
    assert any(name.startswith("comparing ") for name in names)
    assert (last, answer) == ("answer", client.get(path).json())
    assert [kind for kind, _ in events_of(client.get(f"{path}/events").text)] == ["answer"]


@pytest.mark.slow
def test_what_fails_at_once_is_a_problem_document_and_later_an_event(
    client: TestClient, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    missing = client.get(f"{path}/events", params={"recording": 77})
    assert missing.status_code == 404
    assert missing.json()["type"].endswith("not-found")

    def fails(*_: object, **__: object) -> None:
        raise evaluation.BadInput("no such thing")

    monkeypatch.setattr(evaluation, "criticise", fails)
    *_, (kind, problem) = events_of(client.get(f"{path}/events").text)
    assert (kind, problem["status"], problem["detail"]) == ("problem", 400, "no such thing")


@pytest.fixture
def served(tmp_path: Path) -> Iterator[str]:
    service = Service(tmp_path)
    service.start()
    recording = single_axis(1)
    service.lab_service.store.recordings.add_import(recording, recording.info.started_at)
    unit = f"/api/units/{recording.info.serial}/calibrations"
    service.post(unit, {"model": "ojeda2000"})
    yield f"{service.url}{unit}/1/criticism"
    service.stop()


class Client:
    """A client with a connection of its own, which it can close before the answer is there."""

    def __init__(self, url: str) -> None:
        address = httpx.URL(url)
        self._socket = socket.create_connection((address.host, address.port), timeout=WAIT_S)
        self._socket.sendall(f"GET {address.path} HTTP/1.1\r\nHost: {address.host}\r\n\r\n".encode())

    def followed(self) -> None:
        """Wait for the head of the answer: from then on the server knows of this client."""
        assert self._socket.recv(12) == b"HTTP/1.1 200"

    def leave(self) -> None:
        self._socket.close()


@pytest.mark.slow
@pytest.mark.parametrize("end", ["", "/events"])
def test_leaving_cancels_the_computation_and_leaves_nothing_in_the_cache(
    served: str, end: str, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = sorted(cache.rglob("*"))
    held = HeldCriticism(monkeypatch)
    client = Client(served + end)
    assert held.begun.wait(WAIT_S)
    client.leave()
    assert held.ended.wait(WAIT_S)
    assert held.cancelled
    assert sorted(cache.rglob("*")) == before


@pytest.mark.slow
def test_one_of_two_clients_that_leaves_does_not_cancel_the_others_answer(
    served: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = HeldCriticism(monkeypatch)
    one, other = Client(served), Client(f"{served}/events")
    assert held.begun.wait(WAIT_S)
    other.followed()
    one.leave()
    assert not held.ended.wait(2.0)
    other.leave()
    assert held.ended.wait(WAIT_S)
    assert held.cancelled
