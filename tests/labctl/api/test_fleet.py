"""Fleet jobs over HTTP: begun at once, carried out by the service, cancelled, listed; and the report."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.clock import VirtualClock
from labctl.answers.fleet import FleetCancelRequest, FleetJobRequest, FleetPublishRequest, FleetReportRequest
from labctl.api import create_app
from labctl.client import Client, ServiceRefused
from labctl.service_connection import ServiceConnection
from labctl.services.commands.fleet import CANCEL_FLEET_JOB, START_FLEET_JOB, ToFleetJob
from labctl.services.commands.remote import HttpExecutor
from labctl.services.fleet.publishing import publish
from labctl.services.lab_service import LabService
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.fleets import AT, add_units
from tests.helpers.service import service_of, transport_to

UNITS = 3
FIT = {"kind": "fit", "effects": ["bias", "scale_factor"]}


@pytest.fixture
def http(tmp_path: Path) -> Iterator[TestClient]:
    """Return a client of a service whose jobs are carried out by the test, not by a thread."""
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    add_units(store, UNITS)
    service = LabService(store, VirtualClock(AT))
    yield TestClient(create_app(service))  # not entered: no thread watches
    service.close()


def carry_out(http: TestClient) -> None:
    service_of(http)._fleet.tick()


def get(http: TestClient, path: str, **query: Any) -> Any:
    return http.get(path, params=query).raise_for_status().json()


@pytest.mark.slow
def test_a_job_is_begun_at_once_and_carried_out_by_the_service(http: TestClient) -> None:
    begun = http.post("/api/fleet/jobs", json=FIT)
    assert begun.status_code == 201
    assert (begun.json()["state"], begun.json()["units"], begun.json()["waiting"]) == ("waiting", UNITS, UNITS)
    carry_out(http)
    job = get(http, "/api/fleet/jobs/1")
    assert (job["state"], job["ended"], job["done"], job["left_s"]) == ("done", True, UNITS, None)
    listed = http.get("/api/fleet/jobs/1/units", params={"state": "done", "limit": 2})
    assert [row["serial"] for row in listed.json()] == ["U00000", "U00001"]
    assert listed.headers["X-Total-Count"] == str(UNITS)
    assert "after=U00001" in listed.headers["Link"]
    with ServiceConnection("http://testserver", transport=transport_to(http)) as connection:
        service = HttpExecutor(connection)
        assert service.execute(START_FLEET_JOB, FleetJobRequest.model_validate(FIT)).id == 2
        cancelled = service.execute(CANCEL_FLEET_JOB, ToFleetJob(2, FleetCancelRequest(by="Ann", reason="not needed")))
        assert (cancelled.state, cancelled.why) == ("cancelled", "cancelled by Ann: not needed")
    assert [each["id"] for each in get(http, "/api/fleet/jobs")] == [2, 1]
    carry_out(http)
    assert get(http, "/api/fleet/jobs/2")["waiting"] == UNITS
    actions = [row["action"] for row in get(http, "/api/audit", limit=100)]
    assert {"fleet fit", "fleet cancel", "fleet end", "fit"} <= set(actions)


@pytest.mark.slow
def test_the_client_has_a_method_for_each_request(http: TestClient) -> None:
    with Client("http://testserver", transport=transport_to(http)) as client:
        begun = client.start_fleet_job(FleetJobRequest.model_validate(FIT))
        assert (begun.id, begun.state) == (1, "waiting")
        second = client.start_fleet_job(FleetJobRequest(kind="criticise", search="U00001"))
        assert client.cancel_fleet_job(second.id, "not needed", by="Ann").why == "cancelled by Ann: not needed"
        carry_out(http)
        assert client.fleet_job(1).done == UNITS
        assert [job.id for job in client.fleet_jobs(limit=1)] == [2]
        assert [unit.serial for unit in client.fleet_units(1, state="done", search="u00002")] == ["U00002"]
        assert len(client.fleet_units(1, limit=2)) == 2
        with pytest.raises(ServiceRefused, match="no unit of type 'none'") as refused:
            client.fleet_report(FleetReportRequest(type="none"))
        assert refused.value.status == 400
        kind = http.get("/api/units").json()[0]["model"]
        report = client.fleet_report(FleetReportRequest(type=kind))
        assert (report.type, report.figures.units) == (kind, UNITS)


def test_an_engine_is_used_only_where_the_service_was_started_with_it(
    http: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = {**FIT, "engine": "dask://192.0.2.1:8786"}
    refused = http.post("/api/fleet/jobs", json=elsewhere)
    assert refused.status_code == 400
    assert "LABCTL_FLEET_ENGINE=dask://192.0.2.1:8786" in refused.json()["detail"]
    monkeypatch.setenv("LABCTL_FLEET_ENGINE", "dask://192.0.2.1:8786")
    assert http.post("/api/fleet/jobs", json=elsewhere).status_code == 201
    unknown = http.post("/api/fleet/jobs", json={**FIT, "engine": "sausage"})
    assert (unknown.status_code, "choose local, dask or dask://" in unknown.text) == (422, True)
    assert http.post("/api/fleet/jobs", json={**FIT, "type": "none"}).status_code == 404


@pytest.mark.slow
def test_a_storage_is_read_only_where_the_service_was_started_with_it_and_never_with_a_password(
    http: TestClient, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    url = f"file://{tmp_path}/published"
    refused = http.post("/api/fleet/jobs", json={**FIT, "source": url})
    assert (refused.status_code, f"LABCTL_FLEET_SOURCE={url}" in refused.json()["detail"]) == (400, True)
    publish(service_of(http).store, FleetPublishRequest(url=url))
    monkeypatch.setenv("LABCTL_FLEET_SOURCE", url)
    assert http.post("/api/fleet/jobs", json={**FIT, "source": url}).json()["request"]["source"] == url
    carry_out(http)
    assert get(http, "/api/fleet/jobs/1")["done"] == UNITS
    secret = http.post("/api/fleet/jobs", json={**FIT, "source": "s3://ann:hunter2@bucket/lab"})
    assert (secret.status_code, "credentials belong in the environment" in secret.text) == (422, True)
    monkeypatch.setenv("LABCTL_FLEET_SOURCE", "s3://ann:hunter2@bucket/lab")
    wrong = http.post("/api/fleet/jobs", json={**FIT, "source": url})
    assert (wrong.status_code, "LABCTL_FLEET_SOURCE of this service is refused" in wrong.text) == (400, True)
    said = secret.text + wrong.text + str(get(http, "/api/audit", limit=100)) + str(get(http, "/api/fleet/jobs"))
    assert "hunter2" not in said


@pytest.mark.slow
def test_types_chart_and_report_are_answered(http: TestClient) -> None:
    http.post("/api/fleet/jobs", json=FIT).raise_for_status()
    carry_out(http)
    (figures,) = get(http, "/api/fleet/types")
    assert (figures["type"], figures["units"], figures["fitted"]) == ("FOG-A", UNITS, UNITS)
    chart = get(http, "/api/fleet/chart", type="FOG-A", factor="bench")
    assert {each["name"] for each in chart["coefficients"]} == {"bias", "scale_factor"}
    assert sum(point["units"] for point in chart["points"]) == UNITS
    report = get(http, "/api/fleet/report")
    assert (report["type"], report["compared"], report["missing"]) == ("FOG-A", 0, [])
    assert any("at least 5" in sentence for sentence in report["text"])
