"""Steps that seem missed because this computer timed a reply late end no campaign; more than that does."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import create_autospec

import pytest

from instruments.drivers.arrick_c4 import ArrickC4
from instruments.interfaces.table import HomeCheck
from procedures.contracts.errors import TableStopped
from procedures.contracts.steps import CheckHome
from procedures.execution.context import ExecutionContext
from procedures.execution.table_checks import check_home

STEP_S = 0.005
FOUND = HomeCheck(58.8, 4.9, 2.0, 0.225, STEP_S)


class Stalls:
    """A computer that ran labctl late by `late_s`, too short for a stall."""

    speed = 1.0

    def __init__(self, late_s: float) -> None:
        self.late_s = late_s

    def total_s(self) -> float:
        return 0.0

    @contextmanager
    def lateness(self) -> Iterator[Any]:
        yield SimpleNamespace(largest_s=self.late_s)


def context_of(late_s: float, events: list[str], *checks: HomeCheck) -> ExecutionContext:
    table = create_autospec(ArrickC4, instance=True)
    table.name, table.step_clock, table.check_home.side_effect = "table", None, checks
    recorder = SimpleNamespace(
        event=lambda event: events.append(f"{event.kind}: {event.message}"),
        journal=SimpleNamespace(dataset_closed=lambda number, *_: events.append(f"partial {number}")),
    )
    context = SimpleNamespace(
        bench=SimpleNamespace(table=table),
        monitor=SimpleNamespace(stalls=Stalls(late_s)),
        recorder=recorder,
        unchecked=[7],
    )
    return cast(ExecutionContext, context)


def step() -> CheckHome:
    return cast(CheckHome, SimpleNamespace(temperature_c=25.0))


def test_a_reply_that_this_computer_heard_late_is_no_missed_step() -> None:
    events: list[str] = []
    assert check_home(context_of(0.29, events, FOUND), step())["missed_steps"] == 58.8
    (event,) = [each for each in events if each.startswith("home_doubtful")]
    assert "this computer ran labctl late by up to 0.29 s meanwhile" in event
    assert "partial 7" not in events


def test_a_reply_that_was_late_by_the_controllers_own_word_ends_no_campaign() -> None:
    events: list[str] = []
    late = replace(FOUND, explained="home seems 58.8 steps from where it was left, but the reply was late")
    assert check_home(context_of(0.0, events, late), step())["missed_steps"] == 58.8
    (event,) = [each for each in events if not each.startswith("home_uncertain")]
    assert event.startswith(f"home_doubtful: table: {late.explained};")


@pytest.mark.parametrize("late_s", [0.0, 0.2])
def test_steps_that_no_late_reply_explains_are_missing(late_s: float) -> None:
    events: list[str] = []
    with pytest.raises(TableStopped, match=r"home is 58\.8 steps"):
        check_home(context_of(late_s, events, FOUND), step())
    assert events == ["partial 7"]


def test_a_table_that_still_moved_has_missed_steps_however_late_this_computer_ran() -> None:
    events: list[str] = []
    with pytest.raises(TableStopped, match=r"home is 58\.8 steps"):
        check_home(context_of(0.5, events, replace(FOUND, is_shown=True)), step())
    assert events == ["partial 7"]


def test_turns_that_were_timed_late_are_made_again_before_the_homing_is_learned() -> None:
    events: list[str] = []
    learning = HomeCheck(8.4, 1.3, 2.0, 0.225, STEP_S, learning=True)
    fine = HomeCheck(0.2, 1.3, 2.0, 0.225, STEP_S)
    assert check_home(context_of(0.03, events, learning, fine), step())["missed_steps"] == 0.2
    assert events[0].startswith("home_unchecked: home is checked again: this computer ran labctl late by up to 0.03 s")
