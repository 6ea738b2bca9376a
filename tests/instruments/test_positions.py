"""Positions: what is read is what is written, and nothing else is read."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.positions import AXES, MAX_LENGTH, Position

DEGREES = st.integers(0, 359)


@given(st.sampled_from(AXES), st.sampled_from(["", "-"]), DEGREES, DEGREES)
def test_a_position_is_read_as_it_was_written(axis: str, sign: str, unit_deg: int, fixture_deg: int) -> None:
    position = Position.of(f"{sign}{axis}@{unit_deg}/{fixture_deg}")
    assert Position.of(str(position)) == position
    assert (position.end, position.axis, position.is_tilted) == (sign + axis, axis, False)
    assert (position.unit_deg, position.fixture_deg) == (unit_deg, fixture_deg)
    assert position.up[AXES.index(axis)] == position.sign == (-1.0 if sign else 1.0)


@given(st.tuples(*[st.integers(-9, 9)] * 3).filter(any))
def test_a_tilted_direction_is_a_unit_vector_along_its_sum_of_axes(shares: tuple[int, int, int]) -> None:
    text = "".join(f"{share:+d}{axis}" for share, axis in zip(shares, AXES, strict=True) if share).removeprefix("+")
    position = Position.of(text)
    assert Position.of(str(position)) == position
    assert math.hypot(*position.up) == pytest.approx(1.0, abs=1e-15)
    size = math.hypot(*shares)
    assert position.up == pytest.approx([share / size for share in shares], abs=1e-15)
    assert position.upside_down.up == pytest.approx([-share / size for share in shares], abs=1e-15)
    assert position.is_tilted == (sum(map(bool, shares)) > 1)
    assert len(str(position)) <= MAX_LENGTH


def test_a_direction_has_one_text() -> None:
    texts = {"z+x": "x+z", "2x": "x", "6x+8z": "3x+4z", "-x-y-z@90": "-x-y-z@90", "1x+01y": "x+y"}
    assert {text: str(Position.of(text)) for text in texts} == texts
    assert Position.of("x+y+z").in_words == "tilted: body direction x+y+z up"


def test_a_turn_by_nothing_is_not_written() -> None:
    assert [str(Position.of(text)) for text in ("x@0", "-y@0/0", "z@180/0", "z@0/90")] == ["x", "-y", "z@180", "z@0/90"]


WRONG = ["", "w", "+x", "x@", "x@-90", "x@360", "x@90/", "x@1/360", "x@1.5", " x", "x@180 "]
WRONG_TILTED = ["x+x", "0x", "0x+y", "x+", "xy", "x+y+z+x", "1000x+y", "0.5x+y", "x+y+z@0/180", "x++y"]


@pytest.mark.parametrize("text", [*WRONG, *WRONG_TILTED])
def test_anything_else_is_refused_with_what_was_expected(text: str) -> None:
    with pytest.raises(ValueError, match="is not a position"):
        Position.of(text)
