"""The dialog that asks for a key: why it asks, what a wrong key gets, and how a key is forgotten."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from labctl.answers.admin import KeyRequest, Role
from labctl.services.commands.registry import CREATE_KEY
from tests.helpers.browser import PATIENCE_MS, Service

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[tuple[Service, str]]:
    """A service that asks for keys, and a viewer's key."""
    service = Service(tmp_path, keys=True)
    service.start()
    key = service.lab_service.execute(CREATE_KEY, KeyRequest(name="viewer", role=Role.VIEWER)).key
    yield service, key
    service.stop()


@pytest.fixture
def page(chromium: Browser) -> Iterator[Page]:
    context = chromium.new_context()
    context.set_default_timeout(PATIENCE_MS)
    yield context.new_page()
    context.close()


def test_a_key_is_asked_for_checked_kept_in_the_tab_and_forgotten(guarded: tuple[Service, str], page: Page) -> None:
    from playwright.sync_api import expect

    service, key = guarded
    page.goto(f"{service.url}/units")
    asked = page.get_by_role("dialog", name="This service requires a key")
    field = asked.get_by_label("Key", exact=True)
    expect(field).to_be_focused()
    expect(field).to_have_attribute("type", "password")
    expect(field).to_have_accessible_description(
        "The command labctl key create makes a key. The key is kept in this tab until the tab is closed."
    )
    field.fill("not a key")
    asked.get_by_role("button", name="Use it").click()
    expect(field).to_have_value("")  # it is asked for again
    field.fill(f" {key} ")
    field.press("Enter")
    expect(page.get_by_role("heading", name="Units", exact=True)).to_be_visible()
    expect(asked).to_have_count(0)
    assert page.evaluate("() => sessionStorage.getItem('labctl.key')") == key
    page.reload()
    expect(page.get_by_role("heading", name="Units", exact=True)).to_be_visible()
    page.get_by_role("button", name="Forget the key").first.click()
    expect(asked).to_be_visible()
    assert page.evaluate("() => sessionStorage.getItem('labctl.key')") is None
    page.keyboard.press("Escape")
    expect(asked).to_have_count(0)
    page.get_by_role("button", name="Use a key").first.click()
    expect(page.get_by_role("dialog", name="Use a key").get_by_label("Key", exact=True)).to_be_focused()
