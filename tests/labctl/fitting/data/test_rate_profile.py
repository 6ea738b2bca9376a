"""Rates that come through a delay and a first-order response, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.data.rate_profile import RateProfile, rate_profile
from labctl.fitting.data.response import DELAY, TIME_CONSTANT, Response

STEP_S = 0.01


def profile_of(t_s: np.ndarray, rate_dps: np.ndarray) -> RateProfile:
    """Return the profile with every reading as a row."""
    return rate_profile(
        {"t_s": t_s, "dataset": np.ones(len(t_s), dtype=np.int64), "table_rate_dps": rate_dps}, windows=False
    )


@pytest.mark.parametrize("jitter", [0.0, 2e-4])
def test_a_sine_comes_through_with_its_gain_and_phase(jitter: float) -> None:
    rng = np.random.default_rng(1)
    t_s = STEP_S * np.arange(4000) + rng.uniform(-jitter, jitter, 4000)
    omega, response = 2 * np.pi * 3.0, Response(0.0137, 0.021)
    seen = profile_of(t_s, 40.0 * np.sin(omega * t_s)).seen_dps(response)
    gain = 1 / np.hypot(1.0, omega * 0.021)
    expected = 40.0 * gain * np.sin(omega * (t_s - 0.0137) - np.arctan(omega * 0.021))
    inner = slice(500, -500)
    assert seen[inner] == pytest.approx(expected[inner], abs=2e-3)


def test_a_ramp_comes_later_by_delay_and_time_constant() -> None:
    t_s = STEP_S * np.arange(3000)
    seen = profile_of(t_s, 2.0 * t_s).seen_dps(Response(0.05, 0.2))
    assert seen[300:-200] == pytest.approx(2.0 * (t_s[300:-200] - 0.25), abs=1e-3)


def test_nothing_changes_without_delay_and_lag() -> None:
    rate = np.random.default_rng(2).normal(0.0, 10.0, 777)
    assert profile_of(STEP_S * np.arange(777), rate).seen_dps(Response()) == pytest.approx(rate, abs=1e-9)


@pytest.mark.parametrize("name", [DELAY, TIME_CONSTANT])
def test_slopes_are_those_of_differences(name: str) -> None:
    t_s = STEP_S * np.arange(2000)
    profile, response = profile_of(t_s, 30.0 * np.sin(2 * np.pi * 0.5 * t_s**1.3)), Response(0.004, 0.006)
    small = 1e-5
    ends = [profile.seen_dps(response.with_value(name, response.value(name) + s)) for s in (small, -small)]
    assert profile.slope(name, response) == pytest.approx((ends[0] - ends[1]) / (2 * small), abs=1e-2)


def test_a_gap_begins_another_stretch_and_another_window() -> None:
    t_s = np.concatenate([STEP_S * np.arange(500), 60.0 + STEP_S * np.arange(500)])
    rate = np.concatenate([np.full(500, 10.0), np.full(500, -10.0)])
    seen = profile_of(t_s, rate).seen_dps(Response(0.03, 0.1))
    assert seen == pytest.approx(rate, abs=1e-6)


def test_rows_are_the_windows_off_the_ends_of_all_readings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("labctl.recording.motions.windows.MAX_WINDOWS", 100)
    t_s, rate = STEP_S * np.arange(1000), np.arange(1000.0)
    columns = {"t_s": t_s, "dataset": np.repeat([1, 2], [503, 497]), "table_rate_dps": rate}
    profile = rate_profile(columns, windows=True)
    assert len(profile.rows) == 51 + 50 - 3 - 3  # 0.25 s at each end of the one stretch
    seen = profile.seen_dps(Response())
    assert seen[:2] == pytest.approx([34.5, 44.5])
    assert profile.take(np.array([94])).seen_dps(Response()) == pytest.approx([rate[963:973].mean()])
