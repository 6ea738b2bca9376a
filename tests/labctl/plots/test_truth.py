"""Each figure shows what was measured: every data set, at its place, in its number."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from labctl.answers.comparison import ComparisonResponse
from labctl.answers.criticism import CriticismResponse
from labctl.fitting.criticism import residual_maps
from labctl.fitting.data.earth_rate import up_rate_dps
from labctl.plots.model_lines import error_over_rate, full_turn
from labctl.plots.noise import repeats
from labctl.plots.residual_lines import channels, previous_rate, time
from labctl.plots.residual_maps import maps
from labctl.recording import Recording, read_recording, to_points
from tests.helpers.criticism import bare_criticism, held, views
from tests.helpers.paths import ROOT
from tests.helpers.service import add_recording, open_client
from tests.helpers.simulated_recordings import single_axis, three_axes

AXES = ("x", "y", "z")


@lru_cache(maxsize=1)
def triaxial() -> tuple[Recording, CriticismResponse]:
    """Return the means of 630 data sets about three axes, and the criticism's views and maps of them."""
    recording = three_axes(4, scale_factor_odd=3e-9)
    found = held(recording, "yang2018", full=True)
    return to_points(recording), bare_criticism(views=found.views, maps=residual_maps(found.data, found.residuals))


@lru_cache(maxsize=1)
def untimed() -> CriticismResponse:
    recording = read_recording(ROOT / "examples" / "osu-fog")
    found = held(recording, full=True)
    return bare_criticism(views=found.views, maps=residual_maps(found.data, found.residuals))


def cells_of(figure: Any) -> list[tuple[str, str, str, float]]:
    """Return every drawn cell as (panel, rate, temperature, residual over floor)."""
    heat = [trace for trace in figure.data if trace.name in AXES]
    return [
        (trace.xaxis, x, y, z)
        for trace in heat
        for y, line in zip(trace.y, trace.z, strict=True)
        for x, z in zip(trace.x, line, strict=True)
        if z is not None
    ]


@pytest.mark.slow
def test_every_measured_cell_is_in_the_map_with_all_signs_of_rate() -> None:
    points, shown = triaxial()
    figure = maps(shown)
    assert figure is not None
    cells = cells_of(figure)
    measured = {
        (place, rate) for place, rate in zip(points.columns["position"], points.columns["table_rate_dps"], strict=True)
    }
    assert len(measured) == 63  # three positions, 21 rates of both signs
    assert len(cells) == len(AXES) * len(measured) * 10
    for panel in {cell[0] for cell in cells}:
        rates = sorted({float(cell[1]) for cell in cells if cell[0] == panel})
        assert rates == pytest.approx(sorted({float(rate) for _, rate in measured}))
        assert len({cell[2] for cell in cells if cell[0] == panel}) == 10


@pytest.mark.slow
def test_a_cell_has_the_residual_of_its_data_set_at_its_rate_and_temperature() -> None:
    points, shown = triaxial()
    figure = maps(shown)
    assert figure is not None
    number = {int(n): k for k, n in enumerate(points.columns["dataset"])}
    sets = shown.views["sets"]
    scores = {axis: dict(zip(sets["dataset"], sets["over_floor"][axis], strict=True)) for axis in AXES}
    seen = 0
    for trace in (t for t in figure.data if t.name in AXES):
        for y, line, names in zip(trace.y, trace.z, trace.customdata, strict=True):
            for x, z, name in zip(trace.x, line, names, strict=True):
                if z is not None:
                    k, seen = number[int(name)], seen + 1
                    assert float(x) == pytest.approx(points.columns["table_rate_dps"][k], rel=2e-3)
                    assert float(y) == pytest.approx(points.columns["temperature_c"][k], abs=0.25)
                    assert z == pytest.approx(scores[trace.name][int(name)], rel=1e-3)
    assert seen == 1890


def test_a_map_without_levels_has_each_data_set_at_its_own_temperature() -> None:
    shown = untimed()
    figure = maps(shown)
    assert figure is not None
    (picture,) = shown.maps
    (cells,) = (trace for trace in figure.data if trace.name == "cells")
    drawn = [int(n) for names in cells.customdata for n in names.split(", ")]
    assert sorted(drawn) == sorted(picture["dataset"])
    place = {}
    for x, y, names in zip(cells.x, cells.y, cells.customdata, strict=True):
        place |= dict.fromkeys(names.split(", "), (x, y))
    for number, rate, warm in zip(picture["dataset"], picture["table_rate_dps"], picture["temperature_c"], strict=True):
        assert place[str(number)] == pytest.approx((rate, warm), abs=0.26)


@pytest.mark.slow
def test_scatters_draw_every_data_set_where_it_was_measured() -> None:
    points, shown = triaxial()
    figure = channels(shown)
    assert figure is not None
    sets = shown.views["sets"]
    dots = [trace for trace in figure.data if trace.name == "data sets"]
    by_position = [trace for trace in dots if len(trace.x) == 210]
    assert len(by_position) == 9
    assert all(len(trace.x) in {210, 630} for trace in dots)
    logged = np.asarray(points.columns["table_rate_dps"])
    for trace in by_position:
        rows = [int(text.split()[-1]) - 1 for text in trace.text]
        assert list(trace.x) == pytest.approx(logged[rows].tolist())
    warm = dict(zip(points.columns["dataset"], points.columns["temperature_c"], strict=True))
    assert sets["channels"]["temperature_c"] == pytest.approx([warm[n] for n in sets["dataset"]], abs=0.02)
    assert "drawn" not in str(figure.layout.annotations)


@pytest.mark.parametrize("draw", [channels, previous_rate, time])
def test_a_thinned_picture_says_n_of_how_many(draw: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("labctl.fitting.criticism.diagnostics.channels.drawn_rows.__defaults__", (60,))
    found = views(single_axis(5))
    assert {rate > 0 for rate in found["sets"]["channels"]["table_rate_dps"]} == {True, False}
    figure = draw(bare_criticism(views=found))
    dots = next(trace for trace in figure.data if trace.name == "data sets")
    assert len(dots.x) == 60
    assert "60 of 121 data sets drawn" in figure.layout.annotations[0].text


@pytest.mark.slow
def test_a_time_axis_is_there_only_where_time_is_known() -> None:
    figure = time(untimed())
    assert figure is not None
    titles = {axis.title.text for axis in figure.select_xaxes() if axis.title.text}
    assert titles == {"data sets in order"}
    dots = next(trace for trace in figure.data if trace.name == "data sets")
    assert list(dots.x) == list(range(1, len(dots.x) + 1))
    again = repeats(untimed())
    assert again is not None
    assert {axis.title.text for axis in again.select_xaxes()} == {"apart, data sets"}
    timed = time(triaxial()[1])
    assert timed is not None
    assert {axis.title.text for axis in timed.select_xaxes() if axis.title.text} == {"time, h"}


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, dict[str, Any]]:
    """Return the means of a tri-axial recording, and a version fitted to it, as it is, beside it."""
    recording = three_axes(4, scale_factor_odd=3e-9)
    with open_client(tmp_path_factory.mktemp("compared") / "lab.sqlite") as client:
        add_recording(client, recording)
        path = f"/api/units/{recording.info.serial}/calibrations"
        client.post(path, json={"model": "yang2018"})
        return to_points(recording), client.get(f"{path}/1/comparison").json()


@pytest.mark.slow
def test_nine_panels_have_measured_dots_and_model_lines_redder_with_temperature(
    compared: tuple[Recording, dict[str, Any]],
) -> None:
    points, comparison = compared
    figure = error_over_rate(ComparisonResponse.model_validate(comparison))
    assert figure is not None
    dots = {trace.name: trace for trace in figure.data if trace.mode == "markers"}
    assert set(dots) == {f"{axis} about {position}" for axis in AXES for position in AXES}
    number = {int(n): k for k, n in enumerate(points.columns["dataset"])}
    for name, trace in dots.items():
        axis, position = name[0], name[-1]
        rows = [number[n] for n in trace.customdata]
        assert len(rows) == 210
        rate = np.asarray(points.columns["table_rate_dps"])[rows]
        assert list(trace.x) == pytest.approx(rate.tolist())
        true = rate + up_rate_dps(points.info) if axis == position else 0.0 * rate
        assert list(trace.y) == pytest.approx((points.gyro_dps(axis)[rows] - true).tolist(), abs=1e-9)
        assert list(trace.marker.color) == pytest.approx(np.asarray(points.columns["temperature_c"])[rows], abs=1e-9)
        lines = [each for each in figure.data if each.mode == "lines" and each.xaxis == trace.xaxis]
        (model,) = (m for m in comparison["over_rate"] if (m["axis"], m["position"]) == (axis, position))
        assert [list(line.y) for line in lines] == model["error_dps"]
        reds = [[int(part) for part in line.line.color[4:-1].split(",")] for line in lines]
        assert [r - b for r, _, b in reds] == sorted(r - b for r, _, b in reds)


@pytest.mark.slow
def test_the_error_per_turn_is_drawn_before_and_after_on_the_same_axes(
    compared: tuple[Recording, dict[str, Any]],
) -> None:
    _, comparison = compared
    figure = full_turn(ComparisonResponse.model_validate(comparison))
    assert figure is not None
    columns = comparison["columns"]
    for axis in AXES:
        own = [
            k for k, error in enumerate(columns["turn_before_deg"]) if error is not None and columns["axis"][k] == axis
        ]
        ranges = []
        for name in ("turn_before_deg", "turn_after_deg"):
            (trace,) = (each for each in figure.data if each.name == f"{axis} {name}")
            assert list(trace.z) == [columns[name][k] for k in own]
            assert len(trace.z) == 160
            ranges.append(figure.layout[trace.scene].zaxis.range)
        assert ranges[0] == ranges[1]
