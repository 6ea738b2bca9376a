"""Figures in the page: what Plotly drew is what was measured and what the model says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from labctl.plots.temperature_scale import TEMPERATURE_SCALE
from tests.helpers.browser import NARROW, Service, figure, number_of
from tests.helpers.simulated_recordings import three_axes

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """A unit with 630 data sets about three axes, an odd scale factor hidden in it, and a first model."""

    def fitted(service: Service) -> None:
        recording = three_axes(4, scale_factor_odd=3e-9)
        service.lab_service.store.recordings.add_import(recording, recording.info.started_at)
        path = f"/api/units/{recording.info.serial}/calibrations"
        service.post(path, {"model": "yang2018"})
        service.get(f"{path}/1/criticism")  # kept: the page need not wait for it

    return furnish(fitted)


@pytest.fixture
def unit(service: Service) -> str:
    return str(service.get("/api/recordings/1")["serial"])


def opened(visit: Callable[..., Page], unit: str, view: str, **dress: Any) -> Page:
    page = visit(f"/explore?unit={unit}&view={view}", **dress)
    page.wait_for_selector("#compare .plot")
    return page


def redness(colour: str) -> float:
    red, _, blue = (int(part) for part in colour.removeprefix("rgb(").removesuffix(")").split(","))
    return red - blue


@pytest.mark.slow
def test_the_pictures_of_a_tri_axial_recording_are_true(
    service: Service, visit: Callable[..., Page], unit: str
) -> None:
    path = f"/api/units/{unit}/calibrations/1"
    compared = service.get(f"{path}/comparison")
    rows = [dict(zip(compared["columns"], row, strict=True)) for row in zip(*compared["columns"].values(), strict=True)]
    page = opened(visit, unit, "lines")
    check_map(figure(page, "Residual over floor"), rows)
    criticism = service.get(f"{path}/criticism")
    check_scatter(figure(page, "Residual against a channel"), criticism, rows)
    check_lines(figure(page, "Error over rate"), compared, rows)
    page.get_by_role("button", name="Every output and axis").click()
    check_panels(figure(page, "Error of every output"), compared, rows)
    page.get_by_role("button", name="Surface").click()
    check_surfaces(figure(page, "Error surface"), compared, rows)
    page.get_by_role("button", name="Error of a full turn").click()
    check_turns(figure(page, "Error after a full turn"), rows)


def check_map(drawn: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """Every measured cell of axis x is in the map: 21 rates of both signs, 10 temperatures, three positions."""
    heat = [trace for trace in drawn["data"] if trace["name"].endswith(" up")]
    assert [trace["name"] for trace in heat] == ["x up", "y up", "z up"]
    number = {row["dataset"]: row for row in rows if row["axis"] == "x"}
    seen: list[int] = []
    for trace in heat:
        for y, sets, line in zip(trace["y"], trace["customdata"], trace["z"], strict=True):
            for x, cell, score in zip(trace["x"], sets, line, strict=True):
                assert cell is not None
                assert score is not None
                for dataset in cell:
                    assert number[dataset]["position"] == trace["name"][0]
                    assert number_of(x) == pytest.approx(number[dataset]["table_rate_dps"], rel=1e-3)
                    assert number_of(y) == pytest.approx(number[dataset]["temperature_c"], abs=0.25)
                seen += cell
    assert sorted(seen) == list(range(1, 631))


def check_scatter(drawn: dict[str, Any], criticism: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """A dot for each of the 630 data sets, at its rate and with its residual."""
    (dots,) = drawn["data"]
    rate = {row["dataset"]: row["table_rate_dps"] for row in rows}
    residual = dict(
        zip(criticism["views"]["sets"]["dataset"], criticism["views"]["sets"]["residual_dps"]["x"], strict=True)
    )
    assert sorted(dots["customdata"]) == list(range(1, 631))
    assert dots["x"] == pytest.approx([rate[number] for number in dots["customdata"]], rel=1e-4)
    assert dots["y"] == pytest.approx([residual[number] for number in dots["customdata"]])


def check_lines(drawn: dict[str, Any], compared: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """The dots are measured, the lines the model on a grid, and they turn from blue to red with the temperature."""
    lines = [trace for trace in drawn["data"] if trace["mode"] == "lines"]
    (dots,) = (trace for trace in drawn["data"] if trace["mode"] == "markers")
    (model,) = (each for each in compared["over_rate"] if each["axis"] == each["position"] == "x")
    assert len(lines) == len(model["level"]) == 10
    for line, error in zip(lines, model["error_dps"], strict=True):
        assert line["x"] == pytest.approx(model["at"])
        assert line["y"] == pytest.approx(error)
        assert len(line["x"]) > 60  # no chords between the 21 measured rates
    shades = [redness(line["line"]["color"]) for line in lines]
    assert model["level"] == sorted(model["level"])
    assert shades == sorted(shades)
    assert shades[0] < 0 < shades[-1]
    own = {row["dataset"]: row for row in rows if row["axis"] == row["position"] == "x"}
    assert sorted(dots["customdata"]) == sorted(own)
    assert dots["y"] == pytest.approx([own[number]["measured_error_dps"] for number in dots["customdata"]])
    assert dots["marker"]["color"] == pytest.approx([own[number]["temperature_c"] for number in dots["customdata"]])
    assert drawn["layout"]["coloraxis"]["colorscale"] == TEMPERATURE_SCALE


def check_panels(drawn: dict[str, Any], compared: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """Yang's nine panels: each output for each turning axis."""
    dots = {trace["name"]: trace for trace in drawn["data"] if trace["mode"] == "markers"}
    assert set(dots) == {f"{axis} about {position}" for axis in "xyz" for position in "xyz"}
    assert len({trace["xaxis"] for trace in dots.values()}) == 9
    for name, trace in dots.items():
        own = {row["dataset"]: row for row in rows if f"{row['axis']} about {row['position']}" == name}
        assert len(own) == len(trace["x"]) == 210
        assert trace["y"] == pytest.approx([own[number]["measured_error_dps"] for number in trace["customdata"]])
        lines = [each for each in drawn["data"] if each["mode"] == "lines" and each["xaxis"] == trace["xaxis"]]
        (model,) = (each for each in compared["over_rate"] if f"{each['axis']} about {each['position']}" == name)
        assert [line["y"] for line in lines] == [pytest.approx(error) for error in model["error_dps"]]


def check_surfaces(drawn: dict[str, Any], compared: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """Before and after on the same axes; the surface is the model, the dots are measured, then what remains."""
    layout, traces = drawn["layout"], drawn["data"]
    for axis in ("xaxis", "yaxis", "zaxis"):
        assert layout["scene"][axis]["range"] == layout["scene2"][axis]["range"]
    (surface,) = (trace for trace in traces if trace["name"] == "model")
    (model,) = (each for each in compared["over_rate"] if each["axis"] == each["position"] == "x")
    assert np.array(surface["z"]) == pytest.approx(np.array(model["error_dps"]))
    own = {row["dataset"]: row for row in rows if row["axis"] == row["position"] == "x"}
    for name, key, scene in (
        ("measured", "measured_error_dps", "scene"),
        ("residual", "residual_dps", "scene2"),
    ):
        (dots,) = (trace for trace in traces if trace["name"] == name and trace["type"] == "scatter3d")
        assert dots["scene"] == scene
        assert sorted(dots["customdata"]) == sorted(own)
        assert dots["z"] == pytest.approx([own[number][key] for number in dots["customdata"]])
    (remains,) = (trace for trace in traces if trace["type"] == "surface" and trace["name"] == "residual")
    assert np.isfinite(np.array(remains["z"], dtype=float)).sum() == 210


def check_turns(drawn: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """Before: the static bias alone is taken off; hot is red; both on the same axes."""
    assert drawn["layout"]["scene"]["zaxis"]["range"] == drawn["layout"]["scene2"]["zaxis"]["range"]
    assert drawn["layout"]["coloraxis"]["colorscale"] == TEMPERATURE_SCALE
    own = {row["dataset"]: row for row in rows if row["axis"] == "x" and row["turn_before_deg"] is not None}
    for name, scene in (("turn_before_deg", "scene"), ("turn_after_deg", "scene2")):
        (dots,) = (trace for trace in drawn["data"] if trace["name"] == name)
        assert (dots["type"], dots["scene"]) == ("scatter3d", scene)
        assert sorted(dots["customdata"]) == sorted(own)
        assert dots["z"] == pytest.approx([own[number][name] for number in dots["customdata"]])
        assert dots["marker"]["color"] == pytest.approx([own[number]["temperature_c"] for number in dots["customdata"]])
        lines = [trace for trace in drawn["data"] if trace["mode"] == "lines" and trace["scene"] == scene]
        shades = [redness(line["line"]["color"]) for line in lines]
        warm = [np.mean(line["y"]) for line in lines]
        assert [shades[k] for k in np.argsort(warm, kind="stable")] == sorted(shades)


@pytest.mark.slow
def test_a_recording_without_times_has_no_time_axis_and_every_data_set(
    service: Service, visit: Callable[..., Page]
) -> None:
    service.post("/api/recordings/example", {"name": "osu-fog"})
    unit = "OSU-FOG-2024"
    service.post(f"/api/units/{unit}/calibrations", {"model": "ojeda2000"})
    sets = service.get(f"/api/units/{unit}/calibrations/1/criticism")["views"]["sets"]
    page = opened(visit, unit, "rest", size=NARROW, dark=True)
    (cells,) = (trace for trace in figure(page, "Residual over floor")["data"] if trace["name"] == "z up")
    numbers = sorted(number for cell in cells["customdata"] for number in cell)
    assert numbers == sorted(sets["dataset"])
    assert len(numbers) == sets["of"]
    options = page.get_by_label("Residual against").first.locator("option").all_inner_texts()
    assert "time" not in options
    assert "data sets in order" in options


@pytest.mark.slow
def test_evidence_bars_differ_and_coefficients_are_all_shown(
    service: Service, visit: Callable[..., Page], unit: str
) -> None:
    page = opened(visit, unit, "lines")
    criticism = service.get(f"/api/units/{unit}/calibrations/1/criticism")
    speaking = [suspect for suspect in criticism["suspects"] if suspect["log_bayes_factor"] > 0]
    assert max(len(suspect["coefficients"]["x"]) for suspect in speaking) > 1
    shown = page.get_by_role("list", name="Suspects").locator("li.suspect")
    assert shown.count() == len(speaking)
    lengths = []
    for k, suspect in enumerate(speaking):
        text = shown.nth(k).inner_text()
        for name in suspect["coefficients"]["x"]:
            assert name.replace("_", " ") in text
        lengths.append(shown.nth(k).locator(".meter i").evaluate("bar => bar.getBoundingClientRect().width"))
    nats = [suspect["log_bayes_factor"] for suspect in speaking]
    for first, second in zip(range(len(nats)), range(1, len(nats)), strict=False):
        if nats[first] > 2 * nats[second]:
            assert lengths[first] > lengths[second] + 5
