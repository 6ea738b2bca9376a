"""What is asked of a person: place, turn, switch the units. Every question has an id; old answers are refused."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

from procedures.contracts.errors import StalePrompt

if TYPE_CHECKING:
    from instruments.interfaces.unit_handler import UnitHandler


@dataclass(frozen=True)
class Prompt:
    """One question to a person."""

    id: str  #: unique, so that a late answer cannot hit the next question
    kind: Literal["mount", "power_on", "power_off", "turn"]
    text: str
    position: str | None = None  #: where the units are to be turned; of a turn the axis that points up
    turn_deg: float | None = None  #: of a turn: by which angle, positive counter-clockwise seen from above
    within_s: float | None = None  #: how long the answer is waited for; absent: without limit


@dataclass(frozen=True)
class Answer:
    """What the person said, and who it was."""

    prompt_id: str
    confirmed: bool
    by: str
    reason: str = ""
    again: bool = False  #: not done well: the same is to be asked again. Of a turn only


class Operator(Protocol):
    """The one who turns and switches the units. The engine asks once, then polls for the answer about once a second."""

    @property
    def at_once(self) -> bool:
        """Whether answers come without a person at the bench."""
        ...

    def ask(self, prompt: Prompt) -> None:
        """Put the question; must not block for longer than it takes to show it."""
        ...

    def answer(self, prompt_id: str) -> Answer | None:
        """Return the answer to a question, or None while there is none."""
        ...

    def withdraw(self, prompt_id: str) -> None:
        """Take a question back that is no longer of interest."""
        ...


class UnitHandlerOperator:
    """Answers without a person: a unit handler carries out what is asked, as on a simulated bench.

    All but a turn is done at once.
    """

    at_once = True

    def __init__(self, unit_handler: UnitHandler, by: str = "simulated bench") -> None:
        self._unit_handler = unit_handler
        self._by = by
        self._turns = False  #: whether the last question was for a turn

    def ask(self, prompt: Prompt) -> None:
        self._turns = prompt.kind == "turn"
        if prompt.kind == "mount":
            assert prompt.position is not None
            self._unit_handler.mount(prompt.position)
        elif prompt.kind == "turn":
            assert prompt.position is not None
            assert prompt.turn_deg is not None
            self._unit_handler.turn(prompt.position, prompt.turn_deg)
        else:
            self._unit_handler.power(prompt.kind == "power_on")

    def answer(self, prompt_id: str) -> Answer | None:
        if self._turns and self._unit_handler.is_turning():
            return None
        return Answer(prompt_id, confirmed=True, by=self._by)

    def withdraw(self, prompt_id: str) -> None:  # nothing is ever left open
        pass


class HumanOperator:
    """A person who answers from another thread: command line, HTTP, a page. One question at a time."""

    at_once = False

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._pending: Prompt | None = None
        self._answer: Answer | None = None

    @property
    def pending(self) -> Prompt | None:
        """The question that waits for an answer."""
        with self._lock:
            return self._pending if self._answer is None else None

    def ask(self, prompt: Prompt) -> None:
        with self._lock:
            self._pending, self._answer = prompt, None

    def answer(self, prompt_id: str) -> Answer | None:
        with self._lock:
            fits = self._answer is not None and self._answer.prompt_id == prompt_id
            return self._answer if fits else None

    def withdraw(self, prompt_id: str) -> None:
        with self._lock:
            if self._pending is not None and self._pending.id == prompt_id:
                self._pending, self._answer = None, None

    def confirm(self, prompt_id: str, by: str) -> None:
        """Answer that it is done. Raises StalePrompt when another question, or none, is open."""
        self._reply(Answer(prompt_id, confirmed=True, by=by))

    def decline(self, prompt_id: str, by: str, reason: str) -> None:
        """Answer that it cannot be done; the campaign ends. Raises StalePrompt like `confirm`."""
        self._reply(Answer(prompt_id, confirmed=False, by=by, reason=reason))

    def repeat(self, prompt_id: str, by: str, reason: str) -> None:
        """Answer that it did not go well and is to be asked again. Raises StalePrompt, also for what is no turn."""
        with self._lock:
            if self._pending is not None and self._pending.id == prompt_id and self._pending.kind != "turn":
                raise StalePrompt(
                    f"question {prompt_id!r} does not ask for a turn by hand, and only a turn can be repeated; "
                    "confirm the question, or decline it"
                )
        self._reply(Answer(prompt_id, confirmed=False, by=by, reason=reason, again=True))

    def reply(self, answer: Answer) -> None:
        """Answer the question in any way. Raises StalePrompt like `confirm` and `repeat`."""
        if answer.again:
            self.repeat(answer.prompt_id, answer.by, answer.reason)
        elif answer.confirmed:
            self.confirm(answer.prompt_id, answer.by)
        else:
            self.decline(answer.prompt_id, answer.by, answer.reason or "no reason given")

    def _reply(self, answer: Answer) -> None:
        with self._lock:
            if self._pending is None or self._pending.id != answer.prompt_id or self._answer is not None:
                other = self._pending if self._answer is None else None
                now = "no question is open now" if other is None else f"question {other.id!r}"
                raise StalePrompt(
                    f"question {answer.prompt_id!r} was already answered or withdrawn; answer only the question "
                    f"that is open ({now})"
                )
            self._answer = answer
