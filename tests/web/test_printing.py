"""A page on paper: every figure whole, also those that were not scrolled to, and what it is of."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.helpers.browser import Service, settled
from tests.helpers.printed_page import pixels_of, sheets_of

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: Of A4 upright within margins of 10 mm, CSS px.
PAPER_PX = 718
#: Height of such a sheet, CSS px.
SHEET_PX = 1046
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


@pytest.fixture
def fitted(service: Service) -> Service:
    made = service.post("/api/recordings/simulated", {"serial": "FOG-0001", "recipe": "short"})
    fit = {"recording": made["recording"], "effects": ["bias", "scale_factor"]}
    service.post("/api/units/FOG-0001/calibrations", fit)
    return service


BARS = """() => [...document.querySelectorAll(".meter > i")].map((each) => {
  const { width, height } = each.getBoundingClientRect();
  return width * height;
})"""
#: That no figure has.
GREEN = (1, 200, 3)


@pytest.mark.slow
@pytest.mark.usefixtures("fitted")
def test_bars_of_evidence_are_filled_on_paper(visit: Callable[..., Page], tmp_path: Path) -> None:
    """A browser prints no backgrounds unless a style sheet says so, and a bar is one."""
    page = visit("/explore?unit=FOG-0001", alone=True)
    settled(page)
    page.emulate_media(media="print")
    page.set_viewport_size({"width": PAPER_PX, "height": 1000})
    page.add_style_tag(content=f".meter > i {{ background: rgb{GREEN} }}")
    areas = [area for area in page.evaluate(BARS) if area > 0]
    assert len(areas) >= 3
    sheets = pixels_of(page, tmp_path)
    painted = sum(int((np.abs(sheet.astype(int) - GREEN).max(axis=2) < 8).sum()) for sheet in sheets)
    assert 0.7 * sum(areas) < painted < 1.3 * sum(areas)


HEADINGS = """() => [...document.querySelectorAll("main :is(h1, h2, h3)")].map((each) => each.textContent.trim())"""


@pytest.mark.slow
@pytest.mark.parametrize("address", ["/units/FOG-0001", "/explore?unit=FOG-0001", "/recordings/1", "/campaigns/new"])
@pytest.mark.usefixtures("fitted")
def test_no_heading_is_left_alone_at_the_end_of_a_sheet(
    visit: Callable[..., Page], tmp_path: Path, address: str
) -> None:
    page = visit(address, alone=True)
    settled(page)
    headings = set(page.evaluate(HEADINGS))
    assert len(headings) >= 3
    sheets = sheets_of(page, tmp_path)
    printed = {line for lines in sheets for line in lines}
    assert len(headings & printed) >= 2, "the headings are on paper"
    assert [lines[-1] for lines in sheets if lines and lines[-1] in headings] == []


@pytest.mark.slow
@pytest.mark.usefixtures("fitted")
def test_tables_are_printed_as_tables_and_without_their_buttons(visit: Callable[..., Page], tmp_path: Path) -> None:
    page = visit("/units/FOG-0001", alone=True)
    settled(page)
    lines = [line for sheet in sheets_of(page, tmp_path) for line in sheet]
    assert any(re.search(r"Version +Model +Made +RMS", line) for line in lines), lines
    row = next(k for k, line in enumerate(lines) if re.search(r"Version +Model +Made +RMS", line)) + 1
    assert re.search(r"^1 .* 0\.\d+ +0\.\d+$", lines[row]), lines  # its errors stand on the line of the version
    text = "\n".join(lines)
    for button in ("Certify: put in force", "Action", "Download JSON", "File format"):
        assert button not in text


@pytest.mark.slow
@pytest.mark.usefixtures("fitted")
def test_data_sets_have_their_numbers_and_no_figure_is_higher_than_a_sheet(
    visit: Callable[..., Page], tmp_path: Path
) -> None:
    page = visit("/recordings/1", alone=True)
    settled(page)
    page.get_by_text("complete", exact=True).first.wait_for()
    lines = [line for sheet in sheets_of(page, tmp_path) for line in sheet]
    numbered = [line.split()[0] for line in lines if re.search(r"^\d+ +complete ", line)]
    assert numbered == [str(number) for number in range(1, len(numbered) + 1)]
    assert len(numbered) >= 15
    page.evaluate("() => { window.dispatchEvent(new Event('beforeprint')); }")
    page.emulate_media(media="print")
    page.set_viewport_size({"width": PAPER_PX, "height": 1000})
    heights = page.evaluate("() => [...document.querySelectorAll('.figure')].map((each) => each.offsetHeight)")
    assert heights
    assert max(heights) <= SHEET_PX


PRINTED = """() => {
  window.print = async () => {
    const pictures = [...document.querySelectorAll(".print-picture")];
    const canvas = document.createElement("canvas");
    const context = canvas.getContext("2d");
    window.printed = await Promise.all(pictures.map(async (picture) => {
      await picture.decode();
      [canvas.width, canvas.height] = [picture.naturalWidth, picture.naturalHeight];
      context.drawImage(picture, 0, 0);
      const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
      const colours = new Set();
      for (let k = 0; k < data.length; k += 4) if (data[k + 3]) colours.add(data.slice(k, k + 3).join());
      return colours.size;
    }));
  };
}"""
#: Colours of a surface that is drawn, of which an empty scene has only those of its axes.
MIN_COLOURS = 50


@pytest.mark.slow
@pytest.mark.usefixtures("fitted")
def test_ctrl_p_prints_a_figure_in_three_dimensions_that_was_never_scrolled_to(visit: Callable[..., Page]) -> None:
    page = visit("/explore?unit=FOG-0001&view=surface", alone=True, size={"width": 1280, "height": 300})
    settled(page)
    surface = page.locator('.plot[aria-label^="Measured and modelled error"], .plot[aria-label*="urface"]').first
    surface.wait_for(state="attached")
    page.evaluate(PRINTED)
    page.keyboard.press("Control+p")
    page.wait_for_function("() => window.printed")
    colours = page.evaluate("window.printed")
    assert len(colours) == 1
    assert colours[0] > MIN_COLOURS
    page.wait_for_function("() => !document.querySelector('.print-picture')")
