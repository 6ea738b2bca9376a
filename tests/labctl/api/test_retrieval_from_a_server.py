"""A calibration in force that is fetched from a service before PostgreSQL, while other processes change it."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest
import sqlalchemy as sa
from fastapi.testclient import TestClient

from instruments.clock import SystemClock
from labctl.answers.admin import KeyRequest, Role
from labctl.answers.calibrations import FitRequest
from labctl.answers.certificates import CertificateRequest, WithdrawRequest
from labctl.answers.certification import CertifyRequest, RevokeRequest
from labctl.api import create_app
from labctl.api.access_policy import AccessPolicy
from labctl.services.admin.api_keys import create_key, revoke_key
from labctl.services.calibrations.certification import certify, revoke
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.served import calibration_file
from labctl.services.certificates.issue import issue, withdraw
from labctl.services.lab_service import LabService
from labctl.store import ServedCalibration, Store, open_store, served_together
from labctl.store.connection.database import Database
from studies.postgresql_cluster import Cluster
from tests.helpers.certificates import ORDER, SERIAL, add_version

NOW = SystemClock().utc
REASON = "a version that this test needs in force, and no unit uses"
ADDRESS = f"/api/units/{SERIAL}/calibration"


@pytest.fixture(scope="module")
def database(cluster: Cluster) -> str:
    """A database with a unit that has two versions."""
    url = cluster.new_database()
    with open_store(url, write=True) as store:
        add_version(store, certified=False)
        fit_unit(store, SERIAL, FitRequest(effects=["bias", "scale_factor"]), NOW())
    return url


@pytest.fixture
def elsewhere(database: str) -> Iterator[Store]:
    """Another process that writes to the database; the first version is in force."""
    with open_store(database, write=True) as store:
        served = store.certifications.served(SERIAL, None)
        if served is None or served.act is None or served.act.version != 1:
            certify(store, SERIAL, 1, CertifyRequest(by="Ann", reason=REASON, override=True), NOW())
        yield store


@pytest.fixture
def client(elsewhere: Store) -> Iterator[TestClient]:
    """A service that only reads the database."""
    store = Store(Database(elsewhere.location, write=False, read_only=True))
    with TestClient(create_app(LabService(store, SystemClock()))) as opened:
        yield opened


def version_of(answer: httpx.Response) -> Any:
    return answer.raise_for_status().json()["version"]


@pytest.mark.slow
def test_what_was_changed_elsewhere_is_never_served_as_it_was(client: TestClient, elsewhere: Store) -> None:
    first = client.get(ADDRESS)
    assert (version_of(first), first.headers["x-labctl-state"]) == (1, "in-force")
    assert first.content == calibration_file(elsewhere, SERIAL, None, "json").content
    held = {"If-None-Match": first.headers["etag"]}
    assert client.get(ADDRESS, headers=held).status_code == 304

    certify(elsewhere, SERIAL, 2, CertifyRequest(by="Ann", reason=REASON, override=True), NOW())
    second = client.get(ADDRESS, headers=held)
    assert (second.status_code, version_of(second)) == (200, 2)
    held = {"If-None-Match": second.headers["etag"]}
    number = issue(elsewhere, SERIAL, 2, CertificateRequest(by="Ida", order=ORDER), NOW()).number
    assert "x-labctl-withdrawn" not in client.get(ADDRESS, headers=held).headers
    withdraw(elsewhere, WithdrawRequest(number=number, by="Ida", reason="wrong address"), NOW())
    gone = client.get(ADDRESS, headers=held)
    assert (gone.status_code, 'reason="wrong address"' in gone.headers["x-labctl-withdrawn"]) == (304, True)

    revoke(elsewhere, SERIAL, 2, RevokeRequest(by="Rita", reason="was dropped"), NOW())
    refused = client.get(ADDRESS, headers=held)
    assert (refused.status_code, refused.json()["type"]) == (404, "urn:labctl:problem:not-certified")
    certify(elsewhere, SERIAL, 1, CertifyRequest(by="Ann", reason=REASON, override=True), NOW())
    again = client.get(ADDRESS, headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, version_of(again)) == (200, 1)  # its certification is another one
    assert client.get("/api/units/absent/calibration").status_code == 404


def test_many_at_once_get_each_its_own(client: TestClient, elsewhere: Store) -> None:
    expected = calibration_file(elsewhere, SERIAL, None, "json").content
    addresses = [ADDRESS, "/api/units/absent/calibration"] * 20
    with ThreadPoolExecutor(8) as threads:
        answers = list(threads.map(client.get, addresses))
    assert all(answer.content == expected for answer in answers[::2])
    assert {answer.status_code for answer in answers[1::2]} == {404}


def test_a_key_that_was_revoked_elsewhere_is_refused_at_once(elsewhere: Store) -> None:
    key = create_key(elsewhere, KeyRequest(name="robot", role=Role.VIEWER), NOW()).key
    store = Store(Database(elsewhere.location, write=False, read_only=True))
    with TestClient(create_app(LabService(store, SystemClock()), AccessPolicy(keys=True))) as guarded:
        sent = {"Authorization": f"Bearer {key}"}
        assert version_of(guarded.get(ADDRESS, headers=sent)) == 1
        revoke_key(elsewhere, "robot", "lost", NOW())
        assert guarded.get(ADDRESS, headers=sent).status_code == 401


def test_a_connection_that_the_server_ended_costs_no_request(client: TestClient, elsewhere: Store) -> None:
    expected = client.get(ADDRESS).raise_for_status().content
    end = "SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE query LIKE '%%calibrations.document%%'"
    engine = sa.create_engine(elsewhere.location)
    with engine.connect() as connection:
        assert connection.exec_driver_sql(f"{end} AND pid <> pg_backend_pid()").scalar_one() >= 1
    engine.dispose()
    assert client.get(ADDRESS).content == expected


def test_the_short_way_and_the_described_route_answer_the_same(client: TestClient) -> None:
    short, described = client.get(ADDRESS), client.get(f"{ADDRESS}?format=json")
    assert short.content == described.content
    known = {"If-None-Match": short.headers["etag"]}
    for method, headers in (("GET", {}), ("HEAD", {}), ("GET", known)):
        answers = [client.request(method, f"{ADDRESS}{query}", headers=headers) for query in ("", "?format=json")]
        ours, theirs = ({**answer.headers, "x-request-id": ""} for answer in answers)
        assert (ours, answers[0].status_code) == (theirs, answers[1].status_code)
    refusals = [client.get(f"/api/units/absent/calibration{query}").json() for query in ("", "?format=json")]
    assert refusals[0] == refusals[1]


def test_units_read_together_are_as_read_one_by_one(elsewhere: Store) -> None:
    def together(*serials: str) -> dict[str, ServedCalibration]:
        lookup = elsewhere.certifications.lookup()
        try:
            return asyncio.run(served_together(lookup, serials))
        finally:
            lookup.close()

    one = elsewhere.certifications.served(SERIAL, None)
    odd = ('quo"te', "back\\slash", "{brace", "", "\ud800")
    assert together(SERIAL, "absent", SERIAL, *odd) == {SERIAL: one}
    number = issue(elsewhere, SERIAL, 1, CertificateRequest(by="Ida", order=ORDER), NOW()).number
    withdraw(elsewhere, WithdrawRequest(number=number, by="Ida", reason="wrong address"), NOW())
    withdrawn = together(SERIAL)
    assert withdrawn == {SERIAL: elsewhere.certifications.served(SERIAL, None)}
    assert withdrawn[SERIAL].withdrawal is not None
    assert together() == {}
    revoke(elsewhere, SERIAL, 1, RevokeRequest(by="Rita", reason="was dropped"), NOW())
    assert together(SERIAL) == {}
