"""Whoever sits at the terminal that runs a campaign: what counts as an answer, and that it is written down."""

from __future__ import annotations

import os
import pty
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from labctl.actor import Actor, acting, actor
from labctl.cli import terminal_operator
from labctl.cli.terminal_operator import TerminalOperator
from labctl.config import os_user
from labctl.errors import Stopped
from labctl.services.campaigns import preparation, resume
from labctl.services.campaigns.execution import run_here
from labctl.services.campaigns.resume import resume_here
from labctl.services.schemas.campaigns import ResumeRequest, StartRequest
from labctl.store import open_store
from procedures.contracts.operator import HumanOperator, Prompt

QUESTION = Prompt("q1", "mount", "turn the units")
WAIT_S = 30.0


class Terminal:
    """A terminal in place of standard input; types what is asked for as soon as a question is shown."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, answer: str) -> None:
        self.ours, theirs = pty.openpty()
        self.stdin = os.fdopen(theirs, encoding="utf-8")
        self._answer = answer
        monkeypatch.setattr("sys.stdin", self.stdin)
        monkeypatch.setattr(terminal_operator.stderr, "print", self._shown)

    def type(self, text: str) -> None:
        os.write(self.ours, text.encode())

    def _shown(self, text: str, **_: Any) -> None:
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


def test_an_answer_is_noted_in_the_name_of_whoever_gave_the_command(terminal: Callable[[str], Terminal]) -> None:
    terminal("\n")
    operator, noted, who = HumanOperator(), threading.Event(), []

    def note(_: str) -> None:
        who.append(actor().name)
        noted.set()

    with acting(Actor("ada", "command line")):
        TerminalOperator().answer_prompts(operator, note)
    operator.ask(QUESTION)
    assert noted.wait(WAIT_S)
    assert who == ["ada"]


def test_answers_and_resumes_at_a_terminal_are_in_the_audit_trail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    location = str(tmp_path / "lab.sqlite")
    for module in (preparation, resume):
        monkeypatch.setattr(module, "operator_of", lambda _: HumanOperator())
    seen: list[int] = []

    def attend(operator: Any, note: Callable[[str], None]) -> None:
        """Do what is asked as soon as it is asked."""
        put = operator.ask

        def ask(prompt: Prompt) -> None:
            put(prompt)
            operator.confirm(prompt.id, "Ada")
            note(f"{prompt.id}: done")

        operator.ask = ask

    def tired(answer: Any) -> None:
        if answer.step == 7 and not seen:
            seen.append(answer.step)
            raise KeyboardInterrupt

    with acting(Actor("ada", "command line")):
        with pytest.raises(Stopped):
            run_here(location, StartRequest(recipe="short"), tired, attend)
        resume_here(location, 1, None, None, ResumeRequest(by="Ada"), None, attend)
    with open_store(location, write=False) as store:
        rows = store.audit.rows()
        assert store.campaigns.get(1).state == "done"
    assert any(row.action == "campaign confirm" for row in rows)
    resumed = [row for row in rows if row.action == "campaign resume"]
    assert [(row.who, "taken up by Ada" in row.detail["reason"]) for row in resumed] == [("ada", True)]
