"""A real port is read all the time: a reader that pauses, or works at something else, loses nothing."""

from __future__ import annotations

import os
import termios
import tty
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.stim300 import Stim300
from instruments.errors import LinkError
from instruments.protocols.stim300.frames import LAYOUTS
from instruments.protocols.stim300.settings import Stim300Settings
from instruments.transport.factory import Ports
from instruments.transport.serial import Line
from instruments.transport.stream_reader import KEPT_BYTES, PolledReader, ThreadedReader
from tests.helpers.waiting import eventually

PERIOD_S = 1 / 125


class Unit:
    """A STIM300 at the far end of a pseudo-terminal: it sends datagrams and answers nothing."""

    def __init__(self) -> None:
        self.ours, self.theirs = os.openpty()
        tty.setraw(self.theirs)
        self.path = os.ttyname(self.theirs)
        self.sent = 0

    def send(self, n: int) -> None:
        """Send the next `n` datagrams."""
        layout = LAYOUTS[0x94]
        frames = np.zeros((n, layout.stride), dtype=np.uint8)
        frames[:, 0] = layout.id
        frames[:, layout.counter] = 16 * np.arange(self.sent, self.sent + n) % 256
        frames[:, layout.covered :] = layout.crc(frames).astype(">u4").view(np.uint8).reshape(n, 4)
        data = frames.tobytes()
        while data:
            data = data[os.write(self.ours, data) :]
        self.sent += n

    def close(self) -> None:
        for end in (self.ours, self.theirs):
            os.close(end)


@pytest.fixture
def unit() -> Iterator[Unit]:
    made = Unit()
    yield made
    made.close()


def driver_of(unit: Unit, clock: VirtualClock, **options: Any) -> Stim300:
    given = {"name": "mems", "driver": "stim300", "port": unit.path, "serial": "S-1", "max_rate_dps": 400.0}
    settings = Stim300Settings.model_validate(given | {"options": {"ask": False, **options}})
    return Stim300(settings, Ports(clock), clock)


def let_send(unit: Unit, driver: Stim300, clock: VirtualClock, n: int) -> None:
    """Let the unit send `n` readings in their time; the thread notes each ten of them when they come."""
    reader: Any = driver._stream._reader
    for _ in range(n // 10):
        before = len(reader._unread)
        clock.sleep(10 * PERIOD_S)
        unit.send(10)
        eventually(lambda: len(reader._unread) == before + 10 * LAYOUTS[0x94].stride)  # noqa: B023  ends in this round


def test_a_reader_that_pauses_for_two_seconds_loses_nothing(unit: Unit) -> None:
    clock = VirtualClock()
    driver = driver_of(unit, clock)
    driver.start()
    for _ in range(3):
        let_send(unit, driver, clock, 120)
        assert len(driver.read(0.0)) == 120
    let_send(unit, driver, clock, 250)  # 6250 bytes: one question to a port that is not read shows 4095 of them
    readings = driver.read(0.0)
    assert (len(readings), readings.lost, readings.damaged) == (250, 0, 0)
    assert np.allclose(np.diff(readings.t_s), PERIOD_S, rtol=0.05)
    driver.stop()


def test_a_thread_empties_the_port_while_nobody_asks(unit: Unit) -> None:
    """More bytes than the system keeps for a port that is not read."""
    clock = VirtualClock()
    ports = Ports(clock)
    port = ports.serial(unit.path, device="mems", baudrate=460_800, timeout_s=1.0)
    reader = ports.stream_reader(unit.path, port)
    assert isinstance(reader, ThreadedReader)
    for _ in range(100):
        unit.send(100)
    layout, data = LAYOUTS[0x94], b""

    def all_came() -> bool:
        nonlocal data
        data += reader.take().data
        return len(data) >= 10_000 * layout.stride

    eventually(all_came)
    assert layout.intact(np.frombuffer(data, dtype=np.uint8).reshape(-1, layout.stride)).all()
    reader.close()
    reader.close()
    port.close()


def test_an_arrival_is_noted_when_it_comes(unit: Unit) -> None:
    clock = VirtualClock()
    ports = Ports(clock)
    port = ports.serial(unit.path, device="mems", baudrate=460_800, timeout_s=1.0)
    reader = ports.stream_reader(unit.path, port)
    assert isinstance(reader, ThreadedReader)
    clock.sleep(1.0)
    unit.send(1)
    eventually(lambda: len(reader._unread) == LAYOUTS[0x94].stride)
    clock.sleep(60.0)  # the campaign was busy with something else
    came = reader.take()
    assert (len(came.data), came.now_s) == (25, 1.0)
    reader.close()
    port.close()


def test_a_port_that_breaks_is_a_link_error_and_the_thread_ends() -> None:
    unit, clock = Unit(), VirtualClock()
    driver = driver_of(unit, clock)
    driver.start()
    reader: Any = driver._stream._reader
    unit.close()
    with pytest.raises(LinkError, match=r"the link /dev/pts/\d+ broke"):
        driver.read(1.0)
    assert not reader._thread.is_alive()


class Endless:
    """A port that always holds more, a block at a time."""

    def __init__(self, blocks: int) -> None:
        self.blocks = blocks

    @property
    def in_waiting(self) -> int:
        return (1 << 20) if self.blocks else 0

    def read(self, size: int = 1) -> bytes:
        self.blocks -= 1
        return bytes(size)


def test_what_is_never_taken_does_not_grow_without_end() -> None:
    port: Any = Endless(8)
    reader = ThreadedReader(port, VirtualClock())
    eventually(lambda: port.in_waiting == 0)
    assert len(reader.take().data) == KEPT_BYTES
    reader.close()


def test_a_simulated_port_is_read_by_no_thread(stand: Any) -> None:
    """A thread could change the order in which simulated instruments are asked, and so their noise."""
    s = stand("triaxial-sim")
    s.gyro.start()
    assert isinstance(s.gyro._stream._reader, PolledReader)


@pytest.mark.parametrize("parity", ["none", "odd", "even"])
@pytest.mark.parametrize("stop_bits", [1, 2])
def test_parity_and_stop_bits_are_those_of_the_bench_file(unit: Unit, parity: str, stop_bits: int) -> None:
    driver = driver_of(unit, VirtualClock(), parity=parity, stop_bits=stop_bits)
    driver.start()
    flags = termios.tcgetattr(unit.theirs)[2]
    assert bool(flags & termios.PARENB) == (parity != "none") or parity != "none"  # a terminal may refuse parity
    assert bool(flags & termios.CSTOPB) == (stop_bits == 2)
    port: Any = driver._stream._port
    assert (port.parity, port.stopbits) == (parity[0].upper(), stop_bits)
    driver.stop()


def test_dtr_and_rts_are_set_before_the_port_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    """An adapter that resets its unit by DTR must not do so at every start."""
    done: list[tuple[str, object]] = []

    class Port:
        def __init__(self, *_: object, **__: object) -> None: ...
        def __setattr__(self, name: str, value: object) -> None:
            done.append((name, value))

        def open(self) -> None:
            done.append(("open", None))

    monkeypatch.setattr("instruments.transport.opened_port.unopened", Port)
    Ports(VirtualClock()).serial(
        "/dev/ttyUSB0", device="mems", baudrate=9600, timeout_s=1.0, line=Line(dtr=False, rts=True)
    )
    assert done == [("dtr", False), ("rts", True), ("open", None)]
