"""What a visit moves over the network: the files of the pages once, afterwards only what may have changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.timeout(300)

FIRST_VISIT_BYTES, LATER_VISIT_BYTES = 1_500_000, 50_000
#: Bytes as they travelled, headers included; 0 for what came out of the cache.
MOVED = """() => Object.fromEntries(["navigation", "resource"].flatMap((kind) =>
  performance.getEntriesByType(kind).map((entry) => [new URL(entry.name).pathname, entry.transferSize])))"""


def moved_bytes(page: Page) -> dict[str, int]:
    """Return the bytes of a visit by address."""
    page.wait_for_load_state("networkidle")
    moved: dict[str, int] = page.evaluate(MOVED)
    return moved


@pytest.mark.parametrize("path", ["/units/{serial}", "/explore?unit={serial}", "/recordings", "/"])
def test_a_visit_moves_at_most_1500_kb_and_a_later_one_50(
    visit: Callable[..., Page], service: Service, path: str
) -> None:
    made = service.post("/api/recordings/simulated", {"recipe": "ojeda2000-121", "hide": [], "seed": 1})
    service.post(f"/api/units/{made['serial']}/calibrations", {"model": "ojeda2000"})
    page = visit(path.format(serial=made["serial"]), alone=True)  # nothing is kept from an earlier visit
    first = moved_bytes(page)
    assert sum(first.values()) <= FIRST_VISIT_BYTES, first
    drawn = any(address.endswith("plotly-cartesian.js") for address in first)
    assert drawn == ("{serial}" in path), "a page without a figure does not load what draws them"
    page.reload()
    again = moved_bytes(page)
    assert sum(again.values()) <= LATER_VISIT_BYTES, again
    static = {address: size for address, size in again.items() if address.startswith("/static/")}
    assert static
    assert set(static.values()) == {0}
