"""Recordings at rest, in turns, of a profile and in poses on the pages: what is drawn is what was answered."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from labctl.recording import Recording, read_recording
from labctl.recording.checks import checked
from studies.poses_simulation import Session, simulate_session
from tests.helpers.browser import NARROW, Service, figure, settled
from tests.helpers.paths import EXAMPLES
from tests.helpers.profiles import profile_recording, sweep
from tests.helpers.rest import at_rest

if TYPE_CHECKING:
    from playwright.sync_api import Page


def fitted(service: Service, recording: Recording, **fit: Any) -> tuple[str, dict[str, Any]]:
    """Store a recording, fit it; returns the path of the explore page and what the version shows by motion."""
    info = recording.info
    whole = Recording(info, checked(Path("samples"), info, dict(recording.columns)))
    service.lab_service.store.recordings.add_import(whole, info.started_at)
    service.post(f"/api/units/{info.serial}/calibrations", {"accept_warnings": True, **fit})
    return f"/explore?unit={info.serial}", service.get(f"/api/units/{info.serial}/calibrations/1/motion")


def named(drawn: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {trace["name"]: trace for trace in drawn["data"]}


def numbers(values: list[float | None]) -> list[float]:
    return [np.nan if value is None else value for value in values]


@pytest.mark.slow
def test_at_rest_both_legs_are_drawn_and_the_map_is_not(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    path, found = fitted(service, at_rest(("z",), lag_s=600.0), model="bias_temperature")
    page, rows = visit(path), found["rest"]
    traces = named(figure(page, "Bias at rest"))
    for leg in ("heating", "cooling"):
        own = [k for k, each in enumerate(rows["leg"]) if each == leg]
        assert traces[leg]["x"] == pytest.approx([rows["temperature_c"][k] for k in own])
        assert traces[leg]["y"] == pytest.approx([rows["bias_dps"][k] for k in own])
        assert traces[leg]["error_y"]["array"] == pytest.approx([2 * rows["u_dps"][k] for k in own])
    assert len(traces["heating"]["x"]) + len(traces["cooling"]["x"]) == found["of"] == 160
    assert traces["model"]["y"] == pytest.approx(rows["modelled_dps"])
    left = named(figure(page, "Residual at rest"))
    own = [k for k, each in enumerate(rows["leg"]) if each == "heating"]
    assert left["heating"]["y"] == pytest.approx([rows["residual_dps"][k] for k in own])
    fails = page.get_by_role("region", name="Where the model fails")
    expect(fails).to_contain_text("Each dot is the mean of one of 160 pieces")
    assert fails.locator(".heatmaplayer image").count() == 0
    assert fails.get_by_label("Residual against").first.input_value() == "temperature_c"
    page.get_by_role("region", name="Which effects are missing").get_by_role("button", name="Draw").first.click()
    drawn = figure(page, "Residual against a channel")
    expect(page.get_by_text("Diamonds in the figures of")).to_be_visible()
    page.wait_for_function(
        """() => document.querySelector('.plot[aria-label^="Residual against a channel"]').data.length === 2"""
    )
    explained = named(figure(page, "Residual against a channel"))["explained"]
    assert np.std(explained["y"]) > 0.5 * np.std(drawn["data"][0]["y"])  # the lag is nearly all of the residual
    unit = visit("/units/REST-1")
    legs = unit.get_by_role("group", name="Left out by leg")
    expect(legs.get_by_role("row")).to_have_count(4)


@pytest.mark.slow
def test_turns_profiles_and_poses_are_drawn_as_they_are(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    path, found = fitted(service, read_recording(EXAMPLES / "imucal-turns"), model="turns")
    page, turns = visit(path), found["turns"]
    traces = named(figure(page, "Measured minus true angle of each turn"))
    for axis in "xyz":
        own = [k for k, each in enumerate(turns["axis"]) if each == axis]
        assert traces[f"output {axis}"]["y"] == pytest.approx([turns["residual_deg"][k] for k in own])
        bars = traces[f"output {axis}"]["error_y"]["array"]
        assert bars == pytest.approx([2 * turns["u_deg"][k] for k in own])
    expect(page.get_by_role("group", name="Turns", exact=True).get_by_role("row")).to_have_count(10)
    recording = profile_recording(sweep(20.0, 0.5, 10.0, 100.0, 50.0), 50.0, delay_s=0.005, bandwidth_hz=20.0)
    path, found = fitted(service, recording, effects=["bias", "scale_factor", "time_delay", "bandwidth"])
    page, rows = visit(path), found["profile"]
    rates = named(figure(page, "Rate over time"))
    assert rates["table"]["y"] == pytest.approx(rows["true_dps"])
    assert rates["output"]["y"] == pytest.approx(rows["output_dps"])
    assert rates["output"]["x"] == pytest.approx(rows["t_s"])
    left = named(figure(page, "Residual over time"))
    assert left["as a consumer has it"]["y"] == pytest.approx(rows["residual_dps"])
    assert left["true rate filtered by delay and bandwidth"]["y"] == pytest.approx(rows["followed_dps"])
    expect(page.get_by_role("region", name="Compare")).to_contain_text(" ms")
    session, _ = simulate_session(1, Session(rests=16, latitude_deg=48.0, temperature_c=23.5))
    path, found = fitted(service, session, model="poses")
    page, poses = visit(path, size=NARROW), found["poses"]
    moves = named(figure(page, "Angle of each move"))["moves"]
    assert (moves["x"], moves["y"]) == (
        pytest.approx(poses["accelerometer_deg"]),
        pytest.approx(poses["gyro_deg"]),
    )
    assert named(figure(page, "Residual of each move"))["residual"]["y"] == pytest.approx(poses["residual_deg"])
    expect(page.get_by_role("region", name="Verdict")).to_contain_text("As expected")
    expect(page.get_by_text(f"All {found['of']} moves from one rest to the next are shown.")).to_be_visible()
    for number in (1, 2, 3):
        page = visit(f"/recordings/{number}", size=NARROW)
        settled(page)
        wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert page.evaluate(wide) == 0
        expect(page.get_by_text("Table rate", exact=True)).to_have_count(0)
