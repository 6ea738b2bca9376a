"""The natural order of serial numbers, as a key that is compared by its bytes."""

from __future__ import annotations

import random
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labctl.natural_order import natural_key
from labctl.recording.info import SERIAL_PATTERN

SERIALS = st.from_regex(SERIAL_PATTERN, fullmatch=True)
#: Serial numbers in which numbers meet numbers, with zeros in front, and the ends of others.
ALIKE = st.text("0129-A", min_size=1, max_size=8)


def parts(serial: str) -> list[tuple[int, str]]:
    """Return what is compared one after the other: characters, and numbers as numbers at the place of the digits."""
    pieces = re.findall(r"[0-9]+|[^0-9]", serial)
    return [(int(piece), "0") if piece.isdigit() else (0, piece) for piece in pieces]


def is_before(one: str, other: str) -> bool:
    """Compare two serial numbers piece by piece, without a key; zeros in front decide only where all else is equal."""
    for (number, character), (other_number, other_character) in zip(parts(one), parts(other), strict=False):
        if character != other_character:
            return character < other_character
        if number != other_number:
            return number < other_number
    if len(parts(one)) != len(parts(other)):
        return len(parts(one)) < len(parts(other))
    zeros, other_zeros = ([len(run) for run in re.findall("[0-9]+", each)] for each in (one, other))
    return zeros < other_zeros


@pytest.mark.parametrize(
    "ordered",
    [
        ["A-1", "A-2", "A-10", "A-11", "A-100"],
        ["A-2", "A-02", "A-002", "A-2B", "A-3"],
        ["A-0", "A-00", "A-1"],
        ["5", "40", "A", "A9", "A10", "AB"],
        ["VG-2024-9", "VG-2024-10", "VG-2025-1"],
        ["A 2", "A#2", "A+2", "A-2", "A.2", "A2", "AA2", "A_2", "Aa2"],
        ["9" * 9, "1" + "0" * 9, "9" * 63, "1" + "0" * 63],
    ],
)
def test_serial_numbers_are_in_natural_order(ordered: list[str]) -> None:
    assert sorted(random.Random(1).sample(ordered, len(ordered)), key=natural_key) == ordered


@given(SERIALS | ALIKE, SERIALS | ALIKE)
def test_bytes_of_keys_compare_as_the_serial_numbers_do(one: str, other: str) -> None:
    keys = [natural_key(each).encode() for each in (one, other)]
    assert (keys[0] == keys[1]) == (one == other)
    assert (keys[0] < keys[1]) == (one != other and is_before(one, other))
