"""Questions at a real terminal: typed answers, and what was typed before."""

from __future__ import annotations

import os
import pty
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import pytest

from labctl.acting_user import Actor, acting, actor
from labctl.cli import terminal_operator
from labctl.cli.terminal_operator import TerminalOperator
from labctl.config import os_user
from procedures.contracts.operator import HumanOperator, Prompt
from tests.helpers.patience import WAIT_S

QUESTION = Prompt("q1", "mount", "turn the units")


class Terminal:
    """A terminal in place of standard input; types what is asked for as soon as a question is shown."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, answer: str) -> None:
        self.ours, theirs = pty.openpty()
        self.stdin = os.fdopen(theirs, encoding="utf-8")
        self._answer = answer
        self.shown: list[str] = []
        monkeypatch.setattr("sys.stdin", self.stdin)
        monkeypatch.setattr(terminal_operator.stderr, "print", self._shown)

    def type(self, text: str) -> None:
        os.write(self.ours, text.encode())

    def _shown(self, text: str, **_: Any) -> None:
        self.shown.append(text)
        if "Press Enter" in text:
            self.type(self._answer)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], Terminal]]:
    made: list[Terminal] = []

    def make(answer: str) -> Terminal:
        made.append(Terminal(monkeypatch, answer))
        return made[-1]

    yield make
    for each in made:
        each.stdin.close()
        os.close(each.ours)


def test_an_enter_from_before_the_question_is_no_answer_to_it(terminal: Callable[[str], Terminal]) -> None:
    terminal("the key is missing\n").type("\n")
    operator, noted = HumanOperator(), []
    operator.ask(QUESTION)
    TerminalOperator._put(operator, QUESTION, noted.append)
    answer = operator.answer("q1")
    assert answer is not None
    assert (answer.confirmed, answer.reason, answer.by) == (False, "the key is missing", os_user())
    assert "cannot be done; the key is missing" in noted[0]


def test_a_turn_may_be_wanted_again_and_says_its_time_limit(
    terminal: Callable[[str], Terminal],
) -> None:
    typing = terminal("Again\n")
    operator, noted = HumanOperator(), []
    turn = Prompt("q2", "turn", "turn by 360 deg", "x", 360.0, within_s=300.0)
    operator.ask(turn)
    TerminalOperator._put(operator, turn, noted.append)
    answer = operator.answer("q2")
    assert answer is not None
    assert (answer.confirmed, answer.again) == (False, True)
    assert noted == ["q2: to be asked again; turn by 360 deg"]
    assert "again to be asked for the turn again" in typing.shown[0]
    assert "Time limit: 300 s." in typing.shown[0]


def test_an_answer_is_noted_in_the_name_of_whoever_gave_the_command(terminal: Callable[[str], Terminal]) -> None:
    terminal("\n")
    operator, noted, who = HumanOperator(), threading.Event(), []

    def note(_: str) -> None:
        who.append(actor().name)
        noted.set()

    with closing(TerminalOperator()) as here:
        with acting(Actor("ada", "command line")):
            here.answer_prompts(operator, note)
        operator.ask(QUESTION)
        assert noted.wait(WAIT_S)
    assert who == ["ada"]
