"""What others change at the chamber is seen within one poll, and the rule of the recipe decides what follows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.operator import HumanOperator
from procedures.execution.context import POLL_S
from procedures.recipe.rules import GuardRules

SEEN = "guard.foreign_change"


def changed_in(rig: Any, kind: str, back_after_s: float | None = None) -> list[float]:
    """Let a person set 7 K more at the panel once a step of a kind, or "readings", has begun, and perhaps back."""
    when: list[float] = []

    def act() -> None:
        when.append(rig.clock.now_s())
        rig.chamber.at_the_panel(rig.chamber.given_c + 7.0)

    def hook(what: str, _detail: Any) -> None:
        if what == "dataset_opened" and kind == "readings" and not when:
            act()
        if when and back_after_s is not None and rig.clock.now_s() > when[0] + back_after_s:
            rig.chamber.at_the_panel(rig.chamber.given_c)

    rig.when_step(kind, act)
    rig.journal.hooks.append(hook)
    return when


@pytest.mark.parametrize("kind", ["soak", "acquire", "readings"])
def test_it_is_an_event_within_one_poll_and_what_was_under_it_is_done_again(rig: Any, kind: str) -> None:
    when, seen = changed_in(rig, kind, back_after_s=100.0), []
    rig.journal.hooks.append(
        lambda what, event: seen.append(rig.clock.now_s()) if what == "event" and event.kind == SEEN else None
    )
    outcome = rig.run(rig.recipe(acquire={"duration_s": 20.0}))
    assert outcome.state == CampaignState.DONE
    assert seen[0] - when[0] <= POLL_S + 1.0
    event = next(event for event in rig.journal.events if event.kind == SEEN)
    assert "chamber: changed by others (the set point is 37 deg C, labctl gave 30 deg C)" in event.message
    assert [state for state, _ in rig.journal.states][:3] == ["running", "paused", "running"]
    assert rig.journal.headers[-1].step.dataset == 4
    assert [state for _, state, _ in rig.journal.closed].count("complete") == 4
    assert ("partial" in [state for _, state, _ in rig.journal.closed]) == (kind == "readings")


def test_a_change_just_before_a_data_set_ends_is_seen_before_it_counts_as_complete(rig: Any) -> None:
    when: list[float] = []

    def act() -> None:
        context, headers = rig.engine._context, rig.journal.headers
        if not when and headers and context.recorder.t_s() > headers[-1].gate_until_s - 2.0:
            when.append(rig.clock.now_s())
            rig.chamber.at_the_panel(rig.chamber.given_c + 7.0)

    def put_back(_what: str, _detail: Any) -> None:
        if when and rig.clock.now_s() > when[0] + 100.0:
            rig.chamber.at_the_panel(rig.chamber.given_c)

    rig.imu.faults["read"] = act
    rig.journal.hooks.append(put_back)
    assert rig.run(rig.recipe(acquire={"duration_s": 5.0})).state == CampaignState.DONE
    assert [header.step.dataset for header in rig.journal.headers] == [1, 1, 2, 3, 4]
    assert [state for _, state, _ in rig.journal.closed] == ["partial", *["complete"] * 4]
    assert "changed by others" in rig.journal.closed[0][2]


def test_nobody_who_puts_it_back_ends_the_campaign_in_time(rig: Any) -> None:
    changed_in(rig, "soak")
    outcome = rig.run(rig.recipe(guards={"suspend_timeout_s": 600.0}))
    assert outcome.state == CampaignState.FAILED
    assert "suspended for 600 s, the limit of the recipe, because: chamber: changed by others" in outcome.reason
    rig.assert_safe()


def test_it_is_taken_back_where_the_recipe_says_so(rig: Any) -> None:
    changed_in(rig, "acquire")
    rules = {"actions": {"foreign_change": "take_back"}}
    assert rig.run(rig.recipe(guards=rules, acquire={"duration_s": 20.0})).state == CampaignState.DONE
    assert (
        next(event for event in rig.journal.events if event.kind == "taken_back").message
        == "chamber: set point 30 deg C was given again"
    )
    assert "soak_again" in rig.journal.kinds()
    assert [state for _, state, _ in rig.journal.closed].count("complete") == 4


@pytest.mark.parametrize(
    ("action", "state"),
    [("take_back", CampaignState.DONE), ("suspend", CampaignState.FAILED), ("fail", CampaignState.FAILED)],
)
def test_a_chamber_that_is_switched_off_in_a_soak_is_seen_within_one_poll(
    rig: Any, action: str, state: CampaignState
) -> None:
    off_s: list[float] = []

    def switch_off() -> None:
        if not off_s:
            rig.chamber.runs = False
            off_s.append(rig.clock.now_s())

    seen = []
    rig.when_step("soak", switch_off)
    rig.journal.hooks.append(
        lambda what, event: seen.append(rig.clock.now_s()) if what == "event" and event.kind == SEEN else None
    )
    rules = {"actions": {"foreign_change": action}, "suspend_timeout_s": 600.0}
    assert rig.run(rig.recipe(guards=rules, acquire={"duration_s": 20.0})).state == state
    assert 0 <= seen[0] - off_s[0] <= POLL_S + 1.0
    event = next(event for event in rig.journal.events if event.kind == SEEN)
    assert "chamber: changed by others (event output 1 is off)" in event.message
    assert ("taken_back" in rig.journal.kinds()) == (action == "take_back")


def test_a_profile_of_somebody_cannot_be_taken_back(rig: Any) -> None:
    rig.when_step("acquire", lambda: setattr(rig.chamber, "hindrance", "a profile is running"))
    outcome = rig.run(rig.recipe(guards={"actions": {"foreign_change": "take_back"}}))
    assert outcome.state == CampaignState.FAILED
    assert "the set point 30 deg C cannot be taken back: chamber: a profile is running" in outcome.reason


@pytest.mark.parametrize("rule", ["take_back", "suspend"])
def test_air_that_follows_it_within_one_poll_is_no_fault_of_the_chamber(rig: Any, rule: str) -> None:
    """A fast chamber has left its set point by more than its limit when the change is seen."""
    rig.chamber.limits = replace(rig.chamber.limits, ramp_c_per_min=600.0)
    changed_in(rig, "readings", back_after_s=100.0 if rule == "suspend" else None)
    rules = {"actions": {"foreign_change": rule}, "chamber_deviation_c": 2.0}
    assert rig.run(rig.recipe(guards=rules, acquire={"duration_s": 20.0})).state == CampaignState.DONE
    assert SEEN in rig.journal.kinds()
    assert "guard.chamber_deviation" not in rig.journal.kinds()


@pytest.mark.parametrize(("action", "state"), [("warn", CampaignState.DONE), ("fail", CampaignState.FAILED)])
def test_the_rule_of_the_recipe_decides(rig: Any, action: str, state: CampaignState) -> None:
    changed_in(rig, "soak", back_after_s=100.0)
    assert rig.run(rig.recipe(guards={"actions": {"foreign_change": action}})).state == state
    assert SEEN in rig.journal.kinds()


def test_what_a_person_does_who_was_asked_to_is_no_foreign_change(rig: Any) -> None:
    """A person who mounts a unit may switch something at the chamber; it is as it was when they have answered."""
    rig.operator = HumanOperator()
    polled: list[float] = []

    def answer(progress: Any) -> None:
        prompt = rig.operator.pending
        if prompt is None or progress.state != "waiting":
            return
        if rig.chamber.given_c is not None and rig.chamber.setpoint_c == rig.chamber.given_c:
            rig.chamber.at_the_panel(rig.chamber.given_c + 2.0)
        elif len(polled) < 50 and prompt.position == "-z":
            polled.append(rig.clock.now_s())
        else:
            if rig.chamber.given_c is not None:
                rig.chamber.at_the_panel(rig.chamber.given_c)
            rig.operator.confirm(prompt.id, by="Ada")

    assert rig.run(observer=answer).state == CampaignState.DONE
    assert len(polled) == 50
    assert SEEN not in rig.journal.kinds()


def test_only_a_foreign_change_can_be_taken_back() -> None:
    with pytest.raises(ValueError, match=r'actions: stale = "take_back": only foreign_change can be taken back; give'):
        GuardRules(actions={"stale": "take_back"})
