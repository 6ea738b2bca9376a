"""Probabilities in words: one rounding for prints, sentences and pages, and never certain."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labctl.probability_text import probability_text

#: The pages' `probabilityText` is tested with the same cases.
CASES = json.loads(Path("tests/pages/probabilities.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("probability", "text"), CASES)
def test_a_probability_is_written_as_on_the_pages(probability: float, text: str) -> None:
    assert probability_text(probability) == text


@given(st.floats(0.0, 1.0))
def test_no_probability_is_written_as_impossible_or_certain(probability: float) -> None:
    text = probability_text(probability)
    assert text not in {"0 %", "100 %"}
    number = float(text.strip("<> %"))
    assert abs(number - 100.0 * probability) <= (1.0 if text[0] in "<>" else 0.5 + 1e-9)
