"""Figures carry the numbers of the criticism, and the report is one page that needs nothing else."""

from __future__ import annotations

import json
import re
from functools import lru_cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from labctl.answers.criticism import CriticismResponse, ResidualMap
from labctl.answers.ladder import LadderResponse
from labctl.fitting.data.static_record import static_record
from labctl.plots import Picture, pictures_of, report_html
from labctl.plots.noise import ladder
from labctl.plots.residual_maps import maps
from labctl.recording import write_recording
from labctl.services.criticism.answer import answer_of
from tests.helpers.criticism import bare_criticism, held, views
from tests.helpers.lab import Lab
from tests.helpers.recordings import cycled
from tests.helpers.simulated_recordings import single_axis, three_axes
from tests.helpers.static_recordings import with_record_at_rest

STEP = {"parent": None, "recording": 7, "raw_rms_dps": None, "noise_floor_dps": None}
LADDER = LadderResponse.model_validate(
    {
        "serial": "S",
        "noise_floor_dps": 0.002,
        "steps": [
            STEP | {"version": 1, "model": "bias_scale", "effects": ["bias"], "rms_dps": 0.05, "heldout_rms_dps": 0.06},
            STEP | {"version": 2, "model": "more", "effects": ["bias", "x"], "rms_dps": 0.004, "heldout_rms_dps": None},
        ],
    }
)
#: Attributes with which a page reaches out.
REACHING = {"src", "href", "srcset", "action", "data", "poster", "ping", "background", "manifest", "formaction"}


@lru_cache(maxsize=1)
def answer() -> CriticismResponse:
    found = held(single_axis(1, scale_factor_asymmetry=4e-4), full=True)
    shown = answer_of("FOG-0001", 3, [7], found, [])
    static = static_record(with_record_at_rest(30, 2e-3))
    assert static is not None
    return shown.model_copy(update={"noise": {**shown.noise, "static": static.to_json()}})


def named(pictures: list[Picture]) -> dict[str, Picture]:
    return {picture.id: picture for picture in pictures}


def trace(picture: Picture, name: str) -> Any:
    return next(t for t in picture.figure.data if t.name == name)


@pytest.mark.slow
def test_every_picture_has_a_title_a_caption_and_something_drawn() -> None:
    found = named(pictures_of(answer(), LADDER))
    assert list(found) == [
        "map",
        "channels",
        "time",
        "angle",
        "frequency",
        "time_in_set",
        "previous_rate",
        "allan",
        "ladder",
    ]
    for picture in found.values():
        assert picture.title
        assert len(picture.caption) > 80
        assert len(picture.figure.data) > 0
    assert "scale_factor_asymmetry" in found["channels"].effects
    assert found["angle"].effects == tuple(answer().views["draws"]["angle"])


def test_the_map_has_each_data_set_where_it_was_measured_and_dims_what_means_nothing() -> None:
    figure = named(pictures_of(answer()))["map"].figure
    cells, dimmed = figure.data
    source = answer().maps[0]
    rates, warm = [float(x) for x in cells.x], [float(y) for y in cells.y]
    assert (len(rates), len(warm)) == (11, 11)
    for k in (0, 37, 120):
        column = min(range(11), key=lambda c: abs(rates[c] - source["table_rate_dps"][k]))
        row = min(range(11), key=lambda r: abs(warm[r] - source["temperature_c"][k]))
        score = source["over_floor"][k]
        assert cells.z[row][column] == pytest.approx(score)
        assert (dimmed.z[row][column] == 1) == (abs(score) < 2)
        assert cells.customdata[row][column] == str(source["dataset"][k])


@pytest.mark.slow
def test_all_maps_share_one_scale() -> None:
    criticism = held(three_axes(4), "yang2018", full=True)
    from labctl.fitting.criticism import residual_maps

    shown = maps(bare_criticism(maps=residual_maps(criticism.data, criticism.residuals)))
    assert shown is not None
    heat = [t for t in shown.data if t.showscale is None]
    assert len(heat) == 9
    assert {t.coloraxis for t in heat} == {"coloraxis"}
    assert shown.layout.coloraxis.cmin == -shown.layout.coloraxis.cmax


def test_lines_and_bands_are_those_of_the_views() -> None:
    found = named(pictures_of(answer()))
    line = next(line for line in answer().views["channels"] if line["channel"] == "table_rate_dps")
    figure = found["channels"].figure
    drawn = [t for t in figure.data if t.name == "z" and list(t.x) == line["at"]]
    assert [list(t.y) for t in drawn] == [line["mean_dps"]]
    band = next(t for t in figure.data if t.fill == "toself" and list(t.x[: len(line["at"])]) == line["at"])
    assert list(band.y) == [*line["high_dps"], *reversed(line["low_dps"])]
    angle = answer().views["angle"][0]
    assert list(trace(found["angle"], "z").y) == angle["over_white"]
    static = answer().noise["static"]
    assert static is not None
    noise = static["axes"]["z"]
    points = trace(found["allan"], "z")
    assert list(points.y) == noise["deviation_dps"]
    assert [points.y[k] + points.error_y.array[k] for k in range(3)] == pytest.approx(noise["high_dps"][:3])


def test_legs_and_repeats_are_drawn_where_there_are_any() -> None:
    shown = bare_criticism(views=views(cycled(0.01), None, ("bias", "scale_factor")))
    found = named(pictures_of(shown))
    hysteresis_lines = shown.views["legs"][0]
    assert list(trace(found["legs"], "z").y) == hysteresis_lines["mean_dps"]
    assert list(trace(found["repeats"], "z").y) == shown.views["repeats"][0]["difference_dps"]
    assert "thermal_hysteresis" in found["legs"].effects


def test_the_ladder_falls_to_the_floor() -> None:
    figure = ladder(LADDER)
    assert figure is not None
    own, held_out, floor = figure.data
    assert list(own.y) == [0.05, 0.004]
    assert list(held_out.y) == [0.06, None]
    assert list(floor.y) == [0.002, 0.002]


class Page(HTMLParser):
    """Collects what a page reaches out to, its text, and its scripts by type."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.reaches: list[str] = []
        self.order: list[str] = []
        self.scripts: list[tuple[str, str]] = []
        self._script: str | None = None
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.reaches += [f"{tag} {name}={value}" for name, value in attrs if name in REACHING]
        self.reaches += [tag] if tag in {"link", "iframe", "img", "object", "embed", "base"} else []
        self.order.append(given.get("class") or given.get("data-figure") or tag)
        self._script = (given.get("type") or "code") if tag == "script" else None

    def handle_data(self, data: str) -> None:
        if self._script is not None:
            self.scripts.append((self._script, data))
            self._script = None


def test_the_report_is_one_page_that_needs_no_network() -> None:
    text = report_html(answer(), LADDER)
    page = Page(text)
    assert page.reaches == []
    code = [script for kind, script in page.scripts if kind == "code"]
    assert [len(script) > 1_000_000 for script in code] == [True, False]  # plotly.js once, and what draws
    own = text.replace(code[0], "")
    assert not re.search(r"https?://|url\(|@import|fetch\(", own)
    data = [
        json.loads(script, parse_constant=pytest.fail) for kind, script in page.scripts if kind == "application/json"
    ]
    assert len(data) == 9
    assert all(figure["data"] for figure in data)


@pytest.mark.slow
def test_the_verdict_stands_before_the_pictures() -> None:
    page = Page(report_html(answer(), LADDER))
    assert page.order.index("verdict") < page.order.index("table") < page.order.index("numbers-map")
    assert answer().text[0] in report_html(answer())


def test_the_same_criticism_is_the_same_page() -> None:
    assert report_html(answer(), LADDER) == report_html(answer(), LADDER)


def a_map(numbers: list[int], rates_dps: list[float], warm_c: list[float], scores: list[float]) -> ResidualMap:
    """Return a map of data sets that were measured at their levels."""
    return {
        "axis": "z", "position": "z", "dataset": numbers, "table_rate_dps": rates_dps, "temperature_c": warm_c,
        "over_floor": scores, "rate_level_dps": rates_dps, "temperature_level_c": warm_c, "level_width_c": 0.0,
        "residual_dps": scores,
    }  # fmt: skip


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"views": {}, "maps": []},
        {"views": {"sets": {}, "channels": [], "time": [], "angle": [], "draws": {}}},
        {"maps": [a_map([], [], [], [])]},
    ],
)  # fmt: skip
def test_an_empty_criticism_has_no_pictures_and_a_page_all_the_same(more: dict[str, Any]) -> None:
    assert pictures_of(bare_criticism(**more), LADDER.model_copy(update={"steps": [], "noise_floor_dps": None})) == []
    text = report_html(bare_criticism(**more))
    assert "Too little &lt;data&gt;." in text
    assert "</script>" not in text


def test_a_map_of_one_data_set_is_drawn() -> None:
    shown = maps(bare_criticism(maps=[a_map([1], [0.0], [25.0], [-3.0])]))
    assert shown is not None
    assert list(shown.data[0].z[0]) == [-3.0]


def test_what_is_in_the_numbers_cannot_end_the_script() -> None:
    steps = LADDER.model_copy(update={"steps": [LADDER.steps[0].model_copy(update={"model": "</script><b>"})]})
    text = report_html(bare_criticism(), steps)
    assert "</script><b>" not in text
    (data,) = [json.loads(s) for kind, s in Page(text).scripts if kind == "application/json"]
    assert data["data"][0]["x"] == ["1: </script><b>"]


@pytest.mark.slow
def test_the_command_writes_the_report(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    write_recording(single_axis(1), lab.folder / "in", "parquet")
    lab.run("import", str(lab.folder / "in"))
    lab.run("fit", "FOG-0001", "--model", "ojeda2000")
    file = tmp_path / "report.html"
    shown = lab.json("criticise", "FOG-0001", "--report", str(file))
    assert shown["views"]["sets"]["of"] == 121
    text = file.read_text(encoding="utf-8")
    assert shown["text"][0] in text
    assert 'data-figure="numbers-ladder"' in text
    refused = lab.run("criticise", "FOG-0001", "--report", str(tmp_path / "no" / "where.html"), status=2)
    assert "nothing was written" in refused.stderr


def test_headings_of_an_inspection_begin_at_the_left_and_its_time_is_in_hours() -> None:
    """In the middle a long heading is cut on both sides of a phone."""
    from labctl.answers.inspection import CourseJson, MarkJson
    from labctl.plots.inspection import inspection_picture

    course: CourseJson = {
        "channel": "gyro_x", "unit": "deg/s", "readings": 12_000, "bins": 3, "t_s": [0.0, None, 7200.0, 14_400.0],
        "low": [0.0, None, 1.0, 2.0], "high": [0.0, None, 2.0, 2.0],
    }  # fmt: skip
    mark: MarkJson = {
        "what": "spike", "channel": "gyro_x", "from_s": [3600.0], "until_s": [7200.0], "places": 1, "whole": False,
    }  # fmt: skip
    picture = inspection_picture([course], [mark])
    assert picture is not None
    layout = picture.figure.layout
    (heading,) = layout.annotations
    assert (heading.x, heading.xanchor) == (0, "left")
    assert heading.text == "<b>gyro_x</b>: 12,000 readings, in 3 bins<br>spike (1 place)"
    assert layout.xaxis.title.text == "time, h"
    assert list(picture.figure.data[0].x) == [0.0, None, 2.0, 2.0, 4.0]
    assert (layout.shapes[0].x0, layout.shapes[0].x1) == (1.0, 2.0)


@pytest.mark.parametrize(("between_s", "dots"), [(20.0, 0), (3600.0, 5)])
def test_short_data_sets_far_apart_are_seen_in_an_inspection(between_s: float, dots: int) -> None:
    """20 s in an hour are a fifth of a pixel wide as a line: dots mark their least and largest readings."""
    from labctl.answers.inspection import CourseJson
    from labctl.plots.inspection import inspection_picture

    begins_s = [number * (20.0 + between_s) for number in range(3)]
    course: CourseJson = {
        "channel": "gyro_x", "unit": "deg/s", "readings": 9, "bins": 6,
        "t_s": [t_s for begin_s in begins_s for t_s in (begin_s, begin_s + 20.0, None)],
        "low": [1.0, 1.0, None] * 3, "high": [1.0, 2.0, None] * 2 + [1.0, 1.001, None],
    }  # fmt: skip
    picture = inspection_picture([course], [])
    assert picture is not None
    line, *marks = picture.figure.data
    assert (line.mode, [each.mode for each in marks]) == ("lines", ["markers"] * (dots > 0))
    assert sum(len(each.y) for each in marks) == dots
    for each in marks:  # of the last data set both readings are within one dot
        assert list(each.y) == [1.0, 2.0, 1.0, 2.0, 1.0]
