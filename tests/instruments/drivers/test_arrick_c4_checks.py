"""The C4 on the first day: commands before the first motion, a table left turning, a slow step clock, missed steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.errors import NoReply, RequestRejected, WrongInstrument
from procedures.contracts.journal import ClockRun
from procedures.monitoring.step_clock import measured
from procedures.planning.clock_runs import run_lengths_s

Make = Callable[..., Any]
URL = "sim://arrick"
CHECKED = {"clock_run_s": 60.0, "check_home": True}


def simulated(stand: Any) -> Any:
    return stand.bench.simulation.device(URL)._device


def true_rate_dps(stand: Any, spin: Any) -> float:
    """Return what the simulated table really does between two instants of its steady part."""
    times = np.array([spin.steady_from_s + 0.5, spin.steady_until_s - 0.5])
    angles = stand.world.table.commanded_deg(times)
    return float((angles[1] - angles[0]) / (times[1] - times[0]))


def waiting(stand: Any) -> Callable[[float], None]:
    sleep: Callable[[float], None] = stand.clock.sleep
    return sleep


def runs_of(table: Any, s: Any, *lengths_s: float) -> list[ClockRun]:
    timed = [table.time_run(90.0, steady_s, waiting(s)) for steady_s in lengths_s]
    return [ClockRun(1, 1, run.began_s, run.nominal_s, run.duration_s, run.step_hz) for run in timed]


@pytest.mark.parametrize("ratio", [1.0, 10 / 11, 1.00005, 0.9993])
def test_the_true_step_rate_is_measured_and_used(stand: Make, ratio: float) -> None:
    s = stand(table=CHECKED, simulation={"table": {"step_clock_ratio": ratio}})
    table = s.bench.table
    table.home()
    found = measured(runs_of(table, s, *run_lengths_s(4, 0, 10.0, 60.0)), table.step_clock)
    assert found.ratio == pytest.approx(ratio, abs=2e-6)
    assert (abs(found.deviation_ppm) > found.limit_ppm) is (abs(ratio - 1) > 2e-4)
    table.use_step_clock(found.ratio)
    for asked in (90.0, -33.3, 5.0):
        spin = table.spin(asked, 5.0)
        assert spin.rate_dps == pytest.approx(true_rate_dps(s, spin), rel=3e-6)
        assert spin.rate_dps == pytest.approx(asked, rel=1e-3)  # the divisor is by the measured clock too
        table.settle(spin)
    assert table.angle_deg() == pytest.approx(
        float(s.world.table.commanded_deg(np.array([s.clock.now_s()]))[0]), abs=1e-4
    )


@pytest.mark.parametrize("latency_s", [0.001, 0.004, 0.016])
def test_the_timer_of_an_adapter_is_in_the_uncertainty(stand: Make, latency_s: float) -> None:
    """Replies come at the ticks of a timer, so that runs of one length would all be late by the same."""
    s = stand(table=CHECKED, simulation={"table": {"step_clock_ratio": 0.99965, "reply_latency_s": latency_s}})
    table = s.bench.table
    table.home()
    found = measured(runs_of(table, s, *run_lengths_s(6, 0, 10.0, 60.0)), table.step_clock)
    assert abs(found.deviation_ppm + 350.0) < found.expanded_ppm
    assert 1e-4 * latency_s < found.fit.scatter_s < latency_s


@pytest.mark.parametrize("ratio", [0.5, 1.6])
def test_a_clock_that_cannot_be_is_refused(stand: Make, ratio: float) -> None:
    s = stand(table=CHECKED, simulation={"table": {"step_clock_ratio": ratio}})
    s.bench.table.home()
    with pytest.raises((WrongInstrument, NoReply), match=r"check (step_clock_hz|power)"):
        s.bench.table.time_run(40.0, 10.0, waiting(s))


INIT = [{"send": "!1we11", "expect": "a"}, {"send": "!1wl0", "expect": "a"}, {"send": "!1wr0"}]


def test_commands_of_the_bench_file_come_before_any_motion_once_per_link(stand: Make) -> None:
    s = stand(table={"init_commands": INIT})
    heard: list[str] = []
    execute = simulated(s)._execute
    simulated(s)._execute = lambda command, t_s: (heard.append(command), execute(command, t_s))
    s.bench.table.identify()
    assert heard == ["!1fp"]  # to say who it is needs no motor
    s.bench.table.home()
    s.bench.table.settle(s.bench.table.spin(20.0, 1.0))
    assert heard[1:5] == ["!1we11", "!1wl0", "!1wr0", "!1h1"]
    assert heard.count("!1we11") == 1
    s.bench.table.close()
    s.bench.table.home()
    assert heard.count("!1we11") == 2  # it may have lost its power meanwhile


def test_another_reply_than_expected_ends_it_before_the_table_moves(stand: Make) -> None:
    s = stand(table={"init_commands": [{"send": "!1we11", "expect": "ok"}]})
    with pytest.raises(
        RequestRejected,
        match=r"table: answered 'a' to !1we11, but init_commands in the bench file expects 'ok'; correct",
    ):
        s.bench.table.home()
    assert not s.world.table.moving(s.clock.now_s())


def test_a_line_may_end_with_lf(stand: Make) -> None:
    s = stand(table={"terminator": "\n"})
    assert s.bench.table.identify().startswith("C4")


@pytest.mark.parametrize(
    ("command", "reply"), [("!1wh1,r,200", b"a\r\n"), ("!1h12", b"oo"), ("!1h1", b"o"), ("!1we11", b"a\r\n")]
)
def test_the_simulated_controller_acknowledges_as_a_real_one(stand: Make, command: str, reply: bytes) -> None:
    device = simulated(stand())
    device.receive(f"{command}\r".encode(), 0.0)
    assert device.transmit(60.0) == reply


@pytest.mark.parametrize("left", [b"", b"!1m1f99", b"!1"])
def test_stop_in_a_new_process_stops_whatever_was_left(stand: Make, left: bytes) -> None:
    """The earlier process was killed in the middle of a run, perhaps in the middle of a line."""
    s = stand()
    s.bench.table.home()
    s.bench.table.spin(60.0, 3600.0)
    simulated(s).receive(left, s.clock.now_s())
    again = open_bench(s.file, s.clock, s.bench.simulation).table
    again.stop()
    assert not s.world.table.moving(s.clock.now_s())  # when it returns, not some time later
    assert not again.is_moving()
    again.home()
    assert again.angle_deg() == 0
    again.close()


def test_stop_in_a_new_process_does_not_need_an_answer_to_its_question(stand: Make) -> None:
    s = stand()
    s.bench.table.home()
    s.bench.table.spin(60.0, 3600.0)
    s.faults(URL).arm("silence", until_s=s.clock.now_s() + 0.9)
    again = open_bench(s.file, s.clock, s.bench.simulation).table
    again.stop()
    assert not s.world.table.moving(s.clock.now_s())
    again.close()


def turned(table: Any, *rates: float) -> None:
    for rate in rates:
        table.settle(table.spin(rate, 3.0))


def test_the_home_check_finds_no_missed_steps(stand: Make) -> None:
    s = stand(table=CHECKED)
    table = s.bench.table
    assert table.check_home(waiting(s)) is None  # a new process knows no place
    for rates in ((20.0,), (-90.0, 31.0, 7.7), (90.0, 90.0)):
        turned(table, *rates)
        found = table.check_home(waiting(s))
        assert (found.missed_steps, found.is_missing) == (0, False)
    assert table.angle_deg() == 0


@pytest.mark.parametrize("missed", [1, 2, 3, 8, 200])
@pytest.mark.parametrize("rate", [50.0, -50.0])
def test_missed_steps_are_counted(stand: Make, missed: int, rate: float) -> None:
    s = stand(table=CHECKED | {"reply_u_s": 0.001})
    table = s.bench.table
    table.home()
    assert table.check_home(waiting(s)).missed_steps == 0
    simulated(s).missed_steps = missed
    turned(table, rate)
    found = table.check_home(waiting(s))
    assert found.missed_steps == missed
    assert found.is_missing is (missed > 2)
    assert table.check_home(waiting(s)).missed_steps == 0  # home again


def learned(stand: Make) -> Any:
    """Return a stand whose homing is learned, and whose table has turned since."""
    s = stand(table=CHECKED)
    s.bench.table.home()
    s.bench.table.check_home(waiting(s))
    turned(s.bench.table, 50.0)
    return s


def test_a_late_reply_is_no_missed_step(stand: Make) -> None:
    """18 ms are three steps of the homing, and one period of an adapter's timer with its usual scatter."""
    s = learned(stand)
    delay_replies(s, 0.018)
    found = s.bench.table.check_home(waiting(s))
    assert found.missed_steps == pytest.approx(0.018 / found.step_s, rel=0.05)
    assert (found.is_missing, found.is_doubtful, found.explained) == (False, True, "")


@pytest.mark.parametrize("late_s", [0.17, 2.0])
def test_a_reply_that_comes_long_after_the_controller_says_that_the_table_stands_was_late(
    stand: Make, late_s: float
) -> None:
    s = learned(stand)
    delay_replies(s, late_s)
    found = s.bench.table.check_home(waiting(s))
    assert f"home seems {round(late_s / found.step_s, 1):g} steps from where it was left" in found.explained
    asked_s = found.doubt_steps * found.step_s
    assert f"came {late_s - asked_s:.2f} s after the controller said that the table stands" in found.explained
    assert found.missed_steps == pytest.approx(found.doubt_steps, abs=0.5)  # at most, by when it was asked
    assert not found.is_missing


@pytest.mark.parametrize("answer", ["1", ""])
def test_missed_steps_are_no_late_reply(stand: Make, answer: str) -> None:
    """The controller says that the table still moves, or nothing while it does."""
    s = learned(stand)
    device = simulated(s)
    device.missed_steps = 40
    turned(s.bench.table, 50.0)
    if not answer:
        execute = device._execute
        device._execute = lambda command, t_s: None if command == "!1rs" else execute(command, t_s)
    found = s.bench.table.check_home(waiting(s))
    assert (found.missed_steps, found.is_missing, found.explained) == (40, True, "")
    assert found.is_shown is bool(answer)


def test_a_homing_that_ends_while_the_controller_is_asked_is_doubtful(stand: Make) -> None:
    s = learned(stand)
    device = simulated(s)
    execute, reply = device._execute, device._reply
    late: list[Any] = []

    def answer_late(text: str, t_s: float) -> float:
        return float(reply(text, t_s + 0.1 * bool(late)))

    def heard(command: str, t_s: float) -> None:
        late[:] = [command] * (command == "!1rs")
        execute(command, t_s)

    device._execute, device._reply = heard, answer_late
    delay_replies(s, 0.06)
    found = s.bench.table.check_home(waiting(s))
    assert "the controller said that the table stands when it was asked whether it still homes" in found.explained
    assert found.missed_steps == pytest.approx(0.06 / found.step_s, rel=0.05)
    assert not found.is_missing
    turned(s.bench.table, 50.0)
    assert s.bench.table.angle_deg() != 0


def test_a_late_reply_before_the_first_check_is_found_by_a_turn_that_is_made_again(stand: Make) -> None:
    s = stand(table=CHECKED)
    table = s.bench.table
    table.home()
    homings = with_long_homings(s, 1)
    found = table.check_home(waiting(s))
    assert not found.is_missing
    assert "steps seemed to be missed before the first check, but not when it was made again" in found.explained
    assert "a reply was late by about 0.24 s" in found.explained
    assert len(homings) == 7
    again = table.check_home(waiting(s))
    assert (again.missed_steps, again.explained) == (0, "")


@pytest.mark.parametrize("which", [(), (1,)])
def test_steps_missed_before_a_homing_that_is_learned_anew_are_found(stand: Make, which: tuple[int, ...]) -> None:
    """It was learned while replies were late; one may be late again while it is learned."""
    s = stand(table=CHECKED)
    table, device = s.bench.table, simulated(s)
    table.home()
    finish = device._finish
    delay_replies(s, 0.5)
    table.check_home(waiting(s))
    device._finish = finish
    device.missed_steps = 40
    turned(table, 50.0)
    missing_in_moves(s, *which)
    found = table.check_home(waiting(s))
    assert (found.missed_steps, found.is_missing) == (40, True)


def delay_replies(stand: Any, late_s: float) -> None:
    """Let the reply that ends a homing come later than the controller sends it."""
    device = simulated(stand)
    finish = device._finish
    device._finish = lambda end_s, t_s: finish(end_s + late_s, t_s)


def missing_in_moves(stand: Any, *which: int) -> list[int]:
    """Let the table miss 40 steps in these moves; returns the steps of all, which grows."""
    device, moves = simulated(stand), []
    move = device._move

    def missing(way: str, steps: int, divisor: int, t_s: float) -> None:
        device.missed_steps = 40 if len(moves) in which else 0
        moves.append(steps)
        move(way, steps, divisor, t_s)

    device._move = missing
    return moves


@pytest.mark.parametrize("which", [(0, 3), (1, 5), (2, 4)])
def test_steps_that_are_missed_each_time_the_homing_is_learned_are_found(stand: Make, which: tuple[int, ...]) -> None:
    s = stand(table=CHECKED)
    table = s.bench.table
    table.home()
    missing_in_moves(s, *which)
    found = table.check_home(waiting(s))
    assert (found.learning, found.is_missing) == (True, True)
    again = table.check_home(waiting(s))
    assert (again.learning, again.missed_steps) == (False, 0)


@pytest.mark.parametrize("which", [0, 1, 2])
def test_steps_that_seem_missed_once_while_the_homing_is_learned_are_said(stand: Make, which: int) -> None:
    s = stand(table=CHECKED)
    table = s.bench.table
    table.home()
    moves = missing_in_moves(s, which)
    found = table.check_home(waiting(s))
    assert (found.missed_steps, found.is_missing, found.learning) == (0, False, False)
    assert "steps seemed to be missed in a turn from which the homing is learned, but not when" in found.explained
    assert len(moves) == 6
    assert table.check_home(waiting(s)).explained == ""


def with_long_homings(stand: Any, *which: int) -> list[float]:
    """Let these homings take 0.24 s longer, as where pulses are lost; returns the list of all, which grows."""
    table, homings = stand.world.table, []
    home = table.home

    def long(t_s: float) -> float:
        homings.append(t_s)
        return float(home(t_s)) + 0.24 * (len(homings) in which)

    table.home = long
    return homings


@pytest.mark.parametrize("which", [2, 3])
def test_a_homing_at_home_that_takes_long_once_does_not_blind_the_check(stand: Make, which: int) -> None:
    """The homing of the check is the first; it is learned from the next two at home, and three away from it."""
    s = stand(table=CHECKED)
    table = s.bench.table
    table.home()
    homings = with_long_homings(s, which)
    found = table.check_home(waiting(s))
    assert found.u_steps < found.limit_steps
    assert len(homings) == 11  # learned twice
    simulated(s).missed_steps = 40
    turned(table, 50.0)
    again = table.check_home(waiting(s))
    assert (again.is_missing, again.missed_steps) == (True, 40)


def test_homings_that_scatter_each_time_end_with_an_uncertainty_that_says_so(stand: Make) -> None:
    s = stand(table=CHECKED)
    table = s.bench.table
    table.home()
    homings = with_long_homings(s, 2, 7, 12)
    found = table.check_home(waiting(s))
    assert found.u_steps > 10 * found.limit_steps
    assert not found.is_missing
    assert len(homings) == 16
    again = table.check_home(waiting(s))  # by the same homing, which is then learned once more, for the next check
    assert (again.u_steps, len(homings)) == (found.u_steps, 22)
    certain = table.check_home(waiting(s))
    assert certain.u_steps < certain.limit_steps
    assert len(homings) == 23


def test_after_an_abort_the_place_is_not_known(stand: Make) -> None:
    s = stand(table=CHECKED)
    table = s.bench.table
    table.home()
    table.check_home(waiting(s))
    table.spin(40.0, 100.0)
    table.stop()
    assert table.check_home(waiting(s)) is None
    assert table.angle_deg() == 0
