"""Legs: where the temperature turns."""

from __future__ import annotations

import numpy as np

from labctl.fitting.data.temperature.legs import legs_of


def test_a_loop_has_two_legs_and_noise_none() -> None:
    warm = np.concatenate([np.linspace(0, 40, 21), np.linspace(38, 0, 20), np.linspace(2, 40, 20)])
    noisy = warm + np.random.default_rng(1).normal(0, 0.3, len(warm))
    legs = legs_of(noisy, np.ones(len(warm), dtype=np.int64))
    assert set(legs.tolist()) == {1, -2, 3}
    assert (np.abs(np.flatnonzero(np.diff(legs)) - [20, 40]) <= 1).all()
    assert not legs_of(20 + np.random.default_rng(2).normal(0, 0.3, 50), np.ones(50, dtype=np.int64)).any()


def test_a_run_begins_a_leg_of_its_own() -> None:
    warm = np.tile(np.linspace(10, 30, 10), 2)
    assert set(legs_of(warm, np.repeat([1, 2], 10)).tolist()) == {1, 2}
