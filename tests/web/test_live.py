"""The page of live calibration: the pose that is needed, the figures of the API, the end with a version."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from instruments.clock import VirtualClock
from labctl.fitting.live import PoseRequest
from labctl.fitting.live.directions import DIRECTIONS
from labctl.services.live import live_sessions
from labctl.services.live.assessor import InlineAssessor
from tests.helpers.browser import NARROW, WIDE, Faults, Service, figure, on_page, settled
from tests.helpers.paced_feed import PacedFeed

if TYPE_CHECKING:
    from playwright.sync_api import Page

READINGS_PER_BLOCK = 50


class Person:
    """Turns the unit of a stream as the service asks, as far as a test lets time go on."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self.feed = PacedFeed()
        self.feed.turn = lambda unit: unit.see(self._asked())
        self._blocks = 0

    def _asked(self) -> PoseRequest | None:
        moment = self._service.lab_service.bench_access.live_state().moment
        if moment is None or moment.request is None:
            return None
        return PoseRequest(next(each for each in DIRECTIONS if each.name == moment.request.name), 2.0)

    def go_on(self, blocks: int) -> dict[str, Any]:
        """Let so many blocks arrive; returns the state that the service then has."""
        self._blocks += blocks
        self.feed.allow(blocks)
        readings = self._blocks * READINGS_PER_BLOCK
        found: dict[str, Any] = self._service.until(
            "/api/live", lambda state: state["moment"] is not None and state["moment"]["readings"] == readings
        )
        return found


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    serving = Service(tmp_path, bench="poses-sim")
    serving.start()
    yield serving
    serving.stop()


@pytest.fixture
def person(service: Service, monkeypatch: pytest.MonkeyPatch) -> Iterator[Person]:
    made = Person(service)
    monkeypatch.setattr(live_sessions, "BackgroundAssessor", InlineAssessor)
    monkeypatch.setattr(live_sessions, "network_feed", lambda *_: made.feed)
    service.lab_service.bench_access.live._stream_clock = VirtualClock  # type: ignore[attr-defined]
    yield made
    made.feed.run_free()


@pytest.mark.slow
def test_begun_followed_and_ended_with_a_version(service: Service, visit: Callable[..., Page], person: Person) -> None:
    from playwright.sync_api import expect

    page = visit("/live?unit=HAND-1")
    settled(page)
    begin = page.get_by_role("region", name="Begin")
    begin.get_by_label("Address").fill("ws://robot:9090")
    begin.get_by_label("Poses").fill("12")
    begin.get_by_label("Target U", exact=True).fill("1e-6")
    begin.get_by_role("button", name="Begin").click()
    needed = page.get_by_role("status", name="What is needed now")
    expect(needed).to_have_text("waiting for the first readings")

    state = person.go_on(4)
    expect(needed).to_have_text(on_page(state["text"]))
    expect(page.get_by_role("img", name=state["moment"]["request"]["text"])).to_be_visible()
    height = page.get_by_role("region", name="Pose that is needed now").bounding_box()
    state = person.go_on(20)
    expect(needed).to_have_text(on_page(state["text"]))
    moment = state["moment"]
    expect(page.get_by_role("list", name="Poses").locator(".chip.good")).to_have_count(len(moment["poses"]))
    expect(page.get_by_role("region", name="Pose that is needed now")).to_contain_text(
        f"{len(moment['poses'])} of 12 poses"
    )
    after = page.get_by_role("region", name="Pose that is needed now").bounding_box()
    assert height is not None
    assert after is not None
    assert after["height"] == pytest.approx(height["height"], abs=1.0)  # nothing jumps

    while person.go_on(2)["moment"]["fits"] < 2:
        pass
    moment = service.get("/api/live")["moment"]
    cells = page.get_by_role("group", name="Coefficients").locator("[data-u]")
    expect(cells.first).to_have_attribute("data-u", str(moment["coefficients"][0]["expanded"]))
    shown = [float(each.get_attribute("data-u") or "nan") for each in cells.all()]
    assert shown == [each["expanded"] for each in moment["coefficients"]]
    history = service.get("/api/live/history")
    limited = [each for each in history["coefficients"] if each["limit"] is not None]
    traces = figure(page, "Uncertainty against its limit")["data"]
    assert [trace["name"] for trace in traces] == [f"{each['name']} of {each['axis']}" for each in limited]
    for trace, each in zip(traces, limited, strict=True):
        assert trace["x"] == history["t_s"]
        assert trace["y"] == pytest.approx([u / each["limit"] for u in each["expanded"]], rel=1e-12)
    assert [each["expanded"][-1] for each in history["coefficients"]] == shown

    page.get_by_role("button", name="End and fit a version").click()
    person.feed.run_free()
    last = page.get_by_role("region", name="Last: HAND-1")
    expect(last.get_by_role("link", name="Version 1 of HAND-1")).to_be_visible()
    result = service.get("/api/live")["result"]
    assert result["fit"]["version"] == 1
    shown = [float(each.get_attribute("data-u") or "nan") for each in last.locator("[data-u]").all()]
    assert shown == [each["expanded"] for each in result["coefficients"]]
    last.get_by_role("link", name="Version 1 of HAND-1").click()
    expect(page.get_by_role("heading", name="HAND-1", level=1)).to_be_visible()


@pytest.mark.parametrize(("size", "dark"), [(WIDE, False), (NARROW, True)])
def test_wide_and_narrow_nothing_sticks_out_and_axe_finds_no_fault(
    service: Service, visit: Callable[..., Page], person: Person, size: dict[str, int], dark: bool
) -> None:
    from axe_playwright_python.sync_playwright import Axe

    service.post("/api/live/start", {"serial": "HAND-1", "address": "ws://robot:9090"})
    person.go_on(24)
    page = visit("/live", size=size, dark=dark)
    settled(page)
    page.get_by_role("list", name="Poses").locator(".chip.good").first.wait_for()
    assert page.evaluate("() => document.documentElement.scrollWidth - innerWidth") <= 1
    found: dict[str, Any] = Axe().run(page).response
    assert [each["id"] for each in found["violations"] if each["impact"] in {"serious", "critical"}] == []
    page.get_by_role("button", name="End and keep the recording").focus()
    page.keyboard.press("Enter")
    person.feed.run_free()
    page.get_by_role("region", name="Last: HAND-1").get_by_role("link", name="Recording 1").wait_for()


def test_a_refusal_is_said_on_the_page(visit: Callable[..., Page], faults: Faults) -> None:
    from playwright.sync_api import expect

    page = visit("/live")
    settled(page)
    page.get_by_label("Poses").fill("3")
    page.get_by_role("region", name="Begin").get_by_role("button", name="Begin").click()
    expect(page.locator(".toasts")).to_contain_text("give 12 to 26")
    faults.clear()  # the browser itself logs the refusal
