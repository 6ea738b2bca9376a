"""Turns by hand as the person at the desk sees them on the bench page: asked, shown, refused, wanted again, done."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from instruments.bench_config import shipped_benches
from labctl.services.campaigns import preparation
from tests.helpers.browser import Service
from tests.helpers.paced_hand import PacedHand

if TYPE_CHECKING:
    from playwright.sync_api import Page


RECIPE = """
name = "one-turn"
positions = ["z"]
[turns]
turns_deg = [360]
rest_s = 3
within_s = 1e6
"""


@pytest.fixture
def service(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """A desk without table and chamber, and a hand that stops too early the first time."""
    monkeypatch.setattr(preparation, "operator_of", lambda opened: PacedHand(opened.unit_handler))
    text = shipped_benches()["by-hand-sim"].read_text(encoding="utf-8")
    bench = tmp_path / "clumsy.toml"
    bench.write_text(f'{text}\nmistakes = ["short"]\n', encoding="utf-8")
    serving = Service(tmp_path, bench=str(bench))
    serving.start()
    yield serving
    serving.stop()


@pytest.mark.slow
def test_a_turn_is_shown_refused_wanted_again_and_done(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    service.post("/api/campaigns", {"recipe": RECIPE})
    service.until("/api/campaigns/1", lambda answer: answer["prompt"] is not None)
    page = visit("/bench")
    question = page.get_by_role("alert", name="A question for you")
    for text in ("axis z pointing up", "Switch the units on"):
        expect(question).to_contain_text(text)
        question.get_by_role("button", name="Done", exact=True).click()
        asked = page.get_by_role("dialog")
        asked.get_by_label("Your name").fill("Ann")
        asked.get_by_role("button", name="It is done").click()

    turn, angle = page.get_by_role("region", name="The turn now"), page.get_by_role("status", name="Angle so far")
    expect(question.get_by_role("heading")).to_have_text(
        "Keep axis z pointing up, and turn the unit by 360 deg about this axis"
    )
    expect(question).not_to_contain_text("The table")
    expect(angle).to_have_text(re.compile(r"^30\d deg of 360 deg about z, counter-clockwise\.$"))
    expect(page.locator(".gauges")).not_to_contain_text("Chamber")
    question.get_by_role("button", name="Done", exact=True).click()  # the name is known: no dialog

    expect(turn).to_contain_text(
        re.compile(r"Turn again: the unit turned by only 30\d deg about axis z instead of 360 deg\.")
    )
    expect(question).to_contain_text(
        re.compile(
            r"The unit turned by only 30\d deg about axis z instead of 360 deg: turn again; turn the units by 360"
        )
    )
    expect(angle).to_have_text(re.compile(r"^3[56]\d deg of 360 deg about z, counter-clockwise \(attempt 2\)\.$"))
    question.get_by_role("button", name="Turn again").click()
    expect(turn).to_contain_text("Turn again: Ann requested the turn again.")
    expect(angle).to_have_text(re.compile(r"^3[56]\d deg of 360 deg about z, counter-clockwise \(attempt 3\)\.$"))
    question.get_by_role("button", name="Done", exact=True).click()
    expect(page.get_by_role("region", name="No campaign is running")).to_be_visible()

    assert service.get("/api/campaigns/1")["state"] == "done"
    sets = service.lab_service.store.recordings.data_sets(1)
    assert [each.state for each in sets] == ["partial"] * 6 + ["complete"] * 3


def test_the_plan_of_turns_is_drawn_before_it_is_started(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new")
    page.get_by_label("by-hand", exact=False).first.check()
    plan = page.get_by_role("figure").first
    expect(plan.locator(".yaxislayer-above, .y2title, .infolayer").filter(has_text="turn, deg").first).to_be_visible()
