"""Sparklines on the list of units and on the start page: each point is the error of a version over the noise floor."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import NARROW, Service

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

UNIT = "OSU-FOG-2024"


def ratios_of(drawn: Locator) -> list[float]:
    """Return the ratios that a sparkline draws: heights between its floor, which is 1, and the top, which is 100."""
    floor = float(drawn.locator(".floor").get_attribute("y1") or "nan")
    heights = [
        float(point.split(",")[1]) for point in (drawn.locator("polyline").get_attribute("points") or "").split()
    ]
    return [100.0 ** ((floor - height) / (floor - 3.0)) for height in heights]


@pytest.mark.slow
def test_a_sparkline_draws_the_error_of_each_version_over_the_floor(
    service: Service, visit: Callable[..., Page]
) -> None:
    service.post("/api/recordings/example", {"name": "osu-fog"})
    for asked in ({"effects": ["bias"]}, {"effects": ["bias", "scale_factor"]}, {"model": "ojeda2000"}):
        service.post(f"/api/units/{UNIT}/calibrations", asked)
    service.post("/api/recordings/simulated", {"serial": "WITHOUT-A-VERSION", "recipe": "short"})
    steps = service.get(f"/api/units/{UNIT}/ladder")["steps"]
    expected = [step["rms_dps"] / step["noise_floor_dps"] for step in sorted(steps, key=lambda step: step["version"])]
    assert expected[0] > 5 * expected[2]
    page = visit("/units")
    row = page.get_by_role("row").filter(has_text=UNIT)
    drawn = row.locator(".sparkline")
    assert ratios_of(drawn) == pytest.approx([min(max(ratio, 0.5), 100.0) for ratio in expected], rel=0.01)
    assert float(drawn.locator(".sparkline-value").inner_text()) == pytest.approx(expected[2], rel=0.005)
    words = drawn.get_by_role("img").get_attribute("aria-label") or ""
    assert f"version 3: {expected[2]:#.3g}" in words
    assert page.get_by_role("row").filter(has_text="WITHOUT-A-VERSION").locator(".sparkline").count() == 0
    start = visit("/", size=NARROW)
    again = start.get_by_role("region", name="Units").locator(".sparkline")
    again.wait_for()
    assert ratios_of(again) == pytest.approx(ratios_of(drawn), rel=1e-6)
    assert math.isclose(start.evaluate("document.documentElement.scrollWidth"), NARROW["width"])
