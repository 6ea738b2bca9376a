"""From a point of a figure to its readings: the page shows what the raw readings give, and hands it on."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest

from labctl.recording import Recording
from tests.helpers.browser import MINUS, Service, figure, on_page, settled
from tests.helpers.simulated_recordings import single_axis

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page


@pytest.fixture
def recording(service: Service) -> Recording:
    """Return the readings of a unit with a first model; some are marked as invalid, and far off."""
    made = single_axis(3, scale_factor_odd=3e-7)
    columns = {name: np.array(values) for name, values in made.columns.items()}
    columns["valid"] = np.ones(len(made), dtype=np.int64)
    columns["valid"][5::50] = 0
    output = np.array(columns["gyro_z"], dtype=np.float64)
    output[5::50] += 30.0
    columns["gyro_z"] = output
    spoiled = Recording(made.info, columns, made.environment)
    service.lab_service.store.recordings.add_import(spoiled, spoiled.info.started_at)
    service.post(f"/api/units/{made.info.serial}/calibrations", {"effects": ["bias", "scale_factor"]})
    return spoiled


def opened(visit: Callable[..., Page], query: str) -> tuple[Page, Locator]:
    page = visit(f"/explore?{query}")
    settled(page)
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    return page, page.get_by_role("region", name="Where the model fails")


def copied(page: Page, place: Locator, name: str | re.Pattern[str]) -> str:
    place.get_by_role("button", name=name).first.click()
    page.get_by_text(re.compile("copied")).last.wait_for()
    return str(page.evaluate("navigator.clipboard.readText()"))


def ran(cell: str) -> dict[str, Any]:
    """Return the names that a notebook cell leaves."""
    names: dict[str, Any] = {}
    exec(compile(cell, "cell", "exec"), names)
    names["client"].close()
    return names


@pytest.mark.slow
def test_a_click_on_a_point_shows_its_readings_and_the_same_computed_from_them(
    service: Service, visit: Callable[..., Page], recording: Recording
) -> None:
    serial, dataset = recording.info.serial, 7
    page, failing = opened(visit, f"unit={serial}")
    drawn = figure(page, "Residual against a channel")["data"][0]
    k = drawn["customdata"].index(dataset)
    place = failing.locator(".plot").nth(1)
    place.scroll_into_view_if_needed()
    place.evaluate(
        "(plot, k) => plot.emit('plotly_click', { points: [{ customdata: plot.data[0].customdata[k] }] })", k
    )
    card = page.get_by_role("region", name=f"Point: data set {dataset}")
    card.get_by_text("Recomputed from").wait_for()

    rows = np.asarray(recording.columns["dataset"]) == dataset
    valid = np.asarray(recording.columns["valid"]) != 0
    readings = np.asarray(recording.columns["gyro_z"])[rows & valid]
    assert 0 < np.sum(rows & ~valid) < len(readings)
    text = card.inner_text()
    assert f"Recomputed from {len(readings)} raw readings: equal." in text
    assert hashlib.sha256(readings.astype("<f8").tobytes()).hexdigest() in text
    formula = card.locator(".formula").inner_text().replace(MINUS, "-")
    output, rate, model, residual = map(
        float, re.findall(r"(?<![\w.])-?\d[\d.e+-]*(?= |$)", formula.partition("error = ")[2])
    )
    assert output == pytest.approx(readings.mean(), abs=1e-6)
    assert rate == pytest.approx(np.asarray(recording.columns["table_rate_dps"])[rows & valid].mean(), abs=0.01)
    assert output - rate - model == pytest.approx(residual, abs=1e-6)
    assert residual == pytest.approx(drawn["y"][k], rel=1e-4, abs=1e-7)
    shown = figure(page, f"Readings of recording 1 data set {dataset}")["data"]
    assert shown[0]["y"] == pytest.approx(np.asarray(recording.columns["gyro_z"])[rows])
    assert shown[1]["y"] == pytest.approx([readings.mean()] * 2)


@pytest.mark.slow
def test_a_link_opens_exactly_that_point_and_a_cell_gives_it(
    service: Service, visit: Callable[..., Page], recording: Recording
) -> None:
    serial = recording.info.serial
    page, failing = opened(visit, f"unit={serial}&axis=z&pick=9")
    card = page.get_by_role("region", name="Point: data set 9")
    link = copied(page, card, "Copy link")
    formula = card.locator(".formula").inner_text().replace(MINUS, "-")
    point = ran(copied(page, card, "Copy notebook cell"))["point"]
    assert point.formula == formula
    assert point.equal
    asked = parse_qs(urlsplit(link).query)
    assert (asked["unit"], asked["pick"], asked["axis"]) == ([serial], ["9"], ["z"])
    page.goto(link)
    settled(page)
    again = page.get_by_role("region", name="Point: data set 9").locator(".formula")
    again.wait_for()
    assert again.inner_text() == on_page(formula)

    address = copied(page, failing, re.compile("^Link: copy the address of Residual against"))
    assert address.endswith("#figure=residual-against-1")
    beside = visit(address.removeprefix(service.url))
    settled(beside)
    beside.wait_for_function(
        """() => { const box = document.querySelectorAll('#fails figure.figure')[1].getBoundingClientRect();
        return box.top >= 0 && box.bottom <= innerHeight; }"""
    )


@pytest.mark.slow
def test_the_cell_of_a_figure_gives_exactly_that_figure(
    service: Service, visit: Callable[..., Page], recording: Recording
) -> None:
    page, failing = opened(visit, f"unit={recording.info.serial}")
    drawn = figure(page, "Residual against a channel")
    made = ran(copied(page, failing, re.compile("^Notebook: copy a notebook cell that gives Residual")))["figure"]
    (trace,) = made.data
    for own, shown in ((trace.x, drawn["data"][0]["x"]), (trace.y, drawn["data"][0]["y"])):
        assert [float(f"{value:.5g}") for value in own] == shown  # the page takes five digits of each
    assert made.layout.xaxis.title.text == drawn["layout"]["xaxis"]["title"]["text"]
