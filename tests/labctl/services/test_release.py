"""Two-person release: a version is in force once a second key has released it; a name alone is no person."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from datetime import timedelta
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from labctl.acting_user import Actor, acting
from labctl.answers.certification import CertifyRequest, ReleaseRequest, ReleaseRequestResponse, RevokeRequest
from labctl.api import create_app
from labctl.api.access_policy import AccessPolicy
from labctl.config import TWO_PERSON_VARIABLE
from labctl.errors import BadInput, CertificationRefused, Conflict, NotFound
from labctl.services.calibrations.certification import certify, list_certifications, release, revoke, version_in_force
from labctl.services.calibrations.release import ReleaseRefused, list_waiting
from labctl.services.certificates.issue import CertificateRefused, issue
from labctl.services.certificates.served import certificate_file
from labctl.store import NewReleaseRequest, Store, check, copy_database, open_store
from tests.helpers.certificates import AT, ORDER, SERIAL, add_version, request
from tests.helpers.lab import Lab
from tests.helpers.service import open_client, service_of

#: Each test certifies one of the same versions: what its criticism says is tested elsewhere.
pytestmark = pytest.mark.usefixtures("shared_answers")
ADA, BOB = Actor("ada", "key"), Actor("bob", "key")
ASKED = CertifyRequest(by="Ada A.", reason="meets the criteria of LAB-P-012, looked at by hand", override=True)
SECOND = ReleaseRequest(by="Bob B.", reason="looked at the residuals")
DAY = timedelta(days=1)
UNIT = f"/api/units/{SERIAL}"


@pytest.fixture(scope="module")
def with_version(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("release") / "lab.sqlite"
    with open_store(str(path), write=True) as opened:
        add_version(opened, certified=False)
    return path


@pytest.fixture
def database(with_version: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(TWO_PERSON_VARIABLE, "1")
    copy_database(str(with_version), tmp_path / "lab.sqlite")
    return tmp_path / "lab.sqlite"


@pytest.fixture
def store(database: Path) -> Iterator[Store]:
    with open_store(str(database), write=True) as opened:
        yield opened


def ask(store: Store, who: Actor = ADA, days: float = 0) -> None:
    with acting(who):
        assert isinstance(certify(store, SERIAL, 1, ASKED, AT + days * DAY), ReleaseRequestResponse)


def test_nothing_is_in_force_until_a_second_key_has_released_it(store: Store) -> None:
    ask(store)
    assert version_in_force(store, SERIAL) is None
    assert list_certifications(store, SERIAL) == []
    (waiting,) = list_waiting(store, SERIAL)
    assert (waiting.by, waiting.by_key, waiting.reason) == ("Ada A.", "ada", ASKED.reason)
    with acting(ADA), pytest.raises(ReleaseRefused, match=r"key 'ada' asked .* as Ada A\.; a second person"):
        release(store, SERIAL, 1, ReleaseRequest(by="Somebody Else", reason="another name"), AT)
    assert version_in_force(store, SERIAL) is None
    with acting(BOB):
        act = release(store, SERIAL, 1, SECOND, AT + DAY)
    assert (act.by, act.by_key, act.released_by, act.released_key) == ("Ada A.", "ada", "Bob B.", "bob")
    assert (act.reason, act.release_reason, act.at) == (ASKED.reason, SECOND.reason, AT + DAY)
    assert version_in_force(store, SERIAL) == 1
    assert list_waiting(store, SERIAL) == []
    with acting(BOB), pytest.raises(NotFound, match="does not wait for a release"):
        release(store, SERIAL, 1, SECOND, AT + DAY)
    rows = {row.action: row for row in store.audit.rows()}
    assert (rows["certify request"].who, rows["certify"].who) == ("ada", "bob")
    assert rows["certify"].detail["released_by"] == "Bob B."


def test_a_request_that_was_stored_with_a_longer_name_is_released(store: Store) -> None:
    name = "x" * 5000
    store.release_requests.add(NewReleaseRequest(SERIAL, 1, name, "ada", ASKED.reason, AT, None, True))
    with acting(BOB):
        assert release(store, SERIAL, 1, SECOND, AT + DAY).by == name


@pytest.mark.parametrize("who", [Actor("ada", "command line"), Actor("ada", "loopback")])
def test_a_name_without_a_key_is_no_person(store: Store, who: Actor) -> None:
    with acting(who), pytest.raises(ReleaseRefused, match="needs an API key"):
        certify(store, SERIAL, 1, ASKED, AT)
    ask(store)
    with acting(who), pytest.raises(ReleaseRefused, match="needs an API key"):
        release(store, SERIAL, 1, SECOND, AT)
    assert version_in_force(store, SERIAL) is None


def test_a_request_is_overtaken_by_a_later_one_and_by_an_act_on_the_version(store: Store) -> None:
    ask(store)
    ask(store, BOB, 1)
    (waiting,) = list_waiting(store, SERIAL)
    assert waiting.by_key == "bob"
    with acting(ADA):
        release(store, SERIAL, 1, SECOND, AT + 2 * DAY)
    ask(store, ADA, 3)  # again, with a later date
    with acting(BOB):
        revoke(store, SERIAL, 1, RevokeRequest(by="Bob B.", reason="was dropped"), AT + 4 * DAY)
        assert list_waiting(store, SERIAL) == []
        with pytest.raises(NotFound, match="does not wait"):
            release(store, SERIAL, 1, SECOND, AT + 5 * DAY)
    assert version_in_force(store, SERIAL) is None


def test_a_request_that_was_released_meanwhile_puts_nothing_in_force_twice(store: Store) -> None:
    from labctl.store import Release

    ask(store)
    (waiting,) = store.release_requests.waiting(SERIAL)
    second = Release("Bob B.", "bob", "so", waiting.id)
    for _ in range(2):
        try:
            store.calibrations.certify(SERIAL, 1, "certify", by="Ada", reason="r", at=AT, by_key="ada", release=second)
        except Conflict as error:
            assert "does not wait for this release any more" in str(error)  # noqa: PT017  the second time only
    assert len(store.calibrations.history(SERIAL)) == 1


def test_objections_are_named_to_the_first_person(store: Store) -> None:
    plain = ASKED.model_copy(update={"override": False})
    with acting(ADA), pytest.raises(CertificationRefused):
        certify(store, SERIAL, 1, plain, AT)
    assert list_waiting(store, SERIAL) == []


def test_a_certificate_needs_the_release_and_names_both_persons(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.calibrations.certify(SERIAL, 1, "certify", by="Ada", reason="alone", at=AT)
    with pytest.raises(CertificateRefused, match=r"certified by Ada alone, .* two persons"):
        issue(store, SERIAL, 1, request(), AT)
    ask(store)
    with acting(BOB):
        release(store, SERIAL, 1, SECOND, AT)
        issue(store, SERIAL, 1, request(), AT)
    text = certificate_file(store, SERIAL, 1, "xml").content.decode()
    assert "Ada A. (key ada), released by Bob B. (key bob)" in text
    monkeypatch.setenv(TWO_PERSON_VARIABLE, "perhaps")
    with acting(ADA), pytest.raises(BadInput, match=r"LABCTL_TWO_PERSON_RELEASE = 'perhaps': give 1"):
        certify(store, SERIAL, 1, ASKED, AT)


def test_without_the_option_a_certificate_says_that_the_name_was_typed(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(TWO_PERSON_VARIABLE)
    store.calibrations.certify(SERIAL, 1, "certify", by="Ada", reason="alone", at=AT)
    issue(store, SERIAL, 1, request(), AT)
    assert "Ada (name as typed, no key)" in certificate_file(store, SERIAL, 1, "xml").content.decode()


def test_the_check_notices_a_request_that_was_changed(store: Store) -> None:
    ask(store)
    location = store.location
    store.close()
    with closing(sqlite3.connect(location)) as raw:
        raw.execute("UPDATE release_requests SET by_key = 'eve'")
        raw.commit()
    (found,) = check(location).findings
    assert f"request 1 to release {SERIAL} version 1: head changed" in found.text


def test_over_http_two_keys_certify_a_version(database: Path) -> None:
    lab = Lab(database.parent)
    keys = {name: lab.json("key", "create", name, "--role", "approver")["key"] for name in ("ada", "bob")}
    with open_client(database) as plain:
        guarded = TestClient(create_app(service_of(plain), AccessPolicy(keys=True)))
        headers = {name: {"Authorization": f"Bearer {key}"} for name, key in keys.items()}
        body = ASKED.model_dump(mode="json")
        asked = guarded.post(f"{UNIT}/calibrations/1/certify", json=body, headers=headers["ada"])
        assert (asked.status_code, asked.json()["waits_for_release"]) == (202, True)
        assert guarded.get(f"{UNIT}/calibration", headers=headers["ada"]).status_code == 404
        (waiting,) = guarded.get(f"{UNIT}/release-requests", headers=headers["bob"]).json()
        assert waiting["by_key"] == "ada"
        path, second = f"{UNIT}/calibrations/1/release", SECOND.model_dump()
        refused = guarded.post(path, json=second, headers=headers["ada"])
        assert (refused.status_code, refused.json()["type"]) == (409, "urn:labctl:problem:release-refused")
        done = guarded.post(path, json=second, headers=headers["bob"])
        assert (done.status_code, done.json()["released_key"]) == (200, "bob")
        assert guarded.get(f"{UNIT}/calibration", headers=headers["ada"]).status_code == 200
        issued = guarded.post(
            f"{UNIT}/calibrations/1/certificate", json={"by": "Ida", "order": ORDER}, headers=headers["ada"]
        )
        assert (issued.status_code, issued.json()["by_key"]) == (201, "ada")
    said = lab.run("certifications", SERIAL).stdout
    assert "Ada A., key ada; released by Bob B., key bob (looked at the residuals)" in said


def test_on_the_command_line_alone_nobody_certifies(database: Path) -> None:
    lab = Lab(database.parent)
    options = ("--by", "Ada", "--reason", ASKED.reason, "--override")
    assert "needs an API key" in lab.run("certify", SERIAL, "1", *options, status=2).stderr
    assert "needs an API key" in lab.run("release", SERIAL, "1", "--by", "B", "--reason", "r", status=2).stderr
