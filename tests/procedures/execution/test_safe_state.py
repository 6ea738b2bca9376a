"""The safe state: what is tried, how often and when, and what is said of what could not be confirmed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from instruments.clock import VirtualClock
from instruments.errors import NoReply
from procedures.execution.safe_state import PAUSES_S, STANDSTILL_TIMEOUT_S, TABLE, make_safe, stop_table

CHAMBER, STREAM = "chamber to its safe set point", "stream of imu closed"


@pytest.fixture
def begun_s(rig: Any) -> float:
    rig.chamber.setpoint_c = 60.0
    rig.table.moving = rig.imu.started = True
    return float(rig.clock.now_s())


@pytest.fixture
def notes() -> list[tuple[str, str]]:
    return []


def noting(notes: list[tuple[str, str]]) -> Callable[[str, str], None]:
    return lambda what, complaint: notes.append((what, complaint))


def times_of(rig: Any, device: Any, method: str, error: BaseException, times: int = 10**9) -> list[float]:
    """Let a method fail, and return a list that gets the time of each call."""
    device.fail(method, error, times)
    fault, called_s = device.faults[method], []

    def timed() -> None:
        called_s.append(rig.clock.now_s())
        fault()

    device.faults[method] = timed
    return called_s


def test_every_part_is_made_safe_at_once_and_noted(rig: Any, begun_s: float, notes: list[tuple[str, str]]) -> None:
    assert make_safe(rig, rig.clock, note=noting(notes)) == ()
    rig.assert_safe()
    assert notes == [(TABLE, ""), (CHAMBER, ""), (STREAM, "")]
    assert rig.clock.now_s() == begun_s  # what is confirmed is not waited for


def test_what_fails_is_tried_again_after_2_and_10_and_30_seconds(rig: Any, begun_s: float) -> None:
    called_s = times_of(rig, rig.table, "stop", NoReply("table", "no answer"))
    slept_s: list[float] = []
    sleep = rig.clock.sleep
    rig.clock.sleep = lambda duration_s: (slept_s.append(duration_s), sleep(duration_s))
    complaints = make_safe(rig, rig.clock)
    assert [t_s - begun_s for t_s in called_s] == [0.0, 2.0, 12.0, 42.0]
    assert slept_s == [0.0, *PAUSES_S]  # a real clock refuses a negative time
    assert PAUSES_S == (2.0, 10.0, 30.0)
    assert len(complaints) == 1
    assert complaints[0].startswith(f"{TABLE}: table: no answer")


@pytest.mark.parametrize("failures", [1, 2, 3])
def test_a_link_that_comes_back_confirms_the_safe_state(
    rig: Any, begun_s: float, notes: list[tuple[str, str]], failures: int
) -> None:
    rig.chamber.fail("make_safe", NoReply("chamber", "no answer"), times=failures)
    assert make_safe(rig, rig.clock, note=noting(notes)) == ()
    rig.assert_safe()
    assert [what for what, _ in notes] == [TABLE, CHAMBER, STREAM, *[CHAMBER] * failures]
    assert [bool(complaint) for what, complaint in notes if what == CHAMBER] == [True] * failures + [False]
    assert rig.clock.now_s() == begun_s + sum(PAUSES_S[:failures])


def test_a_part_that_is_confirmed_is_not_tried_again(rig: Any, begun_s: float) -> None:
    rig.imu.fail("stop", NoReply("imu", "no answer"))
    make_safe(rig, rig.clock)
    assert (rig.trace.count("table.stop"), rig.trace.count("imu.stop")) == (1, 4)


def test_a_note_says_the_complaint_without_the_name_of_the_part(
    rig: Any, begun_s: float, notes: list[tuple[str, str]]
) -> None:
    rig.imu.fail("stop", ValueError())
    assert make_safe(rig, rig.clock, (), noting(notes)) == (f"{STREAM}: ValueError",)  # an error without words
    assert notes[-1] == (STREAM, "ValueError")


def test_a_bench_without_table_or_chamber_has_a_table_at_rest(rig: Any, notes: list[tuple[str, str]]) -> None:
    rig.table = rig.chamber = None
    rig.imu.started = True
    assert make_safe(rig, rig.clock, note=noting(notes)) == ()
    assert notes == [(TABLE, ""), (STREAM, "")]
    assert not rig.imu.started


def test_an_interrupt_makes_a_part_be_tried_once_more_at_once(rig: Any, begun_s: float) -> None:
    rig.table.fail("stop", KeyboardInterrupt(), times=1)
    assert make_safe(rig, rig.clock, ()) == ()
    assert rig.clock.now_s() == begun_s
    rig.assert_safe()


def test_two_interrupts_leave_a_part_unconfirmed_and_the_others_safe(rig: Any, begun_s: float) -> None:
    called_s = times_of(rig, rig.table, "stop", KeyboardInterrupt(), times=2)
    assert make_safe(rig, rig.clock, ()) == (f"{TABLE}: interrupted twice",)
    assert len(called_s) == 2
    assert rig.chamber.setpoint_c == rig.chamber.safe_c
    assert not rig.imu.started


def test_an_interrupt_of_a_pause_only_brings_the_next_try_forward(rig: Any, begun_s: float) -> None:
    class Impatient(VirtualClock):
        def sleep(self, duration_s: float) -> None:
            if duration_s:
                raise KeyboardInterrupt

    rig.imu.fail("stop", NoReply("imu", "no answer"), times=1)
    assert make_safe(rig, Impatient()) == ()
    assert rig.trace.count("imu.stop") == 2


def test_a_table_is_polled_each_second_until_it_stands(rig: Any) -> None:
    begun_s, asked_s = rig.clock.now_s(), []

    def moving() -> bool:
        asked_s.append(rig.clock.now_s() - begun_s)
        return len(asked_s) < 4

    rig.table.is_moving = moving
    assert stop_table(rig.table, rig.clock) is None
    assert asked_s == [0.0, 1.0, 2.0, 3.0]


def test_a_table_that_stands_at_the_end_of_the_time_is_confirmed(rig: Any) -> None:
    until_s = rig.clock.now_s() + STANDSTILL_TIMEOUT_S
    rig.table.is_moving = lambda: rig.clock.now_s() < until_s
    assert stop_table(rig.table, rig.clock) is None
    assert rig.clock.now_s() == until_s


def test_a_table_that_moves_30_s_after_its_stop_has_to_be_switched_off(rig: Any) -> None:
    begun_s = rig.clock.now_s()
    rig.table.is_moving = lambda: True
    complaint = stop_table(rig.table, rig.clock)
    assert complaint == "the table still moves 30 s after it was stopped; switch the power of the table off"
    assert rig.clock.now_s() == begun_s + 30.0
    assert make_safe(rig, rig.clock, ()) == (f"{TABLE}: {complaint}",)


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize(("resolutions", "is_safe"), [(1.0, True), (1.001, False)])
def test_a_set_point_counts_as_safe_within_the_resolution_of_the_chamber(
    rig: Any, sign: int, resolutions: float, is_safe: bool
) -> None:
    rig.chamber.safe_c = 0.0  # so that the offset below is exact
    rig.chamber.misread_c = sign * resolutions * rig.chamber.limits.resolution_c
    read_c = rig.chamber.misread_c
    said = f"{CHAMBER}: set point {read_c:g} deg C was read back instead of 0 deg C; set it at the panel of the chamber"
    assert make_safe(rig, rig.clock, ()) == (() if is_safe else (said,))


def test_a_set_point_of_the_other_sign_is_not_safe(rig: Any) -> None:
    rig.chamber.misread_c = -2 * rig.chamber.safe_c
    assert "set point -25 deg C was read back instead of 25 deg C" in "".join(make_safe(rig, rig.clock, ()))
