"""The units in which quantities are shown: one for all quantities of a kind, the same on pages and in commands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from labctl.shown_unit import shown_unit

#: The pages' `shownUnit` is tested with the same cases.
CASES = json.loads(Path("tests/pages/shown_units.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("unit", "values", "name", "factor", "shown"), CASES)
def test_a_kind_of_quantities_is_shown_in_one_unit(
    unit: str, values: list[float | None], name: str, factor: float, shown: str
) -> None:
    assert shown_unit(unit, values, name) == (factor, shown)
