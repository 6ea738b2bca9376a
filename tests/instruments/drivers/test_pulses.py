"""Time of readings by the pulses that a unit is given, of units at the far end of a pseudo-terminal.

A unit's crystal is 80 ppm off, and it takes its readings when it likes; a receiver gives it a pulse each second. The
bytes are made without labctl.
"""

from __future__ import annotations

import os
import struct
import tty
from binascii import crc_hqx
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from instruments.clock import VirtualClock
from instruments.drivers.stream_format import StreamFormatGyro
from instruments.interfaces.gyro import Readings
from instruments.protocols.stream_formats.document import StreamFormat
from instruments.protocols.stream_formats.settings import StreamSettings
from instruments.transport.device_time import CountedPulseTime, DeviceTime, PulseTime
from instruments.transport.factory import Ports
from tests.helpers.waiting import eventually

OFF = 1 + 80e-6  #: of the unit's clock: seconds that it counts in one
FIRST_PULSE_S, SECONDS, AT_ONCE = 0.3137, 3.5, 10
Message = Callable[[int, float], bytes]  #: number of the reading, true time at which it was taken -> its bytes


def vectornav(_n: int, t_s: float) -> bytes:
    """Return TimeStartup, TimeSyncIn (s from the last pulse by the unit's clock), acceleration, rates, temperature."""
    since_s = OFF * (t_s - FIRST_PULSE_S - np.floor(t_s - FIRST_PULSE_S))
    body = struct.pack(
        "<BBHHQQ7f", 0xFA, 5, 5, 0x1C, round(1e9 * OFF * (t_s + 7.0)), round(1e9 * since_s), 0, 0, -9.8, 0, 0, 0.5, 24.5
    )
    return body + struct.pack(">H", crc_hqx(body[1:], 0))


def vectornav_line(_n: int, t_s: float) -> bytes:
    """Return a $VNIMU with SyncInTime, whole microseconds since the last pulse by the unit's clock."""
    since_s = OFF * (t_s - FIRST_PULSE_S - np.floor(t_s - FIRST_PULSE_S))
    values = f"{'+00.1000,' * 3}+00.000,+00.000,-09.800,+00.000000,+00.000000,+00.500000,+24.5,+101.3"
    body = f"VNIMU,{values},T{1e6 * since_s:.0f}"
    check = 0
    for byte in body.encode():
        check ^= byte
    return f"${body}*{check:02X}\r\n".encode()


def vectornav_count(_n: int, t_s: float) -> bytes:
    """Return TimeStartup, SyncInCnt, acceleration, rates, temperature."""
    pulses = int(np.floor(t_s - FIRST_PULSE_S)) + 1
    body = struct.pack("<BBHHQI7f", 0xFA, 5, 0x2001, 0x1C, round(1e9 * OFF * t_s), pulses, 0, 0, -9.8, 0, 0, 0.5, 24.5)
    return body + struct.pack(">H", crc_hqx(body[1:], 0))


def xsens(n: int, t_s: float) -> bytes:
    """Return an MTData2 message; SampleTimeFine begins again at 0 in the second second."""
    ticks = round(1e4 * OFF * t_s) + (1 << 32) - 15_000
    data = struct.pack(">HBH", 0x1020, 2, n % 65536) + struct.pack(">HBI", 0x1060, 4, ticks % (1 << 32))
    data += struct.pack(">HB3f", 0x8020, 12, 0.0, 0.0, 0.5) + struct.pack(">HB3f", 0x4020, 12, 0.0, 0.0, 9.8)
    data += struct.pack(">HBf", 0x0810, 4, 24.5) + struct.pack(">HBI", 0xE020, 4, 3)
    body = bytes([0xFF, 0x36, len(data)]) + data
    return b"\xfa" + body + bytes([-sum(body) & 0xFF])


def counting(_n: int, t_s: float) -> bytes:
    """Return a line: rate, time by the unit's own clock in ms, number of pulses so far."""
    pulses = int(np.floor(t_s - FIRST_PULSE_S)) + 1
    return f"0.5,{round(1e3 * OFF * t_s)},{pulses % 256}\r\n".encode()


COUNTING: dict[str, Any] = {
    "format": "labctl-stream/1", "name": "counting", "baudrate": 115200, "rate_hz": 100,
    "time": {"field": "own_ms", "tick_s": 0.001}, "pulses": {"count": "pulses"},
    "line": {"columns": 3, "fields": [
        {"name": "gyro_z", "column": 0, "unit": "deg/s"}, {"name": "own_ms", "column": 1, "resolution": 1.0},
        {"name": "pulses", "column": 2, "resolution": 1.0},
    ]},
}  # fmt: skip


class Unit:
    """A unit that sends messages on a pseudo-terminal."""

    def __init__(self) -> None:
        self.ours, self.theirs = os.openpty()
        tty.setraw(self.theirs)
        self.path = os.ttyname(self.theirs)

    def close(self) -> None:
        for end in (self.ours, self.theirs):
            os.close(end)


@pytest.fixture
def unit() -> Iterator[Unit]:
    made = Unit()
    yield made
    made.close()


def taken_s(rate_hz: float) -> NDArray[np.float64]:
    """Return the true times at which readings are taken: by the unit's crystal."""
    return 0.0021 + np.arange(round(SECONDS * rate_hz)) / (rate_hz * OFF)


def read(unit: Unit, format_: str | StreamFormat, rate_hz: float, message: Message) -> Readings:
    """Return what the driver reads of a unit that sends for SECONDS of the clock, some messages at once."""
    clock = VirtualClock()
    given: dict[str, Any] = {"name": "imu", "driver": "stream-format", "port": unit.path, "serial": "U-1"}
    given |= {"sample_rate_hz": rate_hz}
    settings = StreamSettings.model_validate(given | {"format": format_, "max_rate_dps": 400.0, "axes": ["z"]})
    gyro = StreamFormatGyro(settings, Ports(clock), clock)
    gyro.start()
    reader: Any = gyro._stream._reader
    found: Readings | None = None
    times_s = taken_s(rate_hz)
    for first in range(0, len(times_s), AT_ONCE):
        part = times_s[first : first + AT_ONCE]
        clock.sleep(max(float(part[-1]) + 0.001 - clock.now_s(), 0.0))
        data = b"".join(message(first + k, float(t_s)) for k, t_s in enumerate(part))
        assert os.write(unit.ours, data) == len(data)
        eventually(lambda: len(reader._unread) == len(data))  # noqa: B023  ends in this round
        readings = gyro.read(0.0)
        found = readings if found is None else readings.after(found)
    gyro.stop()
    assert found is not None
    assert (found.lost, found.damaged) == (0, 0)
    assert len(found) >= len(times_s) - 1  # the first line after the opening may be cut
    return found


def test_time_is_by_the_pulses_where_a_unit_says_how_long_ago_the_last_one_came(unit: Unit) -> None:
    found = read(unit, "vectornav-binary-sync", 200.0, vectornav)
    assert found.device_s is not None
    true_s = taken_s(200.0)
    off_s = found.device_s - (true_s - FIRST_PULSE_S)
    off_s -= np.round(off_s[0])  # the zero is the last pulse before the first reading
    assert np.abs(off_s).max() < 81e-6  # within a second the unit's crystal counts; over 3 s nothing adds up
    assert np.diff(found.device_s) == pytest.approx(0.005, abs=90e-6)


def test_time_is_by_the_pulses_where_a_line_says_how_long_ago_the_last_one_came(unit: Unit) -> None:
    found = read(unit, "vectornav-vnimu-sync", 40.0, vectornav_line)
    assert found.device_s is not None
    off_s = found.device_s - (taken_s(40.0)[-len(found) :] - FIRST_PULSE_S)
    off_s -= np.round(off_s[0])
    assert np.abs(off_s).max() < 82e-6


def test_time_is_by_the_pulses_that_a_vectornav_counts(unit: Unit) -> None:
    """A pulse came between two readings, 5 ms apart."""
    found = read(unit, "vectornav-binary-count", 200.0, vectornav_count)
    assert found.device_s is not None
    true_s = taken_s(200.0)[-len(found) :]
    off_s = (found.device_s - true_s)[true_s > FIRST_PULSE_S + 1.0]
    assert np.ptp(off_s) < 0.0052
    assert abs(off_s.mean()) < 0.003


def test_a_counter_of_ten_kilohertz_in_32_bits_is_a_time_of_the_unit(unit: Unit) -> None:
    found = read(unit, "xsens-mti-timed", 100.0, xsens)
    assert found.device_s is not None
    passed_s = found.device_s - found.device_s[0]
    assert passed_s == pytest.approx(OFF * (taken_s(100.0) - taken_s(100.0)[0]), abs=1.1e-4)
    assert found.device_s[0] == pytest.approx(((1 << 32) - 15_000) * 1e-4 + OFF * 0.0021, abs=1e-4)


def test_time_is_by_the_pulses_where_a_unit_counts_them(unit: Unit) -> None:
    """A pulse came between two readings, 10 ms apart; own times are whole milliseconds."""
    found = read(unit, StreamFormat.model_validate(COUNTING), 100.0, counting)
    assert found.device_s is not None
    true_s = taken_s(100.0)[-len(found) :]
    counted = true_s > FIRST_PULSE_S + 1.0
    off_s = (found.device_s - true_s)[counted]
    assert np.ptp(off_s) < 0.0102
    assert abs(off_s.mean()) < 0.0055


def test_pulses_that_do_not_come_do_not_count() -> None:
    """The cable of the pulses is off for 4.6 s: the unit counts on, and the next pulse finds the time of the source."""
    true_s = 0.37 + 0.01 * np.arange(1200)
    came_s = np.where(true_s < 3.0, np.floor(true_s), np.where(true_s < 8.0, 2.0, np.floor(true_s)))
    ticks = np.rint(1e6 * OFF * (true_s - came_s)).astype(np.int64)
    clock_s = 50.0 + true_s * (1 + 2e-5) + 0.002 * np.sin(true_s)  # of this computer
    told = PulseTime(1e-6, 1.0)
    found = np.concatenate([told.of(ticks[part], clock_s[part]) for part in (slice(0, 500), slice(500, 1200))])
    off_s = found - true_s
    assert np.abs(off_s[true_s < 3.0]).max() < 81e-6
    assert np.abs(off_s[true_s > 8.0]).max() < 81e-6
    assert np.abs(off_s).max() < 6 * 81e-6
    assert told.of(np.zeros(0, dtype=np.int64), np.zeros(0)).tolist() == []


@pytest.mark.parametrize("missing", [(), (3, 4, 5)])
def test_counted_pulses_are_known_better_with_each(missing: tuple[int, ...]) -> None:
    rng = np.random.default_rng(6)
    rate_hz, seconds = 99.7, 40
    true_s = 0.123 + np.arange(int(seconds * rate_hz)) / rate_hz
    pulse_s = np.array([k + 0.5 for k in range(seconds) if k not in missing])
    counts = np.searchsorted(pulse_s, true_s) % 256
    ticks = np.stack([np.rint(1e5 * OFF * true_s).astype(np.int64), counts], axis=1)
    told = CountedPulseTime(DeviceTime(1e-5, None), 1.0)
    cuts = np.sort(rng.choice(len(true_s), 30, replace=False))
    parts = [told.of(*part) for part in zip(np.split(ticks, cuts), np.split(true_s, cuts), strict=True)]
    off_s = np.concatenate(parts) - true_s
    last = off_s[true_s > 20.0]
    assert np.ptp(last) < 0.005  # half of a sampling period, where the period of the unit does not divide a second
    assert abs(off_s[true_s > 1.0]).max() < 0.011


@pytest.mark.parametrize(
    ("pulses", "said"),
    [
        ({}, "give exactly one of since"),
        ({"since": "pulses", "count": "pulses", "tick_s": 1.0}, "give exactly one of since"),
        ({"since": "own_ms"}, "tick_s is missing; give the time in s of one unit"),
        ({"count": "edges"}, "pulses: no field is named 'edges'; choose one of gyro_z, own_ms, pulses"),
        ({"count": "pulses", "interval_s": 0}, "greater than 0"),
    ],
)
def test_what_a_format_says_wrong_of_pulses_is_refused(pulses: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        StreamFormat.model_validate(COUNTING | {"pulses": pulses})


def test_a_number_of_pulses_alone_tells_no_time() -> None:
    document = {key: value for key, value in COUNTING.items() if key != "time"}
    with pytest.raises(ValueError, match="a number of pulses tells no time between them; add time or counter"):
        StreamFormat.model_validate(document)
