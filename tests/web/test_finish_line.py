"""From one version to the next: what moves on the page begins and ends at the numbers of the service."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.helpers.browser import Service, figure, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.timeout(400)
#: Keep every text that the counter shows, from the moment that it is on the page.
WATCH = """() => {
  window.counted = [];
  new MutationObserver(() => {
    const text = document.querySelector("#finish .finish-counter")?.textContent;
    if (text && text !== window.counted.at(-1)) window.counted.push(text);
  }).observe(document.querySelector("main"), { childList: true, subtree: true, characterData: true });
}"""


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """Import the real gyro and fit it with the effect left out that it shows."""

    def fitted(service: Service) -> None:
        made = service.post("/api/recordings/example", {"name": "osu-fog"})
        path = f"/api/units/{made['serial']}/calibrations"
        service.post(path, {"recording": made["recording"], "model": "bias_scale"})

    return furnish(fitted)


@pytest.fixture
def unit(service: Service) -> str:
    return str(service.get("/api/recordings/1")["serial"])


def make_version(page: Page) -> None:
    """Add the sine of an open-loop gyro to the first version."""
    from playwright.sync_api import expect

    settled(page)
    learn = page.get_by_role("region", name="Which effects are missing")
    learn.get_by_role("listitem").filter(has_text="sine response").get_by_role("button", name="Add").first.click()
    adding = page.get_by_role("region", name="Add it")
    expect(adding).to_contain_text("Left after the fit")
    page.evaluate(WATCH)
    adding.get_by_role("button", name="Make version 2").click()
    page.wait_for_url("**version=2**")


def shown(value: float) -> float:
    return float(f"{value:.3g}")


def residual_of(service: Service, serial: str, version: int) -> dict[str, Any]:
    answer: dict[str, Any] = service.get(f"/api/units/{serial}/calibrations/{version}/criticism")
    return answer


def test_the_error_runs_from_the_one_version_to_the_other_and_ends_green(
    service: Service, visit: Callable[..., Page], unit: str
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/explore?unit={unit}")
    make_version(page)
    finish = page.locator("#finish")
    expect(finish).to_contain_text("these data say nothing more", ignore_case=True)
    expect(finish.locator(".notice.good")).to_be_visible()
    expect(finish.get_by_role("link", name="Certify")).to_have_attribute("href", f"/units/{unit}?version=2")
    before, after = (residual_of(service, unit, version) for version in (1, 2))
    page.wait_for_function(
        "end => Number(window.counted.at(-1)) === end && window.counted.length > 3",
        arg=shown(after["error"]["rms_dps"]),
    )
    counted = [float(text) for text in page.evaluate("window.counted")]
    assert counted[0] == shown(before["error"]["rms_dps"])
    assert counted == sorted(counted, reverse=True)
    drawn = figure(page, "Residual from version to version")["data"][0]
    residual = after["views"]["sets"]["residual_dps"]["z"]
    assert drawn["y"] == pytest.approx(residual, abs=1e-5)  # the preview is a fit of its own
    cells = figure(page, "Residual over floor from version to version")["data"][0]
    scores = after["views"]["sets"]["over_floor"]["z"]
    shades = cells["marker"]["color"] if "marker" in cells else [z for row in cells["z"] for z in row if z is not None]
    assert max(shades) <= max(scores) + 1e-3
    assert min(shades) >= min(scores) - 1e-3


def test_nothing_moves_where_less_motion_is_wanted(service: Service, visit: Callable[..., Page], unit: str) -> None:
    from playwright.sync_api import expect

    page = visit(f"/explore?unit={unit}")
    page.emulate_media(reduced_motion="reduce")
    make_version(page)
    after = residual_of(service, unit, 2)
    expect(page.locator("#finish .finish-counter")).to_have_text(f"{shown(after['error']['rms_dps'])}")
    assert len(page.evaluate("window.counted")) == 1


def test_the_versions_are_played_again_from_the_ladder(service: Service, visit: Callable[..., Page], unit: str) -> None:
    from playwright.sync_api import expect

    service.post(f"/api/units/{unit}/calibrations/1/improve", {"add": ["sine_response"]})
    page = visit(f"/explore?unit={unit}&version=2")
    settled(page)
    watch = page.get_by_role("region", name="Error of the versions")
    watch.get_by_role("button", name="Replay versions 1, 2").click()
    played = watch.get_by_role("region", name="Versions 1, 2")
    expect(played.locator(".finish-counter")).to_have_text(
        f"{shown(residual_of(service, unit, 2)['error']['rms_dps'])}"
    )
    first, last = (residual_of(service, unit, version)["error"] for version in (1, 2))
    expect(played).to_contain_text(f"Version 1: {shown(first['rms_dps']):.3f} deg/s")
    expect(played).to_contain_text(f"Version 2: {shown(last['rms_dps'])} deg/s")
