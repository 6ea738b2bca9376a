"""Confirmation by a person that a real bench is clear, before a campaign starts there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from instruments.bench_config import BenchFile
from labctl.answers.campaigns import BENCH_CHECKS, BenchCheck
from labctl.errors import StartNotConfirmed

#: What is asked, and what the answer yes says.
QUESTIONS: Mapping[BenchCheck, str] = {
    "chamber_clear": "Is the chamber clear: no person, no tool, no loose part in it, door closed?",
    "table_free": "Is the table free to turn: nothing touches it, and its cables have enough slack?",
    "limiter_on": "Is the independent temperature limiter on?",
}
STATEMENTS: Mapping[BenchCheck, str] = {
    "chamber_clear": "chamber clear",
    "table_free": "table free",
    "limiter_on": "limiter on",
}


class Confirming(Protocol):
    """A request that may carry a confirmation."""

    @property
    def confirmed_by(self) -> str:
        """The person; empty for none."""
        ...

    @property
    def checks(self) -> list[BenchCheck]:
        """What the person confirms."""
        ...


#: What a check is about: without it there is nothing to be confirmed.
ABOUT: Mapping[BenchCheck, str] = {"chamber_clear": "chamber", "table_free": "table", "limiter_on": "chamber"}


def start_questions(bench: BenchFile) -> dict[str, str]:
    """Return what a person is asked before a campaign starts on a bench: check -> question.

    Nothing for a simulated bench, and for one without table and chamber: nothing moves or heats there by itself.
    """
    if bench.is_simulated:
        return {}
    return {check: QUESTIONS[check] for check in BENCH_CHECKS if ABOUT[check] in bench.instruments}


def confirmation_text(bench: BenchFile, request: Confirming) -> str:
    """Return what a person has confirmed about a bench, for the campaign's records; empty for a simulated bench.

    Raises StartNotConfirmed.
    """
    questions = start_questions(bench)
    if not questions:
        return ""
    by = request.confirmed_by.strip()
    missing = {check: text for check, text in questions.items() if not by or check not in request.checks}
    if missing:
        raise StartNotConfirmed(
            f"bench {bench.name} is not simulated: a campaign starts only after a person has confirmed "
            f"{', '.join(STATEMENTS[check] for check in BENCH_CHECKS if check in missing)}. Inspect the bench, then "
            "send `confirmed_by`"
            " and `checks`, or name the person with --clear-confirmed-by NAME",
            missing,
        )
    return f"{', '.join(STATEMENTS[check] for check in BENCH_CHECKS if check in questions)}: confirmed by {by}"
