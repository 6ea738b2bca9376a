"""Records of units that never moved: the verdict is true, and what is advised helps on the next record."""

from __future__ import annotations

import pytest

from studies.rest_verdicts import outcome


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["tilt", "walk", "unlogged temperature", "hysteresis"])
def test_a_record_at_rest_gets_a_true_verdict(cell: str) -> None:
    found = outcome("industrial", cell, 0, records=1)
    assert found.is_right(cell)
    assert not found.is_false(cell)
    assert not found.is_worse


@pytest.mark.slow
def test_an_advised_hysteresis_halves_the_error_of_the_next_record() -> None:
    found = outcome("tactical", "hysteresis", 1, records=2)
    assert found.advised == ("thermal_hysteresis",)
    assert found.next_after_dps < 0.5 * found.next_before_dps
