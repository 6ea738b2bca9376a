"""Opening a port with all its settings, on pseudo-terminals: echo, RS-485 direction, and a Modbus line with both."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import tty
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import serial

from instruments.clock import SystemClock
from instruments.errors import LinkError
from instruments.protocols.serial_options import Rs485Options
from instruments.transport.factory import Ports
from instruments.transport.opened_port import EchoFreePort
from instruments.transport.port_failures import silence_remedy, users_of
from instruments.transport.serial import Line

BY_RTS = Line(rs485=Rs485Options(by="rts", send_level=False))


@dataclass
class Terminal:
    """The far end of a line."""

    ours: int
    path: str

    def hear(self, size: int) -> bytes:
        return os.read(self.ours, size)

    def say(self, data: bytes) -> None:
        os.write(self.ours, data)


@pytest.fixture
def far() -> Iterator[Terminal]:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    yield Terminal(ours, os.ttyname(theirs))
    os.close(ours)
    os.close(theirs)


def opened(far: Terminal, line: Line, timeout_s: float = 1.0) -> Any:
    return Ports(SystemClock()).serial(far.path, device="table", baudrate=9600, timeout_s=timeout_s, line=line)


def test_an_echo_is_dropped_and_the_answer_is_passed_on(far: Terminal) -> None:
    port = opened(far, Line(echo=True))
    port.write(b"!1fp\r")
    far.say(far.hear(5) + b"C4")
    assert port.read(2) == b"C4"
    port.write(b"!1rs\r")
    far.say(far.hear(5)[:3])
    assert port.in_waiting == 0
    far.say(b"s\r0")
    assert port.read(1) == b"0"
    port.close()


def test_an_adapter_without_an_echo_loses_nothing_although_one_was_announced(far: Terminal) -> None:
    port = opened(far, Line(echo=True), timeout_s=0.05)
    assert isinstance(port, EchoFreePort)
    port.write(b"!1rs\r")
    far.say(b"0")
    assert port.read(1) == b"0"
    port.write(b"ask")
    port.reset_input_buffer()
    far.say(b"askyes")  # the echo comes after the buffer was emptied
    assert port.read(3) == b"yes"
    port.close()


def test_rts_switches_the_direction_around_what_is_sent(far: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    levels: list[bool] = []
    monkeypatch.setattr(serial.Serial, "_update_rts_state", lambda self: levels.append(self._rts_state))
    port = opened(far, BY_RTS)
    levels.clear()
    port.write(b"x")
    assert far.hear(8) == b"x"
    assert levels == [False, True]
    port.close()


def test_a_port_whose_kernel_driver_cannot_switch_says_what_to_set(far: Terminal) -> None:
    with pytest.raises(
        LinkError, match=r"table: port /dev/pts/\d+ cannot be opened .*set rs485 = \{ by = 'rts' \}"
    ) as told:
        opened(far, Line(rs485=Rs485Options()))
    assert "\n" not in str(told.value)
    opened(far, Line()).close()  # it was closed again


def test_a_modbus_line_is_opened_with_the_same_settings(far: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    levels: list[bool] = []
    monkeypatch.setattr(serial.Serial, "_update_rts_state", lambda self: levels.append(self._rts_state))
    line = Line(parity="even", stop_bits=2, echo=True, rs485=BY_RTS.rs485)
    client = Ports(SystemClock()).modbus_rtu(far.path, device="chamber", baudrate=19200, timeout_s=1.0, line=line)
    port: Any = client.socket._port
    assert (port.parity, port.stopbits, port.exclusive) == ("E", 2, True)
    levels.clear()

    def answer() -> None:
        far.say(far.hear(8) + bytes.fromhex("01 03 02 14 96 37 2a"))

    answering = threading.Thread(target=answer)
    answering.start()
    assert client.read_holding_registers(0, count=1, device_id=1).registers == [5270]
    answering.join()
    assert levels == [False, True]
    client.close()


@pytest.fixture
def other_user(far: Terminal) -> Iterator[int]:
    """Another process that holds the port as a serial program does: opened, and locked for itself."""
    holding = (
        "import sys, serial; port = serial.Serial(sys.argv[1], exclusive=True); print('open', flush=True); input()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", holding, far.path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"open\n"
        yield process.pid
        process.kill()


def test_a_port_in_use_is_named_with_the_process_that_has_it(far: Terminal, other_user: int) -> None:
    # this process, the maker of the terminal, is not among the users
    assert users_of(far.path) == [f"process {other_user} ({Path(sys.executable).name[:15]})"]
    for opener in (
        lambda: opened(far, Line()),
        lambda: Ports(SystemClock()).modbus_rtu(far.path, device="table", baudrate=9600, timeout_s=1.0),
    ):
        with pytest.raises(
            LinkError,
            match=rf"table: port .* cannot be opened .*; check which other process .*process {other_user} ",
        ):
            opener()


def test_the_maker_of_a_terminal_is_not_its_user(far: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.getpid", lambda: 0)  # seen as by another process, this one is the device at the far end
    assert users_of(far.path) == []


def test_a_pseudo_terminal_has_no_cable(tmp_path: Path) -> None:
    master, terminal = os.openpty()
    try:
        link = tmp_path / "gyro"
        link.symlink_to(os.ttyname(terminal))  # as socat makes it
        assert "the program at the other end" in silence_remedy(os.ttyname(terminal))
        assert silence_remedy(str(link)) == silence_remedy(os.ttyname(terminal))
    finally:
        os.close(master)
        os.close(terminal)
    assert silence_remedy("/dev/ttyUSB0") == "power, cable"
    for host in ("127.0.0.1", "localhost", "socket://127.0.0.1:4001", "::1"):
        assert "the program at this address of this computer" in silence_remedy(host)
    for host in ("192.168.1.7", "socket://10.127.0.1:4001", "chamber.lab"):
        assert silence_remedy(host) == "power, cable"
    assert silence_remedy("sim://stim300") == "power, cable"
