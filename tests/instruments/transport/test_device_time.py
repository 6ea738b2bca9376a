"""Time by a unit's own clock: counters and time stamps that begin again, pauses, late bytes, and times of arrival."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.stream_format import StreamFormatGyro
from instruments.protocols.byte_lines import split_lines
from instruments.protocols.stream_formats.document import read_format
from instruments.protocols.stream_formats.frames import FrameDecoder
from instruments.protocols.stream_formats.settings import StreamSettings
from instruments.transport.device_time import DeviceTime
from instruments.transport.factory import Ports
from instruments.transport.serial_stream import SerialStream
from instruments.transport.stream_reader import Received


@pytest.mark.parametrize(("tick_s", "wrap", "step"), [(1 / 2000, 256, 16), (1e-3, 128, 1), (1e-4, 1 << 32, 25)])
@pytest.mark.parametrize("share", [0.9999, 1.0, 1.0001])
def test_a_counter_that_begins_again_gives_the_units_own_time(
    tick_s: float, wrap: int, step: int, share: float
) -> None:
    rng = np.random.default_rng(3)
    made = 77 + step * np.cumsum(rng.choice([1, 1, 1, 1, 2, 30], size=4000))  # some never come
    told = DeviceTime(tick_s, wrap)
    clock_s = 500.0 + share * tick_s * made
    cuts = np.sort(rng.choice(len(made), size=60, replace=False))
    parts = zip(np.split(made, cuts), np.split(clock_s, cuts), strict=True)
    found = np.concatenate([told.of(counted % wrap, t_s) for counted, t_s in parts])
    first = made[0] - made[0] % wrap  # the unit's zero is not known
    assert found == pytest.approx((made - first) * tick_s, abs=1e-9)


def test_a_pause_of_whole_turns_of_the_counter_is_told_by_the_clock() -> None:
    told = DeviceTime(1 / 2000, 256)
    before = told.of(np.array([0, 16, 32]), np.array([10.0, 10.008, 10.016]))
    after = told.of(np.array([48]), np.array([10.024 + 700 * 0.128 + 0.05]))  # 50 ms of 90 s: the clocks differ
    assert after[0] - before[-1] == pytest.approx(0.008 + 700 * 0.128)


def test_a_time_stamp_that_never_begins_again_is_taken_as_it_is() -> None:
    found = DeviceTime(1e-9, None).of(np.array([5_000_000_000, 5_005_000_000]), np.array([0.0, 9.0]))
    assert found.tolist() == [5.0, 5.005]
    assert DeviceTime(1e-9, 8).of(np.zeros(0, dtype=np.int64), np.zeros(0)).tolist() == []


def vectornav(time_ns: int, rate_rps: float) -> bytes:
    """Return a binary output message with groups 1 and 3, made without labctl."""
    body = struct.pack("<BBHHQ7f", 0xFA, 5, 1, 0x1C, time_ns, 0.0, 0.0, -9.8, 0.0, 0.0, rate_rps, 24.5)
    return body + struct.pack(">H", crc_hqx(body[1:], 0))


def test_the_time_stamp_of_a_vectornav_message_is_read() -> None:
    frames = vectornav(987_654_321_012_345, 0.5) + vectornav(987_654_326_012_345, 0.5)
    found = FrameDecoder(read_format("vectornav-binary-timed")).feed(b"\x00\x01" + frames + b"\xfa\x05\x01")
    assert found.values["time_startup"].tolist() == [987_654_321_012_345, 987_654_326_012_345]
    assert found.behind.tolist() == [47, 3]


def test_lines_say_how_many_bytes_came_after_them() -> None:
    lines, behind, rest = split_lines(b"1,2\r\n\r\n3,4\n5,", 80)
    assert (lines, behind.tolist(), rest) == ([b"1,2", b"", b"3,4"], [8, 6, 2], b"5,")
    assert split_lines(b"123456", 4)[2] == b"3456"


class Pieces:
    """A reader whose bytes arrived in pieces."""

    def __init__(self, *given: Received) -> None:
        self.given = list(given)

    def take(self) -> Received:
        return self.given.pop(0)


def test_each_reading_has_the_time_at_which_its_last_byte_came() -> None:
    clock = VirtualClock()
    stream: Any = SerialStream("unit", "/dev/null", Ports(clock), clock, baudrate=9600, timeout_s=1.0)
    stream._reader = Pieces(
        Received(b"abcdef", 3.0, 2.9, 0.016, ((4, 1.0), (2, 2.9))), Received(b"ghij", 4.0), Received(b"", 5.0)
    )
    assert stream.read_available() == b"abcdef"
    assert stream.arrival_s(np.array([5, 2, 1, 0])).tolist() == [1.0, 1.0, 2.9, 2.9]
    assert stream.arrival_s(np.array([9])).tolist() == [1.0]  # older than what is known
    assert stream.read_available() == b"ghij"
    assert stream.arrival_s(np.array([3, 0])).tolist() == [4.0, 4.0]
    assert stream.read_available() == b""
    assert stream.arrival_s(np.array([0])).tolist() == [5.0]


class Link:
    """Ports, port and reader of a unit whose bytes are given."""

    def __init__(self, clock: VirtualClock) -> None:
        self.clock, self.data, self.due_s = clock, b"", 0.0

    def serial(self, *_: Any, **__: Any) -> Link:
        return self

    def stream_reader(self, *_: Any) -> Link:
        return self

    def take(self) -> Received:
        if self.clock.now_s() < self.due_s - 1e-9:
            return Received(b"", self.clock.now_s())
        data, self.data = self.data, b""
        return Received(data, self.clock.now_s())

    def discard(self) -> None:
        self.data = b""

    def close(self) -> None:
        """Nothing is open."""


def read_messages(*sent_ns: list[int]) -> list[Any]:
    """Return what the driver reads of messages with these time stamps, in one read each; a read lasts 0.45 s."""
    clock = VirtualClock()
    link: Any = Link(clock)
    given = {"name": "vn", "driver": "stream-format", "port": "/dev/null", "serial": "V-1", "max_rate_dps": 400.0}
    gyro = StreamFormatGyro(StreamSettings.model_validate(given | {"format": "vectornav-binary-timed"}), link, clock)
    gyro.start()
    found = []
    for stamps in sent_ns:
        link.data = b"".join(vectornav(stamp, 0.5) for stamp in stamps)
        link.due_s = clock.now_s() + 0.45
        found.append(gyro.read(0.45))
    return found


def test_a_time_stamp_decides_what_is_lost_and_is_kept_with_each_reading() -> None:
    ns = [10**12 + 5_000_000 * k for k in range(300)]
    first, second = read_messages(ns[:90], ns[90:130] + ns[137:180])
    assert (first.lost, second.lost) == (0, 7)
    for part, stamps in ((first, ns[:90]), (second, ns[90:130] + ns[137:180])):
        assert part.device_s == pytest.approx(np.array(stamps) / 1e9, abs=1e-9)
        assert (part.arrival_s >= part.t_s - 1e-9).all()
    assert np.diff(second.t_s)[39] == pytest.approx(8 * 0.005, rel=1e-3)
    newest = second.newest()
    assert newest.device_s == pytest.approx([ns[179] / 1e9], abs=1e-9)
    assert (newest.lost, len(newest)) == (0, 1)
