"""What a visit moves over the network: the files of the pages once, afterwards only what may have changed."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page


FIRST_VISIT_BYTES = 1_500_000
#: Of a unit with 121 data sets; in proportion to the 50 kB of one with 630.
LATER_VISIT_BYTES = 10_000
#: Style sheet, theme, entry point, the bundle of the page, Plotly, two icons.
MAX_STATIC_FILES = 7
#: Bytes as they travelled, headers included; 0 for what came out of the cache.
MOVED = """() => Object.fromEntries(["navigation", "resource"].flatMap((kind) =>
  performance.getEntriesByType(kind).map((entry) => [new URL(entry.name).pathname, entry.transferSize])))"""

#: The event stream of a criticism was read twice.
KEPT = """() => performance.getEntriesByType("resource")
  .filter((entry) => entry.name.includes("/criticism/events") && entry.responseEnd).length > 1"""


def moved_bytes(page: Page) -> dict[str, int]:
    """Return the bytes of a visit by address."""
    page.wait_for_load_state("networkidle")
    moved: dict[str, int] = page.evaluate(MOVED)
    return moved


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", ["/units/{serial}", "/explore?unit={serial}", "/recordings/{recording}", "/recordings", "/"]
)
def test_a_visit_moves_at_most_1500_kb_and_a_later_one_what_has_changed(
    visit: Callable[..., Page], service: Service, path: str
) -> None:
    made = service.post("/api/recordings/simulated", {"recipe": "ojeda2000-121", "hide": [], "seed": 1})
    service.post(f"/api/units/{made['serial']}/calibrations", {"model": "ojeda2000"})
    explores = "explore" in path
    # nothing is kept from an earlier visit
    page = visit(path.format(**made), alone=True, idle=explores)
    if explores:  # the criticism is computed, so it comes once more to be kept
        page.wait_for_function(KEPT)
    first = moved_bytes(page)
    assert sum(first.values()) <= FIRST_VISIT_BYTES, first
    drawn = any(address.endswith("plotly-cartesian.js") for address in first)
    assert drawn == ("{" in path), "a page without a figure does not load what draws them"
    assert not any(re.fullmatch(r"/static/\w+/plotly\.js", address) for address in first), (
        "only surfaces need the whole library"
    )
    page.reload()
    again = moved_bytes(page)
    assert sum(again.values()) <= LATER_VISIT_BYTES, again
    static = {address: size for address, size in again.items() if address.startswith("/static/")}
    assert static
    assert set(static.values()) == {0}
    assert len(static) <= MAX_STATIC_FILES, static


@pytest.mark.slow
def test_a_later_visit_gets_what_has_changed_meanwhile(visit: Callable[..., Page], service: Service) -> None:
    from playwright.sync_api import expect

    made = service.post("/api/recordings/simulated", {"recipe": "short", "hide": [], "seed": 1})
    unit = f"/api/units/{made['serial']}/calibrations"
    service.post(unit, {"effects": ["bias"]})
    page = visit(f"/units/{made['serial']}", alone=True)
    moved_bytes(page)
    second = page.locator("option[value='2']", has_text="version 2")
    expect(second).to_have_count(0)
    service.post(unit, {"effects": ["bias", "scale_factor"]})
    page.reload()
    moved_bytes(page)
    expect(second.first).to_be_attached()
