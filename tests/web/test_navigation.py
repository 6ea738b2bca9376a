"""Addresses and the history: a page begins at its top, Back returns to where one was, what is not there is said."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import httpx
import pytest

from tests.helpers.browser import Faults, Service, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page


LOW = {"width": 900, "height": 420}


def scrolled(page: Page) -> float:
    position: float = page.evaluate("window.scrollY")
    return position


@pytest.fixture
def unit(service: Service) -> str:
    recording = {"recipe": "ojeda2000-121", "hide": [], "seed": 1}
    serial: str = service.post("/api/recordings/simulated", recording)["serial"]
    service.post(f"/api/units/{serial}/calibrations", {"model": "ojeda2000"})
    return serial


@pytest.mark.slow
def test_a_new_page_begins_at_its_top_and_back_returns_to_where_one_was(visit: Callable[..., Page], unit: str) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{unit}", size=LOW)
    page.wait_for_load_state("networkidle")
    page.evaluate("window.scrollTo(0, 600)")
    page.wait_for_function("history.state?.scrolled === 600")
    page.get_by_role("navigation").get_by_role("link", name="Effects").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Effects")
    page.wait_for_function("window.scrollY === 0")
    page.go_back()
    expect(page.get_by_role("heading", level=1)).to_contain_text(unit)
    page.wait_for_function("Math.abs(window.scrollY - 600) < 2")
    page.reload()
    page.wait_for_function("Math.abs(window.scrollY - 600) < 2")


@pytest.mark.slow
def test_a_button_that_opens_a_page_opens_it_at_its_top(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/", size={"width": 390, "height": 400})
    page.get_by_role("button", name="Simulate a hidden effect").scroll_into_view_if_needed()
    page.evaluate("window.scrollTo(0, document.body.scrollHeight)")
    assert scrolled(page) > 0
    page.get_by_role("button", name="Simulate a hidden effect").evaluate("button => button.click()")
    expect(page).to_have_url(re.compile("/explore"))
    expect(page.get_by_role("heading", level=1)).to_have_text("Explore")
    page.wait_for_function("window.scrollY === 0")


def test_the_sections_of_a_page_are_entries_of_the_history(visit: Callable[..., Page]) -> None:
    page = visit("/effects", size=LOW)
    settled(page)
    page.evaluate("""() => {
      const section = Object.assign(document.createElement("h2"), { id: "part", textContent: "A part" });
      section.style.marginTop = "2000px";
      const link = Object.assign(document.createElement("a"), { href: "#part", textContent: "To the part" });
      document.querySelector("main").prepend(link);
      document.querySelector("main").append(section);
    }""")
    page.get_by_role("link", name="To the part").click()
    assert page.url.endswith("/effects#part")
    page.wait_for_function("window.scrollY > 1000")
    page.go_back()
    page.wait_for_function("window.scrollY === 0")
    assert page.get_by_role("heading", name="A part", exact=True).count() == 1, "the page was not made again"


@pytest.mark.parametrize("address", ["/nosuch", "/units/A1/nosuch", "/units/%E0%A4%A"])
def test_an_address_without_a_page_gets_one_that_says_so(
    visit: Callable[..., Page], service: Service, faults: Faults, address: str
) -> None:
    from playwright.sync_api import expect

    asked = httpx.get(service.url + address, headers={"accept": "text/html"})
    assert asked.headers["content-type"].startswith("text/html")
    page = visit(address)
    expect(page.get_by_role("heading", level=1)).to_be_visible()
    expect(page.get_by_role("main")).to_contain_text(
        "is not in this database" if address.startswith("/units/%") else "There is no page"
    )
    page.wait_for_load_state("networkidle")
    faults.clear()  # the browser reports each 404 of what the page is about


def test_a_program_gets_a_problem_document_for_an_address_without_anything(service: Service) -> None:
    for headers in ({}, {"accept": "application/json"}):
        answer = httpx.get(f"{service.url}/nosuch", headers=headers)
        assert answer.status_code == 404
        assert answer.json()["type"] == "urn:labctl:problem:http-404"
    assert httpx.get(f"{service.url}/api/nosuch", headers={"accept": "text/html"}).status_code == 404
    page = httpx.get(f"{service.url}/nosuch", headers={"accept": "text/html"})
    assert page.status_code == 404
    assert "frame-ancestors 'none'" in page.headers["content-security-policy"]
