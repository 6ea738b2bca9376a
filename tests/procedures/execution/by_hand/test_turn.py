"""Turns by hand through the engine and the bytes of a simulated gyro, in virtual time, without table and chamber."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import pytest

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.errors import NoReply
from procedures.contracts.control import Control
from procedures.contracts.operator import HumanOperator, Prompt, UnitHandlerOperator
from procedures.execution.engine import Engine
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe
from tests.helpers.recording_journal import RecordingJournal

RULES = {"turns_deg": [360.0], "rest_s": 2.0, "within_s": 20.0}


class HandBench:
    """A simulated bench without table and chamber, and what an engine needs to run turns on it."""

    def __init__(self, mistakes: tuple[str, ...] = (), operator: Any = None, **rules: Any) -> None:
        file = read_bench("by-hand-sim").model_dump()
        file["simulation"]["hand"] |= {"mistakes": list(mistakes), "rate_dps": 180.0}
        self.clock, self.control = VirtualClock(), Control()
        self.bench: Bench = open_bench(BenchFile.model_validate(file), self.clock)
        self.journal = RecordingJournal([])
        self.operator = operator or UnitHandlerOperator(self.bench.unit_handler)
        self.progress: list[Any] = []
        given: dict[str, Any] = {"name": "t", "positions": ["x"], "turns": {**RULES, **rules}}
        self.plan = make_plan(Recipe.model_validate(given), BenchLimits.of(self.bench))
        self.engine = Engine(
            self.plan, self.bench, self.journal, self.clock, self.operator, control=self.control,
            observer=self.progress.append,
        )  # fmt: skip

    def run(self) -> Any:
        return self.engine.run()

    def said(self, kind: str) -> list[str]:
        return [event.message for event in self.journal.events if event.kind == kind]


class Person(HumanOperator):
    """A person who does at once what is asked, and turns as `act` does."""

    def __init__(self, act: Callable[[Person, Prompt], None]) -> None:
        super().__init__()
        self.act = act

    def ask(self, prompt: Prompt) -> None:
        super().ask(prompt)
        if prompt.kind == "turn":
            self.act(self, prompt)
        else:
            self.confirm(prompt.id, by="Ada")


def test_a_good_turn_is_three_data_sets_and_says_what_came_out() -> None:
    there = HandBench()
    assert there.run().state == "done"
    assert [step.kind for step in there.plan.steps] == ["mount", "power_on", "turn", "safe_state"]
    headers = there.journal.headers
    assert [(h.turn_deg, h.planned, h.setpoint_c, h.angle_from_deg) for h in headers] == [
        (0.0, 1, None, None), (360.0, 2, None, None), (0.0, 3, None, None),
    ]  # fmt: skip
    assert there.plan.datasets == 3
    # the turn is closed last: a step whose turn is complete is done, whenever the process ends
    assert there.journal.closed == [(1, "complete", ""), (3, "complete", ""), (2, "complete", "")]
    assert {chamber_c for *_, chamber_c in there.journal.blocks} == {None}
    [event] = [event for event in there.journal.events if event.kind == "turn.taken"]
    assert event.value == pytest.approx(360.0, abs=3.0)
    assert (event.limit, event.unit, event.device) == (360.0, "deg", "mems")


def test_no_reading_is_missing_between_the_rests_and_the_turn() -> None:
    there = HandBench()
    there.run()
    times = [t for _, _, readings, _ in there.journal.blocks for t in readings.t_s]
    assert max(b - a for a, b in itertools.pairwise(times)) == pytest.approx(1 / 125, abs=1e-6)


@pytest.mark.parametrize(
    ("mistake", "said"),
    [
        ("short", "the unit turned by only 300 deg about axis x instead of 360 deg"),
        ("axis", "deg about axis y, not about axis x"),
        ("direction", "deg in the wrong direction, clockwise"),
        ("nudge", "the unit moved during the rest after the turn"),
        ("fast", "the unit measures only up to 400 deg/s; turn the unit more slowly"),
        ("nothing", "the unit turned by only 0 deg about axis x instead of 360 deg"),
    ],
)
def test_a_clumsy_hand_is_told_what_came_out_and_asked_again(mistake: str, said: str) -> None:
    there = HandBench((mistake,), rest_s=5.0)
    assert there.run().state == "done"
    [refused] = there.said("turn.refused")
    assert said in refused
    assert refused.endswith(": turn again")
    asked = [text for text in there.said("operator.asked") if "turn the units by 360 deg" in text]
    assert len(asked) == 2
    assert said in asked[1]
    states = [state for _, state, _ in there.journal.closed]
    assert states == ["partial"] * 3 + ["complete"] * 3
    assert all(said in reason for _, _, reason in there.journal.closed[:3])
    [turned] = [result for result in there.journal.results() if "attempts" in result.figures]
    assert turned.figures["attempts"] == 2.0


def test_a_hand_that_never_does_it_ends_the_campaign_and_says_why() -> None:
    there = HandBench(("short",) * 9, attempts=3)
    outcome = there.run()
    assert outcome.state == "failed"
    assert outcome.reason.startswith(
        "the turn by 360 deg, x up, was refused 3 times, the last time because: the unit turned by only 300 deg"
    )


def test_the_angle_so_far_is_shown_while_the_hand_turns() -> None:
    there = HandBench(("direction",))
    there.run()
    seen = [progress.turn for progress in there.progress if progress.turn is not None]
    second = [turn for turn in seen if turn.attempt == 2 and turn.phase == "turn" and turn.came_deg]
    came = [turn.came_deg["mems"] for turn in second]
    assert came == sorted(came) or max(came) - came[-1] < 1.0
    assert any(60 < angle < 300 for angle in came)
    assert all("wrong direction" in turn.refused for turn in second)
    assert there.engine.progress.turn is None


def test_a_person_may_want_a_turn_again() -> None:
    class Slipping(Person):
        """Turns, and answers when the unit is at rest again: the first time that it slipped."""

        slips = 1

        def answer(self, prompt_id: str) -> Any:
            if (asked := self.pending) and asked.kind == "turn" and not there.bench.unit_handler.is_turning():
                self.slips -= 1
                if self.slips >= 0:
                    self.repeat(asked.id, "Ada", "slipped off the edge")
                else:
                    self.confirm(asked.id, "Ada")
            return super().answer(prompt_id)

    there = HandBench(operator=Slipping(lambda _, __: there.bench.unit_handler.turn("x", 360.0)))
    assert there.run().state == "done"
    assert there.said("turn.refused") == ["turn by 360 deg, x up: slipped off the edge: turn again"]
    assert [state for _, state, _ in there.journal.closed] == ["partial"] * 3 + ["complete"] * 3


def test_a_person_who_takes_time_lengthens_the_rests_and_not_the_turn() -> None:
    class Slow(Person):
        """Begins a minute after the question, and says that it is done a minute after the turn."""

        begins_s = says_s = float("inf")

        def answer(self, prompt_id: str) -> Any:
            now_s = there.clock.now_s()
            if (asked := self.pending) and now_s >= self.begins_s:
                there.bench.unit_handler.turn("x", 360.0)
                self.begins_s, self.says_s = float("inf"), now_s + 60.0
            elif asked and now_s >= self.says_s:
                self.confirm(asked.id, "Ada")
            return super().answer(prompt_id)

    there = HandBench(
        operator=Slow(lambda person, _: setattr(person, "begins_s", there.clock.now_s() + 60.0)), within_s=200
    )
    assert there.run().state == "done"
    lasted = [0.0, 0.0, 0.0]
    for number, _, readings, _ in there.journal.blocks:
        lasted[number - 1] += len(readings) / 125
    before_s, turned_s, after_s = lasted
    assert before_s == pytest.approx(2.0 + 61.5, abs=2.0)
    assert turned_s == pytest.approx(360 / 180, abs=1.6)
    assert after_s == pytest.approx(60.0 - 4.0, abs=2.0)  # nothing is read on when a rest has been taken already
    assert sum(lasted) == pytest.approx(there.clock.now_s(), abs=1.0)


def test_an_abort_takes_effect_at_once_while_a_turn_is_waited_for() -> None:
    asked_s: list[float] = []

    def act(_: Person, __: Prompt) -> None:
        asked_s.append(there.clock.now_s())
        there.control.abort("enough")

    there = HandBench(operator=Person(act), within_s=3600.0)
    outcome = there.run()
    assert (outcome.state, outcome.reason) == ("aborted", "aborted: enough")
    assert there.clock.now_s() - asked_s[0] < 1.0
    assert [(state, reason) for _, state, reason in there.journal.closed] == [("partial", "enough")]
    assert there.operator.pending is None


def test_a_person_who_is_gone_ends_the_campaign_at_the_time_limit() -> None:
    there = HandBench(operator=Person(lambda _, __: None))
    outcome = there.run()
    assert outcome.state == "failed"
    assert outcome.reason.startswith(
        "no answer within 20 s to the request: turn the units by 360 deg counter-clockwise"
    )
    assert there.operator.pending is None


def test_a_person_who_says_no_ends_the_campaign() -> None:
    there = HandBench(operator=Person(lambda person, prompt: person.decline(prompt.id, "Ada", "no edge")))
    outcome = there.run()
    assert outcome.state == "failed"
    assert "Ada declined: turn the units by 360 deg" in outcome.reason


def test_movement_before_the_turn_is_told_before_anything_is_turned() -> None:
    there = HandBench(rest_s=5.0)
    world: Any = there.bench.simulation.world  # type: ignore[union-attr]
    there.journal.hooks.append(
        lambda what, detail: (
            world.turn_by_hand(there.clock.now_s(), "x", 30.0)
            if what == "dataset_opened" and len(there.journal.headers) == 1
            else None
        )
    )
    assert there.run().state == "done"
    [refused] = there.said("turn.refused")
    assert "the unit moved during the rest before the turn" in refused
    assert "keep the units at rest" in there.said("operator.asked")[2]
    assert [state for _, state, _ in there.journal.closed] == ["partial", "complete", "complete", "complete"]


def test_a_stream_that_breaks_is_opened_anew_and_the_turn_asked_again() -> None:
    there = HandBench()
    gyro: Any = there.bench.gyros["mems"]
    read, left = gyro.read, [1]

    def reading(duration_s: float) -> Any:
        if len(there.journal.headers) == 3 and left and left.pop():
            raise NoReply("mems", "silent")
        return read(duration_s)

    gyro.read = reading
    assert there.run().state == "done"
    assert [state for _, state, _ in there.journal.closed] == ["partial"] * 3 + ["complete"] * 3
    assert [result.outcome for result in there.journal.results()] == ["done", "done", "interrupted", "done", "done"]
