"""The bench as a person beside it uses the page: mounting, pause, stop, silence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from instruments.clock import SystemClock
from labctl.services.benches import check
from labctl.services.campaigns import preparation
from tests.helpers.browser import NARROW, WIDE, Faults, Service, number_of
from tests.helpers.paced_hand import PacedClock, PacedPerson
from tests.helpers.paths import RECIPES

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.fixture
def service(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """A bench on which a person turns and switches the units."""
    monkeypatch.setattr(preparation, "operator_of", lambda _: PacedPerson())
    serving = Service(tmp_path, clock=PacedClock)
    serving.start()
    yield serving
    serving.stop()


#: Longer than a browser on a busy machine takes to press a button.
LONG = (RECIPES / "short.toml").read_text(encoding="utf-8").replace("[soak]", "repeats = 100\n[soak]")


def start(service: Service, recipe: str = "short") -> None:
    service.post("/api/campaigns", {"recipe": recipe})
    service.until("/api/campaigns/1", lambda answer: answer["prompt"] is not None)


def answered(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()
    asked = page.get_by_role("dialog")
    asked.get_by_label("Your name").fill("Ann")
    asked.get_by_role("button", name="It is done").click()


def test_mounted_paused_and_stopped_by_hand(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    start(service, LONG)
    page = visit("/bench")
    expect(page.get_by_role("img", name="The unit with its z axis pointing up")).to_be_visible()
    answered(page, "Done")
    expect(page.get_by_role("alert", name="A question for you")).to_contain_text("Switch the units on")
    answered(page, "Done")
    expect(page.get_by_role("region", name="Gyro output now")).to_contain_text("deg/s")

    page.get_by_role("button", name="Safe stop").click()
    stop = page.get_by_role("dialog")
    stop.get_by_label("Your name").fill("Ann")
    stop.get_by_label("Why").fill("smoke")
    stop.get_by_role("button", name="Stop now").click()
    expect(page.locator(".toasts")).to_contain_text("safe state")
    expect(page.get_by_role("region", name="No campaign is running")).to_be_visible()
    ended = service.get("/api/campaigns/1")
    assert ended["state"] == "aborted"
    assert "smoke (Ann)" in ended["reason"]

    page.get_by_role("button", name="Resume where it stopped").click()
    page.get_by_role("dialog").get_by_role("button", name="Resume", exact=True).click()
    expect(page.get_by_role("region", name="What the bench is doing")).to_be_visible()


def test_what_cannot_be_done_ends_the_campaign(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    start(service)
    page = visit("/bench")
    page.get_by_role("button", name="Cannot be done").click()
    asked = page.get_by_role("dialog")
    asked.get_by_label("Your name").fill("Ann")
    asked.get_by_label("Why").fill("no wrench")
    asked.get_by_role("button", name="It cannot be done").click()
    expect(page.get_by_role("region", name="No campaign is running")).to_be_visible()
    assert "no wrench" in service.get("/api/campaigns/1")["reason"]
    last = page.get_by_role("region", name="Last: campaign 1")
    expect(last).to_contain_text("A person answered that the requested action cannot be done.")
    expect(last).to_contain_text("labctl stopped the table")
    expect(last).to_contain_text("Next:")
    expect(last).to_contain_text("simulated time")


@pytest.mark.slow
def test_says_that_simulated_time_is_slower_than_was_asked_for(
    service: Service, visit: Callable[..., Page], monkeypatch: pytest.MonkeyPatch
) -> None:
    from playwright.sync_api import expect

    monkeypatch.setattr(check, "asked_speed", lambda _: 200.0)
    monkeypatch.setattr(check, "reached_speed", lambda _: 37.4)
    start(service)
    page = visit("/bench")
    said = page.get_by_text("Simulated time runs at 37 times real time; 200 was asked for")
    expect(said).to_be_visible()
    monkeypatch.setattr(check, "reached_speed", lambda _: 199.9)
    expect(said).not_to_be_visible()


@pytest.mark.slow
def test_says_that_it_is_stale_and_goes_on_where_it_was(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    start(service)
    page = visit("/bench", alone=True)
    expect(page.get_by_role("region", name="Last events").get_by_role("list")).to_contain_text("campaign running")
    page.context.set_offline(True)
    service.stop()
    expect(page.get_by_text("No update since")).to_be_visible()
    page.context.set_offline(False)
    service.start()
    expect(page.get_by_text("No update since")).not_to_be_visible()
    # resumed by the service itself, or ended by its stopping: either is shown
    expect(page.locator("main")).to_contain_text("campaign 1")
    faults.clear()


def test_a_page_that_got_no_answer_is_shown_once_the_service_is_heard(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    page = visit("/bench")
    expect(page.get_by_role("region", name="No campaign is running")).to_be_visible()
    page.route("**/api/**", lambda route: route.abort())
    page.get_by_role("link", name="Campaigns", exact=True).click()
    expect(page.get_by_role("heading", name="No answer")).to_be_visible()
    page.unroute("**/api/**")
    expect(page.get_by_role("heading", name="Campaigns", exact=True)).to_be_visible()
    faults.clear()


def test_a_service_without_a_bench_says_how_to_start_one(tmp_path: Path, chromium: object) -> None:
    from playwright.sync_api import expect

    serving = Service(tmp_path / "none", bench=None)
    (tmp_path / "none").mkdir()
    serving.start()
    try:
        page = chromium.new_page()
        page.goto(f"{serving.url}/bench")
        expect(page.get_by_text("labctl serve --simulate")).to_be_visible()
        page.close()
    finally:
        serving.stop()


def test_a_bench_that_was_not_confirmed_safe_is_told_and_cleared_by_a_person(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    start(service)
    service.post("/api/campaigns/1/abort", {"reason": "enough", "by": "Ann"})
    store, bench = service.lab_service.store, "single-axis-sim"
    store.benches.mark(bench, "the chamber did not answer: its set point is not known", SystemClock().utc())
    page = visit("/bench")
    reported = page.get_by_text(f"Bench {bench} was not confirmed safe")
    expect(reported).to_be_visible()
    expect(page.locator("main")).to_contain_text("the chamber did not answer")
    expect(page.get_by_role("region", name="No campaign is running")).to_contain_text("No campaign starts until")
    expect(page.get_by_role("button", name="Resume where it stopped")).to_be_disabled()
    expect(page.get_by_text("Cannot be resumed now")).to_contain_text("inspect the bench first")
    page.get_by_role("button", name="I have inspected the bench, and it is safe").click()
    asked = page.get_by_role("dialog")
    asked.get_by_label("Your name").fill("Ann")
    asked.get_by_role("button", name="It is safe", exact=True).click()
    expect(reported).to_have_count(0)
    assert store.benches.unconfirmed(bench) == ""
    expect(page.get_by_role("button", name="Resume where it stopped")).to_be_enabled()


def test_a_strip_for_each_limit_says_what_the_service_watches(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    start(service)
    page = visit("/bench")
    strips = page.get_by_role("region", name="Limits").get_by_role("listitem")
    expect(strips.first).to_be_visible()
    watched = service.get("/api/campaigns/1")["limits"]
    assert {each["kind"] for each in watched} >= {"chamber_limits", "unit_air", "stale", "chamber_alarm"}
    expect(strips).to_have_count(len(watched))
    for each, strip in zip(watched, strips.all(), strict=True):
        expect(strip).to_contain_text(f"{each['device']} {each['title']}")
        expect(strip).to_contain_text(f"{each['high']:g}")
        expect(strip).to_have_class("limit-strip good")
    air = next(each for each in watched if each["kind"] == "chamber_limits")
    shown = page.locator('[data-kind="chamber_limits"] .limit-value').inner_text()
    assert number_of(shown.split()[0]) == pytest.approx(air["value"], abs=0.5)

    page.get_by_role("link", name="Wall view").click()
    expect(page.get_by_role("navigation", name="Pages")).to_be_hidden()
    expect(page.get_by_role("button", name="Safe stop")).to_be_visible()
    expect(strips).to_have_count(len(watched))
    expect(page.get_by_role("status").filter(has_text="a question waits for an answer")).to_be_visible()
    page.get_by_role("button", name="Sound is off").click()
    expect(page.get_by_role("button", name="Sound is on")).to_be_visible()
    page.get_by_role("link", name="Leave this view").click()
    expect(page.get_by_role("navigation", name="Pages")).to_be_visible()


#: How many lines each value takes that is larger than the others.
LINES = """() => [...document.querySelectorAll(".gauge-value, .limit-value")].map((each) => {
  const of = document.createRange();
  of.selectNodeContents(each);
  return new Set([...of.getClientRects()].map((box) => Math.round(box.top))).size;
})"""
#: The boxes of the titles of the vertical axes of a figure, from above.
TITLES = """plot => [...plot.querySelectorAll(".ytitle, .y2title")]
  .map((each) => each.getBoundingClientRect()).map(({ top, bottom }) => [top, bottom]).sort((a, b) => a[0] - b[0])"""


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["wide", "narrow"])
def test_no_value_is_broken_and_no_title_lies_over_another(
    service: Service, visit: Callable[..., Page], size: dict[str, int]
) -> None:
    from playwright.sync_api import expect

    start(service)
    page = visit("/bench", size=size)
    plot = page.get_by_role("group", name="Temperatures and rate since this page was opened")
    plot.scroll_into_view_if_needed()
    expect(plot.locator(".y2title")).to_be_visible()
    (_, upper_end), (lower_begin, _) = plot.evaluate(TITLES)
    assert upper_end <= lower_begin
    page.goto(f"{service.url}/bench?wall=1")
    expect(page.get_by_role("region", name="Limits").get_by_role("listitem").first).to_be_visible()
    expect(page.get_by_role("heading", level=1)).to_have_text("Bench single-axis-sim")
    expect(page.get_by_role("heading", level=1)).to_be_in_viewport()
    lines = page.evaluate(LINES)
    assert len(lines) >= 5
    assert set(lines) == {1}


def test_a_wall_stays_one_while_no_campaign_runs(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/bench")
    page.get_by_role("link", name="Wall view").click()
    expect(page.get_by_role("region", name="No campaign is running")).to_be_visible()
    expect(page.get_by_role("navigation", name="Pages")).to_be_hidden()
    expect(page.get_by_role("heading", level=1)).to_have_text("Bench single-axis-sim")
    page.get_by_role("link", name="Leave this view").click()
    expect(page.get_by_role("navigation", name="Pages")).to_be_visible()
