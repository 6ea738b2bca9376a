"""Issue of certificates: what is refused, what is recorded, and that the same facts give the same bytes."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import pytest

from instruments.laboratory import Laboratory
from instruments.standards import Standard
from labctl.answers.certificates import CertificateOrder, CertificateRequest
from labctl.errors import BadInput, NotFound
from labctl.recording import Recording
from labctl.services.certificates.facts import facts_of
from labctl.services.certificates.issue import CertificateRefused, issue, missing_facts
from labctl.services.certificates.missing import MissingFacts
from labctl.services.certificates.served import certificate_file, list_certificates
from labctl.store import Judgement, Store, copy_database, open_store
from tests.helpers.certificates import AT, ORDER, SERIAL, add_version, issued, request, simulated
from tests.helpers.simulated_recordings import single_axis

FORMATS = ("pdf", "xml", "json")


@pytest.fixture(scope="module")
def with_version(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("certificates") / "lab.sqlite"
    with open_store(str(path), write=True) as opened:
        add_version(opened)
    return path


@pytest.fixture
def store(with_version: Path, tmp_path: Path) -> Iterator[Store]:
    copy_database(str(with_version), tmp_path / "lab.sqlite")
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "empty.sqlite"), write=True) as opened:
        yield opened


def with_standards(*standards: Standard) -> Recording:
    recording = simulated()
    return replace(recording, info=recording.info.model_copy(update={"standards": standards}))


def rows_of(store: Store) -> int:
    with closing(sqlite3.connect(store.location)) as raw:
        return int(raw.execute("SELECT count(*) FROM certificates").fetchone()[0])


def test_every_missing_fact_is_named_at_once_and_nothing_is_written(empty: Store) -> None:
    add_version(empty, certified=False)
    before = empty.audit.rows()
    with pytest.raises(MissingFacts) as refused:
        issue(empty, SERIAL, 1, CertificateRequest(by="I. Issuer"), AT)
    facts = {each.fact: each.where for each in refused.value.facts}
    for fact in (
        "laboratory's name", "laboratory's street", "laboratory's country", "laboratory's email or phone",
        "customer's name", "customer's city", "item's manufacturer", "item's condition", "name of the method",
        "authorisation",
    ):  # fmt: skip
        assert fact in facts, fact
    assert facts["customer's name"] == "[customer] of the order"
    assert facts["laboratory's name"] == "[laboratory] of the order"  # an import has no bench file
    assert f"labctl certify {SERIAL} 1" in facts["authorisation"]
    text = str(refused.value)
    assert f"{len(refused.value.facts)} facts are missing" in text
    assert all(fact in text for fact in facts)
    city = {"fact": "customer's city", "where": "[customer] of the order", "table": "customer", "key": "city"}
    assert {**city, "remedy": ""} in refused.value.members["missing"]
    assert all((each.table is None) == bool(each.remedy) == (not each.key) for each in refused.value.facts)
    tables = {each.fact: each.table for each in refused.value.facts}
    assert tables["laboratory's name"] == "laboratory"
    assert tables["name of the method"] == "method"
    assert tables["authorisation"] is None
    assert [each.fact for each in missing_facts(empty, SERIAL, 1)] == list(facts)
    assert rows_of(empty) == 0
    assert empty.audit.rows() == before


@pytest.mark.parametrize("part", ["laboratory", "customer", "item", "method"])
def test_each_part_of_the_order_is_needed(store: Store, part: str) -> None:
    with pytest.raises(MissingFacts, match=part):
        issue(store, SERIAL, 1, request(**{part: None}), AT)
    assert rows_of(store) == 0


@pytest.mark.slow
def test_a_standard_past_its_due_date_is_refused_by_name(empty: Store) -> None:
    day = simulated().info.started_at.date()
    good = Standard(quantity="clock", u=1.0, certificate="C-1", issued_by="PTB", calibrated=day, due=date(2099, 1, 1))
    late = Standard(
        quantity="thermometer", name="Pt100 no. 7", u=0.1, certificate="T-9", issued_by="DKD", calibrated=None,
        due=day - timedelta(days=1),
    )  # fmt: skip
    early = late.model_copy(update={"due": date(2099, 1, 1), "calibrated": day + timedelta(days=1)})
    for bad in (late, early):
        version = add_version(empty, with_standards(good, bad))
        with pytest.raises(CertificateRefused, match=r"Pt100 no\. 7, certificate T-9.*measure again"):
            issue(empty, SERIAL, version, request(), AT)
    assert rows_of(empty) == 0


@pytest.mark.slow
def test_standards_without_certificate_or_traceability_are_missing(empty: Store) -> None:
    bare = Standard(quantity="clock", u=1.0)
    version = add_version(empty, with_standards(bare))
    with pytest.raises(MissingFacts, match=r"certificate, issued_by, due \(or traceability\) of standard clock"):
        issue(empty, SERIAL, version, request(), AT)
    version = add_version(empty, with_standards(Standard(quantity="thermometer", u=1.0, traceability="SI")))
    with pytest.raises(MissingFacts, match="standard of the rate"):
        issue(empty, SERIAL, version, request(), AT)


def test_the_same_facts_give_the_same_bytes(empty: Store) -> None:
    answer, forms = issued()
    again = issue(empty, SERIAL, add_version(empty), request(), AT)
    assert again == answer
    assert empty.certificates.forms(again.number) == forms


def test_conditions_and_results_have_one_range_of_the_items_temperature(empty: Store) -> None:
    version = add_version(empty, single_axis(1))
    number = issue(empty, SERIAL, version, request(), AT).number
    document = json.loads(certificate_file(empty, SERIAL, version, "json").content)
    temperatures_c = [each["temperature_c"] for each in document["results"]]
    (item,) = [each for each in document["environment"] if each["name"] == "Temperature of the item"]
    assert (item["low"], item["high"]) == (min(temperatures_c), max(temperatures_c)), number
    readings = empty.recordings.samples(empty.calibrations.get(SERIAL, version).recordings[0]).columns
    (chamber,) = [each for each in document["environment"] if each["name"] == "Temperature of the chamber air"]
    ends = float(readings["chamber_c"].min()), float(readings["chamber_c"].max())
    assert (chamber["low"], chamber["high"]) == pytest.approx(ends, abs=1e-5)  # kept with 7 digits


def test_a_certificate_states_the_nominal_scale_factor_and_of_which_effects_the_cause_is_not_known(
    empty: Store,
) -> None:
    version = add_version(empty, certified=False)
    said = "These data do not show that the cause is scale_factor."
    known = Judgement("adequate", 1, AT, False, {"verdict_text": "Adequate.", "cause_not_known": [said]})
    empty.calibrations.certify(SERIAL, version, "certify", by="Ada A.", reason="meets it", at=AT, judgement=known)
    issue(empty, SERIAL, version, request(), AT)
    document = json.loads(certificate_file(empty, SERIAL, version, "json").content)
    assert f"On the error model: {said}" in document["statements"]
    assert document["nominal"] == [{"axis": "z", "unit": "deg/s", "offset": 0.0, "scale": 1.0}]
    dcc = certificate_file(empty, SERIAL, version, "xml").content.decode()
    assert "Nominal axis z: scale factor 1 °/s per °/s, 0 °/s at rest." in dcc


def test_issuing_again_answers_what_was_issued(store: Store) -> None:
    first = issue(store, SERIAL, 1, request(), AT)
    kept = {name: certificate_file(store, SERIAL, 1, name).content for name in FORMATS}
    assert (first.number, first.replaces, first.version) == ("ICL-2027-0001", None, 1)
    later = issue(store, SERIAL, 1, CertificateRequest(by="Someone Else"), AT + timedelta(days=9))
    assert later == first
    assert issue(store, SERIAL, 1, request(), AT + timedelta(days=9)) == first
    assert {name: certificate_file(store, SERIAL, 1, name).content for name in FORMATS} == kept
    assert rows_of(store) == 1
    with pytest.raises(
        CertificateRefused, match="another item; to replace that certificate, give the reason with --amend"
    ):
        issue(store, SERIAL, 1, request(item={**ORDER["item"], "condition": "Scratched."}), AT)


def test_an_amended_certificate_has_its_own_number_and_names_what_it_replaces(store: Store) -> None:
    first = issue(store, SERIAL, 1, request(), AT)
    changed = request(item={**ORDER["item"], "condition": "Scratched."}).model_copy(update={"amend": "wrong condition"})
    second = issue(store, SERIAL, 1, changed, AT + timedelta(days=400))
    assert (second.number, second.replaces, second.reason) == ("ICL-2028-0001", first.number, "wrong condition")
    document = json.loads(certificate_file(store, SERIAL, 1, "json").content)
    assert document["replaces"] == {"number": first.number, "hash": first.hash, "reason": "wrong condition"}
    old = certificate_file(store, SERIAL, 1, "json", first.number)
    assert json.loads(old.content)["item"]["condition"] == "No visible damage."
    listed = list_certificates(store, SERIAL)
    assert [(row.number, row.replaced_by) for row in listed] == [(second.number, None), (first.number, second.number)]
    kept = CertificateRequest(by="I. Issuer", amend="a third time")  # the facts stay
    assert issue(store, SERIAL, 1, kept, AT + timedelta(days=401)).replaces == second.number
    document = json.loads(certificate_file(store, SERIAL, 1, "json").content)
    assert document["item"]["condition"] == "Scratched."


def test_there_is_nothing_to_amend_or_to_fetch_before_the_first(store: Store) -> None:
    with pytest.raises(CertificateRefused, match="no certificate to amend"):
        issue(store, SERIAL, 1, request().model_copy(update={"amend": "because"}), AT)
    with pytest.raises(NotFound, match=r"--order ORDER\.toml"):
        certificate_file(store, SERIAL, 1, "pdf")
    with pytest.raises(BadInput, match="give pdf, xml or json"):
        certificate_file(store, SERIAL, 1, ".docx")


def test_a_revoked_version_gets_no_certificate(store: Store) -> None:
    store.calibrations.certify(SERIAL, 1, "revoke", by="Ada Authoriser", reason="was dropped", at=AT)
    with pytest.raises(CertificateRefused, match=r"was revoked at .* by Ada Authoriser \(was dropped"):
        issue(store, SERIAL, 1, request(), AT)


def test_an_item_that_came_after_its_calibration_is_refused(store: Store) -> None:
    with pytest.raises(CertificateRefused, match="received = 2099-01-01 is after the calibration"):
        issue(store, SERIAL, 1, request(item={**ORDER["item"], "received": "2099-01-01"}), AT)


@pytest.mark.parametrize(("years", "refused"), [(9, False), (11, True)])
def test_an_item_that_came_more_than_ten_years_before_its_calibration_is_refused(
    store: Store, years: int, refused: bool
) -> None:
    begun = simulated().info.started_at.date()
    received = begun.replace(year=begun.year - years, day=1)
    ordered = request(item={**ORDER["item"], "received": received.isoformat()})
    if not refused:
        assert issue(store, SERIAL, 1, ordered, AT).state == "valid"
        return
    with pytest.raises(CertificateRefused, match=f"received = {received} is more than 10 years before") as error:
        issue(store, SERIAL, 1, ordered, AT)
    words = str(error.value).removeprefix("[item] of the order: received = ")
    assert error.value.members["errors"] == [{"place": ["body", "order", "item", "received"], "text": words}]
    assert rows_of(store) == 0


def test_measurements_end_on_the_day_they_begin_unless_the_order_says_more(store: Store) -> None:
    day = simulated().info.started_at.date()
    method = {**ORDER["method"], "performed_from": (day - timedelta(days=1)).isoformat()}
    imported = replace(simulated(), info=simulated().info.model_copy(update={"date_known": False}))
    version = add_version(store, imported)
    issue(store, SERIAL, version, request(method={**method, "performed_from": day.isoformat()}), AT)
    document = json.loads(certificate_file(store, SERIAL, version, "json").content)
    assert document["performed_from"] == document["performed_until"] == day.isoformat()
    with pytest.raises(CertificateRefused, match=r"performed_until = .* is before the first day"):
        issue(store, SERIAL, 1, request(method={**method, "performed_until": "2000-01-01"}), AT)


def test_what_the_readings_do_not_show_is_missing_before_the_order_with_what_to_do(empty: Store) -> None:
    bare = replace(
        simulated(),
        info=simulated().info.model_copy(update={"standards": (), "datasheet": {}, "datasheet_conventions": {}}),
    )
    add_version(empty, bare, certified=False)
    remedies = {each.fact: each.remedy for each in missing_facts(empty, SERIAL, 1) if each.table is None}
    assert "[[standards]]" in remedies["reference standards"]
    assert "import it again" in remedies["reference standards"]
    assert "Certify: put in force" in remedies["authorisation"]
    assert "bias_repeatability_dps" in remedies["uncertainty of the repeatability"]


def test_a_simulated_bench_gives_a_specimen_that_claims_no_traceability(empty: Store) -> None:
    first = json.loads(issued()[1].document)["statements"]
    assert first[0].startswith("SPECIMEN")
    assert not any("traceable to the SI" in each for each in first)
    real = Standard(quantity="clock", u=1.0, certificate="C-1", issued_by="PTB", due=date(2099, 1, 1))
    version = add_version(empty, with_standards(real))
    other = json.loads(_document(empty, version))["statements"]
    assert not any(each.startswith("SPECIMEN") for each in other)
    assert any("traceable to the SI" in each for each in other)


def test_the_issue_is_in_the_audit_trail(store: Store) -> None:
    answer = issue(store, SERIAL, 1, request(), AT)
    (row,) = [each for each in store.audit.rows() if each.action == "certificate"]
    assert (row.who, row.subject) == ("I. Issuer", f"{SERIAL} version 1")
    assert row.detail["number"] == answer.number
    assert row.detail["hash"] == answer.hash


@pytest.mark.slow
def test_as_found_is_by_the_version_in_force_before(store: Store) -> None:
    first = json.loads(_document(store, 1))
    assert first["as_found"]["basis"] == "the output converted with its nominal scale factor, without correction"
    version = add_version(store)
    second = json.loads(_document(store, version))
    assert second["as_found"]["basis"] == "the calibration in force before, version 1"
    assert second["as_found"]["axes"] == second["as_left"]["axes"] == first["as_left"]["axes"]  # the same recording
    assert first["as_found"]["axes"][0]["rms_dps"] > 3 * first["as_left"]["axes"][0]["rms_dps"]


def test_the_due_date_is_stated_where_the_customer_agreed(store: Store) -> None:
    due = AT + timedelta(days=365)
    store.calibrations.certify(SERIAL, 1, "certify", by="Ada", reason="again", at=AT, due_at=due)
    document = json.loads(_document(store, 1))
    assert document["due"] is None
    agreed = request(state_due=True).model_copy(update={"amend": "the customer agreed to an interval"})
    issue(store, SERIAL, 1, agreed, AT)
    assert json.loads(certificate_file(store, SERIAL, 1, "json").content)["due"] == due.date().isoformat()


def _document(store: Store, version: int) -> bytes:
    issue(store, SERIAL, version, request(), AT)
    return certificate_file(store, SERIAL, version, "json").content


def test_an_order_cannot_complete_the_laboratory_of_a_bench_file(store: Store) -> None:
    facts = facts_of(store, SERIAL, 1, CertificateOrder())
    named = replace(facts, laboratory=Laboratory(name="Inertial Laboratory"), names_laboratory=True)
    found = {each.fact: each for each in named.missing()}
    assert found["laboratory's city"].table is None
    assert "Complete [laboratory] in the bench file" in found["laboratory's city"].remedy
    assert {each.fact: each.table for each in facts.missing()}["laboratory's city"] == "laboratory"
