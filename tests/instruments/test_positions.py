"""Positions: what is read is what is written, and nothing else is read."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.positions import AXES, Position

DEGREES = st.integers(0, 359)


@given(st.sampled_from(AXES), st.sampled_from([1.0, -1.0]), DEGREES, DEGREES)
def test_a_position_is_read_as_it_was_written(axis: str, sign: float, unit_deg: int, fixture_deg: int) -> None:
    position = Position(axis, sign, unit_deg, fixture_deg)
    assert Position.of(str(position)) == position
    assert position.end == ("-" if sign < 0 else "") + axis


def test_a_turn_by_nothing_is_not_written() -> None:
    assert [str(Position.of(text)) for text in ("x@0", "-y@0/0", "z@180/0", "z@0/90")] == ["x", "-y", "z@180", "z@0/90"]


@pytest.mark.parametrize("text", ["", "w", "+x", "x@", "x@-90", "x@360", "x@90/", "x@1/360", "x@1.5", " x", "x@180 "])
def test_anything_else_is_refused_with_what_was_expected(text: str) -> None:
    with pytest.raises(ValueError, match="is not a position"):
        Position.of(text)
