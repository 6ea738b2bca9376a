"""A version that was measured with a standard which was found bad says so on the page of its unit."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.mark.slow
def test_a_bad_standard_is_a_notice_on_the_page(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    service.post("/api/recordings/simulated", {"recipe": "short"})
    service.post("/api/units/FOG-0001/calibrations", {"effects": ["bias", "scale_factor"]})
    service.post("/api/standards", {"label": "step clock", "quantity": "clock", "by": "M"})
    page = visit("/units/FOG-0001")
    versions = page.get_by_role("region", name="Calibrations").first
    expect(versions).to_contain_text("1")
    expect(page.get_by_text("standard bad")).to_have_count(0)
    service.post("/api/standards/step%20clock/findings", {"bad_from": "2020-01-01", "reason": "stopped", "by": "M"})
    page = visit("/units/FOG-0001")
    expect(page.get_by_text("standard bad")).to_have_count(1)
    expect(page.get_by_text("standard step clock was found bad from 2020-01-01 until now")).to_be_visible()
    expect(page.get_by_text("Measure again with another standard.")).to_be_visible()
