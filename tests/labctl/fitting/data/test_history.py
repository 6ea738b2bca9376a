"""States of a temperature course, against their definitions evaluated one temperature after the other."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.data.temperature.history import SPACING_S, TemperatureHistory, TemperatureProfile


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
