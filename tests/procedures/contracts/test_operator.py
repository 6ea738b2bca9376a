"""Questions to the operator."""

from __future__ import annotations

from typing import Any

import pytest

from procedures.contracts.errors import StalePrompt
from procedures.contracts.operator import HumanOperator, Prompt, UnitHandlerOperator

FIRST = Prompt("1", "mount", "turn x up", "x")
SECOND = Prompt("2", "mount", "turn y up", "y")


def test_a_person_answers_the_open_question() -> None:
    person = HumanOperator()
    assert person.pending is None
    person.ask(FIRST)
    assert person.pending == FIRST
    assert person.answer("1") is None
    person.confirm("1", by="Ada")
    assert person.pending is None
    answer = person.answer("1")
    assert answer is not None
    assert (answer.confirmed, answer.by) == (True, "Ada")


def test_an_answer_to_an_old_question_is_refused() -> None:
    person = HumanOperator()
    with pytest.raises(StalePrompt, match="no question is open"):
        person.confirm("1", by="Ada")
    person.ask(FIRST)
    person.ask(SECOND)
    with pytest.raises(StalePrompt, match=r"'1' was already answered or withdrawn; .* \(question '2'\)"):
        person.confirm("1", by="Ada")
    person.confirm("2", by="Ada")
    with pytest.raises(StalePrompt):
        person.decline("2", by="Bob", reason="too late")
    assert person.answer("1") is None


def test_a_question_can_be_taken_back() -> None:
    person = HumanOperator()
    person.ask(FIRST)
    person.withdraw("2")
    assert person.pending == FIRST
    person.withdraw("1")
    with pytest.raises(StalePrompt):
        person.confirm("1", by="Ada")


def test_a_unit_handler_answers_a_prompt_at_once(rig: Any) -> None:
    unit_handler = UnitHandlerOperator(rig.unit_handler)
    for kind in ("mount", "power_on", "power_off"):
        prompt = Prompt("1", kind, "", "-x")  # type: ignore[arg-type]  a loop over the three literals
        unit_handler.ask(prompt)
        answer = unit_handler.answer("1")
        assert answer is not None
        assert answer.confirmed
    assert rig.trace == ["hand.mount -x", "hand.power True", "hand.power False"]


def test_only_a_turn_is_asked_again() -> None:
    person = HumanOperator()
    person.ask(FIRST)
    with pytest.raises(StalePrompt, match="does not ask for a turn by hand, and only a turn can be repeated"):
        person.repeat("1", by="Ada", reason="")
    assert person.pending == FIRST
    person.ask(Prompt("3", "turn", "turn", "x", 360.0))
    person.repeat("3", by="Ada", reason="slipped")
    answer = person.answer("3")
    assert answer is not None
    assert (answer.confirmed, answer.again, answer.reason) == (False, True, "slipped")
    with pytest.raises(StalePrompt, match="no question is open now"):
        person.repeat("3", by="Ada", reason="late")
