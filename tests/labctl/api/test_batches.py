"""Batches of units: stated of all that are named or of none, kept in the audit trail, and a filter of the list."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from labctl.api import create_app
from labctl.cli.app import app
from labctl.client import Client
from labctl.recording import RecordingInfo
from labctl.services.lab_service import LabService
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from labctl.store.schema import tables
from tests.helpers.service import transport_to

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
SERIALS = [f"G{k}" for k in range(5)]


@pytest.fixture
def location(tmp_path: Path) -> str:
    path = str(tmp_path / "lab.sqlite")
    with open_store(path, write=True) as store:
        add_units(store._database)
    return path


def add_units(database: Database) -> None:
    with database.writing() as connection:
        for serial in SERIALS:
            info = RecordingInfo.model_validate({"serial": serial, "axes": ["z"], "kind": "points", "started_at": AT})
            connection.execute(sa.insert(tables.units).values(serial=serial, model="VG", first_seen_at=AT))
            connection.execute(
                sa.insert(tables.recordings).values(
                    serial=serial, kind="points", info=info.model_dump(mode="json"), channels=[], created_at=AT
                )
            )


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    with open_store(location, write=True) as opened:
        yield opened


@pytest.fixture
def client(store: Store) -> Iterator[TestClient]:
    with TestClient(create_app(LabService(store, VirtualClock()))) as opened:
        yield opened


def state(client: TestClient, status: int = 200, **asked: Any) -> dict[str, Any]:
    answer = client.post("/api/batches", json={"by": "Q", **asked})
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


def of_batch(client: TestClient, query: str) -> list[str]:
    return [unit["serial"] for unit in client.get(f"/api/units?{query}").json()]


def test_units_of_a_batch_are_listed_and_searched(client: TestClient) -> None:
    assert client.get("/api/batches").json() == []
    assert state(client, batch="26-W12", serials=["G1", "G3", "G1"], supplier="ACME") == {"batch": "26-W12", "units": 2}
    assert state(client, batch="26-W13", serials=["G4"]) == {"batch": "26-W13", "units": 1}
    assert client.get("/api/batches").json() == [{"batch": "26-W12", "units": 2}, {"batch": "26-W13", "units": 1}]
    assert of_batch(client, "batch=26-W12") == ["G1", "G3"]
    assert of_batch(client, "batch=26") == []
    assert of_batch(client, "search=w13") == ["G4"]
    assert of_batch(client, "search=acme") == ["G1", "G3"]
    assert of_batch(client, "batch=26-W12&calibration=none&limit=1") == ["G1"]
    unit = client.get("/api/units/G3").json()
    assert (unit["batch"], unit["supplier"]) == ("26-W12", "ACME")


def test_a_later_statement_replaces_the_batch_and_keeps_the_supplier(client: TestClient) -> None:
    state(client, batch="A", serials=["G0"], supplier="ACME")
    state(client, batch="B", serials=["G0"])
    unit = client.get("/api/units/G0").json()
    assert (unit["batch"], unit["supplier"]) == ("B", "ACME")
    state(client, batch="", serials=["G0"], supplier="")
    unit = client.get("/api/units/G0").json()
    assert (unit["batch"], unit["supplier"]) == ("", "")
    assert client.get("/api/batches").json() == []


def test_each_change_is_in_the_audit_trail_with_what_was_stated_before(client: TestClient, store: Store) -> None:
    state(client, batch="A", serials=["G0", "G1"])
    state(client, batch="B", serials=["G0", "G1"], supplier="ACME")
    state(client, batch="B", serials=["G0"])  # changes nothing
    rows = [row for row in store.audit.rows() if row.action == "unit batch"]
    assert [row.subject for row in rows] == ["G0", "G1", "G0", "G1"]
    assert rows[-1].detail["batch"] == "B"
    assert rows[-1].detail["supplier"] == "ACME"
    assert rows[-1].detail["before"] == {"batch": "A", "supplier": ""}
    assert rows[-1].who == "Q"
    assert store.audit.first_broken() is None


def test_a_unit_that_is_absent_leaves_all_as_they_were(client: TestClient) -> None:
    problem = state(client, 404, batch="A", serials=["G0", "NOPE"])
    assert "1 of 2 units are not in this database, first 'NOPE'" in problem["detail"]
    assert client.get("/api/batches").json() == []


@pytest.mark.parametrize("asked", [{"serials": []}, {"serials": ["G0"], "by": ""}, {"batch": "x" * 101}])
def test_a_request_that_states_nothing_is_refused(client: TestClient, asked: dict[str, Any]) -> None:
    state(client, 422, **{"batch": "A", "serials": ["G0"], **asked})
    assert client.get("/api/batches").json() == []


def test_a_span_of_due_dates_takes_no_batch(client: TestClient) -> None:
    answer = client.get("/api/units?due_within=30d&batch=A")
    assert answer.status_code == 400
    assert "due_within is given together" in answer.json()["detail"]


def test_the_command_line_takes_serial_numbers_from_a_file(location: str, tmp_path: Path) -> None:
    listed = tmp_path / "serials.txt"
    listed.write_text("\ufeffG1\r\n\r\nG2\n", encoding="utf-8")
    runner = CliRunner()
    there = ["--database", location]
    done = runner.invoke(app, ["batches", "set", "26-W12", "G0", "--from", str(listed), "--by", "Q", *there])
    assert done.exit_code == 0, done.output
    assert runner.invoke(app, ["batches", "list", *there]).output.split()[-2:] == ["26-W12", "3"]
    listing = runner.invoke(app, ["units", "--batch", "26-W12", *there]).output
    assert [serial for serial in SERIALS if serial in listing] == ["G0", "G1", "G2"]
    empty = runner.invoke(app, ["batches", "set", "26-W12", *there])
    assert empty.exit_code == 2
    assert "0 serial numbers were given" in empty.output
    binary = tmp_path / "binary"
    binary.write_bytes(b"\xff\xfe\x00")
    refused = runner.invoke(app, ["batches", "set", "A", "--from", str(binary), *there])
    assert refused.exit_code == 2
    assert "cannot be read as text" in refused.output


def test_the_client_lists_the_units_of_a_batch(client: TestClient) -> None:
    state(client, batch="A", serials=["G2"])
    with Client("http://testserver", transport=transport_to(client)) as lab:
        assert [unit.serial for unit in lab.units(batch="A")] == ["G2"]
        assert len(lab.units()) == len(SERIALS)
