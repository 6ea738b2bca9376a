"""The C4 on the first day: commands before the first motion, a table left turning, a slow step clock, missed steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.errors import NoReply, RequestRejected, WrongInstrument
from instruments.protocols.arrick_c4_moves import TimedRun, step_rate_hz

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


def test_two_runs_of_equal_speed_and_ramp_give_the_step_rate() -> None:
    """Ramps of 1.7 s and a reply that is always 16 ms late cancel."""
    runs = [TimedRun(steps, 2 * 1.7 + (steps - 340) / 400 + 0.016) for steps in (4340, 28340)]
    assert step_rate_hz(*runs) == pytest.approx(400, rel=1e-12)


@pytest.mark.parametrize("ratio", [1.0, 10 / 11, 1.00005, 0.9993])
def test_the_true_step_rate_is_measured_and_used(stand: Make, ratio: float) -> None:
    s = stand(table=CHECKED, simulation={"table": {"step_clock_ratio": ratio}})
    table = s.bench.table
    table.home()
    found = table.measure_clock(90.0, 10.0, waiting(s))
    assert found.ratio == pytest.approx(ratio, abs=2e-6)
    assert found.u_ppm == pytest.approx(1e6 * 2 * 0.001 / (60.0 / ratio), rel=0.02)  # tens of ppm over 60 s
    assert (abs(found.deviation_ppm) > found.limit_ppm) is (abs(ratio - 1) > 2e-4)
    for asked in (90.0, -33.3, 5.0):
        spin = table.spin(asked, 5.0)
        assert spin.rate_dps == pytest.approx(true_rate_dps(s, spin), rel=3e-6)
        assert spin.rate_dps == pytest.approx(asked, rel=1e-3)  # the divisor is by the measured clock too
        table.settle(spin)
    assert table.angle_deg() == pytest.approx(
        float(s.world.table.commanded_deg(np.array([s.clock.now_s()]))[0]), abs=1e-4
    )


def test_late_replies_cost_only_their_scatter(stand: Make) -> None:
    s = stand(table=CHECKED)
    device, rng = s.bench.simulation.device(URL), np.random.default_rng(3)
    reply = simulated(s)._replies
    transmit = device._device.transmit
    assert reply == []

    def late(t_s: float) -> bytes:
        """16 ms of a USB adapter's latency timer, and 1 ms of scatter."""
        for each in simulated(s)._replies:
            if not hasattr(each, "was_late"):
                each.due_s += 0.016 + 0.001 * float(rng.standard_normal())
                each.was_late = True
        return bytes(transmit(t_s))

    device._device.transmit = late
    s.bench.table.home()
    found = [s.bench.table.measure_clock(90.0, 10.0, waiting(s)) for _ in range(12)]
    z = [each.deviation_ppm / each.u_ppm for each in found]
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.7  # the stated uncertainty is that of the scatter


@pytest.mark.parametrize("ratio", [0.5, 1.6])
def test_a_clock_that_cannot_be_is_refused(stand: Make, ratio: float) -> None:
    s = stand(table=CHECKED, simulation={"table": {"step_clock_ratio": ratio}})
    s.bench.table.home()
    with pytest.raises((WrongInstrument, NoReply), match=r"check (step_clock_hz|power)"):
        s.bench.table.measure_clock(40.0, 10.0, waiting(s))


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


def test_home_is_where_it_was_left(stand: Make) -> None:
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
    s = stand(table=CHECKED)
    table = s.bench.table
    table.home()
    assert table.check_home(waiting(s)).missed_steps == 0
    simulated(s).missed_steps = missed
    turned(table, rate)
    found = table.check_home(waiting(s))
    assert found.missed_steps == missed
    assert found.is_missing is (missed > 2)
    assert table.check_home(waiting(s)).missed_steps == 0  # home again


def test_after_an_abort_the_place_is_not_known(stand: Make) -> None:
    s = stand(table=CHECKED)
    table = s.bench.table
    table.home()
    table.check_home(waiting(s))
    table.spin(40.0, 100.0)
    table.stop()
    assert table.check_home(waiting(s)) is None
    assert table.angle_deg() == 0
