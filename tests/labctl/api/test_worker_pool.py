"""A service that computes in worker processes: many clients at once, one that leaves, and what never waits for them."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import pytest

from labctl.fitting.effects import read_formulas
from labctl.services.computation import InWorkers, Limits
from labctl.services.criticism.criticise import criticise_unit
from tests.helpers.browser import Service
from tests.helpers.computations import PIPE, Held, die_in_a_worker, hold, hold_request
from tests.helpers.patience import WAIT_S
from tests.helpers.simulated_recordings import single_axis

LIMITS = Limits(at_once=2, waiting=3, niceness=0)
CLIENTS = 50


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    made = Service(tmp_path, bench=None, limits=LIMITS)
    made.start()
    yield made
    made.stop()


@pytest.fixture
def unit(service: Service) -> str:
    recording = single_axis(1)
    service.lab_service.store.recordings.add_import(recording, recording.info.started_at)
    service.post(f"/api/units/{recording.info.serial}/calibrations", {"model": "ojeda2000"})
    return recording.info.serial


def workers_of(service: Service) -> InWorkers:
    found = service.lab_service.computation
    assert isinstance(found, InWorkers)
    return found


def fill(service: Service, folder: Path) -> Held:
    """Let one worker be held, and the rest of the pool and its queue be full of the same."""
    held = Held(folder)
    workers = workers_of(service)
    workers.submit(hold, held.pipe)
    held.wait_for_begin()
    for _ in range(LIMITS.at_once + LIMITS.waiting - 1):
        workers.submit(hold, held.pipe)
    return held


@pytest.mark.slow
def test_of_many_at_once_so_many_are_computed_and_the_rest_told_when_to_come_back(service: Service, unit: str) -> None:
    path = f"{service.url}/api/units/{unit}/calibrations/1/criticism"
    formulas = [f"own: table_rate_dps**{5 + number}" for number in range(CLIENTS)]
    with ThreadPoolExecutor(CLIENTS) as clients, httpx.Client(limits=httpx.Limits(max_connections=CLIENTS)) as http:
        asked = [clients.submit(http.get, path, params={"formula": each}, timeout=WAIT_S) for each in formulas]
        answers = [each.result(WAIT_S) for each in asked]
    statuses = [answer.status_code for answer in answers]
    assert set(statuses) == {200, 429}
    assert statuses.count(200) >= LIMITS.at_once + LIMITS.waiting
    for formula, answer in zip(formulas, answers, strict=True):
        if answer.status_code == 200:
            expected = criticise_unit(service.lab_service.store, unit, 1, None, tuple(read_formulas([formula])))
            assert answer.json() == expected.model_dump(mode="json")
        else:
            assert answer.json()["type"] == "urn:labctl:problem:too-busy"
            assert int(answer.headers["Retry-After"]) >= 1


@pytest.mark.slow
def test_what_is_quick_never_waits_for_a_worker(service: Service, unit: str, tmp_path: Path) -> None:
    held = fill(service, tmp_path)
    version = f"/api/units/{unit}/calibrations/1"
    with ThreadPoolExecutor(CLIENTS) as clients:
        for _ in range(CLIENTS):
            clients.submit(httpx.get, service.url + f"{version}/criticism", timeout=WAIT_S)
        for path in ("/health", f"/api/units/{unit}/calibration?version=1", f"{version}/surface", "/"):
            assert httpx.get(service.url + path, timeout=10.0).status_code == 200
    refused = [
        httpx.get(service.url + f"{version}/criticism"),
        httpx.get(service.url + f"{version}/criticism/events"),
        httpx.post(service.url + f"{version}/preview", json={"formula": ["k: table_rate_dps**3"]}),
        httpx.post(service.url + f"/api/units/{unit}/calibrations", json={}),
        httpx.post(service.url + "/api/plans", json={"recipe": "short", "visibility": True}),
    ]
    held.close()
    assert [answer.status_code for answer in refused] == [429] * len(refused)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "end"), [("verify_unit", "verification"), ("criticise_unit", "criticism/events")])
def test_a_client_that_leaves_ends_its_worker(
    service: Service, unit: str, name: str, end: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = Held(tmp_path)
    monkeypatch.setenv(PIPE, held.pipe)
    monkeypatch.setattr(f"labctl.api.routers.calibrations.{name}", hold_request)
    with socket.create_connection(("127.0.0.1", service.port), timeout=WAIT_S) as client:
        path = f"/api/units/{unit}/calibrations/1/{end}"
        client.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        held.wait_for_begin()
    held.wait_for_end()
    assert service.get("/health")["status"] == "ok"


@pytest.mark.slow
def test_a_worker_that_dies_is_a_problem_document(service: Service, unit: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("labctl.api.routers.calibrations.verify_unit", die_in_a_worker)
    answer = httpx.get(f"{service.url}/api/units/{unit}/calibrations/1/verification", timeout=WAIT_S)
    assert (answer.status_code, answer.json()["type"]) == (503, "urn:labctl:problem:computation-ended")
    assert "memory" in answer.json()["detail"]
