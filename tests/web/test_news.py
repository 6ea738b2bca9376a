"""The start page says what is new since the evening before, and what waits for a person."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.mark.slow
def test_a_campaign_that_is_done_is_a_row_with_a_button(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    service.post("/api/campaigns", {"recipe": "short"})
    service.until("/api/campaigns/1", lambda answer: answer["state"] == "done")
    page = visit("/")
    rows = page.get_by_role("region", name="What is new").get_by_role("listitem")
    done = rows.filter(has_text="Campaign 1")
    expect(done).to_contain_text("short on single-axis-sim is done")
    expect(done.get_by_role("img", name="100 % done")).to_be_visible()
    page.get_by_label("Show").select_option("week")
    page.reload()
    expect(page.get_by_label("Show")).to_have_value("week")
    rows.filter(has_text="Campaign 1").get_by_role("link", name="Open").click()
    page.wait_for_url("**/campaigns/1")
