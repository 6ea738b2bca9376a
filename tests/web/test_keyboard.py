"""The cells and points of the figures of a criticism are reached and selected without a mouse."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import MINUS, Service, figure, number_of, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page

MAX_TABS = 60


@pytest.fixture
def explored(service: Service, visit: Callable[..., Page]) -> Page:
    made = service.post("/api/recordings/simulated", {"serial": "FOG-0001", "recipe": "short"})
    fit = {"recording": made["recording"], "effects": ["bias", "scale_factor"]}
    service.post("/api/units/FOG-0001/calibrations", fit)
    page = visit("/explore?unit=FOG-0001")
    settled(page)
    page.get_by_role("region", name="Where the model fails").wait_for()
    return page


def tab_to(page: Page, name: str) -> None:
    """Press Tab until the figure of that name has the focus."""
    for _ in range(MAX_TABS):
        page.keyboard.press("Tab")
        if page.evaluate("() => document.activeElement.getAttribute('aria-label') ?? ''").startswith(name):
            return
    pytest.fail(f"{name} is not reached with {MAX_TABS} tabs")


@pytest.mark.slow
def test_a_cell_of_the_map_is_reached_read_and_selected(explored: Page, service: Service) -> None:
    from playwright.sync_api import expect

    cells = figure(explored, "Residual over floor")["data"]
    rates = sorted({number_of(x) for x in cells[0]["x"]})
    tab_to(explored, "Residual over floor")
    explored.keyboard.press("ArrowRight")
    line = explored.locator(".keyboard-line").first
    expect(line).to_contain_text(f"{rates[0]:g} deg/s".replace("-", "\u2212"))
    explored.keyboard.press("ArrowRight")
    expect(line).to_contain_text(f"{rates[1]:g} deg/s".replace("-", "\u2212"))
    explored.keyboard.press("End")
    expect(line).to_contain_text(f"{rates[-1]:g} deg/s")
    explored.keyboard.press("ArrowLeft")
    explored.keyboard.press("Enter")
    failing = explored.get_by_role("region", name="Where the model fails")
    expect(failing).to_contain_text("1 data set selected")
    selected = failing.get_by_role("group", name="Selected data sets").locator("tbody tr")
    columns = service.get("/api/units/FOG-0001/calibrations/1/criticism")["views"]["sets"]
    shown = int(selected.first.locator("td").first.inner_text())
    rate = columns["channels"]["table_rate_dps"][columns["dataset"].index(shown)]
    assert rate == pytest.approx(rates[-2], rel=1e-3)
    explored.keyboard.press("ArrowLeft")
    explored.keyboard.press("Shift+Enter")
    expect(failing).to_contain_text("2 data sets selected")
    explored.keyboard.press("Escape")
    expect(failing).to_contain_text("No data set is selected")


@pytest.mark.slow
def test_the_points_over_a_channel_are_reached_from_left_to_right(explored: Page) -> None:
    from playwright.sync_api import expect

    failing = explored.get_by_role("region", name="Where the model fails")
    plot = failing.locator('.plot[aria-label^="Residual against a channel"]').first
    plot.scroll_into_view_if_needed()
    expect(plot.locator(".main-svg").first).to_be_attached()
    drawn = json.loads(plot.evaluate("plot => JSON.stringify([...plot.data[0].x])"))
    plot.focus()
    explored.keyboard.press("ArrowRight")
    line = plot.locator("xpath=..").locator(".keyboard-line")
    expect(line).to_contain_text(f"{min(drawn):.5g}"[:6].replace("-", MINUS))
    explored.keyboard.press("End")
    expect(line).to_contain_text(f"{max(drawn):.5g}"[:6].replace("-", MINUS))
    explored.keyboard.press("Enter")
    expect(failing).to_contain_text("1 data set selected")
