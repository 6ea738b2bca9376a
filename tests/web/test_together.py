"""Several recordings of a unit on the pages: choose them, read what they say together, fit them; the trend."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from labctl.recording import Recording
from tests.helpers.browser import Service, figure, on_page
from tests.helpers.joint_recordings import EFFECTS, recordings

if TYPE_CHECKING:
    from playwright.sync_api import Page

UNIT = "/api/units/J-1"


@pytest.fixture
def unit(service: Service) -> Service:
    """Return a service with three recordings of a unit, a year apart, and a version of the first."""
    for recording in recordings(3, days=(0.0, 365.25, 730.5)).values():
        columns = {"position": np.full(len(recording), "z"), **recording.columns}
        whole = Recording(recording.info, columns)
        service.lab_service.store.recordings.add_import(whole, recording.info.started_at)
    service.post(f"{UNIT}/calibrations", {"recording": 1, "effects": EFFECTS})
    return service


def trace_of(drawn: dict[str, Any], name: str) -> dict[str, Any]:
    (found,) = [trace for trace in drawn["data"] if trace["name"] == name]
    return found


@pytest.mark.slow
def test_recordings_are_chosen_fitted_and_drawn_together(unit: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/explore?unit=J-1&recording=1")
    together = page.locator("details", has_text="Several recordings together")
    together.locator("summary").click()
    together.get_by_label("Recording 2").check()
    together.get_by_label("Recording 3").check()
    together.get_by_role("button", name="Fit them together").click()
    page.wait_for_url("**version=2**")
    assert "recordings=1%2C2%2C3" in page.url
    joint = page.get_by_role("region", name="Recordings 1, 2, 3 together")
    said = unit.get(f"{UNIT}/calibrations/2/criticism?recordings=1&recordings=2&recordings=3")["joint"]
    for line in said["text"]:
        expect(joint.get_by_text(on_page(line))).to_be_visible()
    expect(joint.get_by_role("group", name="Recordings left out of the fit").get_by_role("row")).to_have_count(4)
    expect(joint.get_by_role("group", name="Agreement").get_by_role("row")).to_have_count(1 + len(said["agreement"]))
    (turn_on, _) = said["repeatability"]["z"]
    shifts = trace_of(figure(page, f"Shifts: {turn_on['term']}"), "axis z")
    assert shifts["y"] == pytest.approx([each["value"] for each in turn_on["shifts"]])
    assert shifts["error_y"]["array"] == pytest.approx([2 * each["u"] for each in turn_on["shifts"]])
    compared = unit.get(f"{UNIT}/calibrations/2/comparison?recordings=1&recordings=2&recordings=3")["columns"]
    dots = trace_of(figure(page, "Error over rate"), "measured")
    assert dots["y"] == pytest.approx(compared["measured_error_dps"])
    marks = dict(zip((1, 2, 3), ("circle", "square", "diamond"), strict=True))
    assert dots["marker"]["symbol"] == [marks[number] for number in compared["recording"]]
    residual = trace_of(figure(page, "Residual against a channel"), "residual")
    assert len(residual["x"]) == 135
    assert residual["marker"]["symbol"] == dots["marker"]["symbol"]
    adding = page.get_by_role("region", name="Add it")
    adding.get_by_label("Add an effect").select_option("scale_factor_even")
    adding.get_by_role("button", name="Preview").click()
    expect(adding).to_contain_text("Make version 3")
    after = trace_of(figure(page, "Residual before and after"), "after")
    assert len([value for value in after["y"] if value is not None]) == 135
    adding.get_by_role("button", name="Make version 3").click()
    page.wait_for_url("**version=3**")
    assert unit.get(f"{UNIT}/calibrations/3")["recordings"] == [1, 2, 3]


def test_the_trend_is_drawn_with_its_interval_and_the_limit(unit: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/units/J-1?limit=0.05")
    years = page.get_by_role("region", name="Over the years")
    said = unit.get(f"{UNIT}/trend?version=1&limit_dps=0.05")
    for line in said["text"]:
        expect(years.get_by_text(on_page(line).replace("scale_factor", "scale factor"))).to_be_visible()
    drawn = figure(page, "Bias over the years")
    points, line = trace_of(drawn, "axis z"), trace_of(drawn, "drift z")
    assert points["y"] == pytest.approx([point["axes"]["z"]["bias_dps"] for point in said["points"]])
    assert points["x"] == [point["at"] for point in said["points"]]
    bias = next(each for each in said["drifts"] if each["what"] == "bias")
    assert (line["x"], line["y"]) == (bias["line"]["at"], pytest.approx(bias["line"]["value"]))
    assert trace_of(drawn, "low z")["y"] == pytest.approx(bias["line"]["low"])
    assert trace_of(drawn, "high z")["y"] == pytest.approx(bias["line"]["high"])
    assert [trace["y"] for trace in drawn["data"] if trace["name"] == "limit"] == [[0.05, 0.05], [-0.05, -0.05]]
    found = trace_of(figure(page, "Error over the years"), "as found")
    assert found["y"] == pytest.approx([point["as_found"]["rms_dps"] for point in said["points"] if point["as_found"]])
    years.get_by_label("Largest acceptable bias, deg/s").fill("0.2")
    years.get_by_label("Largest acceptable bias, deg/s").press("Enter")
    expect(page).to_have_url(re.compile("limit=0.2"))
