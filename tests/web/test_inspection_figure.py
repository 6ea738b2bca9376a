"""The figure of an inspection: each reading is within what is drawn, and short data sets are dots; bullets of lists."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.helpers.browser import NARROW, WIDE, Service, figure, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: Of each list with bullets: how far its first item is within the card around it, px.
BULLETS = """() => [...document.querySelectorAll("main ul")].filter((list) => {
  const item = list.querySelector(":scope > li");
  return item && item.getClientRects().length && getComputedStyle(item).listStyleType !== "none"
    && getComputedStyle(item).display === "list-item";
}).map((list) => {
  const around = list.closest(".card") ?? document.querySelector("main");
  const inner = around.getBoundingClientRect().left + parseFloat(getComputedStyle(around).paddingLeft);
  return list.querySelector("li").getBoundingClientRect().left - inner;
})"""
#: Put a list as pages have it into a card.
LIST = """() => {
  const list = document.createElement("ul");
  list.append(Object.assign(document.createElement("li"), { textContent: "one" }));
  document.querySelector("main .card").append(list);
}"""
#: A bullet and the space after it, px.
BULLET_PX = 16


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """Simulate a campaign of 15 short data sets, and fit a model to it."""

    def fitted(service: Service) -> None:
        made = service.post("/api/recordings/simulated", {"serial": "FOG-0001", "recipe": "short"})
        fit = {"recording": made["recording"], "effects": ["bias", "scale_factor"]}
        service.post("/api/units/FOG-0001/calibrations", fit)

    return furnish(fitted)


def test_every_reading_is_within_what_is_drawn_and_short_data_sets_are_dots(
    service: Service, visit: Callable[..., Page]
) -> None:
    page = visit("/recordings/1")
    settled(page)
    drawn = {trace["name"]: trace for trace in figure(page, "Inspection")["data"]}
    readings = service.lab_service.store.recordings.samples(1, times=True)
    t_s = np.asarray(readings.columns["t_s"])
    for channel in ("gyro_z", "temperature_c"):
        values = np.asarray(readings.columns[channel])
        trace = drawn[channel]
        shown = np.array([np.nan if each is None else each for each in trace["y"]], dtype=np.float64)
        assert (np.nanmin(shown), np.nanmax(shown)) == pytest.approx((values.min(), values.max()), rel=1e-6)
        times = np.array([np.nan if each is None else each for each in trace["x"]], dtype=np.float64)
        assert 60 * (np.nanmax(times) - np.nanmin(times)) == pytest.approx(t_s.max() - t_s.min(), rel=0.01)
        dotted = drawn[f"{channel}: dots"]
        assert (trace["mode"], dotted["mode"], dotted["marker"]["size"]) == ("lines", "markers", 4)
    dots = page.locator('.plot[aria-label^="Inspection"] .scatterlayer .point')
    assert dots.count() >= 15  # at least one of each data set


@pytest.mark.slow
@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["wide", "narrow"])
def test_the_bullets_of_lists_stand_inside_their_card(visit: Callable[..., Page], size: dict[str, int]) -> None:
    page = visit("/explore?unit=FOG-0001", size=size)
    settled(page)
    page.get_by_text("Effects that this recording cannot test").click()
    page.evaluate(LIST)  # as a card has it that lists what was left out
    within_px = page.evaluate(BULLETS)
    assert within_px
    assert min(within_px) >= BULLET_PX
