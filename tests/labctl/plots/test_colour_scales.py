"""One colour for a temperature, in the report and on every page."""

from __future__ import annotations

import re
from importlib.resources import files

import pytest

from labctl.plots.temperature_scale import TEMPERATURE_SCALE, temperature_marker

PAGES = files("labctl.web") / "static" / "js"


def script(name: str) -> str:
    return (PAGES / name).read_text(encoding="utf-8")


def scale_of(name: str) -> list[list[object]]:
    (found,) = re.findall(rf"export const {name} = (\[[^;]*\]);", script("core/colour_scales.js"))
    return [[float(share), colour] for share, colour in re.findall(r'\[([\d.]+), "(#\w+)"\]', found)]


def test_pages_and_report_have_the_same_temperature_scale() -> None:
    assert scale_of("TEMPERATURE_SCALE") == TEMPERATURE_SCALE


def test_warm_is_red_and_cold_is_blue_all_along() -> None:
    rgb = [[int(str(colour)[k : k + 2], 16) for k in (1, 3, 5)] for _, colour in TEMPERATURE_SCALE]
    assert rgb[0][2] > 2 * rgb[0][0]  # blue
    assert rgb[-1][0] > 2 * rgb[-1][2]  # red
    redness = [red - blue for red, _, blue in rgb]
    assert redness == sorted(redness)


def test_a_rate_is_coloured_neither_cold_nor_hot() -> None:
    assert not {colour for _, colour in scale_of("RATE_SCALE")} & {colour for _, colour in TEMPERATURE_SCALE}


@pytest.mark.parametrize("words", ["reversescale", "RdBu", "Jet", "Bluered", "Portland"])
def test_no_page_brings_a_temperature_scale_of_its_own(words: str) -> None:
    scripts = [path for folder in PAGES.iterdir() if folder.is_dir() for path in folder.iterdir()]
    assert not [path.name for path in scripts if path.is_file() and words in path.read_text(encoding="utf-8")]


def test_a_marker_is_coloured_by_its_own_temperature() -> None:
    marker = temperature_marker([20.0, 40.0], 0.0, 50.0, size=4)
    assert (marker["color"], marker["cmin"], marker["cmax"]) == ([20.0, 40.0], 0.0, 50.0)
