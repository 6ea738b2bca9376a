"""Analog gyros on a LabJack T7 at a kilohertz, through its bytes: set-up, packets, means, times, what is missing.

Golden bytes and constants: LabJack's T-series data sheet 3.2.4 and Modbus map, and its C example t7_modbus_tcp_stream.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from instruments.errors import LinkError, NoReply, WrongInstrument
from instruments.protocols.labjack import registers as lj
from instruments.protocols.labjack import stream
from instruments.protocols.labjack.scans import PacketScans
from instruments.simulators.devices.labjack import NOMINAL
from instruments.simulators.links.modbus_device import float32
from instruments.transport.scan_means import ScanMeans
from tests.helpers.tap import Tap

HOST, STREAM = "sim://labjack-t7/fog", "sim://labjack-t7-stream/fog"
#: A packet as the header in the data sheet says: number 5, backlog 4 bytes, status 2941, 7 scans skipped, two codes.
GOLDEN = bytes.fromhex("0005 0000 000e 01 4c 10 00 0004 0b7d 0007 82f3 ffff")


@pytest.fixture
def labjack(stand: Callable[..., Any]) -> Callable[..., Any]:
    """Make a bench with gyros on a LabJack, and a tap on its registers."""

    def make(rate_hz: float = 1000.0, unit: dict[str, Any] | None = None, **options: Any) -> Any:
        gyro = {"driver": "labjack-t", "host": HOST, "port": STREAM, "sample_rate_hz": rate_hz, "options": options}
        s = stand("single-axis-sim", gyro=gyro, simulation={"units": {"fog": unit or {}}})
        wire = s.bench.simulation.device(HOST)
        s.registers, s.packets = wire._device, s.bench.simulation.device(STREAM)._device
        s.tap = s.bench.simulation._devices[HOST] = Tap(wire)
        return s

    return make


def test_a_packet_by_its_bytes() -> None:
    (packet,), rest, damaged = stream.split(GOLDEN + GOLDEN[:9])
    assert (packet.number, packet.backlog, packet.status, packet.info) == (5, 4, stream.RECOVERED, 7)
    assert packet.codes.tolist() == [33523, 65535]
    assert (rest, damaged) == (GOLDEN[:9], 0)
    assert stream.build(packet) == GOLDEN
    assert [p.number for p in stream.split(b"\x00junk" + GOLDEN + b"xx" + GOLDEN)[0]] == [5, 5]
    assert stream.split(b"\x00junk" + GOLDEN + b"xx" + GOLDEN)[2] == 2


def test_codes_and_volts() -> None:
    """With LabJack's nominal constants: 0 V at the centre; 10 V and -10 V are within its range of codes."""
    scaling = lj.t7_scaling(NOMINAL, lj.gain_index(10.0))
    assert scaling.slope_v * (33523 - scaling.centre) == 0
    assert [round(v / scaling.slope_v + scaling.centre) for v in (-10.0, 10.0)] == [1858, 65188]
    assert scaling.kink < 1e-6
    assert lj.t4_scaling([0.0, 0.0, 3.235e-4, -10.532965], 1).centre == pytest.approx(32559.4, abs=0.1)
    with pytest.raises(ValueError, match="5 V is not a range of a T7"):
        lj.gain_index(5.0)


def test_what_is_written_before_the_stream(labjack: Callable[..., Any]) -> None:
    s = labjack(average=10, thermometer_input=2)
    s.gyro.start()
    written = [
        (int.from_bytes(frame[8:10], "big"), frame[13 if frame[7] == 16 else 10 :].hex())
        for frame in s.tap.heard
        if frame[7] in (6, 16)
    ]
    assert (61810, "003c4000") in written
    assert written[2:-3] == [
        (40000, "41200000"),  # AIN0_RANGE 10.0
        (41000, "00c7"),  # AIN0_NEGATIVE_CH 199: single-ended
        (40004, "41200000"),
        (41002, "00c7"),
        (4002, "447a0000"),  # STREAM_SCANRATE_HZ 1000.0
        (4004, "00000002"),
        (4006, "00000064"),  # 50 scans of 2 inputs
        (4008, "00000000"),
        (4010, "00000000"),
        (4012, "00008000"),
        (4016, "00000001"),  # Ethernet
        (4018, "00000000"),
        (4020, "00000000"),
    ]
    assert written[-3:] == [(4100, "00000000"), (4102, "00000004"), (4990, "00000001")]
    s.gyro.stop()
    assert s.registers.stream.started_s is None


@pytest.mark.parametrize("average", [1, 10, 7, 100])
def test_no_scan_is_lost_at_a_kilohertz(labjack: Callable[..., Any], average: int) -> None:
    s = labjack(average=average)
    s.gyro.start()
    s.gyro.read_latest()
    parts = [s.gyro.read(1.0) for _ in range(20)]
    times = np.concatenate([part.t_s for part in parts])
    assert sum(part.lost + part.damaged for part in parts) == 0
    assert len(times) == pytest.approx(20_000 / average, abs=60 / average + 2)
    assert np.diff(times) == pytest.approx(average / 1000.0, rel=1e-3)
    assert all(part.valid.all() for part in parts)


def test_a_reading_is_the_exact_mean_of_its_scans(labjack: Callable[..., Any]) -> None:
    means = ScanMeans(4, 1)
    codes = np.arange(40_000, 40_010)[:, None]
    first = means.add(np.arange(10), codes, np.ones(10, dtype=bool))
    assert (first[0].tolist(), first[1].ravel().tolist()) == ([0, 1], [codes[:4].sum(), codes[4:8].sum()])
    second = means.add(np.array([10, 11, 13, 14, 15, 16]), np.full((6, 1), 5), np.array([True, True, *[False] * 4]))
    assert (second[0].tolist(), second[2].tolist()) == ([2], [True])  # of 12 to 15 one scan is missing
    s = labjack(average=50)
    (channel,) = s.gyro.channels
    code = 2.5 / 3.1580578e-4 + 33523
    assert channel.value(np.array([round(50 * code)]))[0] == pytest.approx(2.5, abs=1e-5)


def test_the_rate_of_a_turning_table_in_volts(labjack: Callable[..., Any]) -> None:
    s = labjack(average=10, unit={"white_dps_rthz": 0.0, "instability_dps": 0.0})
    s.gyro.start()
    s.clock.sleep(600.0)
    s.gyro.read_latest()
    rest = s.gyro.channels[0].value(s.gyro.read(2.0).raw["gyro_z"]).mean()
    s.world.table.start(s.clock.now_s(), 200 * 60, 200.0, 90.0)
    s.clock.sleep(5.0)
    s.gyro.read_latest()
    turning = s.gyro.channels[0].value(s.gyro.read(4.0).raw["gyro_z"]).mean()
    assert (turning - rest) / 0.022 == pytest.approx(45.0, rel=0.005)


def test_a_reading_arrives_with_the_packet_of_its_last_scan(labjack: Callable[..., Any]) -> None:
    """Packets of 50 scans are on the wire every 50 ms; a reading of 20 scans may begin in the packet before."""
    s = labjack(average=20)
    s.gyro.start()
    s.gyro.read_latest()
    found = s.gyro.read(0.01)
    for _ in range(400):
        found = s.gyro.read(0.01).after(found)
    assert found.arrival_s is not None
    assert len(found) == pytest.approx(200, abs=3)
    late_s = found.arrival_s - found.t_s
    assert (late_s >= -1e-9).all()
    assert late_s.max() < 0.06 + 0.02  # a packet, and a read that comes 10 ms later
    assert np.diff(np.unique(found.arrival_s)).max() < 0.07


def test_packets_know_how_many_bytes_came_after_them() -> None:
    (first, second), _, _ = stream.split(GOLDEN + GOLDEN + GOLDEN[:9])
    assert (first.behind, second.behind) == (len(GOLDEN) + 9, 9)
    assert PacketScans(1, 2).add([first, second])[2].tolist() == [len(GOLDEN) + 9, 9]  # one of two is a dummy


def test_packets_that_are_missing_are_counted(labjack: Callable[..., Any]) -> None:
    s = labjack(average=10)
    s.gyro.start()
    s.gyro.read_latest()
    s.faults(STREAM).arm("counter_gap", from_s=s.clock.now_s() + 2.0, count=1, value=1)  # one packet of 50 scans
    readings = s.gyro.read(5.0)
    assert readings.lost == 5
    assert np.diff(readings.t_s).max() == pytest.approx(0.06, rel=1e-2)
    assert np.sort(np.diff(readings.t_s))[:-1] == pytest.approx(0.01, rel=1e-2)


def test_scans_that_the_device_skipped_are_counted(labjack: Callable[..., Any]) -> None:
    s = labjack(average=10)
    s.gyro.start()
    s.gyro.read_latest()
    before = s.gyro.read(2.0)
    s.packets.overflow_scans = 120
    after = s.gyro.read(3.0)
    assert (before.lost, after.lost) == (0, pytest.approx(12, abs=1))
    assert after.valid.all()
    steps = np.diff(np.concatenate([before.t_s, after.t_s]))
    assert steps.max() == pytest.approx(0.13, abs=0.011)
    assert np.sort(steps)[:-1] == pytest.approx(0.01, rel=1e-2)


def test_numbers_go_on_where_the_devices_count_begins_anew() -> None:
    scans = PacketScans(1, 2)
    packets = [stream.Packet(n, 0, 0, 0, np.array([1, 2])) for n in (65534, 65535, 0, 1)]
    assert np.diff(scans.add(packets)[0]).tolist() == [1] * 7


@pytest.mark.parametrize(
    ("status", "text"), [(2942, "cannot be scanned at this rate"), (2943, "more than 65535 scans")]
)
def test_a_stream_that_ended_says_why(labjack: Callable[..., Any], status: int, text: str) -> None:
    s = labjack()
    s.gyro.start()
    s.packets.status = status
    with pytest.raises(LinkError, match=rf"^fog: the stream ended \(status {status}\): .*{text}"):
        s.gyro.read(1.0)
    s.gyro.start()
    assert len(s.gyro.read_latest()) == 1


def test_codes_at_the_rails_are_not_valid(labjack: Callable[..., Any]) -> None:
    s = labjack(average=10, rest_v=10.5)
    s.gyro.start()
    s.gyro.read_latest()
    assert not s.gyro.read(0.5).valid.any()


def test_another_device_and_another_rate_are_refused(labjack: Callable[..., Any]) -> None:
    s = labjack()
    s.registers.product = 9.0
    with pytest.raises(
        WrongInstrument, match=r"fog: sim://labjack-t7/fog reports product number 9, which is not a LabJack T4 or T7"
    ):
        s.gyro.identify()
    other = labjack()
    other.registers._cells[lj.SCAN_RATE.number] = float32("big", lambda _: 980.0, lambda _value, _t_s: True)
    with pytest.raises(
        WrongInstrument, match=r"scans 980 times per second, but the bench file states 1000; set sample_rate_hz = 980"
    ):
        other.gyro.start()
    bent = labjack()
    bent.registers.constants[1] *= 1.001
    with pytest.raises(WrongInstrument, match="differ by 1000 ppm, limit 20 ppm; check the calibration"):
        bent.gyro.identify()


def test_identity(labjack: Callable[..., Any]) -> None:
    found = labjack(average=10).gyro.identify()
    assert found.reported == {"inputs": "LabJack T7 470012345"}
    assert found.output == {"z": {"unit": "V", "offset": 2.5, "scale": 0.022}}


def test_a_stream_that_another_program_left_running_is_ended_first(labjack: Callable[..., Any]) -> None:
    s = labjack()
    s.registers.stream.values |= {4004: 1, 4006: 10}
    s.registers.stream.enable(1, 0.0)
    s.gyro.start()
    assert len(s.gyro.read_latest()) == 1


def test_silence(labjack: Callable[..., Any]) -> None:
    s = labjack()
    s.gyro.start()
    s.faults(STREAM).arm("silence")
    with pytest.raises(NoReply, match=r"^fog: no scan from sim://labjack-t7-stream/fog for 2\.0 s; check network"):
        s.gyro.read_latest()
    s.gyro.stop()
    s.gyro.stop()


@pytest.mark.parametrize(
    ("options", "text"),
    [({"inputs": [0, 1]}, "2 inputs for 1 axes"), ({"thermometer_input": 0}, "one input is given for two signals")],
)
def test_wrong_wiring_is_refused(labjack: Callable[..., Any], options: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        labjack(**options)
