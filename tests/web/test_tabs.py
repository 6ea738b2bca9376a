"""Several tabs of one browser: those that are hidden keep no connection, so that a stop never waits for one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service, settled
from tests.helpers.paths import RECIPES

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: More than the connections that a browser keeps to one service over HTTP/1.1.
TABS = 8
HIDDEN = """hidden => {
  Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
  document.dispatchEvent(new Event("visibilitychange"));
}"""


@pytest.fixture
def service(waiting: Service) -> Service:
    return waiting


def test_a_stop_in_the_ninth_tab_of_a_running_campaign_is_carried_out(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    recipe = (RECIPES / "short.toml").read_text(encoding="utf-8")
    service.post("/api/campaigns", {"recipe": recipe})
    service.until("/api/campaigns/1", lambda answer: answer["prompt"] is not None)
    first = visit("/bench", alone=True)
    settled(first)
    tabs = [first]
    for _ in range(TABS):
        tabs[-1].evaluate(HIDDEN, True)  # the browser hides a tab when the next one is opened
        tabs.append(first.context.new_page())
        tabs[-1].goto(f"{service.url}/bench")
        settled(tabs[-1])
    last = tabs[-1]
    last.get_by_role("button", name="Safe stop").click()
    last.get_by_role("dialog").get_by_role("button", name="Stop now").click()
    service.until("/api/campaigns/1", lambda answer: answer["ended"])
    last.evaluate(HIDDEN, True)
    first.evaluate(HIDDEN, False)
    expect(first.locator("main")).to_contain_text("No campaign is running")
