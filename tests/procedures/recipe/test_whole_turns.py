"""Data sets in which the table makes whole turns, or whole cycles of its motor."""

from __future__ import annotations

import pytest

from labctl.services.planning.loading import load_recipe
from procedures.recipe.whole_turns import over_whole_turns


@pytest.mark.parametrize(("duration_s", "rates_dps", "expected_s"), [
    (30.0, (0.0, 10.0, -50.0), 36.0),  # whole turns
    (10.0, (40.0, 100.0, 280.0), 18.0),  # whole turns would last more than half as long again: whole cycles
    (30.0, (0.07, 33.3), 30.0),  # nothing near fits
    (30.5, (0.0,), 31.0),
])  # fmt: skip
def test_data_sets_are_lengthened_to_whole_turns_then_to_whole_cycles_and_else_left(
    duration_s: float, rates_dps: tuple[float, ...], expected_s: float
) -> None:
    recipe = load_recipe("ojeda2000-121")
    acquire = recipe.acquire.model_copy(update={"duration_s": duration_s})
    lengthened = over_whole_turns(recipe.model_copy(update={"acquire": acquire}), rates_dps)
    assert lengthened == {**acquire.model_dump(), "duration_s": expected_s}
