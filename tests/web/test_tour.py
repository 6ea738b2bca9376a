"""The tour on the real gyro: five steps, each beside the part of the page that it is about."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: What each step is about, by the name of its part of the page.
PARTS = ("Verdict", "Where the model fails", "Which effects are missing", "Add it", "Error of the versions")


@pytest.mark.slow
def test_the_tour_leads_through_the_page_and_can_be_left(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/")
    page.get_by_role("button", name="Take the tour").click()
    tour = page.get_by_role("region", name="Tour")
    for number, name in enumerate(PARTS, start=1):
        expect(tour).to_contain_text(f"Step {number} of {len(PARTS)}")
        part = page.get_by_role("region", name=name)
        expect(part).to_be_in_viewport()
        assert page.locator(".tour-here").get_attribute("aria-label") == name
        assert f"tour={number}" in page.url
        if number < len(PARTS):
            tour.get_by_role("button", name="Next").click()
    tour.get_by_role("button", name="Back").click()
    expect(tour).to_contain_text("Step 4")
    page.keyboard.press("Escape")
    expect(tour).to_have_count(0)
    assert "tour=" not in page.url
    assert page.locator(".tour-here").count() == 0


@pytest.mark.slow
def test_a_step_of_the_tour_has_an_address_and_ends_with_the_page(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/")
    page.get_by_role("button", name="Open the real gyro").click()
    page.wait_for_url("**/explore?**")
    expect(page.get_by_role("region", name="Verdict")).to_be_visible()
    assert page.get_by_role("region", name="Tour").count() == 0
    page.goto(f"{page.url}&tour=3")
    expect(page.get_by_role("region", name="Tour")).to_contain_text("Step 3")
    page.get_by_role("link", name="Units").click()
    expect(page.get_by_role("heading", level=1, name="Units")).to_be_visible()
    expect(page.get_by_role("region", name="Tour")).to_have_count(0)


@pytest.mark.slow
def test_a_version_that_is_made_during_the_tour_ends_it(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/")
    page.get_by_role("button", name="Take the tour").click()
    tour = page.get_by_role("region", name="Tour")
    for _ in range(3):
        tour.get_by_role("button", name="Next").click()
    expect(tour).to_contain_text("Step 4 of 5")
    sine = page.get_by_role("region", name="Which effects are missing").get_by_role("listitem")
    sine.filter(has_text="sine response").get_by_role("button", name="Add").first.click()
    page.get_by_role("button", name="Make version 2").click()
    page.wait_for_url("**version=2**")
    expect(tour).to_contain_text("Step 5 of 5")
    finish = page.locator("#finish.tour-here")
    expect(finish).to_contain_text("Version 1")
    expect(finish.get_by_role("button", name="Certify")).to_be_visible()
