"""The gauges of the bench page: figure, bar and mark stand at the numbers of the service, on the scale of the plan."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from tests.helpers.browser import Service, number_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

#: Length of the scale of a gauge, and the least length of its bar, in units of its drawing.
SCALE, LEAST = 200.0, 2.0
#: Of each gauge: its figure, the begin and the length of its bar, where the mark of its set point is, and its words.
READ = """() => [...document.querySelectorAll(".gauge")].map((each) => ({
  title: each.querySelector(".gauge-title").textContent,
  value: each.querySelector(".gauge-value").textContent,
  unit: each.querySelector(".gauge-unit").textContent,
  begin: Number(each.querySelector(".gauge-bar").getAttribute("x")),
  length: Number(each.querySelector(".gauge-bar").getAttribute("width")),
  mark: each.querySelector(".gauge-setpoint").getAttribute("d"),
  ends: [...each.querySelectorAll(".gauge-ends span")].map((end) => end.textContent),
  note: each.querySelector("span.gauge-note").textContent,
}))"""
#: Put gauges of a plan on the page, with a reading of each.
SHOW = """async ([timeline, reading, setpoint]) => {
  const { gauges } = await import("/static/js/bench/gauges.js");
  const element = gauges(timeline);
  element.set(reading, setpoint);
  document.querySelector("main").replaceChildren(element);
}"""
#: From 0 to 50 deg C: the scale reaches from -5 to 55 deg C, that of the rate to 100 deg/s.
PLAN = {"temperature_c": [0.0, 50.0], "rate_dps": [-100.0, None, 60.0], "kind": ["home", "measure", "measure"]}


def shown(page: Page) -> dict[str, dict[str, Any]]:
    return {each["title"]: each for each in page.evaluate(READ)}


def share(value: float, low: float, high: float) -> float:
    """Return where a value stands on a scale."""
    return SCALE * min(max((value - low) / (high - low), 0.0), 1.0)


def mark_of(gauge: dict[str, Any]) -> float:
    found = re.match(r"M([\d.]+) ", gauge["mark"])
    assert found
    return float(found[1])


def test_a_bar_reaches_from_zero_to_the_reading_and_the_mark_is_the_set_point(visit: Callable[..., Page]) -> None:
    page = visit("/")
    page.wait_for_selector("main h1")
    reading = {"chamber_c": 25.0, "gyro_c": 27.123, "rate_dps": -40.0, "references": {}}
    page.evaluate(SHOW, [PLAN, reading, 30.0])
    found = shown(page)
    chamber, gyro, rate = found["Chamber"], found["Gyro"], found["Table rate"]
    assert (chamber["value"], chamber["unit"], chamber["ends"]) == ("25.00", "°C", ["\u22125", "55"])
    assert chamber["begin"] == pytest.approx(share(0, -5, 55))
    assert chamber["begin"] + chamber["length"] == pytest.approx(share(25, -5, 55))
    assert mark_of(chamber) == pytest.approx(share(30, -5, 55))
    assert chamber["note"] == "set point 30 °C, 5.00 K below"
    assert (gyro["value"], gyro["note"]) == ("27.12", "set point 30 °C, 2.88 K below")
    assert (number_of(rate["value"]), rate["unit"], rate["note"]) == (-40.0, "deg/s", "6.67 turns a minute")
    assert rate["begin"] == pytest.approx(share(-40, -100, 100))
    assert rate["begin"] + rate["length"] == pytest.approx(share(0, -100, 100))


def test_a_value_that_is_not_known_has_no_bar_and_is_not_rest(visit: Callable[..., Page]) -> None:
    page = visit("/")
    page.wait_for_selector("main h1")
    reading = {"chamber_c": None, "gyro_c": None, "rate_dps": None, "references": {}}
    page.evaluate(SHOW, [PLAN, reading, None])
    found = shown(page)
    assert {each["value"] for each in found.values()} == {"\u2013"}
    assert {each["length"] for each in found.values()} == {0.0}
    assert (found["Chamber"]["note"], found["Chamber"]["mark"]) == ("no reading yet", "")
    assert found["Table rate"]["note"] == "no step has begun"
    page.evaluate(SHOW, [PLAN, {**reading, "chamber_c": 80.0, "rate_dps": 0.0}, 50.0])
    found = shown(page)
    chamber, rate = found["Chamber"], found["Table rate"]
    assert chamber["value"] == "80.00"
    assert chamber["begin"] + chamber["length"] == pytest.approx(SCALE)  # not beyond the end of its scale
    assert (rate["note"], rate["length"]) == ("at rest", LEAST)


def test_the_gauges_of_a_campaign_show_what_the_service_reads(waiting: Service, chromium: Browser) -> None:
    waiting.post("/api/campaigns", {"recipe": "short"})
    status = waiting.until("/api/campaigns/1", lambda now: now["prompt"] is not None and now["chamber_c"] is not None)
    temperatures_c = [c for c in waiting.get("/api/campaigns/1/plan")["timeline"]["temperature_c"] if c is not None]
    low, high = min(*temperatures_c, 20.0) - 5.0, max(*temperatures_c, 30.0) + 5.0
    page = chromium.new_page()
    page.goto(f"{waiting.url}/bench")
    page.get_by_text("Table rate", exact=True).wait_for()
    found = shown(page)
    chamber, gyro = found["Chamber"], found["Gyro"]
    value = number_of(chamber["value"])
    assert value == pytest.approx(status["chamber_c"], abs=0.5)  # it goes on while the page is read
    assert [number_of(end) for end in chamber["ends"]] == [low, high]
    end, rounded = share(value, low, high), SCALE * 0.01 / (high - low)
    assert chamber["begin"] + chamber["length"] == pytest.approx(max(end, LEAST), abs=rounded)
    if status["gyro_c"] is None:  # a person has not switched the units on
        assert (gyro["value"], gyro["note"], gyro["length"]) == ("\u2013", "no reading yet", 0.0)
    page.close()
