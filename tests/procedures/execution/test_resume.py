"""Resuming an interrupted campaign: what comes first, what is done again, and what is not."""

from __future__ import annotations

from typing import Any

import pytest

from instruments.errors import NoReply
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.operator import HumanOperator
from procedures.execution.resume import Restart, soak_matters_after_s
from procedures.recipe.rules import ResumeRules


def at(rig: Any, kind: str, number: int = 0) -> int:
    return [index for index, step in enumerate(rig.plan().steps) if step.kind == kind][number]


def at_temperature(rig: Any, temperature_c: float = 30.0) -> None:
    """The chamber kept its set point while no process ran."""
    rig.chamber.from_c = rig.chamber.setpoint_c = temperature_c


def soaked_again(rig: Any) -> bool:
    return any(event.kind == "lead_in" and event.message.endswith("soak") for event in rig.journal.events)


def test_the_safe_state_comes_before_anything_else(rig: Any) -> None:
    rig.table.moving = True
    rig.run(start_at=at(rig, "acquire", 1), restart=Restart(gap_s=5.0))
    devices = [entry for entry in rig.trace if not entry.startswith(("journal.", "hand."))]
    assert devices[:4] == ["table.stop", "chamber.make_safe", "chamber.set_temperature_c", "imu.stop"]
    assert rig.trace.index("table.stop") < rig.trace.index("table.home") < rig.trace.index("table.spin")


def test_a_bench_that_cannot_be_made_safe_is_not_driven(rig: Any) -> None:
    rig.table.fail("stop", NoReply("table", "silent"))
    outcome = rig.run(start_at=at(rig, "acquire", 1), restart=Restart(gap_s=5.0))
    assert outcome.state == CampaignState.FAILED
    assert "could not be made safe first: table to rest: table: silent" in outcome.reason
    assert rig.trace.count("table.spin") == rig.trace.count("table.home") == 0
    assert rig.engine.complaints


def test_instruments_that_start_up_after_a_power_cut_are_waited_for(rig: Any) -> None:
    rig.chamber.fail("make_safe", NoReply("chamber", "boots"), times=6)
    outcome = rig.run(start_at=at(rig, "acquire", 1), restart=Restart(gap_s=5.0))
    assert outcome.state == CampaignState.DONE


def test_a_short_gap_needs_no_soak_and_a_long_one_does(rig: Any) -> None:
    outcomes = []
    for gap_s in (3.0, 60.0):
        each = type(rig)()
        each.chamber.make_safe = lambda each=each: each.chamber.safe_c  # the air has no time to follow
        at_temperature(each)
        each.run(start_at=at(each, "acquire", 1), restart=Restart(gap_s=gap_s))
        outcomes.append(soaked_again(each))
        assert [header.step.dataset for header in each.journal.headers] == [2, 3, 4]
    assert outcomes == [False, True]  # the chamber ramps 10 deg C/min through a band of +-0.5: 6 s


def test_air_that_is_found_off_its_temperature_is_soaked_however_short_the_gap(rig: Any) -> None:
    rig.run(start_at=at(rig, "acquire", 1), restart=Restart(gap_s=1.0))
    assert soaked_again(rig)


def test_the_recipe_says_when_a_gap_matters() -> None:
    assert soak_matters_after_s(ResumeRules(), band_c=0.5, ramp_c_per_min=1.5) == pytest.approx(40.0)
    assert soak_matters_after_s(ResumeRules(soak_again_after_s=7.0), band_c=0.5, ramp_c_per_min=1.5) == 7.0


def test_after_a_power_cut_a_new_session_is_recorded_and_everything_is_soaked(rig: Any) -> None:
    at_temperature(rig)
    rig.chamber.make_safe = lambda: rig.chamber.safe_c
    restart = Restart(gap_s=1.0, power_lost=True, added_runs=1)
    outcome = rig.run(start_at=at(rig, "acquire", 1), restart=restart)
    assert outcome.state == CampaignState.DONE
    assert soaked_again(rig)
    assert [header.run for header in rig.journal.headers] == [2, 3, 3]  # the plan's 1, 2, 2 and one more
    assert rig.journal.sessions == [2, 3]
    assert {sample.run for sample in rig.journal.samples} == {0, 2, 3}


def test_after_a_power_cut_a_person_is_asked_only_when_a_unit_stays_silent(rig: Any) -> None:
    for silent in (False, True):
        each = type(rig)()
        each.operator = HumanOperator()
        asked: list[str] = []

        def answer(progress: Any, each: Any = each, asked: list[str] = asked) -> None:
            if each.operator.pending and progress.state == "waiting":
                asked.append(each.operator.pending.text)
                each.operator.confirm(each.operator.pending.id, by="Ada")

        if silent:
            each.imu.fail("identify", NoReply("imu", "off"), times=4)
        restart = Restart(power_lost=True, added_runs=1)
        assert each.run(start_at=at(each, "acquire", 3), restart=restart, observer=answer).state == CampaignState.DONE
        assert bool(asked) is silent
        assert not asked or "the power failed" in asked[0]


def test_nothing_is_warmed_up_when_only_the_end_is_left(rig: Any) -> None:
    steps = rig.plan().steps
    outcome = rig.run(start_at=len(steps), restart=Restart(gap_s=1e6))
    assert outcome.state == CampaignState.DONE
    assert rig.trace.count("table.home") == rig.trace.count("imu.start") == rig.trace.count("table.spin") == 0
    rig.assert_safe()


def test_a_unit_that_dropped_out_stays_out(two_units: Any) -> None:
    rig = two_units
    rig.run(start_at=at(rig, "acquire", 1), restart=Restart(dropped={"fog": "smoke"}))
    assert all(header.gyros == ("imu",) for header in rig.journal.headers)
    assert rig.trace.count("fog.start") == 0


def test_no_temperature_is_taken_before_a_step_that_sets_another(rig: Any) -> None:
    plan = rig.plan()
    move = at(rig, "move_chamber", 2)
    assert [step.kind for step in plan.lead_in(move)] == ["home"]
    assert plan.lead_in(len(plan.steps)) == ()
    assert plan.lead_in(len(plan.steps) - 1) == ()
