"""Probabilities in words: one rounding for prints, sentences and pages, and never certain."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labctl.probability_text import odds_text, probability_text, risk_text, share_text

#: The pages' `probabilityText` is tested with the same cases.
CASES = json.loads(Path("tests/pages/probabilities.json").read_text(encoding="utf-8"))
#: The pages' `percent` is tested with the same cases.
SHARES = json.loads(Path("tests/pages/shares.json").read_text(encoding="utf-8"))
#: The pages' `oddsText` is tested with the same cases.
ODDS = json.loads(Path("tests/pages/odds.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("nats", "text"), ODDS)
def test_odds_are_written_as_on_the_pages(nats: float, text: str) -> None:
    assert odds_text(nats) == text


@pytest.mark.parametrize(("probability", "text"), CASES)
def test_a_probability_is_written_as_on_the_pages(probability: float, text: str) -> None:
    assert probability_text(probability) == text


@given(st.floats(0.0, 1.0))
def test_no_probability_is_written_as_impossible_or_certain(probability: float) -> None:
    text = probability_text(probability)
    assert text not in {"0 %", "100 %"}
    number = float(text.strip("<> %"))
    assert abs(number - 100.0 * probability) <= (1.0 if text[0] in "<>" else 0.5 + 1e-9)


@pytest.mark.parametrize(
    ("risk", "text"),
    [
        (0.0, "below 0.01 %"),
        (9.9e-5, "below 0.01 %"),
        (1e-4, "0.01 %"),
        (0.00123, "0.12 %"),
        (0.025, "2.5 %"),
        (0.5, "50 %"),
        (0.989, "99 %"),
        (0.99, "above 99 %"),
        (1.0, "above 99 %"),
    ],
)
def test_a_risk_is_written_to_two_digits(risk: float, text: str) -> None:
    assert risk_text(risk) == text


@pytest.mark.parametrize(("share", "text"), SHARES)
def test_a_share_is_written_as_on_the_pages(share: float, text: str) -> None:
    assert share_text(share) == text


@given(st.floats(0.0, 1.0))
def test_only_nothing_is_0_percent_and_only_all_is_100(share: float) -> None:
    assert (share_text(share) == "0 %") == (share == 0.0)
    assert (share_text(share) == "100 %") == (share == 1.0)
