"""A person's answers in a wire log: recorded as they are given, and given again by a replay.

The engine asks for the answer again and again; what it does meanwhile passes the wire. So a replay answers when it has
been asked as often as the person's answer took. Names of people are not recorded.
"""

from __future__ import annotations

from collections.abc import Callable

from instruments.transport.wire_log.replay import Replay
from procedures.contracts.operator import Answer, Operator, Prompt

#: The port of a log that stands for the person at the bench.
OPERATOR = "operator"
CONFIRMED, AGAIN, DECLINED = b"confirmed", b"again", b"declined"
BY = "person of the recorded session"


class RecordedOperator:
    """An operator whose answers are noted; `note` adds an event of the operator's port."""

    at_once = False

    def __init__(self, operator: Operator, note: Callable[..., None]) -> None:
        self._operator, self._note = operator, note
        self._asked = 0

    def ask(self, prompt: Prompt) -> None:
        self._asked = 0
        self._operator.ask(prompt)
        self._note(OPERATOR, "sent", prompt.kind.encode())

    def answer(self, prompt_id: str) -> Answer | None:
        given_answer = self._operator.answer(prompt_id)
        self._asked += 1
        if given_answer is not None:
            outcome = CONFIRMED if given_answer.confirmed else AGAIN if given_answer.again else DECLINED
            self._note(OPERATOR, "received", outcome, asked=self._asked)
        return given_answer

    def withdraw(self, prompt_id: str) -> None:
        self._operator.withdraw(prompt_id)


class ReplayedOperator:
    """Answers as the person of a recorded session did, after as many questions; withdrawn questions stay unanswered."""

    at_once = False

    def __init__(self, replay: Replay) -> None:
        self._replay = replay
        self._asked = 0

    def ask(self, prompt: Prompt) -> None:
        self._asked = 0
        self._replay.sent(OPERATOR, prompt.kind.encode())

    def answer(self, prompt_id: str) -> Answer | None:
        self._asked += 1
        event = self._replay.record.next(OPERATOR)
        if event is None or event.kind != "received" or self._asked < (event.number("asked") or 1):
            return None
        outcome = self._replay.take(OPERATOR).data
        return Answer(prompt_id, confirmed=outcome == CONFIRMED, by=BY, reason="as recorded", again=outcome == AGAIN)

    def withdraw(self, prompt_id: str) -> None:  # the next question passes over what is left
        pass
