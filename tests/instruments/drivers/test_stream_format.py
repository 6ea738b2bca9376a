"""Gyros by stream formats, through bytes: values, counters, losses, rates, and a whole campaign's data set."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.errors import LimitError, MalformedReply, NoReply, WrongInstrument
from instruments.protocols.stream_formats.document import shipped_formats

Make = Callable[..., Any]


def on_bench(stand: Make, format_: str, **more: Any) -> Any:
    gyro = {"driver": "stream-format", "format": format_, "port": "sim://stream-format/mems", "axes": ("x", "y", "z")}
    given = gyro | {"sample_rate_hz": None} | more
    if format_ == "kvh-dsp1760":
        given["axes"] = ("z",)
    made = stand("triaxial-sim", gyro=given)
    made.gyro.start()
    return made


@pytest.fixture(params=list(shipped_formats()))
def streaming(request: pytest.FixtureRequest, stand: Make) -> Any:
    return on_bench(stand, request.param, sample_rate_hz=40)


def test_the_table_rate_is_seen_in_its_unit(streaming: Any) -> None:
    streaming.bench.table.home()
    for asked in (90.0, -30.0):
        spin = streaming.bench.table.spin(asked, 4)
        streaming.gyro.read_latest()
        readings = streaming.gyro.read(3.0)
        streaming.bench.table.settle(spin)
        channels = {each.name: each for each in streaming.gyro.channels}
        assert channels["gyro_z"].value(readings.raw["gyro_z"]).mean() == pytest.approx(asked, abs=1.5)
        if "accel_z_g" in channels:
            assert channels["accel_z_g"].value(readings.raw["accel_z_g"]).mean() == pytest.approx(1, abs=1e-3)
        if "temperature_c" in channels:
            assert channels["temperature_c"].value(readings.raw["temperature_c"]).mean() == pytest.approx(26, abs=3)
        assert readings.valid.all()
        assert (readings.lost, readings.damaged) == (0, 0)


def test_a_kilohertz_comes_without_a_loss(stand: Make) -> None:
    s = on_bench(stand, "kvh-1750", sample_rate_hz=1000)
    parts = [s.gyro.read(0.5) for _ in range(10)]
    assert sum(len(part) for part in parts) == pytest.approx(5000, abs=2)
    assert sum(part.lost + part.damaged for part in parts) == 0
    times = np.concatenate([part.t_s for part in parts])
    assert np.allclose(np.diff(times), 1e-3, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("format_", "share"), [("xsens-mti", 0.97), ("kvh-1750", 1.03), ("serial-csv", 1.03)])
def test_a_clock_three_per_cent_off_loses_nothing(stand: Make, format_: str, share: float) -> None:
    s = stand(
        "triaxial-sim",
        gyro={"driver": "stream-format", "format": format_, "port": "sim://stream-format/mems", "sample_rate_hz": 100},
        simulation={"units": {"mems": {"sample_clock_ppm": 1e6 * (share - 1)}}},
    )
    s.gyro.start()
    parts = [s.gyro.read(1.0) for _ in range(120)]
    assert sum(part.lost + part.damaged for part in parts) == 0
    times = np.concatenate([part.t_s for part in parts[30:]])
    assert (times[-1] - times[0]) / (len(times) - 1) == pytest.approx(0.01 / share, rel=2e-5)


def test_a_gap_of_the_counter_is_counted(stand: Make) -> None:
    s = on_bench(stand, "kvh-1750", sample_rate_hz=200)
    s.gyro.read(1.0)
    s.faults(s.gyro_url).arm("counter_gap", count=1, value=9)
    parts = [s.gyro.read(0.5) for _ in range(4)]
    assert sum(part.lost for part in parts) == 9
    assert sum(part.damaged for part in parts) == 0


def read_on(s: Any, duration_s: float) -> None:
    """Read in steps, as a campaign does."""
    for _ in range(round(2 * duration_s)):
        s.gyro.read(0.5)


def altered(s: Any, monkeypatch: pytest.MonkeyPatch, change: Callable[[bytes], bytes]) -> None:
    """Let the simulated unit's bytes go through `change`."""
    device = s.bench.simulation.device(s.gyro_url)._device
    transmit = device.transmit
    monkeypatch.setattr(device, "transmit", lambda t_s: change(transmit(t_s)))


def test_a_constant_counter_is_reported(stand: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = on_bench(stand, "kvh-1750", sample_rate_hz=100)
    s.gyro.read(1.0)
    import instruments.simulators.devices.stream_format as simulated

    message = simulated.message
    monkeypatch.setattr(simulated, "message", lambda f, numbers: message(f, numbers | {"sequence": 7}))
    with pytest.raises(
        MalformedReply,
        match=r"mems: the sample counter on sim://.* does not advance: it is 7 in \d+ successive readings; check",
    ):
        s.gyro.read(2.0)


def test_a_frame_that_is_sent_twice_is_one_reading(stand: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = on_bench(stand, "kvh-1750", sample_rate_hz=50)
    s.gyro.read(1.0)
    altered(s, monkeypatch, lambda data: b"".join(2 * data[at : at + 36] for at in range(0, len(data), 36)))
    parts = [s.gyro.read(0.5) for _ in range(4)]
    assert sum(len(part) for part in parts) == pytest.approx(100, abs=1)
    assert sum(part.lost for part in parts) == 0
    assert sum(part.damaged for part in parts) == sum(len(part) for part in parts)
    times = np.concatenate([part.t_s for part in parts])
    assert np.allclose(np.diff(times), 0.02, rtol=1e-2)


def test_a_wrong_baud_rate_is_reported(stand: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = on_bench(stand, "kvh-1750", sample_rate_hz=100)
    s.gyro.read(1.0)
    altered(s, monkeypatch, lambda data: bytes(each & 0x9B for each in data))
    with pytest.raises(
        NoReply, match=r"no intact KVH 1750 reading on sim://\S+ for 2.\d s: \d+ bytes arrived .* baud rate 921600"
    ):
        read_on(s, 4.0)


def test_a_different_sample_rate_is_reported(stand: Make) -> None:
    s = stand(
        "triaxial-sim",
        gyro={
            "driver": "stream-format",
            "format": "serial-csv",
            "port": "sim://stream-format/mems",
            "sample_rate_hz": 100,
        },
        simulation={"units": {"mems": {"sample_clock_ppm": 100_000}}},
    )
    s.gyro.start()
    with pytest.raises(WrongInstrument, match=r"sends 110 readings/s .*bench file says 100.*set sample_rate_hz = 110"):
        read_on(s, 10.0)


def test_increments_become_rates(stand: Make) -> None:
    """KVH units as delivered send increments: the same bytes in `rad/sample`."""
    from instruments.protocols.stream_formats.document import read_format

    record = read_format("kvh-1750").model_dump()
    for field in record["frame"]["fields"]:
        if field["name"].startswith("gyro_"):
            field["unit"] = "rad/sample"
    s = on_bench(stand, record, sample_rate_hz=100)
    assert [each.unit for each in s.gyro.channels[:3]] == ["deg/s"] * 3
    readings = s.gyro.read(1.0)
    channel = s.gyro.channels[0]
    assert channel.scale == pytest.approx(2.0**-40 * 180 / np.pi * 100)
    assert abs(channel.value(readings.raw["gyro_x"])).max() < 2


def test_what_the_format_sends_at_the_start_is_sent(stand: Make) -> None:
    from instruments.protocols.stream_formats.document import read_format

    record = read_format("serial-csv").model_dump() | {"start": ("=CONFIG,1\r\n", "go\n")}
    s = on_bench(stand, record)
    heard: list[bytes] = []
    s.bench.simulation.device(s.gyro_url)._device.receive = lambda data, t_s: heard.append(data)
    s.gyro.stop()
    s.gyro.start()
    assert heard == [b"=CONFIG,1\r\n", b"go\n"]


def test_limits_are_those_of_the_bench_file(stand: Make) -> None:
    s = on_bench(stand, "kvh-1750", sample_rate_hz=100)
    assert s.gyro.limits.max_rate_dps == 400
    with pytest.raises(LimitError):
        s.bench.table.spin(1e4, 1)
