"""The period of a stream from the arrivals of its readings, and the times and losses that follow from it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from instruments.errors import WrongInstrument
from instruments.transport.sample_timing import StreamTime, refuse_other_rate
from instruments.transport.stream_period import MEASURED, OF_A_CRYSTAL, PeriodLine

NOMINAL_HZ = 100.0


def listen(rate_hz: float, looks_s: np.ndarray, jitter_s: float | None = None) -> tuple[StreamTime, np.ndarray, int]:
    """Read a device at the looks (n,) s; returns the stream, the times of its readings, (k,), and the losses."""
    rng = np.random.default_rng(1)
    stream = StreamTime(1 / NOMINAL_HZ, 0.0)
    sent, lost, times = 0, 0, []
    for look_s in looks_s:
        total = int(np.floor(look_s * rate_hz + 1e-9))
        if total == sent:
            continue
        known: dict[str, Any] = {}
        if jitter_s is not None:  # an adapter holds bytes back, and a thread notes when they come
            came_s = total / rate_hz + rng.uniform(0, jitter_s)
            known = {"newest_s": came_s, "width_s": jitter_s}
        now_s = float(known.get("newest_s", look_s))
        found, missing = stream.times(np.ones(total - sent, dtype=np.int64), now_s, **known)
        sent, lost = total, lost + missing
        times.append(found)
    return stream, np.concatenate(times), lost


@pytest.mark.parametrize("rate_hz", [96.1, 97.0, 97.013, 99.995, 100.02, 103.0, 103.9])
@pytest.mark.parametrize("jitter_s", [None, 0.016])
def test_the_period_is_found_to_parts_per_million_and_nothing_is_lost(rate_hz: float, jitter_s: float | None) -> None:
    looks_s = np.cumsum(np.random.default_rng(3).uniform(0.4, 0.6, 1200))
    stream, times, lost = listen(rate_hz, looks_s, jitter_s)
    assert lost == 0
    assert not stream.line.is_outside_tolerance
    assert stream.line.measured_s is not None
    assert stream.line.measured_s * rate_hz == pytest.approx(1.0, abs=1e-5)
    assert np.all(np.diff(times) > 0)
    later = times[len(times) // 2 :]
    assert np.diff(later).mean() * rate_hz == pytest.approx(1.0, abs=1e-4)
    reading = np.arange(1, len(times) + 1)[len(times) // 2 :]
    assert np.abs(later - reading / rate_hz).max() < 0.03


def test_the_stated_uncertainty_covers_the_period() -> None:
    """2000 streams with uniform delays: the expanded uncertainty, k = 4, holds nearly always and is not idle."""
    rng, inside, share = np.random.default_rng(5), 0, []
    for _ in range(2000):
        line, hold_s = PeriodLine(0.01), 0.016
        for second in range(0, 60, 2):
            number = 97 * second
            line.add(number, number / 97.0 + rng.uniform(0, hold_s), hold_s)
        assert line.measured_s is not None
        off = abs(line.measured_s * 97.0 - 1.0)
        inside += off < line.u_share
        share.append(off / line.u_share)
    assert inside >= 1995
    assert np.sqrt(np.mean(np.square(share))) == pytest.approx(0.25, rel=0.15)  # one standard uncertainty of four


def test_a_device_of_the_nominal_rate_keeps_exactly_that() -> None:
    """Looks that beat with the readings tilt a line; the nominal period stands until it is excluded."""
    for every_s in (0.5, 0.50007, 1.0001, 0.4993):
        stream, times, lost = listen(NOMINAL_HZ, np.arange(every_s, 120, every_s))
        assert lost == 0
        assert stream.line.period_s == 1 / NOMINAL_HZ
        assert np.all(np.diff(times) > 0)


def test_looks_far_apart_count_whole_periods() -> None:
    """While only the newest reading is taken from time to time, the count goes on: hours give a sharp period."""
    stream, _, _ = listen(97.01, np.arange(0.5, 60, 0.5), 0.016)
    now_s = 60.0
    for _ in range(200):
        now_s += 8.5
        stream.drop()
        newest_s = np.floor(now_s * 97.01) / 97.01
        _, lost = stream.times(np.ones(1, dtype=np.int64), newest_s + 0.001, newest_s=newest_s, width_s=0.001)
        assert lost == 0
    assert stream.line.period_s * 97.01 == pytest.approx(1.0, abs=1e-7)


def test_a_gap_is_lost_readings_and_no_slower_device() -> None:
    stream = StreamTime(1 / NOMINAL_HZ, 0.0)
    for second in range(1, 5):
        assert stream.times(np.ones(97, dtype=np.int64), float(second))[1] == 0
    assert stream.times(np.ones(97, dtype=np.int64), 7.0)[1] == 0  # two seconds of silence: the rest may still come
    assert stream.is_late
    _, lost = stream.times(np.ones(97, dtype=np.int64), 8.0)
    assert lost == pytest.approx(194, abs=1)
    assert stream.line.period_s == pytest.approx(1 / 97, rel=MEASURED)
    assert stream.times(np.ones(97, dtype=np.int64), 9.0)[1] == 0
    assert not stream.is_late


@pytest.mark.parametrize("rate_hz", [75.0, 95.0, 105.0, 150.0])
def test_a_rate_beyond_the_tolerance_is_named(rate_hz: float) -> None:
    stream, _, lost = listen(rate_hz, np.arange(1.0, 12.0))
    assert lost == 0
    with pytest.raises(
        WrongInstrument,
        match=rf"fog: sends {rate_hz:.3g}\S* readings/s on /dev/ttyUSB0, but the bench file says 100, limit \+-4 %; "
        r"set sample_rate_hz = ",
    ):
        refuse_other_rate("fog", "/dev/ttyUSB0", stream.line)


@pytest.mark.parametrize(("rate_hz", "advice"), [(250.02, "set sample_rate_hz = 250 or"), (128.5, "check whether som")])
def test_a_rate_that_the_unit_cannot_be_set_to_is_not_advised(rate_hz: float, advice: str) -> None:
    line = PeriodLine(1 / 125, OF_A_CRYSTAL)
    for second in range(12):
        line.add(round(rate_hz * second), round(rate_hz * second) / rate_hz, 0.008)
    with pytest.raises(WrongInstrument, match=rf"limit \+-0.5 %; .*{advice}"):
        refuse_other_rate("imu", "/dev/ttyUSB0", line, (125, 250, 500, 1000, 2000))


def test_a_period_that_drifts_is_followed() -> None:
    """50 ppm in an hour, as of a clock in a chamber: the last ten minutes count."""
    line, number, t_s = PeriodLine(0.01), 0, 0.0
    for second in range(3600):
        line.add(number, t_s, 1e-4)
        number, t_s = number + 100, t_s + 1.0 * (1 + 50e-6 * second / 3600)
    assert line.period_s / 0.01 - 1 == pytest.approx(50e-6, abs=15e-6)
