"""Three simulated years of a laboratory whose thermometer is found bad in the second."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from labctl.answers.certification import CertifyRequest
from labctl.answers.standards import StandardResponse, WithdrawFindingRequest
from labctl.errors import CertificationRefused, Conflict
from labctl.services.calibrations.certification import certify
from labctl.services.calibrations.fitting import list_calibrations, one_version
from labctl.services.certificates import issue as issuing
from labctl.services.certificates.issue import CertificateRefused, issue
from labctl.services.certificates.served import certificate_file, list_certificates, public_certificate
from labctl.services.standards.register import one_standard, withdraw_finding
from labctl.services.standards.usage import affected
from labctl.services.units import unit
from labctl.store import Store, check, open_store
from tests.helpers import register
from tests.helpers.certificates import request
from tests.helpers.register import COUNTER, noon, thermometer

LAST_GOOD, FOUND = date(2025, 4, 1), date(2025, 9, 15)
REFUSED = r"Pt100-7 was found bad from 2025-04-01 until 2025-09-15 \(sheath is broken"


@dataclass
class Laboratory:
    """The laboratory at the end of the three years."""

    store: Store
    after_check: StandardResponse  #: the thermometer when its check was out of limits


def three_years(store: Store) -> Laboratory:
    """Measure two units in each year; the thermometer breaks between April and September of the second."""
    register.add(store)
    register.certificate(store, "T-1", date(2023, 12, 1), 0.010, due="2024-12-31")
    for month in (1, 3, 5, 7, 9, 11):
        register.check(store, date(2024, month, 20), 0.010 + 0.002 * (month % 3 - 1))
    register.measured(store, "FOG-A", date(2024, 3, 4), COUNTER, thermometer("T-1"))
    register.certificate(store, "T-2", date(2024, 12, 3), 0.018, due="2025-12-31")
    register.measured(store, "FOG-B", date(2025, 2, 3), COUNTER, thermometer("T-2"))
    register.check(store, LAST_GOOD, 0.021)
    register.measured(store, "FOG-A", date(2025, 6, 2), COUNTER, thermometer("T-2"))
    register.measured(store, "FOG-B", date(2025, 7, 7), COUNTER, thermometer("T-2", name="SN-0815"))
    register.measured(store, "FOG-C", date(2025, 7, 8), COUNTER, thermometer("T-9", name="Pt100-8"))  # another one
    issue(store, "FOG-A", 2, request(), noon(date(2025, 6, 10)))
    found = register.check(store, FOUND, 0.250)
    register.bad(store, LAST_GOOD, FOUND, FOUND)
    register.certificate(store, "T-3", date(2025, 10, 20), 0.012, due="2026-10-31", adjusted=True)
    register.measured(store, "FOG-A", date(2026, 3, 2), COUNTER, thermometer("T-3"))
    return Laboratory(store, found)


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    with open_store(str(tmp_path_factory.mktemp("years") / "lab.sqlite"), write=True) as store:
        yield three_years(store)


def test_the_calibrations_between_the_last_good_check_and_the_bad_one_are_listed(laboratory: Laboratory) -> None:
    found = affected(laboratory.store, "Pt100-7")
    assert [(each.serial, each.version) for each in found.calibrations] == [("FOG-A", 2), ("FOG-B", 2)]
    assert (found.bad_from, found.bad_until) == (LAST_GOOD, FOUND)
    first, second = found.calibrations
    assert first.certificates == ["ICL-2025-0001"]  # issued before it was found
    assert (first.in_force, second.in_force) == (False, True)
    assert (first.performed_from, second.performed_from) == (date(2025, 6, 2), date(2025, 7, 7))
    assert "ICL-2025-0001" in found.text[1]
    assert "revoke" in found.text[2]
    assert len(affected(laboratory.store, "SN-0815", date(2023, 1, 1), date(2027, 1, 1)).calibrations) == 5


def test_they_have_a_notice_wherever_they_are_shown(laboratory: Laboratory) -> None:
    store = laboratory.store
    assert [bool(row.notices) for row in list_calibrations(store, "FOG-A")] == [False, True, False]  # newest first
    assert [bool(row.notices) for row in list_calibrations(store, "FOG-B")] == [True, False]
    (notice,) = one_version(store, "FOG-A", 2).notices
    assert notice.startswith("standard Pt100-7 was found bad from 2025-04-01 until 2025-09-15")
    assert not one_version(store, "FOG-C", 1).notices
    assert unit(store, "FOG-B", noon(FOUND)).notices  # its version in force
    assert not unit(store, "FOG-A", noon(FOUND)).notices
    touched = list_certificates(store, "FOG-A")[-1]
    assert touched.notices == [notice]
    _, hash_ = store.calibrations.document("FOG-A", 2)
    (said,) = public_certificate(store, touched.number, hash_).notices  # behind the QR code
    assert "Pt100-7, which was used on these days, was found bad from 2025-04-01 until 2025-09-15. Ask" in said
    assert "sheath" not in said  # what the laboratory wrote for itself


@pytest.mark.slow
def test_new_certificates_of_them_are_refused_and_the_others_are_issued(laboratory: Laboratory) -> None:
    store, at = laboratory.store, noon(date(2026, 4, 1))
    with pytest.raises(CertificateRefused, match=REFUSED):
        issue(store, "FOG-B", 2, request(), at)
    with pytest.raises(CertificateRefused, match=REFUSED):  # neither an amended one
        issue(
            store,
            "FOG-A",
            2,
            request(external="Other Laboratory").model_copy(update={"amend": "other laboratory"}),
            at,
        )
    with pytest.raises(CertificationRefused, match="measure again with another standard"):
        certify(store, "FOG-B", 2, CertifyRequest(by="Ada", reason="again"), at)
    kept = issue(store, "FOG-A", 2, request(), at)
    assert kept.number == "ICL-2025-0001"  # that was issued is answered as it is, with the notice
    assert kept.notices
    for serial, version in (("FOG-A", 1), ("FOG-B", 1), ("FOG-C", 1), ("FOG-A", 3)):
        assert issue(store, serial, version, request(), at).number
    document = json.loads(certificate_file(store, "FOG-A", 3, "json").content)
    assert [each["certificate"] for each in document["standards"]] == ["C-1", "T-3"]


def test_the_charts_say_when_it_was_out(laboratory: Laboratory) -> None:
    after = laboratory.after_check
    assert [each.state for each in after.checks] == ["in"] * 7 + ["out"]
    assert after.state == "check it"
    assert after.text[0].startswith("Check standard Pt100-7: on 2025-09-15 its check of 0.25 deg C is out of the")
    assert {each.basis for each in after.checks[-1].limits} == {"stated u"}  # seven checks are no history yet
    now = one_standard(laboratory.store, "Pt100-7", date(2026, 4, 1))
    assert now.state == "valid"  # repaired, calibrated, and its finding is over
    assert [each.number for each in now.certificates] == ["T-1", "T-2", "T-3"]
    assert (now.predictions[0].value, now.predictions[0].per_year) == (0.012, None)
    assert "since the last adjustment" in now.predictions[0].why
    assert one_standard(laboratory.store, "Pt100-7", date(2026, 11, 1)).state == "overdue"
    assert one_standard(laboratory.store, "Pt100-7", date(2025, 9, 1)).state == "bad"


def test_the_drift_of_the_first_two_years_is_known(laboratory: Laboratory) -> None:
    (found,) = one_standard(laboratory.store, "Pt100-7", date(2025, 6, 2)).predictions
    assert found.per_year == pytest.approx(0.008, rel=0.01)
    assert found.value == pytest.approx(0.018 + 0.008 * 0.5, abs=2e-4)
    assert found.u > 0.02  # more than either certificate
    assert found.u_per_year == pytest.approx(0.02 * 2**0.5, rel=0.01)


def test_every_act_is_audited_and_sealed(laboratory: Laboratory) -> None:
    store = laboratory.store
    acts = [row for row in store.audit.rows() if row.action.startswith("standard ")]
    assert [row.action for row in acts].count("standard certificate") == 3
    (bad,) = [row for row in acts if row.action == "standard bad"]
    assert (bad.who, bad.subject) == ("M. Metrologist", "standard Pt100-7")
    assert bad.detail["reason"] == "sheath is broken"
    assert not check(store.location).findings


def test_a_certificate_that_is_changed_by_hand_is_found(tmp_path: Path) -> None:
    path = tmp_path / "lab.sqlite"
    with open_store(str(path), write=True) as store:
        register.add(store)
        register.certificate(store, "T-1", date(2023, 12, 1), 0.01)
        register.bad(store, LAST_GOOD, None, FOUND)
    assert not check(str(path)).findings
    with closing(sqlite3.connect(path)) as raw, raw:
        raw.execute("UPDATE standard_certificates SET points = replace(points, '0.01', '0.09')")
        raw.execute("UPDATE standard_findings SET bad_until = '2025-04-02'")
    found = [each.text for each in check(str(path)).findings]
    assert any(text.startswith("certificate T-1 of a standard: points changed") for text in found)
    assert any(text.startswith("finding 1 on a standard: act changed") for text in found)


@pytest.mark.slow
def test_a_finding_that_was_wrong_is_withdrawn_and_stays_readable(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        register.add(store)
        register.certificate(store, "T-1", date(2023, 12, 1), 0.01)
        register.measured(store, "FOG-B", date(2025, 7, 7), COUNTER, thermometer("T-1"))
        (finding,) = register.bad(store, LAST_GOOD, None, FOUND).findings
        with pytest.raises(CertificateRefused):
            issue(store, "FOG-B", 1, request(), noon(FOUND))
        asked = WithdrawFindingRequest(reason="the reference of the check was wrong", by="Q. Manager")
        answer = withdraw_finding(store, "Pt100-7", finding.number, asked, noon(FOUND))
        assert answer.findings[0].withdrawn == "Q. Manager, 2025-09-15: the reference of the check was wrong"
        assert not list_calibrations(store, "FOG-B")[0].notices
        assert issue(store, "FOG-B", 1, request(), noon(FOUND)).number


@pytest.mark.slow
def test_a_standard_that_is_found_bad_while_a_certificate_is_written_refuses_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    on = date(2025, 3, 3)
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        register.add(store)
        register.certificate(store, "T-1", date(2024, 12, 1), 0.010, due="2025-12-31")
        register.measured(store, "FOG-A", on, COUNTER, thermometer("T-1"))
        write = issuing.forms_of

        def found_bad_meanwhile(*given: Any) -> Any:
            register.bad(store, on, on, on)
            return write(*given)

        with monkeypatch.context() as patched:
            patched.setattr(issuing, "forms_of", found_bad_meanwhile)
            with pytest.raises(Conflict, match=r"no certificate of FOG-A version 1 was stored.*send the request again"):
                issue(store, "FOG-A", 1, request(), noon(on))
        assert store.certificates.of_unit("FOG-A") == []
        assert not [row for row in store.audit.rows() if row.action == "certificate"]
        with pytest.raises(CertificateRefused, match="Pt100-7 was found bad"):
            issue(store, "FOG-A", 1, request(), noon(on))
