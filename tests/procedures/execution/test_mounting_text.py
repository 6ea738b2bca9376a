"""What a person is asked for: which axis points up, and what is turned by how much against the first mounting."""

from __future__ import annotations

import pytest

from procedures.execution.step_handlers import mounting_text

STRAIGHT = "turn the units so that body axis {} points up along the table axis"
SEEN = "(counter-clockwise seen from above)"
ON_FACE = (
    f"{STRAIGHT.format('x')}, and each unit on the same face of its fixture by 180 deg from where it was first {SEEN}"
)
CUBE = f"{STRAIGHT.format('z')}, and the fixture with the units on the table by 90 deg from where it was first {SEEN}"
TILTED = (
    "mount the units on the tilted fixture so that body direction x+y+z, 54.74 deg from x, 54.74 deg from y, 54.74 deg "
    "from z, points up along the table axis"
)
ASKED = [("-x", STRAIGHT.format("-x")), ("x@180", ON_FACE), ("z@0/90", CUBE), ("x+y+z", TILTED)]


@pytest.mark.parametrize(("position", "asked"), ASKED)
def test_a_mounting_is_asked_for_in_words(position: str, asked: str) -> None:
    assert mounting_text(position) == asked
