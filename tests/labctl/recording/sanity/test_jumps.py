"""A level that jumps while the output drifts by as much in minutes."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.recording.sanity.readings.jumps import READINGS, jump_of

N, NOISE = 4000, 0.01


def drifting(seed: int = 3) -> np.ndarray:
    """Return readings that follow a chamber, by 200 noises there and back, with turns that have corners."""
    ramp = np.interp(np.arange(N), (0, 400, 1800, 2200, 3600, N), (0.0, 0.0, 2.0, 2.0, 0.0, 0.0))
    return ramp + np.random.default_rng(seed).normal(0.0, NOISE, N)


@pytest.mark.parametrize("row", [1000, 2000, 3000])
@pytest.mark.parametrize("noises", [-12.0, 12.0, 60.0])
def test_a_jump_within_a_ramp_is_found_at_its_row(row: int, noises: float) -> None:
    values = drifting()
    values[row:] += noises * NOISE
    found = jump_of(values, NOISE, 0.0)
    assert found is not None
    assert abs(found - row) <= 1


def test_what_only_drifts_spikes_or_comes_back_does_not_jump() -> None:
    assert all(jump_of(drifting(seed), NOISE, 0.0) is None for seed in range(20))
    spike, motion, coarse = drifting(), drifting(), np.round(drifting() / 0.2) * 0.2
    spike[1000] += 5.0
    motion[1000:1400] += 1.0
    smoothed = np.convolve(drifting(), np.ones(READINGS) / READINGS, mode="valid")
    assert [jump_of(each, NOISE, 0.0) for each in (spike, motion, smoothed)] == [None, None, None]
    assert jump_of(coarse, NOISE, 0.2) is None
