"""Gyros on a CAN bus, through bytes: values, cycles that are not whole, the bus itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.drivers.can_bus import TRIAL
from instruments.errors import LinkError, MalformedReply, NoReply, WrongInstrument
from instruments.protocols.can.frames import CanFrame, packed

Make = Callable[..., Any]


@pytest.fixture
def on_bus(stand: Make) -> Make:
    def make(simulation: dict[str, Any] | None = None, **more: Any) -> Any:
        gyro = {"driver": "can", "axes": ("x", "y", "z"), **TRIAL, **more}
        made = stand("triaxial-sim", gyro=gyro, simulation=simulation or {})
        made.gyro.start()
        return made

    return make


def altered(s: Any, monkeypatch: pytest.MonkeyPatch, change: Callable[[bytes], bytes]) -> None:
    """Let the frames of the simulated unit go through `change`."""
    device = s.bench.simulation.device(s.gyro_url)._device
    transmit = device.transmit
    monkeypatch.setattr(device, "transmit", lambda t_s: change(transmit(t_s)))


def counts(parts: list[Any]) -> tuple[int, int, int]:
    return sum(map(len, parts)), sum(each.lost for each in parts), sum(each.damaged for each in parts)


def test_the_table_rate_is_seen(on_bus: Make) -> None:
    s = on_bus()
    s.bench.table.home()
    channels = {each.name: each for each in s.gyro.channels}
    for asked in (90.0, -30.0):
        spin = s.bench.table.spin(asked, 4)
        s.gyro.read_latest()
        readings = s.gyro.read(3.0)
        s.bench.table.settle(spin)
        found = {name: each.value(readings.raw[name]).mean() for name, each in channels.items()}
        assert found["gyro_z"] == pytest.approx(asked, abs=1.5)
        assert found["accel_z_g"] == pytest.approx(1, abs=1e-3)
        assert found["temperature_c"] == pytest.approx(26, abs=3)
        assert readings.valid.all()
        assert counts([readings])[1:] == (0, 0)


def test_a_kilohertz_comes_without_a_loss(on_bus: Make) -> None:
    s = on_bus(sample_rate_hz=1000)
    parts = [s.gyro.read(0.5) for _ in range(4)]
    n, lost, damaged = counts(parts)
    assert n == pytest.approx(2000, abs=3)
    assert (lost, damaged) == (0, 0)
    assert np.allclose(np.diff(np.concatenate([each.t_s for each in parts])), 1e-3, rtol=1e-2)


@pytest.mark.parametrize("counter", ["Rates.Count", None])
def test_a_missing_message_is_one_reading(on_bus: Make, counter: str | None) -> None:
    """With a counter it is lost, and damaged; without one it has taken its period."""
    s = on_bus(counter=counter)
    first = s.gyro.read(1.0)
    s.faults(s.gyro_url).arm("lost_reply", count=1)
    parts = [first, *(s.gyro.read(0.5) for _ in range(4))]
    n, lost, damaged = counts(parts)
    assert (n, damaged) == (299, 1)
    assert lost == (1 if counter else 0)
    steps = np.diff(np.concatenate([each.t_s for each in parts]))
    assert sorted(np.round(steps / 0.01)) == [1.0] * (len(steps) - 1) + [2.0]


def test_a_gap_of_the_counter_is_counted(on_bus: Make) -> None:
    s = on_bus()
    s.gyro.read(1.0)
    s.faults(s.gyro_url).arm("counter_gap", count=1, value=9)
    _, lost, damaged = counts([s.gyro.read(0.5) for _ in range(4)])
    assert (lost, damaged) == (9, 0)


def test_an_error_frame_is_damaged_and_loses_nothing(on_bus: Make) -> None:
    s = on_bus()
    s.gyro.read(1.0)
    s.faults(s.gyro_url).arm("wrong_crc", count=1)
    assert counts([s.gyro.read(1.0)])[1:] == (0, 1)


def test_bus_off_is_told_and_the_bus_can_be_opened_again(on_bus: Make) -> None:
    s = on_bus()
    s.gyro.read(1.0)
    s.faults(s.gyro_url).arm("stall", count=1)
    with pytest.raises(LinkError, match=r"^mems: the interface of sim://can/mems has left the bus .*; check bit rate"):
        s.gyro.read(1.0)
    s.gyro.start()
    assert counts([s.gyro.read(1.0)])[1:] == (0, 0)


def test_frames_other_than_readings_are_reported(on_bus: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = on_bus()
    out: list[bytes] = []
    altered(s, monkeypatch, lambda data: b"".join(out) if data else b"")
    for sent, text in [
        ([], r"no reading on sim://can/mems for 2.0 s: no frame arrived; check power, cable and bit rate$"),
        ([packed(CanFrame(0x20, b"x"))], r"frames arrived, but not message Rates \(0x1A0\), RateAndForce \(0x1A1\)"),
        (
            [packed(CanFrame(0x20000088, b""))],
            r"the bus reports errors \(\d+ of protocol violation, \d+ of bus error\)",
        ),
    ]:
        out[:] = sent
        with pytest.raises(NoReply, match=text):
            s.gyro.read_latest()


def test_another_rate_and_a_counter_that_stands_are_told(on_bus: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = on_bus(simulation={"units": {"mems": {"sample_clock_ppm": 2e5}}})
    with pytest.raises(WrongInstrument, match=r"sends 120 readings/s on sim://can/mems, but the bench file says 100"):
        [s.gyro.read(1.0) for _ in range(60)]
    s = on_bus()
    altered(s, monkeypatch, lambda data: b"".join(
        each[:14] + b"\x17" + each[15:] if each[:2] == b"\xa0\x01" else each
        for each in (data[at : at + 16] for at in range(0, len(data), 16))
    ))  # fmt: skip
    with pytest.raises(MalformedReply, match=r"mems: the sample counter on sim://can/mems does not advance: it is 7"):
        [s.gyro.read(0.5) for _ in range(4)]


def test_the_frames_that_start_a_unit_are_sent(on_bus: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = on_bus(start=["000#0100", "18F00101#FF"])
    s.gyro.stop()
    heard: list[bytes] = []
    device = s.bench.simulation.device(s.gyro_url)._device
    monkeypatch.setattr(device, "receive", lambda data, t_s: heard.append(data))
    s.gyro.start()
    assert heard == [packed(CanFrame(0, b"\x01\x00")), packed(CanFrame(0x98F00101, b"\xff"))]
