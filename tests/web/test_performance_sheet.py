"""The page of a real gyro: what its performance sheet, coefficients and certification state, and what not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service, on_page, settled

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

SERIAL = "OSU-FOG-2024"
VERSIONS = f"/api/units/{SERIAL}/calibrations"
PAGE = f"/units/{SERIAL}"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """The example of a real gyro, with the effect that its first model lacks added."""

    def prepare(service: Service) -> None:
        service.post("/api/recordings/example", {"name": "osu-fog"})
        service.post(VERSIONS, {"model": "bias_scale"})
        service.post(f"{VERSIONS}/1/improve", {"add": ["sine_response"]})

    return furnish(prepare)


def opened_sheet(page: Page) -> Locator:
    page.get_by_role("button", name="Show the performance sheet").click()
    return page.get_by_role("group", name=f"Performance sheet of {SERIAL}")


def test_a_sheet_states_what_was_fitted_and_how_its_figures_and_coefficients_differ(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit(PAGE)
    coefficients = page.get_by_role("region", name="Coefficients")
    nominal = "axis z: −0.0279253 arb per deg/s, 0 arb at rest."
    expect(coefficients).to_contain_text(f"to which the coefficients of the scale factor are relative: {nominal}")
    expect(coefficients).to_contain_text("The performance sheet below states other quantities")
    sheet = opened_sheet(page)
    answer = service.get(f"/api/units/{SERIAL}/datasheet")
    card = page.locator("#datasheet")
    expect(card).to_contain_text(on_page(answer["basis"]))
    for name in ("Scale factor temperature sensitivity", "Bias temperature sensitivity"):
        row = sheet.get_by_role("row").filter(has_text=name)
        expect(row).to_contain_text("recording 1")
        expect(row).not_to_contain_text("not measured")
    row = sheet.get_by_role("row").filter(has_text="Scale factor, relative to the nominal one")
    expect(row).to_contain_text("slope of the best straight line")
    expect(row).to_contain_text("(scale factor −0.0279253 arb per deg/s, 0 arb at rest)")
    expect(card).not_to_contain_text("Data sheet of")  # that name is of the maker's


def test_a_sheet_stays_open_when_another_act_is_refused(
    service: Service, visit: Callable[..., Page], faults: list[str]
) -> None:
    from playwright.sync_api import expect

    service.post(f"{VERSIONS}/2/certify", {"by": "Ada A.", "reason": "meets the criteria"})
    page = visit(PAGE)
    sheet = opened_sheet(page)
    expect(sheet).to_be_visible()
    page.get_by_role("button", name="Revoke").click()
    service.post(f"{VERSIONS}/2/revoke", {"by": "Bob B.", "reason": "dropped"})
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Who").fill("Ada A.")
    dialog.get_by_label("Why").fill("dropped")
    dialog.get_by_role("button", name="Revoke").click()
    expect(dialog.get_by_role("alert")).to_be_visible()
    expect(page.get_by_text("No calibration is in force.")).to_be_attached()  # the page was shown again
    dialog.get_by_role("button", name="Cancel").click()
    settled(page)
    expect(sheet).to_be_visible()
    faults.clear()  # the browser reports the refusal


def test_who_certifies_is_told_that_the_cause_is_not_known_and_so_is_who_looks_later(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit(PAGE)
    page.get_by_role("button", name="Certify").first.click()
    dialog = page.get_by_role("dialog")
    said = "The cause is not known. These data do not show that the cause is sine response, which version 2 contains"
    expect(dialog).to_contain_text(said)
    expect(dialog).to_contain_text("Largest expanded uncertainty U of the corrected rate z, k = 2")
    expect(dialog).to_contain_text("while the unit turns about any axis, at up to 101 deg/s: only one power-on")
    dialog.get_by_label("Who").fill("Ada A.")
    dialog.get_by_label("Why").fill("meets the criteria")
    dialog.get_by_role("button", name="Certify").click()
    expect(page.get_by_role("region", name="In force")).to_contain_text(said)
    expect(page.get_by_role("main")).to_contain_text("Per deg/s about x and y, without an output")
    expect(page.get_by_role("main")).to_contain_text("turn the unit on the table with x up and with y up too")
