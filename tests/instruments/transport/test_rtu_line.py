"""A serial line as it is: late replies, echoes, stray bytes, other units. Each reply is what was asked for, or none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from instruments.clock import VirtualClock
from instruments.errors import InstrumentError, MalformedReply, NoReply
from instruments.protocols.modbus_registers import Register
from instruments.simulators.links.factory import SimulatedLinks
from instruments.simulators.links.faults import Faults
from instruments.simulators.links.modbus_device import Cell, ModbusDevice, constant, int16
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers

AIR, MODE, SETPOINT = (Register(number, f"register {number}", "int16", access="rw") for number in (100, 200, 300))


class Line:
    """A device behind a line with latency: `latency_s` gives that of each request. `shape` changes each reply."""

    def __init__(
        self,
        latency_s: Callable[[int], float] = lambda _: 0.06,
        shape: Callable[[bytes, bytes], bytes] = lambda _request, reply: reply,
        address: int = 1,
    ) -> None:
        self.clock, self.held = VirtualClock(), 850
        self.values = {100: 213, 200: 2, 300: 850}
        cells: dict[int, Cell] = {number: constant(value) for number, value in self.values.items()}
        cells[300] = int16(lambda _: self.held, self._put)
        self.device = ModbusDevice("rtu", cells, Faults(), address)
        self._latency_s, self._shape = latency_s, shape
        self._due: list[tuple[float, bytes]] = []
        self._free_s = 0.0
        self.requests: list[bytes] = []
        ports = Ports(self.clock, SimulatedLinks(lambda _: self, self.clock))
        self.registers = Registers(
            "chamber",
            1,
            self.clock,
            lambda: ports.modbus_rtu("sim://it", device="chamber", baudrate=19200, timeout_s=1.0),
            pause_s=0.03,
        )

    def _put(self, value: int, _t_s: float) -> bool:
        self.held = value
        return True

    def receive(self, data: bytes, t_s: float) -> None:
        self.device.receive(data, t_s)
        reply = self._shape(data, self.device.transmit(t_s))
        # a device works at one request after the other
        self._free_s = max(self._free_s, t_s) + self._latency_s(len(self.requests))
        self.requests.append(data)
        if reply:
            self._due.append((self._free_s, reply))

    def transmit(self, t_s: float) -> bytes:
        sent = b"".join(reply for due_s, reply in self._due if due_s <= t_s)
        self._due = [each for each in self._due if each[0] > t_s]
        return sent

    def skip(self, t_s: float) -> None:
        self.transmit(t_s)

    def next_byte_s(self, t_s: float) -> float | None:
        return min((due_s for due_s, _ in self._due), default=None)

    def poll(self) -> list[int | None]:
        """Read all three as a driver does; None where it is said that no value came."""
        found: list[int | None] = []
        for register in (AIR, SETPOINT, MODE):
            try:
                found.append(self.registers.get_int(register))
            except InstrumentError:
                found.append(None)
        return found


@pytest.mark.parametrize("late", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("late_s", [1.02, 1.25, 1.9, 2.2])
def test_a_late_reply_is_never_read_as_another_register(late: int, late_s: float) -> None:
    """The issue's case: 60 ms latency, one reply of 1.25 s; air 21.3 was read as set point, then set point as air."""
    line = Line(lambda n: late_s if n == late else 0.06)
    assert [line.poll() for _ in range(6)] == [[213, 850, 2]] * 6
    line.registers.close()


@pytest.mark.parametrize("always_s", [1.1, 1.5, 2.4, 3.2, 4.0])
def test_a_device_that_is_always_late_gives_right_values_or_none(always_s: float) -> None:
    line = Line(lambda _: always_s)
    for _ in range(5):
        assert all(found in {None, right} for found, right in zip(line.poll(), [213, 850, 2], strict=True))
    line.registers.close()


def test_replies_of_any_latency_give_right_values_or_none() -> None:
    """A fixed course of latencies, 0 to 2.3 s: no value is ever that of another register."""
    line = Line(lambda n: 0.01 * ((n * 7919) % 231))
    polls = [line.poll() for _ in range(40)]
    assert all(found in {None, right} for each in polls for found, right in zip(each, [213, 850, 2], strict=True))
    assert sum(each == [213, 850, 2] for each in polls) > 20
    line.registers.close()


def test_a_line_without_a_fault_waits_for_nothing() -> None:
    line = Line()
    line.poll()
    assert line.clock.now_s() == pytest.approx(3 * 0.06 + 2 * 0.03, abs=0.002)
    line.registers.close()


@pytest.mark.slow
def test_a_line_that_is_never_silent_is_said_in_bounded_time() -> None:
    line = Line()
    line.transmit = lambda _t_s: b"\x55\xaa"  # type: ignore[method-assign]
    with pytest.raises(
        MalformedReply,
        match=r"chamber: labctl sent .*, but the line was never silent for .* find a second Modbus master",
    ):
        line.registers.get(AIR)
    assert line.clock.now_s() < 70
    line.registers.close()


def _echoing(request: bytes, reply: bytes) -> bytes:
    return request + reply


@pytest.mark.parametrize("register", [AIR, SETPOINT])
def test_an_adapter_that_echoes_is_told_and_survived(register: Register) -> None:
    line = Line(shape=_echoing)
    assert line.registers.get_int(register) == line.values[register.number]
    assert line.clock.now_s() < 0.1  # at the first try
    line.registers.put(SETPOINT, 300)
    assert line.held == 300
    assert line.poll() == [213, 300, 2]
    assert line.registers.remarks == ("the RS-485 adapter echoes each request; switch its local echo off",)
    line.registers.close()


def test_a_write_that_only_the_adapter_answered_is_not_done() -> None:
    """The reply to function 6 repeats the request, and so does the echo."""
    line = Line(shape=_echoing)
    line.poll()
    line.device.functions = frozenset()  # it answers with an exception from now on
    with pytest.raises(InstrumentError, match="exception 1"):
        line.registers.put(SETPOINT, 300)
    line._shape = lambda request, _reply: request
    with pytest.raises(NoReply):
        line.registers.put(SETPOINT, 300)
    line.registers.close()


@pytest.mark.parametrize("stray", [b"\0", b"\xff", b"\0\0\xff"])
def test_stray_bytes_before_a_reply_are_told_and_survived(stray: bytes) -> None:
    line = Line(shape=lambda _request, reply: stray + reply)
    assert line.poll() == [213, 850, 2]
    line.registers.put(SETPOINT, 300)
    assert line.held == 300
    assert line.clock.now_s() < 0.5
    assert line.registers.remarks == (
        "stray bytes arrive before replies; check termination and bias of the RS-485 line",
    )
    line.registers.close()


def test_an_echo_in_pieces_is_survived_too() -> None:
    class Pieces(Line):
        def receive(self, data: bytes, t_s: float) -> None:
            super().receive(data, t_s)
            due_s, reply = self._due.pop()
            self._due += [(due_s, reply[:3]), (due_s + 0.01, reply[3:7]), (due_s + 0.02, reply[7:])]

    line = Pieces(shape=_echoing)
    assert line.poll() == [213, 850, 2]
    assert line.clock.now_s() < 0.5
    line.registers.close()


def test_a_reply_of_another_unit_says_so() -> None:
    other = ModbusDevice("rtu", {100: constant(7)}, Faults(), 2)

    def as_unit_2(request: bytes, _reply: bytes) -> bytes:
        from pymodbus.framer import FramerRTU

        frame = b"\2" + request[1:6]
        other.receive(frame + FramerRTU.compute_CRC(frame).to_bytes(2, "big"), 0.0)
        return other.transmit(0.0)

    line = Line(shape=as_unit_2)
    with pytest.raises(
        MalformedReply,
        match=r"chamber: cannot read register 100 .*unit 2 answered instead of unit 1; set address in the bench file",
    ):
        line.registers.get(AIR)
    line.registers.close()


def test_garbage_is_counted_in_the_message() -> None:
    line: Any = Line(shape=lambda _request, _reply: b"garbage")
    with pytest.raises(
        MalformedReply, match="7 bytes arrived that are not a Modbus reply; check line settings and cable"
    ):
        line.registers.get(AIR)
    line.registers.close()
