"""States of a temperature course, against their definitions evaluated one temperature after the other."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.data.temperature.history import (
    MAX_GAP_S,
    SPACING_S,
    TemperatureHistory,
    TemperatureProfile,
    history_of,
)
from labctl.recording import Recording, RecordingInfo


def _state(temperature_c: np.ndarray, width_k: float) -> np.ndarray:
    """Return the state of a play of a width, at each temperature of a course."""
    history = TemperatureHistory({1: TemperatureProfile(0.0, temperature_c)}, {}, 1.0)
    times = SPACING_S * np.arange(len(temperature_c))
    return np.asarray(history.hysteresis_state({"t_s": times}, width_k))


@pytest.mark.parametrize("width_k", [0.02, 0.5, 8.0, 100.0])
@pytest.mark.parametrize("number", [1, 2, 3, 1000])
def test_the_play_operator_follows_its_definition(number: int, width_k: float) -> None:
    noise = np.random.default_rng(number).normal(0.0, 0.05, number)
    temperature_c = 20.0 + 6.0 * np.sin(np.arange(number) / 90.0) + np.cumsum(noise)
    follower, wanted = temperature_c[0], []
    for now in temperature_c:  # Visintin 1994, chapter III: it moves only where the play is used up
        follower = min(max(follower, now - width_k / 2), now + width_k / 2)
        wanted.append((now - follower) / (width_k / 2))
    assert _state(temperature_c, width_k).tolist() == wanted


def _cooling(gap_s: float) -> Recording:
    """Return data sets of two runs beside a log of a temperature that falls from 60 to 20 deg C in 2000 s."""
    t_s = np.arange(0.0, 4000.0, SPACING_S)
    run = np.where(t_s < 2000.0, 1, 2)
    log = {"t_s": t_s + gap_s * (run == 2), "run": run, "temperature_c": np.interp(t_s, [0, 2000], [60.0, 20.0])}
    sets = slice(0, None, 20)
    columns = {name: values[sets] for name, values in log.items()}
    columns |= {"dataset": np.arange(1, len(columns["run"]) + 1), "table_rate_dps": np.zeros(len(columns["run"]))}
    info = RecordingInfo(serial="A1", model="M", axes=("z",), kind="points", started_at="2026-01-05T08:00:00Z")
    return Recording(info, columns, log)


def test_a_follower_goes_on_over_a_power_cycle_while_the_thermometer_is_logged() -> None:
    recording, tau_s = _cooling(gap_s=0.0), 400.0
    lag_k = history_of(recording).lag_k(recording.columns, tau_s)
    t_s = np.asarray(recording.columns["t_s"])
    slope_k_s = -40.0 / 2000.0
    ramp = -slope_k_s * tau_s * (1.0 - np.exp(-t_s / tau_s))  # of a first-order follower on a ramp
    after = -slope_k_s * tau_s * (1.0 - np.exp(-2000.0 / tau_s)) * np.exp(-(t_s - 2000.0) / tau_s)
    assert lag_k == pytest.approx(np.where(t_s < 2000.0, ramp, after), abs=0.05)


def test_a_follower_is_settled_at_power_on_where_the_log_has_a_gap() -> None:
    recording = _cooling(gap_s=MAX_GAP_S + 1.0)
    lag_k = history_of(recording).lag_k(recording.columns, 400.0)
    assert np.abs(lag_k[np.asarray(recording.columns["run"]) == 2]).max() < 1e-9
