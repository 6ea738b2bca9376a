"""Units that drop out while others continue, wires that are repaired, questions that are put again or left out."""

from __future__ import annotations

from typing import Any

import pytest

from instruments.errors import LinkError, NoReply
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.operator import HumanOperator


def gyros_of(rig: Any) -> list[tuple[int, tuple[str, ...]]]:
    return [(header.step.dataset, header.gyros) for header in rig.journal.headers]


def test_a_unit_whose_readings_fail_drops_out_and_the_others_go_on(two_units: Any) -> None:
    rig = two_units
    rig.when_step("acquire", lambda: rig.gyros["fog"].fail("read", NoReply("fog", "gone")))
    outcome = rig.run()
    assert outcome.state == CampaignState.DONE
    assert "fog was excluded (fog: gone)" in outcome.reason
    assert rig.journal.dropped == [("fog", "fog: gone")]
    both, one = ("imu", "fog"), ("imu",)
    assert gyros_of(rig) == [(1, both), (1, both), (1, one), (2, one), (3, one), (4, one)]
    assert [state for _, state, _ in rig.journal.closed] == ["partial", "partial", *["complete"] * 4]
    assert rig.engine.progress.dropped == {"fog": "fog: gone"}
    rig.assert_safe()


def test_a_unit_that_is_silent_in_a_soak_drops_out(two_units: Any) -> None:
    rig = two_units
    rig.when_step("soak", lambda: rig.gyros["fog"].fail("read_latest", NoReply("fog", "gone")))
    assert rig.run().state == CampaignState.DONE
    assert [name for name, _ in rig.journal.dropped] == ["fog"]
    assert "no answer" in rig.journal.dropped[0][1]
    lost = [event.kind for event in rig.journal.events if event.device == "fog"]
    assert lost[:3] == ["link.degraded", "link.lost", "guard.stale"]


def test_a_unit_that_never_starts_drops_out(two_units: Any) -> None:
    rig = two_units
    rig.gyros["fog"].fail("identify", NoReply("fog", "dead"))
    assert rig.run().state == CampaignState.DONE
    assert rig.journal.dropped == [("fog", "fog: dead")]
    assert rig.trace.count("fog.identify") == 4  # a unit may take a while to start up


def test_the_last_unit_ends_the_campaign(two_units: Any) -> None:
    rig = two_units
    for name, gyro in rig.gyros.items():
        gyro.fail("read_latest", NoReply(name, "gone"))
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert len(rig.journal.dropped) == 1
    rig.assert_safe()


def test_a_stream_that_broke_is_opened_again(rig: Any) -> None:
    began: list[int] = []

    def breaks() -> None:
        began.append(rig.trace.count("imu.start"))
        rig.imu.fail("read_latest", LinkError("imu", "unplugged"), times=1)

    rig.when_step("soak", breaks)
    assert rig.run().state == CampaignState.DONE
    first = rig.trace.index("journal.event", rig.trace.index("imu.read_latest"))
    assert "imu.start" in rig.trace[first : first + 12]
    assert "link.well" in rig.journal.kinds()
    assert rig.engine.progress.links == {}


@pytest.mark.parametrize(("kind", "method"), [("acquire", "spin"), ("home", "home"), ("acquire", "settle")])
def test_a_table_whose_port_came_back_is_stopped_homed_and_the_step_begun_again(
    rig: Any, kind: str, method: str
) -> None:
    rig.when_step(kind, lambda: rig.table.fail(method, LinkError("table", "unplugged"), times=1))
    homed = rig.trace.count("table.home")
    assert rig.run().state == CampaignState.DONE
    assert rig.trace.count("table.home") > homed + 1
    assert [state for _, state, _ in rig.journal.closed].count("complete") == 4
    links = [event.kind for event in rig.journal.events if event.kind.startswith("link.")]
    assert links == ["link.degraded", "link.well"]


def test_a_table_that_stays_away_is_lost_after_bounded_tries(rig: Any) -> None:
    rig.when_step("acquire", lambda: [rig.table.fail(m, LinkError("table", "gone")) for m in ("spin", "stop", "home")])
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert outcome.reason.startswith("table: gone. NOT confirmed safe: table to rest: table: gone")
    assert rig.trace.count("table.spin") == 1
    assert "link.lost" in rig.journal.kinds()
    assert [result.outcome for result in rig.journal.results()][-1] == "failed"


def test_a_chamber_that_answers_late_is_asked_again_and_not_for_ever(rig: Any) -> None:
    rig.when_step("move_chamber", lambda: rig.chamber.fail("set_temperature_c", NoReply("chamber", "busy"), times=1))
    assert rig.run().state == CampaignState.DONE
    other = type(rig)()
    other.when_step("move_chamber", lambda: other.chamber.fail("set_temperature_c", NoReply("chamber", "busy")))
    assert other.run().state == CampaignState.FAILED
    assert other.trace.count("chamber.set_temperature_c") <= 3 + 2 * 4  # three attempts, and the safe state's rounds


def never(rig: Any, **rules: Any) -> Any:
    rig.operator = HumanOperator()
    return rig.recipe(on_failure={"operator_timeout_s": 900, **rules})


def test_a_question_is_put_again_while_it_is_open(rig: Any) -> None:
    rig.run(never(rig, operator_remind_s=300))
    reminded = [event for event in rig.journal.events if event.kind == "operator.reminded"]
    assert len(reminded) == 2
    assert "open since 300 s" in reminded[0].message
    asked = [event for event in rig.journal.events if event.kind == "operator.asked"]
    assert "[question " in asked[0].message


def test_a_mounting_that_nobody_does_is_left_out_where_the_recipe_says_so(rig: Any) -> None:
    recipe = never(rig, operator_timeout="skip")

    def answer(progress: Any) -> None:
        prompt = rig.operator.pending
        if prompt and progress.state == "waiting" and prompt.position != "-z":
            rig.operator.confirm(prompt.id, by="Ada")

    outcome = rig.run(recipe, observer=answer)
    assert outcome.state == CampaignState.DONE
    assert "left out because the units were not turned" in outcome.reason
    assert [header.step.position for header in rig.journal.headers] == ["z", "z"]
    steps = rig.engine.plan.steps
    outcomes = [result.outcome for result in rig.journal.results()]
    assert outcomes[-1] == "done"  # the safe state is never left out
    assert outcomes.count("skipped") == 6
    assert outcomes.count("interrupted") == 1  # the question itself
    assert len(outcomes) == len(steps) + 1


def test_a_soak_that_does_not_settle_suspends_where_the_recipe_says_so_and_not_for_ever(rig: Any) -> None:
    rig.imu.temperature_c = lambda: 20 + rig.clock.now_s() / 100
    outcome = rig.run(rig.recipe(guards={"actions": {"soak": "suspend"}, "max_suspensions": 2}))
    assert outcome.state == CampaignState.FAILED
    assert rig.journal.kinds().count("guard.soak") == 3
    event = next(event for event in rig.journal.events if event.kind == "guard.soak")
    assert (event.limit, event.unit, event.device) == (1000.0, "s", "chamber")
