"""What an engine does when all goes well: order, times, gates, several units, pauses, progress."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.operator import HumanOperator
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import make_plan


def test_a_campaign_runs_through_and_every_step_is_marked_once(rig: Any) -> None:
    outcome = rig.run()
    assert (outcome.state, outcome.safe) == (CampaignState.DONE, True)
    count = len(rig.engine.plan.steps)
    started = [index for what, index, _ in rig.journal.steps if what == "started"]
    assert started == list(range(count))
    assert [result.outcome for result in rig.journal.results()] == ["done"] * count
    assert rig.journal.states == [("running", "started"), ("done", "all steps done")]
    rig.assert_safe()


def test_the_order_of_events_in_one_data_set(rig: Any) -> None:
    rig.run()
    first = rig.trace.index("table.spin")
    order = [entry for entry in rig.trace[first:] if not entry.startswith(("chamber.", "journal.environment"))]
    end = order.index("journal.step_ended")
    assert order[:5] == ["table.spin", "imu.read_latest", "imu.read_latest", "journal.dataset_opened", "imu.read"]
    assert order[5:7] == ["journal.readings", "imu.read"]
    assert order[end - 3 : end + 1] == [
        "journal.readings",
        "table.settle",
        "journal.dataset_closed",
        "journal.step_ended",
    ]


def test_a_person_is_asked_before_the_units_are_read_and_after_they_are_silent(rig: Any) -> None:
    rig.run()
    hands = [entry for entry in rig.trace if entry.startswith("hand.")]
    assert hands == ["hand.mount z", "hand.power True", "hand.power False", "hand.mount -z", "hand.power True"]
    assert rig.trace.index("hand.power True") < rig.trace.index("imu.start")
    assert rig.trace.index("imu.stop") < rig.trace.index("hand.power False")


def test_readings_are_inside_the_gate_in_campaign_time_and_complete(rig: Any) -> None:
    rig.run()
    for number, header in enumerate(rig.journal.headers, start=1):
        t_s = np.concatenate([readings.t_s for dataset, _, readings, _ in rig.journal.blocks if dataset == number])
        assert header.gate_from_s <= t_s[0]
        assert t_s[-1] < header.gate_until_s
        assert np.allclose(np.diff(t_s), 0.1)
        assert len(t_s) in {np.floor(10 * (header.gate_until_s - header.gate_from_s)) + extra for extra in (0, 1)}
    assert rig.journal.headers[0].gate_from_s < 1000  # the clock stood at 1000 s when the campaign began


def test_the_gate_lies_on_step_edges_and_the_recorded_rate_is_the_one_really_run(rig: Any) -> None:
    rig.run()
    header = next(header for header in rig.journal.headers if header.asked_dps == 20)
    assert header.rate_dps == 20 * (1 + 1e-5)
    gate_s = header.gate_until_s - header.gate_from_s
    steps = gate_s * header.rate_dps / 0.225
    assert steps == pytest.approx(round(steps), abs=1e-6)
    assert gate_s >= 10
    assert (header.angle_from_deg - 7.0) / 0.225 == pytest.approx(
        round((header.angle_from_deg - 7.0) / 0.225), abs=1e-6
    )


def test_whole_turns_are_whole_at_the_rate_that_is_really_run(rig: Any) -> None:
    acquire = {"duration_s": 10.0, "settle_s": 2.0, "whole_turns_above_dps": 15.0}
    plan = make_plan(rig.recipe(acquire=acquire), BenchLimits.of(rig))
    step = next(step for step in plan.steps if step.kind == "acquire" and step.rate_dps == 20)
    assert step.duration_s * 20 * (1 + 1e-5) == pytest.approx(360, rel=1e-12)


def test_the_environment_is_recorded_at_least_every_ten_seconds_while_powered(rig: Any) -> None:
    rig.run()
    powered = [sample for sample in rig.journal.samples if sample.run]
    t_s = np.array([sample.t_s for sample in powered])
    assert np.all(np.diff(t_s) > 0)
    assert np.diff(t_s).max() <= 10.0
    assert {sample.run for sample in powered} == {1, 2}
    assert all("imu" in sample.gyro_c for sample in powered)
    assert powered[-1].gyro_c["imu"] == pytest.approx(30, abs=0.02)


def test_a_soak_counts_only_time_in_the_band_and_says_what_it_held(rig: Any) -> None:
    rig.run()
    figures = [result.figures for result in rig.journal.results() if "held_s" in result.figures]
    assert len(figures) == 2
    assert all(120 <= each["held_s"] <= 131 and abs(each["drift_c.imu"]) < 0.2 for each in figures)


def test_several_units_are_read_in_the_same_data_set_without_a_gap(two_units: Any) -> None:
    rig = two_units
    outcome = rig.run()
    assert outcome.state == CampaignState.DONE
    for number, header in enumerate(rig.journal.headers, start=1):
        for name in ("imu", "fog"):
            blocks = [b.t_s for dataset, gyro, b, _ in rig.journal.blocks if (dataset, gyro) == (number, name)]
            t_s = np.concatenate(blocks)
            assert np.allclose(np.diff(t_s), 0.1)
            assert t_s[0] - header.gate_from_s < 0.1 + 1e-9
            assert header.gate_until_s - t_s[-1] <= 0.1 + 1e-9


def test_a_unit_without_a_thermometer_is_soaked_by_time_alone(rig: Any) -> None:
    rig.imu.channels = rig.imu.channels[:1]
    assert rig.run().state == CampaignState.DONE
    assert not any("drift_c.imu" in result.figures for result in rig.journal.results())


def test_a_pause_holds_between_data_sets_and_keeps_the_environment(rig: Any) -> None:
    rig.when_step("acquire", lambda: rig.control.pause("coffee"))
    began: list[float] = []

    def hook(what: str, detail: Any) -> None:
        if what == "state" and detail == CampaignState.PAUSED:
            began.append(rig.clock.now_s())
        if what == "environment" and began and rig.clock.now_s() > began[0] + 300:
            rig.control.resume("back")

    rig.journal.hooks.append(hook)
    outcome = rig.run()
    assert outcome.state == CampaignState.DONE
    states = [state for state, _ in rig.journal.states]
    assert states == ["running", "paused", "running", "done"]
    assert rig.journal.closed[0][1] == "complete"  # the data set that was being taken was finished first
    start_s = began[0] - 1000.25
    during = [sample for sample in rig.journal.samples if start_s <= sample.t_s <= start_s + 300]
    assert len(during) >= 30
    assert "soak_again" not in rig.journal.kinds()


def test_what_a_pause_lets_cool_down_is_soaked_again(rig: Any) -> None:
    paused: list[float] = []
    rig.chamber.disturbance_c = lambda t_s: -1.0 if paused and paused[0] + 60 < t_s < paused[0] + 120 else 0.0
    rig.when_step("acquire", rig.control.pause)

    def hook(what: str, detail: Any) -> None:
        if what == "state" and detail == CampaignState.PAUSED:
            paused.append(rig.clock.now_s())
        if what == "environment" and paused and rig.clock.now_s() > paused[0] + 300:
            rig.control.resume()

    rig.journal.hooks.append(hook)
    assert rig.run().state == CampaignState.DONE
    assert rig.journal.kinds().count("soak_again") == 1
    second = next(header for header in rig.journal.headers if header.step.dataset == 2)
    assert second.gate_from_s > paused[0] - 1000.25 + 300 + 120


def test_a_pause_during_a_soak_does_not_eat_its_time_out(rig: Any) -> None:
    rig.when_step("soak", rig.control.pause)
    until_s = [0.0]

    def hook(what: str, detail: Any) -> None:
        if what == "state" and detail == CampaignState.PAUSED:
            until_s[0] = rig.clock.now_s() + 2000
        if what == "environment" and until_s[0] and rig.clock.now_s() > until_s[0]:
            rig.control.resume()

    rig.journal.hooks.append(hook)
    assert rig.run().state == CampaignState.DONE  # the soak's own limit is 1000 s


def test_a_question_waits_for_its_answer_and_is_seen_from_outside(rig: Any) -> None:
    rig.operator = HumanOperator()
    seen: list[str] = []

    def answer_after_a_minute(progress: Any) -> None:
        prompt = rig.operator.pending
        if prompt and progress.prompt == prompt and prompt.id not in seen and progress.state == "waiting":
            seen.append(prompt.id)
        if prompt and prompt.id in seen and rig.clock.now_s() % 60 > 50:
            rig.operator.confirm(prompt.id, by="Ada")

    outcome = rig.run(observer=answer_after_a_minute)
    assert outcome.state == CampaignState.DONE
    assert len(set(seen)) == 5
    assert [state for state, _ in rig.journal.states].count("waiting") == 5
    said = [event.message for event in rig.journal.events if event.kind == "operator.mount"]
    assert len(said) == 2
    assert all("confirmed by Ada" in message for message in said)
    assert rig.engine.progress.prompt is None


def test_an_observer_that_fails_is_dropped_and_the_campaign_goes_on(rig: Any) -> None:
    def broken(progress: Any) -> None:
        raise RuntimeError("no page")

    assert rig.run(observer=broken).state == CampaignState.DONE
    assert "no page" in rig.engine.progress.last_error


def test_progress_rises_to_one_and_the_forecast_is_aware_and_close(rig: Any) -> None:
    fractions: list[float] = []
    forecasts: list[Any] = []

    def observe(progress: Any) -> None:
        fractions.append(progress.fraction)
        if progress.expected_end:
            forecasts.append(progress.expected_end)

    rig.run(observer=observe)
    assert fractions[-1] == 1.0
    assert fractions == sorted(fractions)
    assert forecasts[0].tzinfo is not None
    assert abs((forecasts[-1] - rig.clock.utc()).total_seconds()) < 1
    progress = rig.engine.progress
    assert (progress.state, progress.step, progress.steps) == ("done", progress.steps, len(rig.engine.plan.steps))


def test_a_campaign_can_be_resumed_in_the_middle(rig: Any) -> None:
    plan = rig.plan()
    acquires = [index for index, step in enumerate(plan.steps) if step.kind == "acquire"]
    outcome = rig.run(start_at=acquires[1])
    assert outcome.state == CampaignState.DONE
    assert [header.step.dataset for header in rig.journal.headers] == [2, 3, 4]
    before = rig.trace[: rig.trace.index("table.spin")]
    assert "table.home" in before
    assert "chamber.set_temperature_c" in before
    assert not any(entry.startswith("hand.") for entry in before)  # nobody turns or switches what stayed as it was
    soaking = [sample for sample in rig.journal.samples if sample.t_s < rig.journal.headers[0].gate_from_s]
    assert len(soaking) >= 12
    assert {sample.run for sample in soaking} == {0, 1}


def test_start_at_the_first_step_of_the_second_session_opens_no_stream_early(rig: Any) -> None:
    steps = rig.plan().steps
    second = [index for index, step in enumerate(steps) if step.kind == "power_on"][1]
    assert rig.run(start_at=second).state == CampaignState.DONE
    assert rig.trace.index("imu.start") > rig.trace.index("hand.power True")


def test_the_same_campaign_twice_is_the_same_to_the_last_bit(rig: Any) -> None:
    other = type(rig)()
    rig.run()
    other.run()
    for mine, theirs in zip(rig.journal.blocks, other.journal.blocks, strict=True):
        assert mine[:2] == theirs[:2]
        assert np.array_equal(mine[2].t_s, theirs[2].t_s)
    assert rig.journal.samples == other.journal.samples
