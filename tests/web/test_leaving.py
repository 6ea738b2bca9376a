"""Explore while a criticism is computed: its stages are shown, and leaving the page cancels it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import PATIENCE_MS, Service
from tests.helpers.held_criticism import STAGE, HeldCriticism

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.mark.slow
@pytest.mark.parametrize("leave", ["by a link", "by closing the tab"])
def test_leaving_the_page_cancels_what_it_waits_for(
    visit: Callable[..., Page], service: Service, monkeypatch: pytest.MonkeyPatch, leave: str
) -> None:
    from playwright.sync_api import expect

    made = service.post("/api/recordings/simulated", {"recipe": "ojeda2000-121", "hide": [], "seed": 77})
    service.post(f"/api/units/{made['serial']}/calibrations", {"model": "ojeda2000"})
    held = HeldCriticism(monkeypatch)
    page = visit(f"/explore?unit={made['serial']}")
    expect(page.locator("main")).to_contain_text(STAGE)
    assert not held.ended.is_set()
    if leave == "by a link":
        page.get_by_role("link", name="Units", exact=True).first.click()
        expect(page.locator("h1")).to_have_text("Units")
    else:
        page.close()
    assert held.ended.wait(PATIENCE_MS / 1000)
    assert held.cancelled
