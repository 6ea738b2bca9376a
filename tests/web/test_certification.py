"""Certifying on the page of a unit: the verdict is shown, and an override is asked for only where it is needed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page

UNIT = "/api/units/OSU-FOG-2024/calibrations"


@pytest.mark.slow
def test_the_dialog_shows_the_verdict_and_asks_for_an_override_where_it_is_needed(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    service.post("/api/recordings/example", {"name": "osu-fog"})
    service.post(UNIT, {"model": "ojeda2000"})
    service.post(UNIT, {"effects": ["bias", "scale_factor"]})
    page = visit("/units/OSU-FOG-2024")
    certify, dialog = page.get_by_role("button", name="Certify"), page.get_by_role("dialog")
    in_force = page.get_by_role("region", name="In force")

    expect(page.get_by_role("button", name="Issue certificate")).to_have_count(0)  # of none that is not certified
    expect(page.get_by_text("Certificate: only once it is certified")).to_have_count(2)
    certify.last.click()  # version 1
    expect(dialog).to_contain_text("Adequate: no effect is missing")
    expect(dialog.get_by_role("checkbox")).to_have_count(0)
    # issuing a certificate is another act
    expect(dialog).to_contain_text("Certify version 1 of OSU-FOG-2024: put it in force")
    expect(dialog).to_contain_text("It makes no document.")
    expect(dialog).to_contain_text("No certificate can be issued afterwards.")  # the data lack what one states
    expect(dialog).not_to_contain_text("is issued afterwards")
    dialog.get_by_label("Who").fill("A. Person")
    dialog.get_by_label("Why").fill("fits")
    dialog.get_by_role("button", name="Certify").click()
    expect(in_force).to_contain_text("version 1")
    expect(in_force).to_contain_text("adequate")

    certify.first.click()  # version 2
    expect(dialog).to_contain_text("Objections")
    expect(dialog).to_contain_text("the verdict on recording 1 is 'ambiguous'")
    expect(dialog).to_contain_text("of version 1, which is in force, on the same recording")
    dialog.get_by_label("Who").fill("A. Person")
    dialog.get_by_label("Why").fill("needed on the robot today, to be replaced tomorrow")
    dialog.get_by_role("button", name="Certify").click()
    expect(dialog).to_be_visible()  # not without the override
    dialog.get_by_role("checkbox", name="Certify this version despite the objections").check()
    dialog.get_by_role("button", name="Certify").click()
    expect(in_force).to_contain_text("version 2")
    expect(in_force).to_contain_text("Certified despite objections")
    certificate = page.get_by_role("group", name="Certificate of version 2")
    expect(certificate).to_contain_text("No certificate can be issued.")  # before anything is pressed
    expect(certificate).to_contain_text("Missing: reference standards. State [[standards]]")
    expect(certificate).to_contain_text("Missing: uncertainty of the repeatability.")
    expect(certificate).to_contain_text("import it again")
    expect(page.get_by_role("button", name="Issue certificate")).to_have_count(0)
    acts = page.get_by_role("region", name="Certifications").first
    expect(acts).to_contain_text("overridden")
    expect(acts).to_contain_text("needed on the robot today")


@pytest.mark.slow
def test_a_change_that_predicts_no_better_is_shown_as_such(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    service.post("/api/recordings/example", {"name": "osu-fog"})
    service.post(UNIT, {"effects": ["bias", "scale_factor", "scale_factor_odd"]})
    page = visit("/explore?unit=OSU-FOG-2024")
    adding = page.get_by_role("region", name="Add it")
    adding.get_by_label("Remove an effect").select_option("scale_factor_odd")
    adding.get_by_role("button", name="Preview").click()
    rises = "Check: change: the RMS error on data left out of the fit rises"
    expect(adding).to_contain_text(rises)
    adding.get_by_role("button", name="Make version 2").click()
    page.wait_for_url("**version=2**")
    expect(page.get_by_role("region", name="Verdict")).to_contain_text(rises)
