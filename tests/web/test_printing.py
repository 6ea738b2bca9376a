"""A page on paper: every figure whole, also those that were not scrolled to, and what it is of."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tests.helpers.browser import Service, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: Of A4 upright within margins of 10 mm, CSS px.
PAPER_PX = 718
#: For each figure on paper: whether it is drawn, and how far its drawing reaches beyond the paper.
FIGURES = """() => [...document.querySelectorAll("figure.figure")].map((each) => {
  const svg = each.querySelector(".main-svg");
  return {
    name: each.querySelector(".plot").getAttribute("aria-label").split(".")[0],
    drawn: Boolean(svg), width: svg?.getBoundingClientRect().width ?? 0,
    right: svg ? svg.getBoundingClientRect().right - document.documentElement.clientWidth : 0,
    dark: each.querySelector(".plot").layout?.font?.color,
  };
})"""


def test_every_figure_is_printed_whole_and_in_light_colours(service: Service, visit: Callable[..., Page]) -> None:
    made = service.post("/api/recordings/simulated", {"serial": "FOG-0001", "recipe": "short"})
    fit = {"recording": made["recording"], "effects": ["bias", "scale_factor"]}
    service.post("/api/units/FOG-0001/calibrations", fit)
    page = visit("/explore?unit=FOG-0001", dark=True, alone=True)
    settled(page)
    page.get_by_role("region", name="Error of the versions").wait_for()
    page.wait_for_function("() => window.Plotly")
    page.evaluate("() => { window.dispatchEvent(new Event('beforeprint')); }")
    page.emulate_media(media="print")
    page.set_viewport_size({"width": PAPER_PX, "height": 1000})
    figures = page.evaluate(FIGURES)
    assert len(figures) >= 5
    assert [each["name"] for each in figures if not each["drawn"]] == []
    assert [each["name"] for each in figures if each["right"] > 0 or each["width"] < PAPER_PX / 2] == []
    muted = "#51606e"  # the text of the light theme
    assert {each["dark"] for each in figures} == {muted}
    line = page.locator(".print-line")
    assert "unit FOG-0001, version 1" in line.inner_text()
    assert page.url in line.inner_text()
    page.emulate_media(media="screen")
    page.evaluate("() => { window.dispatchEvent(new Event('afterprint')); }")
    assert page.locator(".print-line").count() == 0
    assert page.evaluate("() => document.documentElement.dataset.theme") == "dark"


#: The headings that are shown, and the headers of cards with them, of which nothing keeps what follows on their page.
LONE_HEADINGS = """() => [...document.querySelectorAll("main :is(h1, h2, h3)")]
  .filter((each) => each.getClientRects().length)
  .map((each) => each.closest(".card-header, .page-header") ?? each)
  .filter((each) => {
    const flow = ["block", "list-item"].includes(getComputedStyle(each.parentElement).display);
    return getComputedStyle(each).breakAfter !== "avoid" || !flow;  // in flex and grid a break is not avoided
  })
  .map((each) => each.textContent)"""


def test_no_heading_is_left_alone_at_the_end_of_a_page(service: Service, visit: Callable[..., Page]) -> None:
    made = service.post("/api/recordings/simulated", {"serial": "FOG-0001", "recipe": "short"})
    fit = {"recording": made["recording"], "effects": ["bias", "scale_factor"]}
    service.post("/api/units/FOG-0001/calibrations", fit)
    for address in ("/units/FOG-0001", "/explore?unit=FOG-0001", "/recordings/1", "/campaigns/new"):
        page = visit(address, alone=True)
        settled(page)
        page.emulate_media(media="print")
        headings = page.locator("main").locator("h1, h2, h3").count()
        assert headings >= 3, address
        assert page.evaluate(LONE_HEADINGS) == [], address
        assert not any(each.is_visible() for each in page.locator(".version-actions summary").all()), address
