"""Puts a campaign's questions to the person at the terminal that runs it."""

from __future__ import annotations

import sys
import termios
import threading
from collections.abc import Callable, Mapping
from contextvars import copy_context
from typing import TYPE_CHECKING

from labctl.cli.output import stderr
from labctl.config import os_user
from labctl.errors import StoreError
from procedures.contracts.errors import StalePrompt
from procedures.contracts.operator import HumanOperator

if TYPE_CHECKING:
    from procedures.contracts.operator import Operator, Prompt

POLL_INTERVAL_S = 0.5
#: What a person types who wants a turn by hand to be asked again.
AGAIN = "again"


class TerminalOperator:
    """Prints each question and takes the next line for its answer: empty for done, anything else says why not."""

    def __init__(self) -> None:
        self._closed = threading.Event()

    def answer_prompts(self, operator: Operator, note: Callable[[str], None]) -> None:
        """Answer for an operator from now on, in the background; `note` is called with each answer.

        A bench with a unit handler asks no questions.
        """
        if isinstance(operator, HumanOperator):
            caller_context = copy_context()  # in the name of the user who gave the command
            threading.Thread(target=caller_context.run, args=(self._serve, operator, note), daemon=True).start()

    def _serve(self, operator: HumanOperator, note: Callable[[str], None]) -> None:
        asked_prompt = ""
        while not self._closed.wait(POLL_INTERVAL_S):
            prompt = operator.pending
            if prompt is not None and prompt.id != asked_prompt:
                asked_prompt = prompt.id
                self._put(operator, prompt, note)

    def close(self) -> None:
        """Put no further question. One that waits for its line is left to the end of the process."""
        self._closed.set()

    @staticmethod
    def _put(operator: HumanOperator, prompt: Prompt, note: Callable[[str], None]) -> None:
        if sys.stdin.isatty():  # an Enter from before the question is no answer to it
            termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
        stderr.print(f"{prompt.text}. {_how_to_answer(prompt)}")
        line = sys.stdin.readline()
        if not line:  # end of input: no person is at the terminal
            limit = "" if prompt.within_s is None else f" within {prompt.within_s:g} s"
            stderr.print(
                "labctl: the input of this terminal has ended, so no answer can be typed here; the "
                f"campaign waits{limit}",
            )
            return
        try:
            reason = line.strip()
            again = prompt.kind == "turn" and reason.lower() == AGAIN
            if again:
                operator.repeat(prompt.id, os_user(), "")
            elif reason:
                operator.decline(prompt.id, os_user(), reason)
            else:
                operator.confirm(prompt.id, os_user())
            outcome = "to be asked again" if again else f"cannot be done; {reason}" if reason else "done"
            note(f"{prompt.id}: {outcome}; {prompt.text}")
        except (StalePrompt, StoreError) as error:
            stderr.print(f"labctl: {error}")


def _how_to_answer(prompt: Prompt) -> str:
    """Return what to type, and by when."""
    again = f", {AGAIN} to be asked for the turn again" if prompt.kind == "turn" else ""
    limit = "" if prompt.within_s is None else f" Time limit: {prompt.within_s:g} s."
    return f"Press Enter when this is done{again}, or type the reason why it cannot be done.{limit}"


def ask_bench_clear(questions: Mapping[str, str]) -> str:
    """Ask at the terminal whether a real bench is clear; returns who has said yes to every question, else nothing.

    Without a terminal nothing is asked.
    """
    if not sys.stdin.isatty():
        return ""
    termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)  # an answer from before the question is none
    stderr.print("This bench is not simulated: the table turns and the chamber heats when the campaign starts.")
    for question in questions.values():
        stderr.print(f"{question} Type yes, or anything else to stop.")
        if sys.stdin.readline().strip().lower() not in {"yes", "y"}:
            return ""
    stderr.print("Your name:", end=" ")
    return sys.stdin.readline().strip()
