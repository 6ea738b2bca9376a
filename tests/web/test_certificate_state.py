"""The page behind the QR code of a certificate, for a visitor without a key, and the list on the page of the unit."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest

from labctl.answers.certificates import CertificateRequest
from labctl.services.certificates.issue import issue
from labctl.services.certificates.served import certificate_file
from labctl.services.certificates.states import list_certificates
from labctl.store import NewReleaseRequest, open_store
from tests.helpers.browser import Faults, Service
from tests.helpers.certificates import AT, SERIAL, add_version, request

if TYPE_CHECKING:
    from playwright.sync_api import Page

FIRST, SECOND = "ICL-2027-0001", "ICL-2027-0002"


@pytest.fixture
def keys() -> bool:
    return False


@pytest.fixture
def service(tmp_path: Path, keys: bool) -> Iterator[Service]:
    """Serve a unit whose certificate was amended."""
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        add_version(store)
        issue(store, SERIAL, 1, request(), AT)
        issue(store, SERIAL, 1, CertificateRequest(by="Ida", amend="street was wrong"), AT + timedelta(days=1))
    serving = Service(tmp_path, bench=None, keys=keys)
    serving.start()
    yield serving
    serving.stop()


def printed_page(service: Service, number: str) -> str:
    """Return path and query of the address that a certificate's QR code has."""
    file = certificate_file(service.lab_service.store, SERIAL, 1, "json", number)
    address = urlsplit(json.loads(file.content)["state_address"])
    return f"{address.path}?{address.query}"


def test_without_a_bench_no_diagnosis_is_offered_and_the_page_says_why(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{SERIAL}")
    found = page.get_by_role("region", name="Diagnosis by experiments")
    expect(found.get_by_text("This service drives no bench, so it runs no experiment")).to_be_visible()
    expect(page.get_by_role("button", name="Diagnose")).to_have_count(0)


@pytest.mark.parametrize("keys", [True])
def test_whoever_has_the_paper_sees_the_state_without_a_key(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit(printed_page(service, SECOND))
    found = page.get_by_role("region", name=f"Certificate {SECOND}")
    expect(found.get_by_text(f"Certificate {SECOND} is valid.")).to_be_visible()
    expect(found).to_contain_text(service.lab_service.store.calibrations.get(SERIAL, 1).hash)

    page = visit(printed_page(service, FIRST))
    found = page.get_by_role("region", name=f"Certificate {FIRST}")
    expect(found.get_by_role("alert")).to_contain_text("is amended")
    expect(found.get_by_role("alert")).to_contain_text("street was wrong")
    expect(found.get_by_role("alert")).to_contain_text(f"Valid now: certificate {SECOND}.")
    (row, _) = list_certificates(service.lab_service.store, SERIAL)
    service.lab_service.store.calibrations.certify(SERIAL, 1, "revoke", by="Rita", reason="was dropped", at=AT)
    page.reload()
    found = page.get_by_role("region", name=f"Certificate {FIRST}")
    expect(found.get_by_role("alert")).to_contain_text("is withdrawn")
    expect(found.get_by_role("alert")).to_contain_text("Reason: was dropped")
    expect(found.get_by_role("alert")).to_contain_text("None is valid now.")
    assert row.number == SECOND


@pytest.mark.slow
def test_a_number_that_does_not_belong_to_the_hash_is_unknown(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    page = visit("/certificates")
    page.get_by_label("Number of the certificate").fill(FIRST)
    page.get_by_label("SHA-256 of the calibration").fill("0" * 16)
    page.get_by_role("button", name="Look up").click()
    expect(page.get_by_role("alert")).to_contain_text("Unknown certificate.")
    faults.clear()  # the browser complains of the answer 404
    page.get_by_label("SHA-256 of the calibration").fill(service.lab_service.store.calibrations.get(SERIAL, 1).hash)
    page.get_by_role("button", name="Look up").click()
    expect(page.get_by_role("alert")).to_contain_text(f"Certificate {FIRST} is amended")


@pytest.mark.slow
def test_the_page_of_the_unit_lists_the_states_and_withdraws(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{SERIAL}")
    listed = page.get_by_role("region", name="Certificates", exact=True).get_by_role("table")
    expect(listed.get_by_role("row").nth(1)).to_contain_text("valid")
    expect(listed.get_by_role("row").nth(2)).to_contain_text("amended")
    listed.get_by_role("row").nth(1).get_by_role("button", name="Withdraw").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Who").fill("Rita")
    dialog.get_by_label("Why").fill("standard was bad")
    dialog.get_by_role("button", name="Withdraw").click()
    expect(listed.get_by_role("row").nth(1)).to_contain_text("withdrawn")
    expect(listed.get_by_role("row").nth(1)).to_contain_text("standard was bad")
    expect(page.get_by_role("group", name=f"Certificate {SECOND}")).to_contain_text("withdrawn")
    (newest, _) = service.get(f"/api/units/{SERIAL}/certificates")
    assert (newest["state"], newest["state_by"], newest["state_by_key"]) == ("withdrawn", "Rita", None)


@pytest.mark.slow
def test_a_revocation_names_certificates_and_who_fetched_the_version(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    service.get(f"/api/units/{SERIAL}/calibration")
    page = visit(f"/units/{SERIAL}")
    calibrations = page.get_by_role("region", name="Calibrations", exact=True).get_by_role("table")
    calibrations.get_by_text("Fetched by").click()
    expect(calibrations.get_by_role("group", name="Who fetched it")).to_contain_text("anonymous")
    calibrations.get_by_role("button", name="Revoke").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Who").fill("Rita")
    dialog.get_by_label("Why").fill("was dropped")
    dialog.get_by_role("button", name="Revoke").click()
    said = page.get_by_text("Version 1 is revoked.")
    expect(said).to_contain_text(f"Withdrawn: {FIRST}, {SECOND}. Notify those who fetched it: anonymous.")


@pytest.mark.slow
def test_a_version_that_waits_is_released_by_the_second_person(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    first = NewReleaseRequest(SERIAL, 1, "Ada A.", "ada", "meets the criteria", AT, None, override=True)
    service.lab_service.store.release_requests.add(first)
    page = visit(f"/units/{SERIAL}")
    expect(page.get_by_text("Version 1 waits for a second person.")).to_be_visible()
    page.get_by_role("button", name="Release").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Who").fill("Bob B.")
    dialog.get_by_label("Why").fill("looked at it")
    dialog.get_by_role("button", name="Release").click()
    expect(page.get_by_role("alert")).to_contain_text("needs an API key")  # this service asks for none
    faults.clear()  # the browser complains of the answer 409
