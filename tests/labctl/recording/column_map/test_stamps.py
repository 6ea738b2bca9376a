"""Stamps of arrival: readings of one rate that were handed over in packets, beside gaps in which none were taken."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.recording.column_map.stamps import interpolate_in_packets

Array = NDArray[np.float64]
RATE_HZ, WITHIN_S = 100.0, 0.001


def arrived(rng: np.random.Generator, n: int = 8000) -> Array:
    """Stamps of n readings at 100 Hz that a host reads when it gets to it: all that wait, 1 ms apart."""
    taken, stamps = np.arange(n) / RATE_HZ, np.zeros(n)
    done, now_s = 0, 0.0
    while done < n:
        now_s += float(rng.exponential(0.04)) + 0.005
        waiting = int(np.searchsorted(taken, now_s, side="right"))
        stamps[done:waiting] = now_s + WITHIN_S * np.arange(waiting - done)
        now_s += WITHIN_S * max(waiting - done, 0)
        done = max(done, waiting)
    return stamps


def asleep(rng: np.random.Generator, packets: int = 2000, size: int | None = None) -> Array:
    """Stamps of a logger that takes some readings, 1 ms apart, and then sleeps for a time of its own."""
    sizes = np.full(packets, size) if size else rng.integers(1, 9, packets)
    sleeps = np.full(packets, 0.05) if size else 0.03 + rng.exponential(0.05, packets)
    return np.cumsum(np.concatenate([np.r_[s, np.full(m - 1, WITHIN_S)] for s, m in zip(sleeps, sizes, strict=True)]))


@pytest.mark.parametrize("seed", range(5))
def test_readings_that_arrive_in_packets_are_put_at_their_one_rate(seed: int) -> None:
    stamps = arrived(np.random.default_rng(seed))
    found = interpolate_in_packets(stamps)
    assert found is not None
    assert float(np.median(1.0 / np.diff(found.t_s))) == pytest.approx(RATE_HZ, rel=2e-3)
    assert np.abs(found.t_s - stamps).max() < 2.0 * np.diff(stamps).max()
    assert "arrival of packets" in found.said


@pytest.mark.parametrize("seed", range(5))
def test_a_logger_that_slept_keeps_its_stamps(seed: int) -> None:
    rng = np.random.default_rng(seed)
    assert interpolate_in_packets(asleep(rng)) is None
    assert interpolate_in_packets(asleep(rng, size=5)) is None


def test_readings_that_were_lost_beside_packets_keep_the_stamps() -> None:
    stamps = arrived(np.random.default_rng(1))
    lost = stamps + 60.0 * (np.arange(len(stamps)) > 4000)
    assert interpolate_in_packets(lost) is None


def test_even_and_jittered_stamps_are_left_as_they_are() -> None:
    even = np.arange(5000) / RATE_HZ
    assert interpolate_in_packets(even) is None
    assert interpolate_in_packets(even + np.random.default_rng(2).uniform(0.0, 0.009, 5000)) is None
