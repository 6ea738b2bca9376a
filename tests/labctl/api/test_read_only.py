"""A service that only reads: it answers as the one that writes does, and refuses every act in one way."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock
from labctl.answers.admin import KeyRequest, Role
from labctl.answers.calibrations import FitRequest
from labctl.api import create_app
from labctl.api.access_policy import ASKING, AccessPolicy, ReadOnlyAccess
from labctl.errors import ReadOnly
from labctl.recording import Recording
from labctl.services.admin.api_keys import create_key
from labctl.services.commands.registry import COMMANDS, FIT
from labctl.services.commands.requests import ToUnit
from labctl.services.lab_service import LabService
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from tests.helpers.openapi import operations
from tests.helpers.service import add_recording, service_of

LAB = "http://lab.example:8420"
#: What a path is filled with: a unit with one version in force, one recording and one campaign.
PARAMETERS = {
    "{version}": "1", "{recording}": "1", "{campaign}": "1", "{bench}": "single-axis-sim", "{effect}": "constant_bias",
    "{sensor}": "accelerometer", "{job}": "1", "{diagnosis}": "1",
}  # fmt: skip
#: Their answers differ by the service, by the moment, or take seconds to compute.
OTHERS = (
    "/health", "/metrics", "/events", "/criticism", "/trend", "/datasheet", "/diagnostics", "/bench", "/live", "/laws",
    "/certificate", "/residuals", "/file",
)  # fmt: skip


#: What can be started or resumed depends on the bench of the service.
OF_BENCH = {"/api/campaigns/{campaign}", "/api/recipes"}


def reader_of(path: Path, access: AccessPolicy | None = None) -> TestClient:
    """Return a client of a service that only reads a database."""
    store = Store(Database(str(path), write=False, read_only=True))
    policy = access or AccessPolicy(read_only=ReadOnlyAccess(LAB))
    return TestClient(create_app(LabService(store, SystemClock(), acts_at=LAB), policy))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "lab.sqlite"


@pytest.fixture
def reader(client: TestClient, path: Path) -> Iterator[TestClient]:
    """A reader beside the service that writes."""
    assert client.get("/health").json()["read_only"] is False
    with reader_of(path) as opened:
        yield opened


@pytest.fixture
def serial(client: TestClient, make_points: Callable[..., Recording]) -> str:
    """A unit whose recording has a fit, version 1."""
    rate = np.linspace(-100.0, 100.0, 21)
    recording = make_points(rate, np.full(21, 25.0), 1.01 * rate + 0.1 + 0.01 * np.sin(rate))
    add_recording(client, recording)
    fitted = client.post(f"/api/units/{recording.info.serial}/calibrations", json={"effects": ["bias", "scale_factor"]})
    assert fitted.status_code == 201, fitted.text
    return recording.info.serial


def filled(path: str, serial: str) -> str:
    for name, value in {**PARAMETERS, "{serial}": serial}.items():
        path = path.replace(name, value)
    return path


def test_every_act_is_refused_with_one_problem_that_says_where_to_act(reader: TestClient, path: Path) -> None:
    rows = service_of(reader).store.audit.rows()
    asked = [(method, each) for method, each in operations() if method != "get" and each not in ASKING]
    assert {(command.method.lower(), command.path) for command in COMMANDS} <= set(asked)
    for method, each in asked:
        answer = reader.request(method.upper(), filled(each, "ONE"), content=b"not even read")
        problem = answer.json()
        assert (answer.status_code, problem["type"]) == (403, "urn:labctl:problem:read-only"), each
        assert problem["acts_at"] == LAB
        assert problem["detail"].endswith(
            f"this service is read-only, nothing was changed and nothing was stopped; send the request to {LAB}"
        )
    assert service_of(reader).store.audit.rows() == rows
    with reader_of(path, AccessPolicy(read_only=ReadOnlyAccess())) as unnamed:
        problem = unnamed.post("/api/stop", json={}).json()
        assert problem["acts_at"] is None
        assert "`labctl bench status` lists those with a bench" in problem["detail"]


@pytest.mark.slow
def test_what_is_read_equals_what_the_service_that_writes_answers(
    ran: TestClient, reader: TestClient, serial: str
) -> None:
    act = {"by": "Ann", "reason": "an exception for this test of reading", "override": True}
    assert ran.post(f"/api/units/{serial}/calibrations/1/certify", json=act).status_code == 200
    same = 0
    for method, each in operations():
        if method != "get" or each in OF_BENCH or any(part in each for part in OTHERS):
            continue
        address = filled(each, serial)
        written, read = ran.get(address), reader.get(address)
        assert (read.status_code, read.content) == (written.status_code, written.content), each
        same += read.status_code == 200
    assert same >= 25
    preview = {"recipe": "short"}
    assert reader.post("/api/plans", json=preview).status_code == 200
    health = reader.get("/health").json()
    assert (health["status"], health["read_only"], health["acts_at"], health["replica"]) == ("ok", True, LAB, None)
    heartbeat = reader.get("/health/heartbeat").json()
    assert (heartbeat["read_only"], heartbeat["acts_at"]) == (True, LAB)


def test_who_shows_no_key_does_not_learn_where_to_act(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        key = create_key(store, KeyRequest(name="Vera", role=Role.VIEWER), SystemClock().utc()).key
    with reader_of(tmp_path / "lab.sqlite", AccessPolicy(keys=True, read_only=ReadOnlyAccess(LAB))) as client:
        said = [
            client.get("/health/heartbeat", headers=sent).json() for sent in ({}, {"Authorization": f"Bearer {key}"})
        ]
        assert [(each["read_only"], each["acts_at"]) for each in said] == [(True, None), (True, LAB)]
        assert "acts_at" not in client.get("/health").json()


def test_a_fetch_is_answered_and_leaves_no_row(client: TestClient, reader: TestClient, serial: str) -> None:
    assert reader.get(f"/api/units/{serial}/calibration?version=1").status_code == 200
    assert reader.get(f"/api/units/{serial}/calibrations/1/fetches").json() == []
    assert client.get(f"/api/units/{serial}/calibration?version=1").status_code == 200
    assert len(client.get(f"/api/units/{serial}/calibrations/1/fetches").json()) == 1


def test_what_no_request_reaches_is_refused_too(reader: TestClient, serial: str) -> None:
    service = service_of(reader)
    with pytest.raises(ReadOnly, match="nothing was stored"):
        service.execute(FIT, ToUnit(serial, FitRequest(effects=["bias"])))
    assert len(reader.get(f"/api/units/{serial}/calibrations").json()) == 1


@pytest.mark.slow
def test_a_campaign_that_the_writer_may_run_is_not_called_abandoned(
    ran: TestClient, reader: TestClient, path: Path
) -> None:
    store = service_of(ran).store
    with store._database.writing() as connection:
        connection.exec_driver_sql("UPDATE campaigns SET state = 'running'")
    assert reader.get("/api/campaigns/1").json()["abandoned"] is False
    service_of(ran).close()
    assert reader.get("/api/campaigns/1").json()["abandoned"] is True


def test_a_key_is_asked_for_and_only_reads(client: TestClient, path: Path) -> None:
    store = service_of(client).store
    keys = {role: create_key(store, KeyRequest(name=role.value, role=role), SystemClock().utc()).key for role in Role}
    with reader_of(path, AccessPolicy(keys=True, read_only=ReadOnlyAccess(LAB))) as guarded:
        assert guarded.get("/api/units").status_code == 401
        assert guarded.post("/api/batches", json={}).status_code == 401
        for key in keys.values():
            as_key = {"Authorization": f"Bearer {key}"}
            assert guarded.get("/api/units", headers=as_key).status_code == 200
            refused = guarded.post("/api/batches", json={}, headers=as_key).json()
            assert refused["type"] == "urn:labctl:problem:read-only"
