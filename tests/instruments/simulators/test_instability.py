"""The simulated bias instability: an Ornstein-Uhlenbeck process for each time constant, whenever it is read."""

from __future__ import annotations

import numpy as np
import pytest

from instruments.simulators.physics.instability import BiasInstability

SD_DPS, TAU_S = 0.01, 50.0


def process(seed: int = 1, axes: int = 1) -> BiasInstability:
    return BiasInstability(np.random.default_rng(seed), SD_DPS, (TAU_S,), axes)


@pytest.mark.parametrize("lag_s", [1, 20, 100])
def test_the_correlation_over_seconds_in_a_row_is_that_of_the_process(lag_s: int) -> None:
    bias = process(axes=400).sample(np.arange(400.0))
    found = np.mean(bias[:-lag_s] * bias[lag_s:]) / SD_DPS**2
    # 400 axes are 400 independent courses; each has about 400 / (2 * TAU_S) independent parts
    assert found == pytest.approx(np.exp(-lag_s / TAU_S), abs=4 / np.sqrt(400 * 4))
    assert np.std(bias) == pytest.approx(SD_DPS, rel=0.05)


def test_the_correlation_over_a_pause_is_that_of_the_process() -> None:
    drift = process(axes=4000)
    before, after = drift.sample(np.array([10.0]))[0], drift.sample(np.array([10.0 + TAU_S]))[0]
    assert np.corrcoef(before, after)[0, 1] == pytest.approx(np.exp(-1.0), abs=4 / np.sqrt(4000))


@pytest.mark.parametrize("cuts_s", [(30.0,), (7.5, 7.75, 8.0, 31.0), (0.25, 59.5)])
def test_times_asked_in_parts_give_the_bias_of_times_asked_at_once(cuts_s: tuple[float, ...]) -> None:
    t_s = np.arange(0.0, 60.0, 0.25)
    parts = np.split(t_s, np.searchsorted(t_s, cuts_s))
    in_parts = process()
    assert np.array_equal(np.concatenate([in_parts.sample(part) for part in parts]), process().sample(t_s))


def test_between_whole_seconds_the_bias_is_on_a_line() -> None:
    bias = process().sample(np.array([3.0, 3.25, 3.5, 4.0]))[:, 0]
    assert bias[1:3] == pytest.approx([0.75 * bias[0] + 0.25 * bias[3], 0.5 * bias[0] + 0.5 * bias[3]])
