"""Resuming an interrupted campaign: what comes first, what is done again, and what is not."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from instruments.errors import NoReply
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.operator import HumanOperator
from procedures.execution.resume import Restart, soak_matters_after_s
from procedures.execution.safe_state import PAUSES_S
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
        assert [header.run for header in each.journal.headers] == [1, 2, 2]  # the sessions of the plan, none added
    assert outcomes == [False, True]  # the chamber ramps 10 deg C/min through a band of +-0.5: 6 s


def resumed_after(rig: Any, gap_s: float, air_c: float = 30.0, **changes: Any) -> Any:
    """Resume at the second data set, with the air found somewhere, and at its set point 10 s later."""
    rig.chamber.make_safe = lambda: rig.chamber.safe_c
    at_temperature(rig)
    until_s = rig.clock.now_s() + 10.0
    rig.chamber.air_c = lambda: air_c if rig.clock.now_s() < until_s else 30.0
    rig.run(rig.recipe(**changes), start_at=at(rig, "acquire", 1), restart=Restart(gap_s=gap_s))
    return rig


@pytest.mark.parametrize(("gap_s", "soaks"), [(6.0, False), (6.01, True)])
def test_a_gap_matters_from_when_the_air_could_have_left_its_band_and_come_back(
    rig: Any, gap_s: float, soaks: bool
) -> None:
    assert soaked_again(resumed_after(rig, gap_s)) == soaks


@pytest.mark.parametrize(("air_c", "soaks"), [(30.5, False), (29.5, False), (30.51, True), (29.49, True)])
def test_air_at_the_edge_of_its_band_is_still_soaked(rig: Any, air_c: float, soaks: bool) -> None:
    assert soaked_again(resumed_after(rig, 1.0, air_c)) == soaks


def test_the_journal_says_what_was_done_before_the_first_step(rig: Any) -> None:
    resumed_after(rig, 1.0, 30.25)
    first = at(rig, "acquire", 1)
    kinds = {"safe_state", "lead_in", "soak_holds", "lead_in_done"}
    said = [event for event in rig.journal.events if event.kind in kinds]
    assert said[0].message == "setting the bench to its safe state before resuming"
    assert said[1].message == f"step repeated before step {first + 1}: home"
    holds = next(event for event in said if event.kind == "soak_holds")
    assert (holds.value, holds.limit, holds.unit) == (1.0, pytest.approx(6.0), "s")
    assert "1 s; the air was never more than 0.25 deg C from the set point" in holds.message
    assert said[-1].message == f"ready for step {first + 1}"


def rounds_s(rig: Any, failures: int) -> list[float]:
    """Let the chamber fail so often, and return a list that gets when each round of the safe state began, s."""
    rig.chamber.fail("make_safe", NoReply("chamber", "boots"), times=failures)
    fault, begun_s, called_s = rig.chamber.faults["make_safe"], rig.clock.now_s(), []

    def timed() -> None:
        called_s.append(rig.clock.now_s() - begun_s)
        fault()

    rig.chamber.faults["make_safe"] = timed
    return called_s


def test_the_pauses_between_rounds_of_the_safe_state_grow_to_half_a_minute(rig: Any) -> None:
    called_s = rounds_s(rig, failures=28)
    rig.run(rig.recipe(resume={"instruments_within_s": 1000.0}), at(rig, "acquire", 1), Restart(gap_s=5.0))
    in_a_round_s = sum(PAUSES_S)
    begun_s = called_s[:29:4]
    assert [later - earlier - in_a_round_s for earlier, later in pairwise(begun_s)] == [2, 4, 8, 16, 30, 30, 30]


@pytest.mark.parametrize(("within_s", "rounds"), [(42.0, 1), (42.01, 2), (86.0, 2), (86.01, 3)])
def test_instruments_are_waited_for_until_the_time_of_the_recipe_is_over(
    rig: Any, within_s: float, rounds: int
) -> None:
    """A round takes 42 s, the pause after the first one 2 s."""
    called_s = rounds_s(rig, failures=100)
    outcome = rig.run(rig.recipe(resume={"instruments_within_s": within_s}), at(rig, "acquire", 1), Restart(gap_s=5.0))
    assert outcome.state == CampaignState.FAILED
    assert rig.trace.count("table.home") == 0
    after_the_end = len(PAUSES_S) + 1  # the campaign that failed makes the bench safe once more
    assert len(called_s) == rounds * (len(PAUSES_S) + 1) + after_the_end
    assert "resumed, but the bench could not be made safe first: chamber to its safe set point" in outcome.reason


def test_a_pause_is_not_obeyed_before_the_bench_is_safe(rig: Any) -> None:
    called_s = rounds_s(rig, failures=4)
    rig.control.pause()
    paused_s: list[float] = []

    def hook(what: str, detail: Any) -> None:
        if what == "state" and detail == CampaignState.PAUSED:
            paused_s.append(rig.clock.now_s())
            rig.control.resume()

    rig.journal.hooks.append(hook)
    begun_s = rig.clock.now_s()
    rig.run(start_at=at(rig, "acquire", 1), restart=Restart(gap_s=5.0))
    assert called_s[:5] == [0.0, 2.0, 12.0, 42.0, 44.0]
    assert paused_s
    assert paused_s[0] - begun_s >= 44.0


def test_after_a_power_cut_the_unit_handler_switches_the_units_on_and_they_warm_up(rig: Any) -> None:
    times_s: dict[str, float] = {}
    rig.journal.hooks.append(lambda what, _detail: times_s.setdefault(what, rig.clock.now_s()))
    rig.table.faults["home"] = lambda: times_s.setdefault("home", rig.clock.now_s())
    restart = Restart(gap_s=1.0, power_lost=True, added_runs=1)
    rig.run(rig.recipe(warm_up_s=900.0), at(rig, "acquire", 1), restart)
    assert rig.trace.index("hand.power True") < rig.trace.index("imu.start")
    assert times_s["home"] - times_s["session_began"] >= 900.0


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
        assert each.journal.dropped == []  # a unit without power is no unit that failed
        assert ("units_off" in each.journal.kinds()) is silent
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


def test_a_chamber_that_does_not_answer_at_once_is_not_gone_on_with(rig: Any) -> None:
    """During a campaign a short silence is waited out; at its beginning it is an error."""
    rig.chamber.fail("read", NoReply("chamber", "silent"), times=1)
    outcome = rig.run(start_at=at(rig, "acquire", 1), restart=Restart(gap_s=5.0))
    assert outcome.state == CampaignState.FAILED
    assert "chamber: silent" in outcome.reason
    assert rig.trace.count("table.home") == 0


def test_of_two_units_one_that_is_silent_after_a_power_cut_is_asked_about_before_it_drops_out(two_units: Any) -> None:
    rig = two_units
    rig.operator = HumanOperator()

    def answer(progress: Any) -> None:
        if rig.operator.pending and progress.state == "waiting":
            rig.operator.confirm(rig.operator.pending.id, by="Ada")

    rig.imu.fail("identify", NoReply("imu", "off"), times=4)
    restart = Restart(power_lost=True, added_runs=1)
    outcome = rig.run(start_at=at(rig, "acquire", 1), restart=restart, observer=answer)
    assert outcome.state == CampaignState.DONE
    assert rig.journal.dropped == []
    assert "units_off" in rig.journal.kinds()


@pytest.mark.parametrize(("is_silent", "soaks"), [(False, False), (True, True)])
def test_air_that_no_poll_could_read_is_soaked(rig: Any, is_silent: bool, soaks: bool) -> None:
    """The chamber answers once, is silent at the polls after that, and answers again with the soak."""
    rig.chamber.make_safe = lambda: rig.chamber.safe_c
    at_temperature(rig)
    reads = 0

    def settled() -> bool:
        return any(event.kind in {"soak_holds", "lead_in_done"} for event in rig.journal.events) or soaked_again(rig)

    def silent() -> None:
        nonlocal reads
        reads += 1
        if is_silent and reads > 1 and not settled():
            raise NoReply("chamber", "silent")

    rig.chamber.faults["read"] = silent
    rig.run(start_at=at(rig, "acquire", 1), restart=Restart(gap_s=1.0))
    assert soaked_again(rig) == soaks
