"""What a person is asked for: which axis points up, and what is turned by how much against the first mounting."""

from __future__ import annotations

import pytest

from procedures.execution.step_handlers import mounting_text


@pytest.mark.parametrize(
    ("position", "asked"),
    [
        ("-x", "turn the units so that body axis -x points up along the table axis"),
        (
            "x@180",
            "turn the units so that body axis x points up along the table axis, and each unit on the same face of its "
            "fixture by 180 deg from where it was first (counter-clockwise seen from above)",
        ),
        (
            "z@0/90",
            "turn the units so that body axis z points up along the table axis, and the fixture with the units on the "
            "table by 90 deg from where it was first (counter-clockwise seen from above)",
        ),
    ],
)
def test_a_mounting_is_asked_for_in_words(position: str, asked: str) -> None:
    assert mounting_text(position) == asked
