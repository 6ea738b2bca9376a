"""The units in which quantities are shown: each has one, the same on pages, in commands and on certificates."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from labctl.fitting.effects import CATALOGUE
from labctl.shown_unit import ANGLES, PARTS, RATIOS, shown_unit, size_text

#: The pages' `shownUnit` is tested with the same cases.
CASES = json.loads(Path("tests/pages/shown_units.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("unit", "name", "factor", "shown"), CASES)
def test_a_quantity_is_shown_in_one_unit(unit: str, name: str, factor: float, shown: str) -> None:
    assert shown_unit(unit, name) == (factor, shown)


def test_the_cases_contain_every_plain_number_of_the_catalogue() -> None:
    names = {name for unit, name, _, _ in CASES if unit == "1"}
    symbols = [
        (effect, symbol)
        for effect, each in CATALOGUE.items()
        if each.equation is not None
        for symbol in each.equation.coefficients
        if symbol.unit == "1"
    ]
    for effect, symbol in symbols:
        pattern = re.sub(r"\\\{\w+\\\}", r"\\w+", re.escape(symbol.name))
        assert any(re.fullmatch(pattern, name) for name in names), (effect, symbol.name)
    assert len(symbols) >= 10


@pytest.mark.parametrize(("kind", "names"), [("ANGLES", ANGLES), ("PARTS", PARTS), ("RATIOS", RATIOS)])
def test_the_pages_list_the_same_names_of_plain_numbers(kind: str, names: tuple[str, ...]) -> None:
    script = Path("labctl/web/static/js/core/shown_unit.js").read_text(encoding="utf-8")
    pattern = script.partition(f"const {kind} =")[2].partition(";")[0]
    listed = pattern.partition("[. ])?")[2].partition("(?![a-z])")[0]
    assert listed.removeprefix("(?:").removesuffix(")").split("|") == list(names)


def test_an_angle_is_the_same_number_as_a_coefficient_and_as_a_change_between_mountings() -> None:
    assert size_text(0.00031, "1", "misalignment_y") == size_text(0.00031, "rad", "alignment") == "0.31 mrad"


def test_a_large_size_is_written_without_an_exponent() -> None:
    assert size_text(2.04e-3, "1", "scale_factor") == "2000 ppm"
    assert size_text(2.04e-7, "1", "scale_factor") == "0.2 ppm"
    assert size_text(12345.0, "deg/s", "bias") == "1.2e+04 deg/s"
