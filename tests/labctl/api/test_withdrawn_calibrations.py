"""Who fetched a calibration is recorded and named at its revocation; a client that holds a withdrawn one raises."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from fastapi.testclient import TestClient

from labctl.api import create_app
from labctl.api.access_policy import AccessPolicy
from labctl.client import CalibrationWithdrawn, Client, ServiceRefused
from labctl.errors import StoreError
from labctl.services.calibrations.fetch_log import ANONYMOUS, LAST_KNOWN_TO, FetchLog
from labctl.store import FetchRow, Store, open_store
from tests.helpers.certificates import ORDER, SERIAL, add_version
from tests.helpers.lab import Lab
from tests.helpers.service import open_client, service_of, transport_to

UNIT = f"/api/units/{SERIAL}"
ONE = f"{UNIT}/calibrations/1"
AT = datetime(2027, 3, 1, 12, tzinfo=UTC)
ISSUE = {"by": "Ida", "order": ORDER}


@pytest.fixture
def database(tmp_path: Path) -> Path:
    path = tmp_path / "lab.sqlite"
    with open_store(str(path), write=True) as store:
        add_version(store)
    return path


@pytest.fixture
def inside(database: Path) -> Iterator[TestClient]:
    with open_client(database) as client:
        yield client


def fetches(inside: TestClient) -> list[Any]:
    found: list[Any] = inside.get(f"{ONE}/fetches").json()
    return found


@pytest.mark.slow
def test_a_revocation_withdraws_the_certificates_and_names_who_fetched(inside: TestClient) -> None:
    assert fetches(inside) == []
    number = inside.post(f"{ONE}/certificate", json=ISSUE).json()["number"]
    assert inside.get(f"{UNIT}/calibration").headers.get("x-labctl-withdrawn") is None
    inside.head(f"{UNIT}/calibration")  # which fetches nothing
    (fetch,) = fetches(inside)
    assert fetch["who"] == ANONYMOUS
    answer = inside.post(f"{ONE}/revoke", json={"by": "Rita", "reason": "was dropped"}).json()
    assert (answer["withdrawn_certificates"], answer["fetched_by"]) == ([number], [fetch])

    for form in ("json", "c"):
        file = inside.get(f"{UNIT}/calibration", params={"version": 1, "format": form})
        assert file.status_code == 200
        notice = file.headers["x-labctl-withdrawn"]
        assert 'by="Rita", reason="was dropped"' in notice
        again = inside.get(
            f"{UNIT}/calibration",
            params={"version": 1, "format": form},
            headers={"If-None-Match": file.headers["etag"]},
        )
        assert (again.status_code, again.headers["x-labctl-withdrawn"]) == (304, notice)
    certificate = inside.get(f"{ONE}/certificate")
    assert certificate.headers["x-labctl-state"] == "withdrawn"
    assert f'reason="was dropped", certificate="{number}"' in certificate.headers["x-labctl-withdrawn"]
    (row,) = inside.get(f"{UNIT}/certificates").json()
    assert (row["state"], row["state_by"], row["state_reason"]) == ("withdrawn", "Rita", "was dropped")
    acts = inside.get(f"{UNIT}/certifications").json()
    assert [act["fetched_by"] for act in acts] == [[], []]


@pytest.mark.slow
def test_each_key_is_recorded_once_with_its_first_and_last_fetch(database: Path) -> None:
    lab = Lab(database.parent)
    keys = {name: lab.json("key", "create", name, "--role", "viewer")["key"] for name in ("robot 1", "robot 2")}
    with open_client(database) as plain:
        service = service_of(plain)
        app = create_app(service, AccessPolicy(keys=True))
        guarded = TestClient(app)
        for name in ("robot 1", "robot 2", "robot 1"):
            headers = {"Authorization": f"Bearer {keys[name]}"}
            assert guarded.get(f"{UNIT}/calibration", headers=headers).status_code == 200
        assert guarded.get(f"{UNIT}/calibration").status_code == 401
        service.fetches.write()
        assert sorted(row.who for row in service.store.fetches.of_version(SERIAL, 1)) == ["robot 1", "robot 2"]
        number = plain.post(f"{ONE}/certificate", json=ISSUE).json()["number"]
        hash_ = service.store.calibrations.get(SERIAL, 1).hash
        state = "/api/certificates/state"
        answer = guarded.get(state, params={"number": number, "calibration": hash_[:16]})
        assert (answer.status_code, answer.json()["state"]) == (200, "valid")  # without a key
        wrong = guarded.get(state, params={"number": number, "calibration": "0" * 16})
        assert (wrong.status_code, wrong.json()["type"]) == (404, "urn:labctl:problem:not-found")
        withdraw = guarded.post("/api/certificates/withdraw", json={"number": number, "by": "x", "reason": "y"})
        assert withdraw.status_code == 401
        headers = {"Authorization": f"Bearer {keys['robot 1']}"}
        body = {"number": number, "by": "x", "reason": "y"}
        assert guarded.post("/api/certificates/withdraw", json=body, headers=headers).status_code == 403


def test_the_client_raises_for_a_withdrawn_calibration_and_for_one_that_it_holds(inside: TestClient) -> None:
    with Client("http://testserver", transport=transport_to(inside)) as client:
        file = client.calibration(SERIAL)
        hash_ = file.calibration.calibration_hash
        assert client.check_calibration(SERIAL, hash_).state == "in-force"
        with pytest.raises(ServiceRefused, match="no calibration with the hash"):
            client.check_calibration(SERIAL, "0" * 64)
        number = inside.post(f"{ONE}/certificate", json=ISSUE).json()["number"]
        gone = {"number": number, "by": "Rita", "reason": "standard was bad"}
        assert inside.post("/api/certificates/withdraw", json=gone).status_code == 200
        said = rf"{SERIAL}.* must not be used: certificate {number} was withdrawn at .* by Rita \(standard was bad\)"
        with pytest.raises(CalibrationWithdrawn, match=said) as raised:
            client.calibration(SERIAL, held=file)
        assert raised.value.content == file.content
        assert raised.value.notice is not None
        assert raised.value.notice.certificate == number
        with pytest.raises(CalibrationWithdrawn, match=said):
            client.check_calibration(SERIAL, hash_)
        accepted = client.calibration(SERIAL, held=file, accept_withdrawn=True)
        assert (accepted.content, accepted.withdrawn) == (file.content, raised.value.notice)

        inside.post(f"{ONE}/revoke", json={"by": "Rita", "reason": "was dropped"})
        with pytest.raises(CalibrationWithdrawn, match=r"the version was revoked .* by Rita \(was dropped\)"):
            client.calibration(SERIAL, 1)
        with pytest.raises(CalibrationWithdrawn, match="the version was revoked"):
            client.check_calibration(SERIAL, hash_)
        with pytest.warns(match="was revoked"):
            assert client.calibration(SERIAL, 1, accept_withdrawn=True).state == "revoked"


@pytest.mark.slow
def test_on_the_command_line_every_state_is_said(database: Path, tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    with open_client(database) as client:
        number = client.post(f"{ONE}/certificate", json=ISSUE).json()["number"]
        client.get(f"{UNIT}/calibration")
    assert f"{number}  version 1" in lab.run("certificates", SERIAL).stdout
    out = tmp_path / "copy.pdf"
    said = lab.run("certificate", "withdraw", number, "--by", "Rita", "--reason", "standard was bad").stdout
    assert "is withdrawn since" in said
    assert "withdrawn since" in lab.run("certificates", SERIAL).stdout
    copy = lab.run("certificate", SERIAL, "--out", str(out))
    assert f"certificate {number} is withdrawn since" in copy.stderr
    assert "by Rita (standard was bad)" in copy.stderr
    assert out.read_bytes().startswith(b"%PDF")
    file = lab.run("calibration", SERIAL)
    assert f"certificate {number} was withdrawn" in file.stderr
    revoked = lab.run("revoke", SERIAL, "1", "--by", "Rita", "--reason", "was dropped").stdout
    assert f"fetched by {ANONYMOUS}" in revoked
    assert "the version was revoked" in lab.run("calibration", SERIAL, "--version", "1").stderr
    assert "--reason" in lab.run("certificate", "withdraw", "--help").stdout


class Failing:
    """Fetches of a database that does not answer, then does."""

    def __init__(self) -> None:
        self.fails = True
        self.rows: list[FetchRow] = []

    def record(self, rows: list[FetchRow]) -> None:
        if self.fails:
            raise StoreError("the server does not answer")
        self.rows += rows


def log_over(fetches: object) -> FetchLog:
    return FetchLog(cast(Store, SimpleNamespace(fetches=fetches, is_read_only=False)))


def test_fetches_that_could_not_be_written_are_written_later_with_their_first_time() -> None:
    failing = Failing()
    log = log_over(failing)
    assert log.note("G", 1, "robot", AT)
    log.write()
    later = AT + timedelta(seconds=5)
    assert log.note("G", 1, "robot", later)  # nothing is written yet: try again
    failing.fails = False
    log.write()
    assert failing.rows == [FetchRow("G", 1, "robot", AT, later)]
    assert not log.note("G", 1, "robot", later + timedelta(seconds=1))
    assert log.note("G", 1, "robot", later + LAST_KNOWN_TO)
    log.write()
    assert failing.rows[-1].last_at == later + LAST_KNOWN_TO


def test_a_write_that_hangs_holds_no_other_thread() -> None:
    entered, go_on = threading.Event(), threading.Event()

    class Hanging(Failing):
        def record(self, rows: list[FetchRow]) -> None:
            entered.set()
            assert go_on.wait(30)
            self.rows += rows

    hanging = Hanging()
    log = log_over(hanging)
    log.note("G", 1, "a", AT)
    thread = threading.Thread(target=log.write)
    thread.start()
    assert entered.wait(30)
    log.note("G", 1, "b", AT)
    log.write()  # returns at once
    go_on.set()
    thread.join(30)
    log.write()
    assert [row.who for row in hanging.rows] == ["a", "b"]


def test_rows_keep_the_earliest_and_the_latest_time(database: Path) -> None:
    with open_store(str(database), write=True) as store:
        for first, last in ((2, 3), (1, 2), (4, 5)):
            at = [AT + timedelta(days=day) for day in (first, last)]
            store.fetches.record([FetchRow(SERIAL, 1, "robot", *at)])
        (row,) = store.fetches.of_version(SERIAL, 1)
    assert (row.first_at, row.last_at) == (AT + timedelta(days=1), AT + timedelta(days=5))
