"""Every way out of a campaign ends in the safe state and says why."""

from __future__ import annotations

from typing import Any

import pytest

from instruments.errors import MalformedReply, NoReply, RequestRejected
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import BadData
from procedures.contracts.operator import Answer, HumanOperator

STEP_KINDS = ["home", "move_chamber", "mount", "power_on", "soak", "acquire", "power_off", "safe_state"]

#: (step kind, device, method): every call that a step makes to a device
CALLS = [
    ("home", "table", "identify"),
    ("home", "table", "home"),
    ("home", "chamber", "identify"),
    ("move_chamber", "chamber", "set_temperature_c"),
    ("move_chamber", "chamber", "read"),
    ("power_on", "imu", "identify"),
    ("power_on", "imu", "start"),
    ("soak", "chamber", "read"),
    ("soak", "imu", "read_latest"),
    ("acquire", "table", "spin"),
    ("acquire", "table", "settle"),
    ("acquire", "imu", "read"),
    ("acquire", "imu", "read_latest"),
    ("acquire", "chamber", "read"),
    ("power_off", "imu", "stop"),
]


def device(rig: Any, name: str) -> Any:
    return rig.gyros.get(name) or getattr(rig, name)


@pytest.mark.parametrize(("kind", "name", "method"), CALLS)
@pytest.mark.parametrize("error", [NoReply, RequestRejected])
def test_a_device_that_fails_for_good_ends_the_campaign_safely(
    rig: Any, kind: str, name: str, method: str, error: Any
) -> None:
    rig.when_step(kind, lambda: device(rig, name).fail(method, error(name, f"{method} failed")))
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert name in outcome.reason
    assert not rig.table.moving
    assert rig.chamber.setpoint_c == 25.0 or method == "set_temperature_c"
    assert rig.journal.states[-1] == ("failed", outcome.reason)
    failed = [result for result in rig.journal.results() if result.outcome == "failed"]
    assert len(failed) == 1
    assert name in failed[0].reason
    if (name, method) in {("imu", "read"), ("table", "settle")}:
        assert {state for _, state, _ in rig.journal.closed} == {"partial"}


@pytest.mark.parametrize("filter_hz", ["16", "262", None])
def test_a_unit_that_comes_back_set_otherwise_is_not_measured_on(rig: Any, filter_hz: str | None) -> None:
    """What was not saved in it is lost when it is switched off; what it does not say is not compared."""
    rig.configurations = {"imu": {"filter_hz": "262"}}
    rig.gyros["imu"].reported = {"serial": "N1", "firmware": "12"} | ({"filter_hz": filter_hz} if filter_hz else {})
    outcome = rig.run()
    if filter_hz != "16":
        assert outcome.state == CampaignState.DONE
        return
    assert outcome.state == CampaignState.FAILED
    assert "imu: the unit is set otherwise than before: filter_hz was 262 and is 16." in outcome.reason
    assert not rig.table.moving
    assert rig.journal.closed == []


@pytest.mark.parametrize(("kind", "name", "method"), CALLS)
def test_ctrl_c_anywhere_leaves_the_bench_safe(rig: Any, kind: str, name: str, method: str) -> None:
    rig.when_step(kind, lambda: device(rig, name).fail(method, KeyboardInterrupt(), times=1))
    with pytest.raises(KeyboardInterrupt):
        rig.run()
    rig.assert_safe()
    assert rig.journal.states[-1] == ("aborted", "interrupted (Ctrl-C or a signal)")
    assert rig.journal.results()[-1].outcome == "interrupted"


@pytest.mark.parametrize("kind", STEP_KINDS)
def test_abort_in_every_kind_of_step(rig: Any, kind: str) -> None:
    rig.when_step(kind, lambda: rig.control.abort("the lamp smokes"))
    outcome = rig.run()
    rig.assert_safe()
    if kind == "safe_state":
        assert outcome.state == CampaignState.DONE  # nothing was left to abort
        return
    assert outcome.state == CampaignState.ABORTED
    assert outcome.reason == "aborted: the lamp smokes"


@pytest.mark.parametrize(("ask", "state"), [("abort", "aborted"), ("interrupt", "interrupted")])
def test_a_step_that_fails_because_another_thread_stopped_its_table_is_ended_by_the_stop(
    rig: Any, ask: str, state: str
) -> None:
    def stopped_from_outside() -> None:
        getattr(rig.control, ask)("the lamp smokes")
        raise RequestRejected("table", "stands still")

    rig.table.faults["spin"] = stopped_from_outside
    outcome = rig.run()
    rig.assert_safe()
    assert outcome.state == state
    assert outcome.reason.startswith(f"{state}: the lamp smokes (the step then ended with: ")
    assert "stands still" in outcome.reason


def test_abort_inside_a_data_set_keeps_what_was_read_as_partial(rig: Any) -> None:
    def hook(what: str, detail: Any) -> None:
        if what == "readings" and len(rig.journal.blocks) == 4:
            rig.control.abort("enough")

    rig.journal.hooks.append(hook)
    outcome = rig.run()
    assert outcome.state == CampaignState.ABORTED
    assert rig.journal.closed == [(1, "partial", "enough")]
    assert sum(len(readings) for _, _, readings, _ in rig.journal.blocks) > 20
    assert len(rig.journal.blocks) == 4  # acted on within a second
    rig.assert_safe()


@pytest.mark.parametrize("what", ["step_started", "dataset_opened", "readings", "environment", "step_ended"])
def test_a_journal_that_cannot_write_stops_the_bench_and_is_heard(rig: Any, what: str) -> None:
    def full(entry: str, _detail: Any) -> None:
        if entry == what and rig.trace.count("table.spin") >= (entry in {"dataset_opened", "readings"}):
            raise OSError("disk full")

    rig.journal.hooks.append(full)
    with pytest.raises(OSError, match="disk full"):
        rig.run()
    rig.assert_safe()
    assert rig.journal.states[-1][0] == "failed"
    assert "disk full" in rig.journal.states[-1][1]


def test_a_journal_that_cannot_even_write_the_end_leaves_the_bench_safe(rig: Any) -> None:
    def full(entry: str, _detail: Any) -> None:
        if rig.trace.count("imu.read"):
            raise OSError("disk full")

    rig.journal.hooks.append(full)
    with pytest.raises(OSError, match="disk full"):
        rig.run()
    rig.assert_safe()


@pytest.mark.parametrize(
    ("name", "method", "words"),
    [("table", "stop", "table to rest"), ("chamber", "make_safe", "chamber to"), ("imu", "stop", "stream of imu")],
)
@pytest.mark.parametrize("ending", ["done", "aborted", "failed"])
def test_every_part_of_the_safe_state_is_tried_and_what_failed_is_said(
    rig: Any, name: str, method: str, words: str, ending: str
) -> None:
    def break_it() -> None:
        device(rig, name).fail(method, NoReply(name, "silent"))
        if ending == "aborted":
            rig.control.abort()
        elif ending == "failed":
            rig.table.fail("spin", RequestRejected("table", "no"))

    rig.when_step("safe_state" if ending == "done" else "acquire", break_it)
    outcome = rig.run()
    assert not outcome.safe
    assert outcome.state == (CampaignState.ABORTED if ending == "aborted" else CampaignState.FAILED)
    assert f"NOT confirmed safe: {words}" in outcome.reason
    assert "silent" in outcome.reason
    last = [rig.trace.index(call, len(rig.trace) - 20) for call in ("table.stop", "chamber.make_safe", "imu.stop")]
    assert last == sorted(last)
    assert any(event.kind == "safe_state" and event.level == "error" for event in rig.journal.events)


def test_all_that_is_not_confirmed_yet_is_named_while_it_is_tried_again(rig: Any) -> None:
    """Also what is tried before something that is confirmed."""

    def break_it() -> None:
        rig.table.fail("stop", NoReply("table", "silent"), times=2)
        rig.chamber.fail("make_safe", NoReply("chamber", "silent too"), times=2)
        rig.control.abort()

    texts: list[str] = []
    rig.when_step("acquire", break_it)
    outcome = rig.run(observer=lambda progress: texts.append(progress.step_text))
    assert outcome.safe
    both = [text for text in texts if text.startswith("stopping: table to rest: ") and "; chamber to its safe" in text]
    assert both
    assert not rig.control.hindrance


def test_a_chamber_that_reads_back_another_safe_set_point_is_not_safe(rig: Any) -> None:
    rig.when_step("safe_state", lambda: setattr(rig.chamber, "misread_c", 15.0))
    outcome = rig.run()
    assert not outcome.safe
    assert "40 deg C was read back instead of 25" in outcome.reason


def test_a_table_that_does_not_come_to_rest_is_not_safe(rig: Any) -> None:
    rig.when_step("safe_state", lambda: setattr(rig.table, "is_moving", lambda: True))
    outcome = rig.run()
    assert "the table still moves 30 s after it was stopped" in outcome.reason


def test_a_second_ctrl_c_during_the_safe_state_does_not_skip_it(rig: Any) -> None:
    rig.when_step("acquire", lambda: rig.table.fail("spin", KeyboardInterrupt(), times=1))
    rig.table.fail("stop", KeyboardInterrupt(), times=1)
    with pytest.raises(KeyboardInterrupt):
        rig.run()
    rig.assert_safe()
    assert rig.trace.count("table.stop") == 2


def test_a_mistake_in_the_program_is_raised_again_once_the_bench_is_safe(rig: Any) -> None:
    rig.when_step("acquire", lambda: rig.imu.fail("read", ZeroDivisionError("oops")))
    with pytest.raises(ZeroDivisionError):
        rig.run()
    rig.assert_safe()
    assert rig.journal.states[-1] == ("failed", "ZeroDivisionError: oops")


def test_a_chamber_that_is_silent_from_the_start_is_an_error_at_once(rig: Any) -> None:
    rig.chamber.fail("read", NoReply("chamber", "no answer"))
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert "chamber: no answer" in outcome.reason
    assert rig.trace.count("chamber.read") == 1


def test_a_soak_that_never_settles_fails_and_never_passes(rig: Any) -> None:
    rig.imu.temperature_c = lambda: 20 + rig.clock.now_s() / 100  # 0.6 deg C per window of 60 s
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert "did not settle within 1000 s" in outcome.reason
    assert "imu still changes by +0.60 deg C in 60 s, more than 0.2 deg C" in outcome.reason
    assert rig.journal.headers == []
    failed = rig.journal.results()[-1]
    assert failed.outcome == "failed"
    assert failed.figures["drift_c.imu"] == pytest.approx(0.6, abs=0.02)
    rig.assert_safe()


def test_leaving_the_band_starts_the_soak_again(rig: Any) -> None:
    began: list[float] = []
    rig.when_step("soak", lambda: began.append(rig.clock.now_s()))
    rig.chamber.disturbance_c = lambda t_s: 1.0 if began and began[0] + 80 < t_s < began[0] + 100 else 0.0
    assert rig.run().state == CampaignState.DONE
    first = next(result for result in rig.journal.results() if "held_s" in result.figures)
    assert first.figures["restarts"] == 1
    assert first.figures["took_s"] > 100 + 120


def test_a_chamber_that_does_not_arrive_fails_with_where_it_was(rig: Any) -> None:
    rig.chamber.disturbance_c = lambda t_s: -3.0
    soak = {"hold_s": 120.0, "move_timeout_s": 600.0, "drift_window_s": 60.0}
    outcome = rig.run(rig.recipe(soak=soak))
    assert outcome.state == CampaignState.FAILED
    assert "22.0 deg C after 6" in outcome.reason
    assert "limit 600 s" in outcome.reason


def test_a_set_point_that_is_not_taken_is_a_failure(rig: Any) -> None:
    rig.chamber.misread_c = 0.3
    outcome = rig.run()
    assert "set point 25.3 deg C was read back instead of 25 deg C" in outcome.reason


def test_a_short_silence_is_noted_and_forgiven(rig: Any) -> None:
    rig.when_step("soak", lambda: rig.imu.fail("read_latest", NoReply("imu", "nothing in 0.5 s"), times=2))
    assert rig.run().state == CampaignState.DONE
    assert rig.journal.kinds().count("link.degraded") == 1


@pytest.mark.parametrize("error", [NoReply("imu", "gone"), MalformedReply("imu", "noise"), BadData("imu", "odd")])
def test_a_data_set_whose_readings_failed_is_taken_once_more(rig: Any, error: Exception) -> None:
    rig.when_step("acquire", lambda: rig.imu.fail("read", error, times=1))
    assert rig.run().state == CampaignState.DONE
    assert [state for _, state, _ in rig.journal.closed] == ["partial", *["complete"] * 4]
    assert [header.step.dataset for header in rig.journal.headers] == [1, 1, 2, 3, 4]
    assert "data_set_repeated" in rig.journal.kinds()


def test_a_table_that_fails_is_not_tried_again(rig: Any) -> None:
    rig.when_step("acquire", lambda: rig.table.fail("settle", NoReply("table", "no `o`"), times=1))
    assert rig.run().state == CampaignState.FAILED
    assert rig.trace.count("table.spin") == 1


def test_a_unit_that_sends_nothing_is_bad_data(rig: Any) -> None:
    rig.when_step("acquire", lambda: setattr(rig.imu, "silent", True))
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert "imu: none of about 100 expected readings arrived" in outcome.reason


def test_a_steady_part_that_is_too_short_is_refused(rig: Any) -> None:
    rig.table.short_s = 5.0
    outcome = rig.run()
    assert "not for the 10 s of the data set" in outcome.reason
    assert rig.journal.headers == []


def test_a_person_who_declines_ends_the_campaign(rig: Any) -> None:
    rig.operator.answer = lambda prompt_id: Answer(prompt_id, confirmed=False, by="Bob", reason="the cube is hot")
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert "Bob declined" in outcome.reason
    assert "the cube is hot" in outcome.reason


def test_a_campaign_fails_when_a_prompt_times_out(rig: Any) -> None:
    rig.operator = HumanOperator()
    outcome = rig.run(rig.recipe(on_failure={"operator_timeout_s": 900}))
    assert outcome.state == CampaignState.FAILED
    assert "no answer within 900 s to the request: turn the units" in outcome.reason
    assert rig.operator.pending is None


def test_abort_while_a_question_waits(rig: Any) -> None:
    rig.operator = HumanOperator()

    def hook(what: str, detail: Any) -> None:
        if what == "state" and detail == CampaignState.WAITING:
            rig.control.abort("never mind")

    rig.journal.hooks.append(hook)
    assert rig.run().state == CampaignState.ABORTED
    assert rig.operator.pending is None


def test_a_signal_that_ends_the_process_is_an_abort(rig: Any) -> None:
    rig.when_step("soak", lambda: rig.chamber.fail("read", SystemExit(143), times=1))
    with pytest.raises(SystemExit):
        rig.run()
    rig.assert_safe()
    assert rig.journal.states[-1][0] == "aborted"
