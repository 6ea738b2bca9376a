"""KVH text lines as the manual prints them."""

from __future__ import annotations

import re

import pytest

from instruments.protocols.kvh_lines import DSP3000, RD2100, Line, parse_line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("       0.015733   1", Line(15_733, True, None)),
        ("     -12.500000   0", Line(-12_500_000, False, None)),
        ("  0.1 1", None),  # too short
        ("       0.015733   2", None),  # a flag is 0 or 1
        ("?      0.015733   1", None),
    ],
)
def test_a_dsp3000_line_has_19_characters(text: str, line: Line | None) -> None:
    assert parse_line(text, re.compile(DSP3000.pattern), DSP3000.length) == line


def test_an_rd2100_line_may_carry_a_temperature() -> None:
    pattern = re.compile(RD2100.pattern)
    assert parse_line("1.250000 25.125", pattern) == Line(1_250_000, True, 25_125)
    assert parse_line("1.250000", pattern) == Line(1_250_000, True, None)
    assert parse_line("1.250000 warm", pattern) is None
