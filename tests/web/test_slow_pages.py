"""A page that takes long shows its frame at once, says what it waits for, and can be left."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Faults, Service, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page, Route


@pytest.mark.slow
def test_a_slow_page_shows_its_name_what_it_waits_for_and_can_be_left(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/effects")
    settled(page)
    page.route("**/api/units*", lambda _: None)  # never answered
    page.get_by_role("link", name="Units").click()
    expect(page.get_by_role("heading", level=1, name="Units")).to_be_visible()
    expect(page.locator("main")).to_contain_text("Waiting for the service")
    expect(page.locator("main")).to_contain_text("GET /api/units")
    page.get_by_role("link", name="Recordings").click()
    expect(page.get_by_role("heading", level=1, name="Recordings")).to_be_visible()
    expect(page.locator("main")).not_to_contain_text("GET /api/units")


def test_a_page_that_arrives_late_takes_the_place_of_its_frame(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    service.post("/api/recordings/simulated", {"serial": "FOG-0001", "recipe": "short"})
    page = visit("/effects")
    settled(page)
    held: list[Route] = []
    page.route("**/api/units*", lambda route: held.append(route))  # noqa: PLW0108  playwright marks its handlers
    with page.expect_request("**/api/units*"):
        page.get_by_role("link", name="Units").click()
    expect(page.locator("main")).to_contain_text("Waiting for the service")
    (route,) = held
    route.continue_()
    expect(page.get_by_role("link", name="FOG-0001")).to_be_visible()
    expect(page.locator("main")).not_to_contain_text("Waiting for the service")


BUSY = {"type": "about:blank", "title": "Busy", "status": 503, "detail": "too many requests at once; ask again"}


@pytest.mark.slow
@pytest.mark.parametrize("address", ["/units", "/explore?unit=FOG-0001"])
def test_a_page_that_was_refused_for_a_while_comes_by_itself(
    service: Service, visit: Callable[..., Page], faults: Faults, address: str
) -> None:
    from playwright.sync_api import expect

    made = service.post("/api/recordings/simulated", {"serial": "FOG-0001", "recipe": "short"})
    fit = {"recording": made["recording"], "effects": ["bias", "scale_factor"]}
    service.post("/api/units/FOG-0001/calibrations", fit)
    page = visit("/effects")
    settled(page)
    refused = 2

    def answer(route: Route) -> None:
        nonlocal refused
        refused -= 1
        if refused >= 0:
            route.fulfill(status=503, headers={"Retry-After": "1"}, json=BUSY)
        else:
            route.continue_()

    asked = "**/criticism/events*" if "explore" in address else "**/api/units?*"
    page.route(asked, answer)
    page.evaluate("address => { const link = document.createElement('a'); link.href = address; "
                  "document.body.append(link); link.click(); }", address)  # fmt: skip
    expect(page.locator("main")).to_contain_text(BUSY["detail"])
    expect(page.get_by_role("button", name="Try again")).to_be_visible()
    there = (
        page.get_by_role("region", name="Verdict")
        if "explore" in address
        else page.get_by_role("link", name="FOG-0001")
    )
    expect(there).to_be_visible()
    assert refused < 0
    faults.clear()  # the browser itself logs each refusal


@pytest.mark.slow
def test_an_answer_that_is_followed_is_read_to_its_end(service: Service, visit: Callable[..., Page]) -> None:
    """A stream that a page leaves at its answer is a failed request in the console of the browser."""
    from playwright.sync_api import expect

    made = service.post("/api/recordings/simulated", {"recipe": "short"})
    fit = {"recording": made["recording"], "effects": ["bias", "scale_factor"]}
    service.post("/api/units/FOG-0001/calibrations", fit)
    page = visit("/effects")
    ended: list[tuple[bool, str]] = []
    page.on("requestfailed", lambda request: ended.append((False, request.url)))
    page.on("requestfinished", lambda request: ended.append((True, request.url)))
    page.goto(f"{service.url}/explore?unit=FOG-0001")
    expect(page.get_by_role("region", name="Verdict")).to_be_visible()
    page.wait_for_load_state("networkidle")
    assert [is_whole for is_whole, url in ended if "/criticism/events" in url] == [True]
