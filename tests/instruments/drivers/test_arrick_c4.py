"""The C4 through bytes: finite moves, replies, the exact rate of a whole divisor, aborts, refusals and faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.errors import LimitError, LinkError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.interfaces.table import Spin

Make = Callable[..., Any]
URL = "sim://arrick"


class Tap:
    """Remembers what was sent and said."""

    def __init__(self, device: Any) -> None:
        self._device, self.heard, self.said = device, b"", b""

    def receive(self, data: bytes, t_s: float) -> None:
        self.heard += data
        self._device.receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        data: bytes = self._device.transmit(t_s)
        self.said += data
        return data

    def connect(self) -> Tap:
        return self

    def __getattr__(self, name: str) -> Any:
        return getattr(self._device, name)


@pytest.fixture
def c4(stand: Make) -> Any:
    s = stand("single-axis-sim")
    s.tap = Tap(s.bench.simulation.device(URL))
    s.bench.simulation._devices[URL] = s.tap
    s.table = s.bench.table
    return s


def test_frames_as_the_wire_has_them(c4: Any) -> None:
    assert c4.table.identify().startswith("C4")
    c4.table.home()
    spin = c4.table.spin(45.0, 2.0)
    c4.table.settle(spin)
    c4.table.settle(c4.table.spin(-45.0, 2.0))
    sent = c4.tap.heard.split(b"\r")
    assert sent[:2] == [b"!1fp", b"!1h1"]
    assert sent[2] == b"!1ra1,400"  # 90 deg/s^2 in steps of 0.225 deg, written once
    assert sent[3] == b"!1sp1,10000"  # 200 steps a second from 2 MHz
    assert sent[4].startswith(b"!1m1f")
    assert sent[4].endswith(b"n")
    assert sent[5].startswith(b"!1m1r")
    assert len([line for line in sent if line]) == 6  # the speed was not written again
    assert c4.tap.said.endswith(b"ao")


@pytest.mark.parametrize("asked", [1.0, 7.3, -33.3, 99.9])
def test_the_reference_rate_is_that_of_a_whole_divisor(c4: Any, asked: float) -> None:
    spin = c4.table.spin(asked, 3.0)
    divisor = round(2e6 * 0.225 / abs(asked))
    assert spin.rate_dps == pytest.approx(np.copysign(2e6 / divisor * 0.225, asked), rel=1e-12)
    assert spin.asked_dps == asked
    assert c4.table.achievable_dps(asked) == pytest.approx(spin.rate_dps, rel=1e-12)
    assert abs(spin.rate_dps - asked) < 1e-3 * abs(asked)
    times = np.linspace(spin.steady_from_s, spin.steady_until_s, 50)
    truth = c4.world.table.commanded_deg(times)
    assert np.allclose(spin.angle_deg(times), truth, atol=0.03 * abs(asked) / 9.6 + 1e-3)  # a byte or two of delay
    c4.table.settle(spin)


def test_steps_inside_the_gate_over_gate_time_is_the_rate() -> None:
    spin = Spin(10.0, 10.0, 5.0, 70.0, 0.0, 0.225)
    begin, end = spin.gate(6.0001, 60.0)
    assert begin >= 6.0001
    assert end - begin >= 60
    assert (end - begin) * 10 / 0.225 == pytest.approx(round((end - begin) * 10 / 0.225), abs=1e-6)
    assert end <= 70
    assert Spin(0.0, 0.0, 0.0, 61.0, 0.0, 0.225).gate(1.0, 60.0) == (1.0, 61.0)


def test_the_angle_is_counted_over_moves_and_home_is_zero(c4: Any) -> None:
    c4.table.home()
    for asked in (20.0, -20.0, 20.0):
        c4.table.settle(c4.table.spin(asked, 2.0))
    there = c4.table.angle_deg()
    assert there == pytest.approx(c4.world.table.commanded_deg(np.array([c4.clock.now_s()]))[0], abs=1e-4)
    assert abs(there) > 10
    c4.table.home()
    assert c4.table.angle_deg() == 0
    assert c4.world.table.commanded_deg(np.array([c4.clock.now_s()]))[0] == pytest.approx(0, abs=1e-4)


def test_abort_ramps_down_and_says_when_it_is_at_rest(c4: Any) -> None:
    c4.table.spin(60.0, 100.0)
    assert c4.table.is_moving()
    c4.table.stop()
    assert not c4.table.is_moving()
    assert not c4.world.table.moving(c4.clock.now_s())
    c4.table.stop()  # again: nothing is there to stop
    c4.table.home()


def test_a_driver_that_is_new_stops_what_an_earlier_process_left_turning(c4: Any) -> None:
    c4.table.home()
    c4.table.spin(20.0, 3600.0)
    again = open_bench(c4.file, c4.clock, c4.bench.simulation).table
    again.stop()
    c4.clock.sleep(1.0)
    assert not again.is_moving()
    again.close()


def test_rest_is_a_rate_too(c4: Any) -> None:
    spin = c4.table.spin(0.0, 10.0)
    assert (spin.rate_dps, spin.steady_until_s - spin.steady_from_s >= 10) == (0.0, True)
    assert not c4.table.is_moving()
    c4.table.settle(spin)


def test_a_rate_beyond_the_table_is_refused_before_a_byte_is_sent(c4: Any) -> None:
    with pytest.raises(LimitError, match=r"100\.1 deg/s is beyond the limit of the table, 100 deg/s"):
        c4.table.spin(100.1, 1.0)
    assert c4.tap.heard == b""


def test_without_the_manuals_template_there_is_no_constant_rate(stand: Make) -> None:
    s = stand("single-axis-sim", table={"speed_template": None})
    s.bench.table.home()
    with pytest.raises(RequestRejected, match="speed_template"):
        s.bench.table.spin(10.0, 1.0)
    assert s.bench.table.spin(0.0, 1.0).rate_dps == 0


def test_a_table_mounted_the_other_way_turns_the_same_way(stand: Make) -> None:
    s = stand("single-axis-sim", table={"direction": -1})
    s.tap = Tap(s.bench.simulation.device(URL))
    s.bench.simulation._devices[URL] = s.tap
    spin = s.bench.table.spin(30.0, 2.0)
    assert b"!1m1r" in s.tap.heard
    assert spin.rate_dps > 0
    turned = s.world.table.commanded_deg(np.array([spin.steady_from_s, spin.steady_until_s]))
    assert turned[1] > turned[0]


def test_a_refusal_letter_is_said(c4: Any) -> None:
    c4.faults(URL).arm("refusal", count=1)
    with pytest.raises(RequestRejected, match="answered 'e'"):
        c4.table.spin(10.0, 1.0)


def test_silence(c4: Any) -> None:
    c4.faults(URL).arm("silence")
    with pytest.raises(NoReply, match="check power, cable and baud rate"):
        c4.table.identify()


def test_the_wrong_instrument(c4: Any) -> None:
    c4.tap._device._device._execute = lambda command, t_s: c4.tap._device._device._reply("MX1 2.3\r\n", t_s)
    with pytest.raises(WrongInstrument, match=r"answered 'MX1 2\.3', which is not the answer of a C4"):
        c4.table.identify()


def test_a_dropped_link_can_be_opened_again(c4: Any) -> None:
    c4.faults(URL).arm("dropped_link", count=1)
    with pytest.raises(LinkError, match="broke"):
        c4.table.identify()
    assert c4.table.identify().startswith("C4")


def test_a_lost_o_is_no_reply_and_a_stall_is_noticed(c4: Any) -> None:
    c4.faults(URL).arm("lost_reply", count=1)
    spin = c4.table.spin(20.0, 3.0)
    with pytest.raises(NoReply):
        c4.table.settle(spin)
    c4.table.stop()
    c4.table.home()
    c4.faults(URL).arm("stall", count=1)
    spin = c4.table.spin(20.0, 30.0)
    with pytest.raises(MalformedReply, match="home the table"):
        c4.table.settle(spin)


@pytest.mark.parametrize("fault", ["split", "merge"])
def test_split_and_late_replies_are_waited_for(c4: Any, fault: str) -> None:
    c4.faults(URL).arm(fault, until_s=c4.clock.now_s() + 0.3)
    assert c4.table.identify().startswith("C4")
    c4.table.settle(c4.table.spin(20.0, 1.0))
