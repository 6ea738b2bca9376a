"""A port is read once the kernel has handed on what arrived: it does that late where the processor is busy."""

from __future__ import annotations

import os
import select
import tty
from collections.abc import Iterator

import pytest
import serial

from instruments.clock import SystemClock
from instruments.protocols.serial_options import Rs485Options
from instruments.transport import settled_port
from instruments.transport.factory import HardwareLinks
from instruments.transport.serial import EIGHT_N_1, Line, SerialPort
from instruments.transport.stream_reader import empty

REAL_POLL = select.poll


class BusyKernel:
    """Hands on one piece of what it holds each time that it is polled, and counts the polls."""

    def __init__(self) -> None:
        self.ours, self.theirs = os.openpty()
        tty.setraw(self.theirs)
        self.held: list[bytes] = []
        self.polls = 0

    def close(self) -> None:
        os.close(self.ours)
        os.close(self.theirs)


class Asked:
    """What `select.poll` returns."""

    def __init__(self, kernel: BusyKernel) -> None:
        self._kernel, self._asked = kernel, REAL_POLL()
        self.register = self._asked.register

    def poll(self, timeout_ms: int) -> None:
        self._kernel.polls += 1
        if self._kernel.held:
            os.write(self._kernel.ours, self._kernel.held.pop(0))
        self._asked.poll(timeout_ms)


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> Iterator[BusyKernel]:
    made = BusyKernel()
    monkeypatch.setattr("instruments.transport.settled_port.select.poll", lambda: Asked(made))
    yield made
    made.close()


def opened(kernel: BusyKernel, line: Line = EIGHT_N_1) -> SerialPort:
    links = HardwareLinks(SystemClock())
    return links.serial_port(os.ttyname(kernel.theirs), baudrate=9600, timeout_s=0.0, line=line)


@pytest.mark.parametrize("line", [EIGHT_N_1, Line(rs485=Rs485Options(by="rts", send_level=False))])
def test_bytes_that_the_kernel_still_holds_are_waiting(
    kernel: BusyKernel, line: Line, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serial.Serial, "_update_rts_state", lambda _: None)  # a terminal has no RTS
    port = opened(kernel, line)
    assert port.in_waiting == 0
    kernel.held += [b"one", b"two"]
    assert port.in_waiting == 3
    polls = kernel.polls
    assert port.in_waiting == 3  # some wait already: nothing is asked
    assert kernel.polls == polls
    assert empty(port) == b"onetwo"
    port.close()


def test_bytes_that_the_kernel_still_holds_are_dropped_with_the_others(kernel: BusyKernel) -> None:
    port = opened(kernel)
    kernel.held.append(b"old")
    port.reset_input_buffer()
    assert not kernel.held
    assert empty(port) == b""
    kernel.held.append(b"new")
    assert empty(port) == b"new"
    port.close()


def test_a_port_that_is_not_open_is_left_as_it_is(kernel: BusyKernel) -> None:
    settled_port.settle(settled_port.unopened(os.ttyname(kernel.theirs), {}))
    assert kernel.polls == 0


def test_an_address_of_pyserial_is_opened_as_before() -> None:
    port = settled_port.unopened("loop://", {"baudrate": 9600})
    assert not isinstance(port, settled_port.SettledSerial)
