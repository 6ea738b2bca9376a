"""Puts a campaign's questions to whoever sits at the terminal that runs it."""

from __future__ import annotations

import getpass
import sys
import threading
from typing import TYPE_CHECKING

from instruments.clock import SystemClock
from labctl.cli.output import complaints
from procedures.errors import StalePrompt
from procedures.operator import PersonOperator

if TYPE_CHECKING:
    from procedures.operator import Operator, Prompt

LOOK_S = 0.5


class Attendant:
    """Prints each question and takes the next line for its answer: empty for done, anything else says why not."""

    def attend(self, operator: Operator) -> None:
        """Answer for an operator from now on, in the background. A bench that helps itself asks nobody."""
        if isinstance(operator, PersonOperator):
            threading.Thread(target=self._serve, args=(operator,), daemon=True).start()

    def _serve(self, operator: PersonOperator) -> None:
        clock, asked = SystemClock(), ""
        while True:
            prompt = operator.pending
            if prompt is not None and prompt.id != asked:
                asked = prompt.id
                self._put(operator, prompt)
            clock.sleep(LOOK_S)

    @staticmethod
    def _put(operator: PersonOperator, prompt: Prompt) -> None:
        complaints.print(f"{prompt.text}. Press Enter when it is done, or type why it cannot be.", markup=False)
        line = sys.stdin.readline()
        if not line:  # nobody sits there
            return
        try:
            if why := line.strip():
                operator.decline(prompt.id, getpass.getuser(), why)
            else:
                operator.confirm(prompt.id, getpass.getuser())
        except StalePrompt as error:
            complaints.print(f"labctl: {error}", markup=False)
