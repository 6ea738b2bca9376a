"""What a busy computer reads late had come in time: no instrument was silent."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from typing import Any, cast

import pytest

from instruments.clock import ScaledClock, VirtualClock
from instruments.transport.factory import HardwareLinks
from instruments.transport.rtu import RtuClient
from instruments.transport.serial import Line
from instruments.transport.tcp_client import TcpClient

REPLY = b"\x01\x03\x02\x00\x19"
TIMEOUT_S, SPEED = 1.0, 100.0


class Slow(VirtualClock):
    """A clock that runs on by a share of a time-out each time that it is read."""

    def __init__(self, step_s: float) -> None:
        super().__init__()
        self.step_s = step_s
        self.pauses_in_stalls = True
        self.latency_s, self.heartbeat_interval_s = 0.0, 0.01

    def registered(self) -> Any:
        raise NotImplementedError

    def now_s(self) -> float:
        self.sleep(self.step_s)
        return super().now_s()

    def wall_s(self, duration_s: float) -> float:
        return duration_s / SPEED


class Port:
    """A port on which a reply is there from the given number of inspections on."""

    def __init__(self, looks: int) -> None:
        self.looks = looks

    @property
    def in_waiting(self) -> int:
        self.looks -= 1
        return len(REPLY) if self.looks < 0 else 0

    def read(self, size: int) -> bytes:
        return REPLY[:size]


def rtu(clock: VirtualClock, port: Port) -> RtuClient:
    client = RtuClient("/dev/none", clock, baudrate=9600, timeout_s=TIMEOUT_S, line=Line())
    client.socket = cast("Any", port)
    return client


def stalled(client: RtuClient, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the whole time-out pass while pymodbus waits: it looks no further."""
    monkeypatch.setattr(client, "_wait_for_data", lambda: 0)


def test_bytes_that_came_while_the_time_out_ended_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Slow(2 * TIMEOUT_S)
    clock.pauses_in_stalls = False  # as in real time
    client = rtu(clock, Port(looks=0))
    stalled(client, monkeypatch)
    assert client.recv(None) == REPLY


def test_a_serial_line_is_awaited_by_the_clock_of_the_bench(monkeypatch: pytest.MonkeyPatch) -> None:
    client = rtu(Slow(TIMEOUT_S / 50), Port(looks=20))
    stalled(client, monkeypatch)
    assert client.recv(None) == REPLY


def test_a_silent_serial_line_is_given_up_at_the_end_of_the_time_out(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, port = Slow(TIMEOUT_S / 10), Port(looks=10**6)
    client = rtu(clock, port)
    stalled(client, monkeypatch)
    assert client.recv(None) == b""
    assert VirtualClock.now_s(clock) == pytest.approx(TIMEOUT_S, abs=0.21)


@pytest.fixture
def far() -> Iterator[tuple[socket.socket, socket.socket]]:
    ours, theirs = socket.socketpair()
    yield ours, theirs
    ours.close()
    theirs.close()


def test_a_socket_is_awaited_by_the_clock_of_the_bench(far: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = far

    class Replying(Slow):
        def now_s(self) -> float:
            now_s = super().now_s()
            if now_s > 0.5 * TIMEOUT_S:
                theirs.sendall(REPLY)
            return now_s

    client = TcpClient("127.0.0.1", 1, Replying(TIMEOUT_S / 10), TIMEOUT_S)
    client.socket = ours
    assert client.recv(None).startswith(REPLY)


def test_a_silent_socket_is_given_up_at_the_end_of_the_time_out(far: tuple[socket.socket, socket.socket]) -> None:
    clock = Slow(TIMEOUT_S / 10)
    client = TcpClient("127.0.0.1", 1, clock, TIMEOUT_S)
    client.socket = far[0]
    assert client.recv(None) == b""
    assert VirtualClock.now_s(clock) == pytest.approx(TIMEOUT_S, abs=0.21)


def test_a_write_that_a_busy_computer_interrupts_is_not_a_lost_link(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}
    monkeypatch.setattr("instruments.transport.opened_port.unopened", lambda _, each, **__: given.update(each))
    with pytest.raises(AttributeError):  # nothing was opened
        HardwareLinks(ScaledClock(SPEED)).serial_port("/dev/none", baudrate=9600, timeout_s=TIMEOUT_S)
    assert given["write_timeout"] >= 1.0
    assert given["timeout"] < 1.0
