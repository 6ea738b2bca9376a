"""Lags through long arrays beside a follower that goes from sample to sample in extended precision."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.numeric.following import LANE, Steps

N = 700 * LANE + 5


def by_hand(t_s: np.ndarray, warm: np.ndarray, warming_s: float, cooling_s: float, at_c: float) -> np.ndarray:
    """Return a follower less the temperature, K, by d at / dt = (T - at) / tau, exact for straight lines."""
    at, before, last = np.longdouble(at_c), np.longdouble(warm[0]), np.longdouble(t_s[0])
    found = []
    for time, now in zip(t_s.astype(np.longdouble), warm.astype(np.longdouble), strict=True):
        tau = np.longdouble(cooling_s if now < at else warming_s)
        ratio = (time - last) / tau
        keep = np.exp(-ratio)
        mean = -np.expm1(-ratio) / ratio if ratio else np.longdouble(1)
        at = keep * at + (mean - keep) * before + (1 - mean) * now
        before, last = now, time
        found.append(at - now)
    return np.array(found, dtype=np.float64)


def times(kind: str) -> np.ndarray:
    rng = np.random.default_rng(5)
    if kind == "even":
        return 1e5 + 0.01 * np.arange(N)
    if kind == "gaps":
        return np.cumsum(np.where(rng.random(N) < 0.01, 300.0, 0.005) * rng.random(N))
    return np.cumsum(rng.exponential({"uneven": 0.01, "seldom": 20.0}[kind], N))


@pytest.mark.parametrize("kind", ["even", "uneven", "gaps", "seldom"])
@pytest.mark.parametrize("cooling_s", [25.0, 400.0])
def test_a_lag_through_a_long_array_is_that_from_sample_to_sample(kind: str, cooling_s: float) -> None:
    t_s = times(kind)
    warm = 20.0 + 40.0 * np.sin((t_s - t_s[0]) / 90.0) + np.random.default_rng(6).normal(0, 0.02, N)
    steps = Steps.of(t_s, warm, float(t_s[0]), float(warm[0]))
    expected = by_hand(t_s, warm, 25.0, cooling_s, float(warm[0]) + 3.0)
    found = steps.lagged(25.0, 3.0) if cooling_s == 25.0 else steps.lagged_two_ways(25.0, cooling_s, 3.0)
    # two times that are even to rounding are taken as even, to 4 units in their last place
    assert found == pytest.approx(expected, abs=2e-11 if kind == "even" else 1e-12)


def test_a_lag_far_from_its_start_keeps_small_distances() -> None:
    """One millionth of a kelvin decays like any other: it is not rounded at the last digit of the temperature."""
    n = 4_000
    steps = Steps.of(np.arange(1.0, n + 1), np.full(n, 300.0), 0.0, 300.0)
    expected = 1e-6 * np.exp(-np.arange(1.0, n + 1) / 100.0)
    assert steps.lagged(100.0, 1e-6) == pytest.approx(expected, rel=1e-12)
