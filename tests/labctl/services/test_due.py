"""Due dates: the interval of a certification, what a consumer learns of it, and the units that are due."""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from fastapi.testclient import TestClient
from prometheus_client.parser import text_string_to_metric_families
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest as ServiceFit
from labctl.answers.certification import CertifyRequest, RevokeRequest
from labctl.api import create_app
from labctl.calibration import CalibrationWarning, hash_of, read_calibration
from labctl.cli.app import app
from labctl.client import Client, FitRequest
from labctl.compensator import Compensator
from labctl.errors import BadCalibrationFile, BadInput, NotCertified, NotEnoughData
from labctl.services.calibrations import assessment
from labctl.services.calibrations.apply import compensate_file
from labctl.services.calibrations.certification import certify, revoke
from labctl.services.calibrations.due import interval_days, span
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.served import calibration_file
from labctl.services.lab_service import LabService
from labctl.services.recordings.transfer import import_folder
from labctl.services.units import count_due, list_units, units_due
from labctl.store import Store, copy_database, open_store
from labctl.store.paging import PageRequest
from labctl.store.schema import tables
from tests.helpers.certifying import OVERRIDE
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES
from tests.helpers.service import open_client, service_of, transport_to

FOG = "OSU-FOG-2024"
PATH = f"/api/units/{FOG}/calibration"
START = datetime(2026, 3, 1, 12, tzinfo=UTC)
DAY = timedelta(days=1)


@pytest.fixture(autouse=True)
def without_criticism(monkeypatch: pytest.MonkeyPatch) -> None:
    """Certify without the seconds that a criticism takes; `test_certification` tests that there is one."""

    def refuse(*_: object, **__: object) -> None:
        raise NotEnoughData("no criticism in this test")

    monkeypatch.setattr(assessment, "criticise_unit", refuse)


@pytest.fixture(scope="module")
def two_versions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a database with two versions of a unit."""
    path = tmp_path_factory.mktemp("due") / "lab.sqlite"
    with open_store(str(path), write=True) as opened:
        import_folder(opened, EXAMPLES / "osu-fog", START)
        for _ in range(2):
            fit_unit(opened, FOG, ServiceFit(effects=["bias"]), START)
    return path


@pytest.fixture
def store(two_versions: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    """Return a store of its own with two versions of a unit; no interval is configured."""
    monkeypatch.delenv("LABCTL_DUE_DAYS", raising=False)
    copy_database(str(two_versions), tmp_path / "lab.sqlite")
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def put_in_force(store: Store, version: int = 1, due_days: int | None = None, at: datetime = START) -> None:
    request = CertifyRequest(by='Ada "A"', reason=OVERRIDE["reason"], override=True, due_days=due_days)  # type: ignore[arg-type]
    certify(store, FOG, version, request, at)


def headers(store: Store, now: datetime, version: int | None = None) -> dict[str, str]:
    return calibration_file(store, FOG, version, "json").headers(now)


def test_a_date_is_never_invented(store: Store) -> None:
    put_in_force(store)
    assert "X-Labctl-Due" not in headers(store, START + 40_000 * DAY)
    assert "Warning" not in headers(store, START + 40_000 * DAY)
    assert read_calibration(calibration_file(store, FOG, None, "json").content).certification.due is None  # type: ignore[union-attr]
    assert units_due(store, START, 36_500 * DAY).rows == []


@pytest.fixture
def three_units(store: Store) -> Store:
    """Return a store with a unit of two versions, of which one can be put in force, and two that have none."""
    with store._database.writing() as connection:
        for serial in ("A-1", "Z-1"):
            unit = {"serial": serial, "model": "VG", "technology": "fog"}
            connection.execute(sa.insert(tables.units).values(**unit, first_seen_at=START))
            recording = {"serial": serial, "kind": "points", "info": {}, "channels": []}
            connection.execute(sa.insert(tables.recordings).values(**recording, created_at=START))
    return store


def chosen(store: Store, now: datetime, **wanted: str) -> list[str]:
    return [unit.serial for unit in list_units(store, now, PageRequest(), **wanted).rows]  # type: ignore[arg-type]


def test_units_are_chosen_by_their_calibration(three_units: Store) -> None:
    assert chosen(three_units, START, calibration="none") == ["A-1", FOG, "Z-1"]
    put_in_force(three_units, due_days=10)
    assert chosen(three_units, START) == ["A-1", FOG, "Z-1"]
    assert chosen(three_units, START, calibration="none") == ["A-1", "Z-1"]
    assert chosen(three_units, START, calibration="in_force") == [FOG]
    assert chosen(three_units, START + 9 * DAY, calibration="overdue") == []
    assert chosen(three_units, START + 10 * DAY, calibration="overdue") == [FOG]
    page = list_units(three_units, START, PageRequest(limit=1), calibration="none")
    assert (page.total, [unit.serial for unit in page.rows], page.next_after) == (2, ["A-1"], "A-1")
    revoke(three_units, FOG, 1, RevokeRequest(by="Ada", reason="dropped"), START + 11 * DAY)
    assert chosen(three_units, START + 12 * DAY, calibration="overdue") == []
    assert chosen(three_units, START + 12 * DAY, calibration="none") == ["A-1", FOG, "Z-1"]


def test_units_are_chosen_by_the_verdict_on_the_version_in_force(three_units: Store) -> None:
    put_in_force(three_units, 1)
    with three_units._database.writing() as connection:
        connection.execute(sa.update(tables.certifications).values(verdict="missing"))
    (unit,) = list_units(three_units, START, PageRequest(), verdict="missing").rows
    assert (unit.serial, unit.certified_verdict) == (FOG, "missing")
    assert chosen(three_units, START, verdict="adequate") == []
    assert chosen(three_units, START, verdict="missing", calibration="overdue") == []
    put_in_force(three_units, 2)  # without a verdict, here
    assert chosen(three_units, START, verdict="missing") == []
    assert list_units(three_units, START, PageRequest(), calibration="in_force").rows[0].certified_verdict is None


def test_units_that_are_due_are_listed_by_date_in_parts(three_units: Store) -> None:
    days = {"A-10": 20, "A-2": 20, "A-9": 10, "A-3": 40}
    with three_units._database.writing() as connection:
        for serial, due_days in days.items():
            connection.execute(sa.insert(tables.units).values(serial=serial, model="VG", first_seen_at=START))
            recording = {"serial": serial, "kind": "points", "info": {}, "channels": [], "created_at": START}
            connection.execute(sa.insert(tables.recordings).values(**recording))
            made = {"serial": serial, "version": 1, "model": "cubic", "hash": serial, "document": b"{}", "answer": {}}
            connection.execute(sa.insert(tables.calibrations).values(**made, created_at=START))
            act = {"serial": serial, "version": 1, "act": "certify", "by": "A", "reason": "", "at": START}
            connection.execute(sa.insert(tables.certifications).values(**act, due_at=START + due_days * DAY))
    whole = units_due(three_units, START, 30 * DAY)
    assert ([unit.serial for unit in whole.rows], whole.total) == (["A-9", "A-2", "A-10"], 3)
    first = units_due(three_units, START, 30 * DAY, PageRequest(limit=2))
    assert ([unit.serial for unit in first.rows], first.total, first.next_after) == (["A-9", "A-2"], 3, "A-2")
    rest = units_due(three_units, START, 30 * DAY, PageRequest(limit=2, after="A-2"))
    assert ([unit.serial for unit in rest.rows], rest.total, rest.next_after) == (["A-10"], 3, None)
    assert [unit.serial for unit in units_due(three_units, START, 50 * DAY, PageRequest("a-3")).rows] == ["A-3"]
    assert count_due(three_units, START + 15 * DAY, 15 * DAY) == (1, 3)
    assert [row.serial for row in units_due(three_units, START, 9 * DAY).rows] == []


@pytest.mark.parametrize(
    ("wanted", "reason"),
    [
        ({"calibration": "late"}, "calibration 'late': choose one of in_force, overdue, none"),
        ({"verdict": "good"}, "verdict 'good': choose one of adequate, missing"),
        ({"verdict": "missing", "within": DAY}, "due_within is given together with calibration, verdict or batch"),
    ],
)
def test_what_there_is_no_unit_of_is_refused(store: Store, wanted: dict[str, Any], reason: str) -> None:
    with pytest.raises(BadInput, match=reason):
        list_units(store, START, PageRequest(), **wanted)


def test_the_service_the_client_and_the_command_choose_alike(three_units: Store, tmp_path: Path) -> None:
    put_in_force(three_units)
    with TestClient(create_app(LabService(three_units, VirtualClock()))) as inside:
        client = Client("http://testserver", transport=transport_to(inside))
        assert [unit.serial for unit in client.units(calibration="none")] == ["A-1", "Z-1"]
        assert [unit.serial for unit in client.units(calibration="in_force", search="osu")] == [FOG]
        assert client.units(verdict="adequate") == []
        assert inside.get("/api/units?calibration=late").status_code == 422
        assert inside.get("/api/units?calibration=none&due_within=1d").status_code == 400
        client.close()
    listed = ["units", "--json", "--database", str(tmp_path / "lab.sqlite")]
    found = CliRunner().invoke(app, [*listed, "--calibration", "none"])
    assert [unit["serial"] for unit in json.loads(found.stdout)] == ["A-1", "Z-1"]
    assert CliRunner().invoke(app, [*listed, "--verdict", "good"]).exit_code == 2


def test_the_users_interval_goes_before_the_recipes_and_that_before_the_configured(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert interval_days(store, FOG, 1, None) == (None, None)
    monkeypatch.setenv("LABCTL_DUE_DAYS", "180")
    assert interval_days(store, FOG, 1, None) == (180, "configuration")
    monkeypatch.setattr("labctl.services.calibrations.due._of_recipe", lambda *_: 365)
    assert interval_days(store, FOG, 1, None) == (365, "recipe")
    assert interval_days(store, FOG, 1, 30) == (30, "user")
    assert interval_days(store, FOG, 1, 0) == (None, "user")
    put_in_force(store)
    (act,) = store.calibrations.history(FOG)
    assert act.due_at == START + 365 * DAY
    assert act.judgement is not None
    assert act.judgement.detail["due_from"] == "recipe"


@pytest.mark.parametrize("text", ["0", "a year", "-3", "36501", "1.5"])
def test_a_configured_interval_that_is_no_number_of_days_is_refused(
    store: Store, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    monkeypatch.setenv("LABCTL_DUE_DAYS", text)
    with pytest.raises(BadInput, match=r"LABCTL_DUE_DAYS = .*whole number from 1 to 36500"):
        interval_days(store, FOG, 1, None)


def test_the_answer_says_until_when_and_the_warning_when_that_has_passed(store: Store) -> None:
    put_in_force(store, due_days=365)
    fresh = headers(store, START + 365 * DAY - timedelta(seconds=1))
    assert (fresh["X-Labctl-State"], fresh["X-Labctl-Due"]) == ("in-force", "2027-03-01T12:00:00Z")
    assert "Warning" not in fresh
    late = headers(store, START + 368 * DAY)
    assert late["Warning"] == (
        '299 labctl "calibration of OSU-FOG-2024 version 1 was due on 2027-03-01 12:00 UTC, 3.0 days ago; calibrate '
        'the unit again, then fetch the new version"'
    )
    assert late["ETag"] == fresh["ETag"]  # the file is the same: only time has passed


def test_the_document_has_the_certification_under_its_hash(store: Store) -> None:
    plain = calibration_file(store, FOG, 1, "json")
    assert plain.headers(START)["X-Labctl-State"] == "not-certified"
    assert read_calibration(plain.content).certification is None
    put_in_force(store, due_days=10)
    file = calibration_file(store, FOG, None, "json")
    assert calibration_file(store, FOG, 1, "json").content == file.content
    document = json.loads(file.content)
    assert file.etag == document["hash"] == hash_of(document) != plain.etag
    assert document["certification"] == {
        "state": "in-force", "by": 'Ada "A"', "reason": OVERRIDE["reason"], "at": START.isoformat(),
        "due": (START + 10 * DAY).isoformat(), "calibration_hash": plain.etag,
    }  # fmt: skip
    assert {**document, "hash": plain.etag, "certification": None} == {
        **json.loads(plain.content),
        "certification": None,
    }
    document["certification"]["due"] = (START + 9999 * DAY).isoformat()
    with pytest.raises(BadCalibrationFile, match="was edited or damaged"):
        read_calibration(json.dumps(document).encode())
    assert calibration_file(store, FOG, None, "c").etag == f"{file.etag}-c"


def test_a_revoked_and_a_replaced_version_say_so(store: Store) -> None:
    put_in_force(store, 1, due_days=10)
    put_in_force(store, 2, due_days=10, at=START + DAY)
    assert headers(store, START + 2 * DAY, 1)["X-Labctl-State"] == "superseded"
    assert "Warning" not in headers(store, START + 2 * DAY, 1)
    assert "was due on" in headers(store, START + 20 * DAY, 1)["Warning"]
    revoke(store, FOG, 2, RevokeRequest(by='B \\"', reason="drifts – strongly"), START + 3 * DAY)
    with pytest.raises(NotCertified):
        calibration_file(store, FOG, None, "json")
    said = headers(store, START + 4 * DAY, 2)
    assert said["X-Labctl-State"] == "revoked"
    assert said["Warning"] == (
        '299 labctl "calibration of OSU-FOG-2024 version 2 was revoked at 2026-03-04 12:00 UTC by B \\\\\\" (drifts ? '
        'strongly); fetch the one in force"'
    )
    assert "X-Labctl-Due" not in said


def test_the_compensator_warns_of_an_overdue_and_of_a_revoked_file_and_goes_on(store: Store, tmp_path: Path) -> None:
    put_in_force(store, due_days=10)
    calibration = read_calibration(calibration_file(store, FOG, None, "json").content)

    def at(days: float) -> VirtualClock:
        return VirtualClock(START + days * DAY)

    assert Compensator(calibration, clock=at(9)).warning == ""
    with pytest.warns(
        CalibrationWarning, match=r"OSU-FOG-2024 version 1 was due on 2026-03-11 12:00 UTC, 1\.0 days"
    ) as given:
        late = Compensator(calibration, clock=at(11))
    assert str(given[0].message) == late.warning
    assert late.step([-1.4], 40.0)[0] == pytest.approx(Compensator(calibration, clock=at(9)).step([-1.4], 40.0)[0])
    revoke(store, FOG, 1, RevokeRequest(by="B", reason="drifts"), START + DAY)
    (tmp_path / "fog.json").write_bytes(calibration_file(store, FOG, 1, "json").content)
    with pytest.warns(CalibrationWarning, match="was revoked at 2026-03-02") as given:
        Compensator.from_file(tmp_path / "fog.json")
    assert given[0].filename == __file__
    (tmp_path / "in.csv").write_text("gyro_z,temperature_c\n-1.4,40\n")
    answer = compensate_file(tmp_path / "fog.json", tmp_path / "in.csv", tmp_path / "out.csv", "clamp")
    assert "was revoked" in answer.warning


def test_a_certification_that_is_not_whole_is_a_bad_file(store: Store) -> None:
    put_in_force(store)
    document = json.loads(calibration_file(store, FOG, None, "json").content)
    for key, value in (("state", "fine"), ("due", "2026-01-01T00:00:00"), ("at", None)):
        wrong = {**document, "certification": {**document["certification"], key: value}}
        calibration = read_calibration(json.dumps({**wrong, "hash": hash_of(wrong)}).encode())
        with pytest.raises(BadCalibrationFile, match="its certification cannot be read"):
            Compensator(calibration)


@pytest.mark.parametrize(("text", "days"), [("30d", 30), ("12h", 0.5), (" 2w ", 14), ("0d", 0)])
def test_a_span_of_time(text: str, days: float) -> None:
    assert span(text) == timedelta(days=days)


@pytest.mark.parametrize("text", ["30", "d", "-1d", "1.5d", "1y", "٣d", "9999999d"])
def test_a_malformed_time_span_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match=r"due_within .*30d"):
        span(text)


@pytest.fixture
def client(store: Store, tmp_path: Path) -> Iterator[TestClient]:
    put_in_force(store, due_days=10)  # ended long ago by the computer's clock, which is the service's
    store.close()
    with open_client(tmp_path / "lab.sqlite") as opened:
        yield opened


@pytest.mark.slow
def test_units_that_are_due_are_found_counted_and_listed(client: TestClient, store: Store) -> None:
    now = service_of(client).clock.utc()
    campaign = client.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    assert "campaign done" in client.get(f"/api/campaigns/{campaign}/events").text
    client.post("/api/units/FOG-0001/calibrations", json={"effects": ["bias"]})
    body = {"by": "A", "due_days": 20, **OVERRIDE}
    assert client.post("/api/units/FOG-0001/calibrations/1/certify", json=body).status_code == 200
    within = {"due_within": "30d"}
    found = client.get("/api/units", params=within).json()
    assert [(unit["serial"], unit["overdue"]) for unit in found] == [(FOG, True), ("FOG-0001", False)]
    assert found[0]["recalibration"] is None  # imported: there is no recipe
    assert [unit["serial"] for unit in client.get("/api/units", params={"due_within": "0d"}).json()] == [FOG]
    refused = client.get("/api/units", params={"due_within": "a month"})
    assert (refused.status_code, refused.json()["type"]) == (400, "urn:labctl:problem:bad-input")
    metrics = {each.name: each for each in text_string_to_metric_families(client.get("/metrics").text)}
    assert metrics["labctl_units_overdue"].samples[0].value == 1
    assert metrics["labctl_units_due_30d"].samples[0].value == 2
    assert now < datetime.fromisoformat(found[1]["due"]) < now + 21 * DAY

    again = found[1]["recalibration"]  # one press: the recipe of the version in force, on the bench it is from
    assert (again["name"], again["bench"]) == ("short", "single-axis-sim")
    begun = client.post("/api/campaigns", json={"recipe": again["recipe"], "at": "now"})
    assert (begun.status_code, begun.json()["recipe"]) == (202, "short")


def test_the_client_library_tells_of_an_overdue_and_of_a_revoked_calibration(client: TestClient) -> None:
    with Client("http://testserver", transport=transport_to(client)) as vehicle:
        assert [unit.serial for unit in vehicle.units(due_within="1d")] == [FOG]
        with pytest.warns(CalibrationWarning, match=r"was due on 2026-03-11") as given:
            held = vehicle.calibration(FOG)
        assert given[0].filename == __file__
        assert held.warning == str(given[0].message)
        assert (held.state, held.due) == ("in-force", START + 10 * DAY)
        with pytest.warns(CalibrationWarning, match="was due on"):
            assert vehicle.calibration(FOG, held=held).content is held.content  # not downloaded again, but warned of
        client.post(f"/api/units/{FOG}/calibrations/1/revoke", json={"by": "B", "reason": "the unit fell"})
        with pytest.warns(CalibrationWarning, match=r"was revoked at .* by B \(the unit fell\)"):
            revoked = vehicle.calibration(FOG, 1, held=held, accept_withdrawn=True)
        assert (revoked.state, revoked.due, revoked.etag == held.etag) == ("revoked", None, False)
        assert vehicle.fit(FOG, FitRequest(effects=["bias"])).version == 3
        assert vehicle.calibration(FOG, 3).state == "not-certified"  # and no warning


def test_the_command_lists_units_and_certifies_without_a_date(client: TestClient, tmp_path: Path) -> None:
    client.close()
    service_of(client).close()
    lab = Lab(tmp_path)
    (unit,) = lab.json("units", "--due-within", "30d")
    assert (unit["serial"], unit["certified_version"], unit["overdue"]) == (FOG, 1, True)
    assert "overdue" in lab.run("units").stdout
    assert "give a whole number and h, d or w" in lab.run("units", "--due-within", "soon", status=2).stderr
    act = lab.json("certify", FOG, "1", "--by", "A", "--due-days", "0", "--override", "--reason", OVERRIDE["reason"])
    assert (act["due"], act["due_from"]) == (None, "user")
    assert "no unit is due" in lab.run("units", "--due-within", "30d").stdout
