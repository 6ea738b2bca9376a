"""From a point of an Allan deviation, a trace, the means of a campaign or a trend to its readings, on the pages."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from labctl.recording import Recording
from tests.helpers.browser import Service, figure, number_of, on_page
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.static_recordings import resting

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

STILL = np.random.default_rng(7).normal(0.3, 0.01, 4000)
CLICK = "(plot, [series, k]) => plot.emit('plotly_click', { points: [{ curveNumber: series, pointNumber: k }] })"


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """Two recordings of a unit, a year apart, with a first model; one at rest; and a campaign."""

    def measured(service: Service) -> None:
        first, store = single_axis(3), service.lab_service.store
        later = first.info.model_copy(update={"started_at": first.info.started_at + timedelta(days=365)})
        columns = {**first.columns, "gyro_z": np.asarray(first.columns["gyro_z"]) + 0.01}
        still = resting(STILL, position=np.full(len(STILL), "z"))
        for recording in (first, Recording(later, columns, first.environment), still):
            store.recordings.add_import(recording, recording.info.started_at)
        asked = {"effects": ["bias", "scale_factor"], "recording": 1}
        service.post(f"/api/units/{first.info.serial}/calibrations", asked)
        service.post("/api/campaigns", {"recipe": "short"})
        service.until("/api/campaigns/1", lambda answer: answer["state"] == "done")

    return furnish(measured)


def clicked(page: Page, name: str, series: int, k: int) -> Locator:
    """Click a point of a figure and return its card, computed."""
    page.locator(f'.plot[aria-label^="{name}"]').evaluate(CLICK, [series, k])
    card = page.get_by_role("region", name=re.compile("^Point: "))
    card.get_by_text("Recomputed from").wait_for()
    return card


def facts_of(card: Locator) -> dict[str, list[str]]:
    """Return the list of facts of a card: name -> value with unit, what stands beside it."""
    rows = card.locator(".fact").all_inner_texts()
    return {name: rest for name, *rest in (row.replace("\xa0", " ").split("\n") for row in rows)}


def value(text: str) -> float:
    return number_of(text.split(maxsplit=1)[0])


def digest(readings: Any) -> str:
    return hashlib.sha256(np.asarray(readings, dtype="<f8").tobytes()).hexdigest()


def copied(card: Locator, name: str) -> str:
    page = card.page
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    card.get_by_role("button", name=name).click()
    page.get_by_text(re.compile("copied")).last.wait_for()
    return str(page.evaluate("navigator.clipboard.readText()"))


@pytest.mark.slow
def test_a_point_of_an_allan_deviation_is_its_clusters_and_a_link_and_a_cell_give_it(
    service: Service, visit: Callable[..., Page]
) -> None:
    page = visit("/recordings/3")
    page.locator('.plot[aria-label^="Recording 3 Allan deviation"]').scroll_into_view_if_needed()
    drawn = figure(page, "Recording 3 Allan deviation")["data"][2]
    card = clicked(page, "Recording 3 Allan deviation", 2, 4)
    means = np.lib.stride_tricks.sliding_window_view(STILL, 16).mean(axis=1)
    deviation = np.sqrt(np.mean((means[16:] - means[:-16]) ** 2) / 2)
    assert drawn["y"][4] == pytest.approx(deviation, rel=1e-4)
    text, facts = card.inner_text(), facts_of(card)
    assert f"Recomputed from {len(STILL)} raw readings: equal." in text
    assert value(facts["Allan deviation"][0]) == drawn["y"][4]
    assert value(facts["averaging time"][0]) == pytest.approx(1.6)
    assert value(facts["clusters that do not overlap"][0]) == len(STILL) // 16
    assert value(facts["95 % interval, from"][0]) < deviation < value(facts["95 % interval, to"][0])
    squares, twice = re.search(r"sqrt\(([\d.e+-]+) / (\d+)\)", card.locator(".formula").inner_text()).groups()  # type: ignore[union-attr]
    assert np.sqrt(float(squares) / float(twice)) == pytest.approx(deviation, rel=1e-8)
    assert digest(STILL) in text
    names: dict[str, Any] = {}
    exec(compile(copied(card, "Copy notebook cell"), "cell", "exec"), names)
    names["client"].close()
    assert names["point"].equal
    assert on_page(names["point"].formula) == card.locator(".formula").inner_text()
    with page.expect_download() as saved:
        card.get_by_role("button", name="Save as CSV").click()
    assert f"Allan deviation,deg/s,{drawn['y'][4]}" in saved.value.path().read_text()
    page.goto(copied(card, "Copy link"))
    again = page.get_by_role("region", name=re.compile("^Point: Allan deviation"))
    page.locator('.plot[aria-label^="Recording 3 Allan deviation"]').scroll_into_view_if_needed()
    again.get_by_text("Recomputed from").wait_for()
    assert again.locator(".formula").inner_text() == on_page(names["point"].formula)
    page.locator('.plot[aria-label^="Recording 3 Allan deviation"]').press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    page.get_by_role("region", name=re.compile("averaging time 0.200 s")).get_by_text("Recomputed from").wait_for()


def test_a_point_of_a_trace_and_of_a_campaign_is_its_readings(service: Service, visit: Callable[..., Page]) -> None:
    page = visit("/recordings/3?from=10&until=20")
    drawn = figure(page, "Recording 3 trace")["data"][1]
    card = clicked(page, "Recording 3 trace", 1, 7)
    assert value(facts_of(card)["mean"][0]) == pytest.approx(drawn["y"][7], rel=1e-8)
    assert drawn["y"][7] == pytest.approx(STILL[107])
    assert digest(STILL[107:108]) in card.inner_text()
    card.get_by_role("button", name="Open data set 1").click()
    page.get_by_role("region", name="Data set 1").first.wait_for()

    page.goto(f"{service.url}/campaigns/1/channels")
    traces = figure(page, "Channels of the campaign")["data"]
    (series,) = (k for k, trace in enumerate(traces) if "gyro output" in trace["name"] and "(means)" in trace["name"])
    card = clicked(page, "Channels of the campaign", series, 2)
    (recording,) = service.get("/api/campaigns/1")["recordings"].values()
    (dataset,) = re.findall(r"data set (\d+)", card.locator("h3").inner_text())
    samples = service.get(f"/api/recordings/{recording}/samples?dataset={dataset}&limit=100000")["columns"]
    (channel,) = (name for name in samples if name.startswith("gyro_") and name in card.locator("h3").inner_text())
    assert np.mean(samples[channel]) == pytest.approx(traces[series]["y"][2])
    assert digest(samples[channel]) in card.inner_text()
    assert "equal." in card.inner_text()


@pytest.mark.slow
def test_a_point_of_a_trend_is_what_the_version_leaves_of_every_reading(
    service: Service, visit: Callable[..., Page]
) -> None:
    serial = service.get("/api/recordings/1")["serial"]
    page = visit(f"/units/{serial}")
    page.locator('.plot[aria-label^="Bias over the years"]').scroll_into_view_if_needed()
    traces = figure(page, "Bias over the years")["data"]
    (series,) = (k for k, trace in enumerate(traces) if trace["name"] == "axis z")
    k = traces[series]["customdata"].index(2)
    card = clicked(page, "Bias over the years", series, k)
    compared = service.get(f"/api/units/{serial}/calibrations/1/comparison?recording=2")["columns"]
    _, bias = np.polyfit(compared["own_rate_dps"], compared["residual_dps"], 1)
    assert value(facts_of(card)["bias left"][0]) == pytest.approx(traces[series]["y"][k], rel=1e-8)
    assert traces[series]["y"][k] == pytest.approx(bias, abs=2e-5)
    assert f"Recomputed from {len(single_axis(3))} raw readings: equal." in card.inner_text()
    page.locator('.plot[aria-label^="Error over the years"]').scroll_into_view_if_needed()
    errors = figure(page, "Error over the years")["data"]
    k = errors[0]["customdata"].index(2)
    clicked(page, "Error over the years", 0, k)
    card = page.get_by_role("region", name=re.compile("^Point: RMS error as found on recording 2"))
    card.get_by_text("Recomputed from").wait_for()
    assert value(facts_of(card)["RMS error as found"][0]) == pytest.approx(errors[0]["y"][k], rel=1e-8)
