"""Every page, wide and narrow, light and dark: it opens without complaint, nothing sticks out, axe finds no fault."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from tests.helpers.browser import NARROW, WIDE, Faults, Service, settled
from tests.helpers.certifying import OVERRIDE

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: As long as a serial number can be, without a place to break it.
LONG_SERIAL = ("GYRO-" + "0123456789ABCDEF" * 4)[:64]


@pytest.fixture
def furnished(service: Service) -> Service:
    """A service with a campaign that is done, a unit with two versions, one in force, and a table that was imported."""
    service.post("/api/campaigns", {"recipe": "short"})
    service.until("/api/campaigns/1", lambda answer: answer["state"] == "done")
    unit = "/api/units/FOG-0001/calibrations"
    service.post(unit, {"effects": ["bias", "scale_factor"]})
    service.post(f"{unit}/1/improve", {"add": ["scale_factor_odd"]})
    service.post(f"{unit}/1/certify", {"by": "A. Person", "due_days": 365, **OVERRIDE})
    service.post("/api/recordings/example", {"name": "osu-fog"})
    long = service.post("/api/recordings/simulated", {"serial": LONG_SERIAL, "recipe": "short"})
    fit = {"recording": long["recording"], "effects": ["bias", "scale_factor"]}
    service.post(f"/api/units/{LONG_SERIAL}/calibrations", fit)
    return service


PAGES = {
    "/": "labctl",
    "/bench": "Bench",
    "/campaigns": "Campaigns",
    "/campaigns/1": "Campaign 1",
    "/campaigns/new?recipe=short": "Plan a campaign",
    "/units": "Units",
    "/units/FOG-0001?beside=1": "FOG-0001",
    f"/units/{LONG_SERIAL}": LONG_SERIAL,
    "/explore?unit=FOG-0001": "Explore",
    f"/explore?unit={LONG_SERIAL}": "Explore",
    "/recordings": "Recordings",
    "/recordings/1": "Recording 1",
    "/recordings/3": "Recording 3",
    "/noise?recordings=1": "Noise",
    "/live": "Live",
    "/certificates": "State of a certificate",
    "/nosuch": "No such page",
    "/effects": "Effects",
    "/effects/scale_factor_asymmetry": "Scale factor asymmetry",
}


@pytest.mark.slow
def test_every_page_opens_in_every_dress(furnished: Service, visit: Callable[..., Page], faults: Faults) -> None:
    from axe_playwright_python.sync_playwright import Axe

    wrong: list[str] = []
    for size, dark in ((WIDE, False), (NARROW, True)):
        page = visit("/", size=size, dark=dark)
        for path, title in PAGES.items():
            page.goto(furnished.url + path)
            settled(page)
            heading = page.locator("main h1").inner_text()
            if title not in heading:
                wrong.append(f"{path}: headed {heading!r}, not {title!r}")
            beyond = page.evaluate("() => document.documentElement.scrollWidth - innerWidth")
            if beyond > 1:
                wrong.append(f"{path}: sticks out by {beyond} px at {size['width']} px")
            found: dict[str, Any] = Axe().run(page).response
            wrong += [
                f"{path} ({size['width']} px): {each['id']}: {each['help']}: {each['nodes'][0]['html'][:160]}"
                for each in found["violations"]
            ]
    assert not wrong, "\n".join(wrong)
    faults[:] = [each for each in faults if not each.endswith("/nosuch")]  # the browser itself logs each 404


def test_an_empty_house_leads_to_a_first_calibration_in_one_press(visit: Callable[..., Page], service: Service) -> None:
    from playwright.sync_api import expect

    page = visit("/")
    expect(page.get_by_role("heading", name="Begin", exact=True)).to_be_visible()
    page.get_by_role("button", name="Open the real gyro").click()
    page.wait_for_url("**/explore?unit=OSU-FOG-2024**")
    expect(page.get_by_role("region", name="Verdict")).to_contain_text("Cause ambiguous")
    assert service.get("/api/units/OSU-FOG-2024/ladder")["steps"][0]["model"] == "bias_scale"

    page.get_by_role("link", name="labctl").click()  # again, from the overview: what is there is opened
    page.get_by_role("button", name="Take the tour").click()
    page.wait_for_url("**version=1**recording=1**tour=1**")
    assert [row["id"] for row in service.get("/api/recordings?unit=OSU-FOG-2024")] == [1]
    assert [row["version"] for row in service.get("/api/units/OSU-FOG-2024/calibrations")] == [1]


@pytest.mark.slow
def test_the_picture_of_the_start_page_is_true(visit: Callable[..., Page], service: Service) -> None:
    """The figures that it shows are those of the example, fitted and improved."""
    page = visit("/")
    label = page.get_by_role("img", name="Error after the fit").get_attribute("aria-label") or ""
    shown = [float(text) for text in re.findall(r": ([0-9.]+) deg/s", label)]
    made = service.post("/api/recordings/example", {"name": "osu-fog"})
    unit = f"/api/units/{made['serial']}/calibrations"
    before = service.post(unit, {"recording": made["recording"], "model": "bias_scale"})
    after = service.post(f"{unit}/{before['version']}/improve", {"add": ["sine_response"]})
    computed = [before["error"]["rms_dps"], after["error"]["rms_dps"], after["error"]["noise_floor_dps"]]
    assert shown == [float(f"{value:.3g}") for value in computed]


def test_pages_that_do_not_exist_and_units_that_do_not(visit: Callable[..., Page], faults: Faults) -> None:
    from playwright.sync_api import expect

    page = visit("/units/NO_SERVICE")
    expect(page.locator("main")).to_contain_text("NO_SERVICE")
    page.goto(page.url.replace("/units/NO_SERVICE", "/effects/nothing/at/all"))
    expect(page.get_by_role("heading", name="No such page")).to_be_visible()
    faults.clear()  # the browser itself logs each 404


def test_a_person_without_a_mouse_gets_there(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/", idle=True)
    settled(page)
    page.wait_for_function("() => window.Plotly")  # loaded while the page is idle, for the next one
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="To the page")).to_be_focused()
    for _ in range(7):
        page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Recordings")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Recordings", level=1)).to_be_visible()
