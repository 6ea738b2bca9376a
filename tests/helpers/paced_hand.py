"""A person beside a simulated bench: the hand of the simulation does what is asked, the person answers."""

from __future__ import annotations

import threading

from instruments.interfaces.unit_handler import UnitHandler
from procedures.contracts.operator import Answer, HumanOperator, Prompt, UnitHandlerOperator

#: How long the bench's virtual time stands still, s of wall time, between two looks for an answer.
PACE_S = 0.05


class PacedHand(HumanOperator):
    """Does what is asked when it is asked; a person, over HTTP or at a terminal, says when it is done.

    While the units are at rest virtual time is held back, so that it does not run hours ahead of the person.
    """

    def __init__(self, unit_handler: UnitHandler) -> None:
        super().__init__()
        self._unit_handler, self._does = unit_handler, UnitHandlerOperator(unit_handler)
        self._answered = threading.Event()

    def ask(self, prompt: Prompt) -> None:
        self._answered.clear()
        super().ask(prompt)
        self._does.ask(prompt)

    def answer(self, prompt_id: str) -> Answer | None:
        if self._unit_handler.is_turning():
            return None
        self._answered.wait(PACE_S)
        return super().answer(prompt_id)

    def _reply(self, answer: Answer) -> None:
        super()._reply(answer)
        self._answered.set()
