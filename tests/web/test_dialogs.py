"""Dialogs: one belongs to the page that it was opened on, and stays open while its request is refused."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Faults, Service, settled
from tests.helpers.certifying import OVERRIDE

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

FOG = "OSU-FOG-2024"
UNIT = f"/api/units/{FOG}/calibrations"
#: A page whose names are not cut is 24 000 px high.
MAX_HEIGHT_PX = 6000

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """Import a gyro, and fit an adequate version to it and one that lacks an effect."""

    def fitted(service: Service) -> None:
        service.post("/api/recordings/example", {"name": "osu-fog"})
        service.post(UNIT, {"model": "ojeda2000"})
        service.post(UNIT, {"effects": ["bias", "scale_factor"]})
        service.get(f"{UNIT}/1/assessment")

    return furnish(fitted)


def asked(page: Page, button: str) -> Locator:
    """Open a dialog of the unit for version 1 and fill in who and why."""
    page.get_by_role("button", name=button, exact=True).last.click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Who").fill("A. Person")
    dialog.get_by_label("Why").fill("fits")
    return dialog


def test_a_dialog_closes_when_its_page_is_left(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/units")
    page.get_by_role("link", name=FOG).first.click()
    dialog = asked(page, "Certify: put in force")
    expect(dialog.get_by_role("heading")).to_have_text(f"Certify version 1 of {FOG}: put it in force")
    page.go_back()
    expect(page.get_by_role("heading", level=1)).to_have_text("Units")
    expect(dialog).to_have_count(0)
    assert service.get(f"/api/units/{FOG}/certifications") == []


def test_a_dialog_that_is_not_ready_before_the_page_is_left_does_not_open(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit("/units")
    page.get_by_role("link", name=FOG).first.click()
    held: list[object] = []
    page.route("**/assessment", lambda route: held.append(route))  # noqa: PLW0108  playwright marks it
    page.get_by_role("button", name="Certify: put in force").last.click()
    with page.expect_event("requestfailed", lambda request: request.url.endswith("/assessment")):
        page.go_back()
    expect(page.get_by_role("heading", level=1)).to_have_text("Units")
    expect(page.get_by_role("dialog")).to_have_count(0)


def test_a_refusal_is_shown_in_the_dialog_beside_what_was_filled_in(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{FOG}")
    dialog = asked(page, "Certify: put in force")
    due, act = dialog.get_by_label("Due again in days"), dialog.get_by_role("button", name="Certify")
    expect(dialog).to_contain_text("From 1 to 36500; empty: no due date.")
    for wrong in ("0", "-5", "99999999"):
        due.fill(wrong)
        act.click()
        assert due.evaluate("input => input.matches(':invalid')"), wrong
    due.evaluate("input => { input.min = ''; input.max = ''; }")  # as a page of another version might
    due.fill("99999999")
    act.click()
    refusal = dialog.get_by_role("alert")
    expect(refusal).to_contain_text("Due again in days: the next calibration cannot be due in 99999999 days; give from")
    expect(dialog.get_by_label("Who")).to_have_value("A. Person")
    expect(due).to_have_value("99999999")
    dialog.get_by_label("Who").fill("   ")
    due.fill("30")
    act.click()
    expect(refusal).to_contain_text("Who: the name of a person is blank (3 characters); give a name")
    dialog.get_by_label("Who").fill("A. Person")
    act.click()
    expect(dialog).to_have_count(0)
    expect(page.get_by_role("region", name="In force")).to_contain_text("in 30 days")
    faults.clear()  # the browser reports what was refused


def test_the_same_certification_of_two_tabs_is_said_and_written_once(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    tabs = [visit(f"/units/{FOG}") for _ in range(2)]
    dialogs = [asked(page, "Certify: put in force") for page in tabs]
    for dialog in dialogs:
        dialog.get_by_role("button", name="Certify").click()
        expect(dialog).to_have_count(0)
    expect(tabs[1].locator(".toasts")).to_contain_text("Version 1 was in force already.")
    expect(tabs[1].locator(".toasts")).to_contain_text("nothing was written")
    assert len(service.get(f"/api/units/{FOG}/certifications")) == 1

    revoking = [asked(page, "Revoke") for page in tabs]
    expect(revoking[0].get_by_role("heading")).to_have_text(f"Revoke version 1 of {FOG}")
    revoking[0].get_by_role("button", name="Revoke").click()
    expect(revoking[0]).to_have_count(0)
    revoking[1].get_by_role("button", name="Revoke").click()
    expect(revoking[1].get_by_role("alert")).to_contain_text("version 1 is not in force")
    expect(tabs[1].get_by_role("button", name="Revoke", exact=True, include_hidden=True)).to_have_count(1)  # its own
    faults.clear()  # the browser reports what was refused


def test_a_long_name_that_was_stored_is_cut(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    store = service.lab_service.store
    store.calibrations.certify(FOG, 1, "certify", by="x" * 5000, reason="r", at=datetime(2027, 3, 1, tzinfo=UTC))
    page = visit(f"/units/{FOG}")
    expect(page.get_by_role("region", name="In force")).to_contain_text("x" * 120 + "…")
    settled(page)
    assert page.evaluate("document.documentElement.scrollHeight") < MAX_HEIGHT_PX


def test_explore_keeps_the_next_experiment_of_a_certified_version_that_lacks_something(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    service.post(f"{UNIT}/2/certify", {"by": "A. Person", **OVERRIDE})
    page = visit(f"/explore?unit={FOG}&version=2")
    settled(page)
    link = page.get_by_role("link", name="Next experiment")
    expect(link).to_be_visible()
    link.click()
    page.wait_for_url("**/campaigns/new**")
