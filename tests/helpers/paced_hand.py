"""A person beside a simulated bench in virtual time, which is held back while the person has not answered."""

from __future__ import annotations

import threading

from instruments.clock import VirtualClock
from instruments.interfaces.unit_handler import UnitHandler
from procedures.contracts.operator import Answer, HumanOperator, Prompt, UnitHandlerOperator

#: How long the bench's virtual time stands still, s of wall time, between two looks for an answer.
PACE_S = 0.1
#: What a paced clock takes for a wait of at least `WAIT_S` of its own time, s of wall time.
REST_S, WAIT_S = 0.005, 0.5


class PacedClock(VirtualClock):
    """Virtual time that leaves the processor to the page: else a campaign runs, and is drawn, as fast as it can."""

    def __init__(self) -> None:
        super().__init__()
        self._never = threading.Event()

    def sleep(self, duration_s: float) -> None:
        super().sleep(duration_s)
        if duration_s >= WAIT_S:
            self._never.wait(REST_S)


class PacedPerson(HumanOperator):
    """A person over HTTP or at a terminal. While the answer is waited for, virtual time does not run hours ahead."""

    def __init__(self) -> None:
        super().__init__()
        self._answered = threading.Event()

    def ask(self, prompt: Prompt) -> None:
        self._answered.clear()
        super().ask(prompt)

    def answer(self, prompt_id: str) -> Answer | None:
        self._answered.wait(PACE_S)
        return super().answer(prompt_id)

    def _reply(self, answer: Answer) -> None:
        super()._reply(answer)
        self._answered.set()


class PacedHand(PacedPerson):
    """The hand of the simulation does what is asked when it is asked; a person says when it is done.

    Time is held back only while the units are at rest.
    """

    def __init__(self, unit_handler: UnitHandler) -> None:
        super().__init__()
        self._unit_handler, self._does = unit_handler, UnitHandlerOperator(unit_handler)

    def ask(self, prompt: Prompt) -> None:
        super().ask(prompt)
        self._does.ask(prompt)

    def answer(self, prompt_id: str) -> Answer | None:
        return None if self._unit_handler.is_turning() else super().answer(prompt_id)
