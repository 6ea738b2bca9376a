"""STIM300 and KVH drivers through bytes: values, flags, gaps, silence, and every fault of the wire."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.errors import LinkError, NoReply
from instruments.transport.sample_timing import StreamTime

Make = Callable[..., Any]


def stim(stand: Make, **options: Any) -> Any:
    return stand("triaxial-sim", gyro={"options": options})


def dsp3000(stand: Make, **gyro: Any) -> Any:
    changes = {"driver": "kvh-dsp3000", "port": "sim://kvh-dsp3000/fog", "sample_rate_hz": 100, "max_rate_dps": 375}
    return stand("single-axis-sim", gyro=changes | gyro)


@pytest.fixture(params=["stim300", "stim300-crlf", "stim300-a7", "dsp3000", "rd2100"])
def streaming(request: pytest.FixtureRequest, stand: Make) -> Any:
    kinds: dict[str, Callable[[], Any]] = {
        "stim300": lambda: stim(stand),
        "stim300-crlf": lambda: stim(stand, crlf=True),
        "stim300-a7": lambda: stim(stand, datagram=0xA7),
        "dsp3000": lambda: dsp3000(stand),
        "rd2100": lambda: stand("single-axis-sim"),
    }
    made = kinds[request.param]()
    made.gyro.start()
    return made


def n_in(s: Any, seconds: float) -> int:
    return round(seconds * s.gyro.sample_rate_hz)


def test_readings_are_whole_numbers_at_even_times(streaming: Any) -> None:
    readings = streaming.gyro.read(5.0)
    assert abs(len(readings) - n_in(streaming, 5)) <= 2
    assert np.allclose(np.diff(readings.t_s), 1 / streaming.gyro.sample_rate_hz, rtol=1e-3)
    assert readings.t_s[-1] <= streaming.clock.now_s()
    assert readings.valid.all()
    assert (readings.lost, readings.damaged) == (0, 0)
    for channel in streaming.gyro.channels:
        assert readings.raw[channel.name].dtype == np.int64


def test_the_table_rate_is_seen_with_its_sign(streaming: Any) -> None:
    streaming.bench.table.home()
    for asked in (30.0, -30.0):
        spin = streaming.bench.table.spin(asked, 4)
        streaming.gyro.read_latest()
        readings = streaming.gyro.read(3.0)
        streaming.bench.table.settle(spin)
        up = next(c for c in streaming.gyro.channels if c.name == "gyro_z")
        assert up.value(readings.raw["gyro_z"]).mean() == pytest.approx(asked, abs=1.5)


def test_nothing_is_lost_between_reads(streaming: Any) -> None:
    parts = [streaming.gyro.read(1.0) for _ in range(20)]
    times = np.concatenate([part.t_s for part in parts])
    assert np.all(np.diff(times) > 0)
    assert abs(len(times) - n_in(streaming, 20)) <= 2
    assert sum(part.lost for part in parts) == 0


def test_silence_is_an_error_that_names_port_and_remedy(streaming: Any) -> None:
    streaming.gyro.read(1.0)
    streaming.faults(streaming.gyro_url).arm("silence")
    streaming.gyro.read(1.0)
    streaming.gyro.read(1.0)  # up to two seconds are only a gap
    with pytest.raises(NoReply, match=r"sim://.*check power"):
        streaming.gyro.read(1.0)
    with pytest.raises(NoReply):
        streaming.gyro.read_latest()


def test_a_short_silence_is_counted_as_loss(streaming: Any) -> None:
    streaming.gyro.read(1.0)
    now = streaming.clock.now_s()
    streaming.faults(streaming.gyro_url).arm("silence", from_s=now, until_s=now + 1.5)
    parts = [streaming.gyro.read(0.5) for _ in range(10)]
    got, lost = sum(len(p) for p in parts), sum(p.lost for p in parts)
    assert got + lost == pytest.approx(n_in(streaming, 5), abs=max(0.05 * n_in(streaming, 5), 17))


def test_noise_damages_frames_and_no_value(streaming: Any) -> None:
    streaming.gyro.read(1.0)
    streaming.faults(streaming.gyro_url).arm("noise", count=3, value=7)
    parts = [streaming.gyro.read(1.0) for _ in range(6)]
    assert sum(p.damaged for p in parts) >= 1
    rates = np.concatenate([p.raw["gyro_z"] for p in parts])
    scale = next(c for c in streaming.gyro.channels if c.name == "gyro_z")
    assert np.abs(scale.value(rates)).max() < 5
    assert sum(len(p) for p in parts) >= n_in(streaming, 6) - 8


@pytest.mark.parametrize("fault", ["split", "merge"])
def test_split_and_merged_frames_lose_nothing(streaming: Any, fault: str) -> None:
    streaming.gyro.read(1.0)
    now = streaming.clock.now_s()
    streaming.faults(streaming.gyro_url).arm(fault, from_s=now, until_s=now + 0.2)
    parts = [streaming.gyro.read(0.5) for _ in range(10)]
    assert abs(sum(len(p) for p in parts) - n_in(streaming, 5)) <= 2
    assert sum(p.damaged for p in parts) == 0


def test_a_broken_frame_is_damaged_and_the_next_is_read(streaming: Any) -> None:
    streaming.gyro.read(1.0)
    streaming.faults(streaming.gyro_url).arm("wrong_crc", count=2)
    parts = [streaming.gyro.read(1.0) for _ in range(4)]
    assert sum(p.damaged for p in parts) == 2
    assert abs(sum(len(p) for p in parts) - (n_in(streaming, 4) - 2)) <= 2


def test_a_gap_of_the_counter_is_counted(stand: Make) -> None:
    s = stim(stand)
    s.gyro.start()
    before = s.gyro.read(1.0)
    s.faults(s.gyro_url).arm("counter_gap", count=1, value=5)
    parts = [before, *(s.gyro.read(1.0) for _ in range(3))]
    assert sum(p.lost for p in parts) == 5
    times = np.concatenate([p.t_s for p in parts])
    assert np.diff(times).max() == pytest.approx(6 / 125, rel=0.1)


def test_a_gap_of_a_whole_counter_turn_is_seen_by_the_clock(stand: Make) -> None:
    """Sixteen frames at 125 a second leave the counter as it was."""
    s = stim(stand)
    s.gyro.start()
    s.gyro.read(1.0)
    s.faults(s.gyro_url).arm("counter_gap", count=1, value=16)
    parts = [s.gyro.read(1.0) for _ in range(3)]
    assert sum(p.lost for p in parts) == 16


def test_a_dropped_link_is_one_error_and_the_stream_can_start_again(streaming: Any) -> None:
    streaming.gyro.read(1.0)
    streaming.faults(streaming.gyro_url).arm("dropped_link", count=1)
    with pytest.raises(LinkError, match="broke"):
        streaming.gyro.read(1.0)
    streaming.gyro.start()
    assert len(streaming.gyro.read(1.0)) >= n_in(streaming, 1) - 2


def test_reading_without_a_start_says_so(stand: Make) -> None:
    for s in (stim(stand), dsp3000(stand)):
        with pytest.raises(LinkError, match="was not started"):
            s.gyro.read(1.0)
        s.gyro.stop()
        s.gyro.stop()


def test_what_stands_at_the_rail_is_not_valid(stand: Make) -> None:
    s = stand("triaxial-sim", simulation={"hidden": {"bias": 600.0}})
    s.gyro.start()
    assert not s.gyro.read(1.0).valid.any()


def test_status_bits_make_readings_invalid(stand: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = stim(stand)
    s.gyro.start()
    import instruments.simulators.devices.stim300 as simulated

    monkeypatch.setattr(simulated, "OVERLOAD", 0)
    good = s.gyro.read(0.5)
    assert good.valid.all()
    wire = s.bench.simulation.device(s.gyro_url)._device
    encode = wire._encode

    def flagged(index: Any, t_s: float) -> Any:
        frames = encode(index, t_s)
        frames[:, 10] = 0x40  # start-up
        frames[:, 21:25] = wire._layout.crc(frames).astype(">u4").view(np.uint8).reshape(len(frames), 4)
        return frames

    monkeypatch.setattr(wire, "_encode", flagged)
    bad = s.gyro.read(0.5)
    assert len(bad) > 0
    assert not bad.valid.any()
    assert (bad.raw["status"] == 0x40).all()


def test_dsp3000_line_and_sign(stand: Make) -> None:
    """The real line of the manual: 19 characters; the device counts clockwise positive."""
    s = dsp3000(stand)
    s.gyro._in_line = True
    readings = s.gyro._decode(b"       0.015733   1\r\n     -12.500000   0\r\n     400.000000   1\r\n  0.1 1\r\n")
    (channel,) = s.gyro.channels
    assert channel.value(readings.raw["gyro_z"]).tolist() == pytest.approx([-0.015733, 12.5, -400.0])
    assert readings.valid.tolist() == [True, False, False]  # a fault flag; beyond its linear range whatever its flag
    assert readings.damaged == 1


def test_the_first_line_after_opening_is_dropped(stand: Make) -> None:
    s = dsp3000(stand)
    readings = s.gyro._decode(b"15733   1\r\n       0.015733   1\r\n")
    assert (len(readings), readings.damaged) == (1, 0)


def test_a_line_format_is_a_setting(stand: Make) -> None:
    s = stand("single-axis-sim", gyro={"options": {"pattern": r"W=(?P<rate>-?\d+\.\d+);T=(?P<temperature>-?\d+\.\d+)"}})
    s.gyro._in_line = True
    readings = s.gyro._decode(b"W=1.5;T=25.125\r\n")
    assert readings.raw["gyro_z"].tolist() == [1_500_000]
    assert readings.raw["temperature_c"].tolist() == [25_125]


def test_stream_times_follow_a_device_whose_clock_is_fast() -> None:
    period, fast = 0.01, 1 + 2e-4
    stream = StreamTime(period, 0.0)
    sent, times = 0, []
    for second in range(1, 600):
        now = float(second)
        total = int(now * fast / period)
        found, lost = stream.times(np.ones(total - sent, dtype=np.int64), now)
        assert lost == 0
        sent = total
        times.append(found)
    joined = np.concatenate(times)
    assert np.all(np.diff(joined) > 0)
    assert joined[-1] == pytest.approx(599, abs=0.05)


def test_a_glance_leaves_the_times_without_a_step(streaming: Any) -> None:
    """A step of a few ms within a data set would turn a line of the table's steps into noise."""
    period = 1 / streaming.gyro.sample_rate_hz
    phases = []
    for pause_s in (3.1, 7.77, 0.013, 61.3, 12.345):
        streaming.clock.sleep(pause_s)
        streaming.gyro.read_latest()
        parts = [streaming.gyro.read(1.003) for _ in range(3)]
        times = np.concatenate([part.t_s for part in parts])
        assert np.allclose(np.diff(times), period, rtol=0.02)
        assert sum(part.lost for part in parts) == 0
        phases.append(times[0] / period % 1)
    turns = np.exp(2j * np.pi * np.array(phases[1:]))
    assert abs(turns.mean()) > 0.99  # one even spacing through all of it


def test_a_stream_is_found_again_by_its_phase_or_anchored_anew() -> None:
    stream = StreamTime(0.1, 0.0)
    stream.times(np.ones(3, dtype=np.int64), 0.305)
    stream.drop()
    found, lost = stream.times(np.ones(1, dtype=np.int64), 50.312)  # 7 ms later than its phase: the wire
    assert (found[0], lost) == (pytest.approx(50.305), 0)
    stream.drop()
    found, lost = stream.times(np.ones(1, dtype=np.int64), 99.95)  # half a period off: its clock is another
    assert (found[0], lost) == (pytest.approx(99.95), 0)
