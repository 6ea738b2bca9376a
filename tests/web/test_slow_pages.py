"""A page that takes long shows its frame at once, says what it waits for, and can be left."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tests.helpers.browser import Service, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page, Route


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
