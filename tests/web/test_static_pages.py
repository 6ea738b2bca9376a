"""Pages that need no server, on a phone: nothing is cut, and no heading or legend lies over a figure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from labctl.answers.budget import ContributionLinesJson, ContributionsOverJson
from labctl.answers.inspection import CourseJson, MarkJson
from labctl.plots.contributions import contributions_html
from labctl.plots.inspection import inspection_html

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

PHONE = {"width": 390, "height": 844}
SOURCES = ["coefficients", "repeatability", "chamber_gradient", "misalignment towards x", "tilt", "clock", "level"]
#: Left, right, top and bottom of all elements of a kind, px.
BOXES = """elements => elements.map((each) => {
  const box = each.getBoundingClientRect();
  return [box.left, box.right, box.top, box.bottom];
})"""


def inspection() -> str:
    """Return an inspection whose source and headings are long."""
    courses: list[CourseJson] = [
        {
            "channel": channel, "unit": "deg/s", "t_s": [0.0, 1.0, 2.0], "low": [0.0, 0.1, 0.0],
            "high": [0.1, 0.2, 0.1], "readings": 6_000_000, "bins": 600,
        }
        for channel in ("gyro_x", "gyro_y", "chamber_setpoint_c")
    ]  # fmt: skip
    marks: list[MarkJson] = [
        {"what": what, "channel": "gyro_y", "from_s": [0.5], "until_s": [1.0], "places": places, "whole": False}
        for what, places in (("frozen", 1), ("repeated", 3000), ("spikes", 2))
    ]
    return inspection_html(f"{'a_long_name_' * 6}.csv", ["a_long_name" * 6], courses, marks)


def contributions() -> str:
    """Return contributions from several sources, one of which has a long name."""
    lines: ContributionLinesJson = {
        "at": [-100.0, 0.0, 100.0], "contributions": {name: [0.1, 0.2, 0.1] for name in SOURCES},
        "combined": [0.3, 0.4, 0.3], "expanded": [0.6, 0.8, 0.6],
    }  # fmt: skip
    over: ContributionsOverJson = {
        "over_rate": lines, "over_temperature": lines, "temperature_c": 25.0, "rate_dps": 100.0,
    }  # fmt: skip
    return contributions_html("FOG-0001, version 1: contributions", {"z": over}, ["earth_rate"])


@pytest.fixture
def phone(chromium: Browser) -> Any:
    context = chromium.new_context(viewport=PHONE, is_mobile=True)
    yield context.new_page()
    context.close()


def boxes(page: Page, selector: str) -> list[list[float]]:
    found: list[list[float]] = page.locator(selector).evaluate_all(BOXES)
    return found


@pytest.mark.slow
def test_pages_without_a_server_fit_a_phone(phone: Page, tmp_path: Path) -> None:
    for name, content, headings in (("inspection", inspection(), 3), ("contributions", contributions(), 2)):
        file = tmp_path / f"{name}.html"
        file.write_text(content, encoding="utf-8")
        phone.goto(file.as_uri())
        phone.locator(".annotation-text").first.wait_for()
        assert phone.evaluate("document.documentElement.scrollWidth") == PHONE["width"], name
        texts = boxes(phone, ".annotation-text")
        assert len(texts) == headings
        assert all(left >= 0 and right <= PHONE["width"] for left, right, *_ in texts), (name, texts)
        panels = boxes(phone, ".subplot .plot")
        assert all(
            bottom <= other_top + 1 or top >= other_bottom - 1
            for *_, top, bottom in texts
            for *_, other_top, other_bottom in panels
        ), (name, texts, panels)
    names = boxes(phone, ".legend .traces")
    assert len(names) == len(SOURCES) + 2
    axis = max(bottom for *_, bottom in boxes(phone, ".xtitle, .x2title"))
    assert all(left >= 0 and right <= PHONE["width"] and top >= axis - 1 for left, right, top, _ in names), names
