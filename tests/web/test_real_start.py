"""A start on a bench that is not simulated: who has looked, when a person is needed, and nothing by one press."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from instruments.bench_config import BenchFile
from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.fixture
def real(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the bench be one whose table moves, and on which a person turns the units."""
    monkeypatch.setattr(BenchFile, "is_simulated", property(lambda _: False))
    monkeypatch.setattr(BenchFile, "needs_person", property(lambda _: True))


@pytest.mark.usefixtures("real")
def test_a_start_asks_who_has_looked_before_anything_moves(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new?recipe=short")
    expect(page.get_by_role("region", name="Steps")).to_contain_text("needs a person at")
    page.get_by_role("button", name="Start on").click()
    asked = page.get_by_role("dialog")
    expect(asked).to_contain_text("is a real bench")
    asked.get_by_label("Your name").fill("Ann")
    asked.get_by_role("button", name="Start now").click()
    expect(asked).to_be_visible()
    assert service.get("/api/campaigns") == []
    for question in ("chamber clear", "table free", "limiter on"):
        asked.get_by_label(question).check()
    asked.get_by_role("button", name="Start now").click()
    page.wait_for_url("**/bench")
    first = service.lab_service.store.campaigns.events(1)[0]
    assert first.message == "chamber clear, table free, limiter on: confirmed by Ann"


@pytest.mark.usefixtures("real")
def test_a_start_that_needs_a_person_at_night_is_warned_of_and_a_better_one_proposed(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new?recipe=short")
    page.get_by_role("button", name="At a time").click()
    page.get_by_label("Time zone").fill("Europe/Berlin")
    page.get_by_label("Begin at").fill("2199-07-01T22:00")
    page.get_by_label("Begin at").blur()
    begin = page.get_by_role("region", name="Begin")
    expect(begin).to_contain_text("At night:")
    expect(begin).to_contain_text("between 20:00 and 07:00")
    begin.get_by_role("button", name="instead").click()
    expect(page.get_by_label("Begin at")).to_have_value("2199-07-02T07:00")
    expect(begin).not_to_contain_text("At night:")
    page.get_by_role("button", name="Add to the schedule").click()
    asked = page.get_by_role("dialog")
    asked.get_by_label("Your name").fill("Ann")
    for question in ("chamber clear", "table free", "limiter on"):
        asked.get_by_label(question).check()
    asked.get_by_role("button", name="I confirm these points for that time").click()
    page.wait_for_url("**/campaigns")
    entry = page.get_by_role("region", name="Schedule").first
    expect(entry).to_contain_text("Ann confirmed that the bench will be clear")
    expect(entry).to_contain_text("needs a person at")
    assert service.get("/api/schedule")[0]["confirmed_by"] == "Ann"
