"""A temperature that jumps: soaks that were joined without the time between them, or a thermometer that fails."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.recording.sanity.readings.series import Array, Series
from labctl.recording.sanity.readings.thermometers import check_thermometers

#: Readings at each rate, and the rates at each temperature.
HELD, RATES_DPS = 20, (-100.0, -50.0, 0.0, 50.0, 100.0)


def said_of(temperature_c: Array, rate_dps: Array) -> str:
    n = len(temperature_c)
    series = Series(
        np.arange(n, dtype=np.float64) / 2.0, np.zeros(n, dtype=np.int64), rate_dps, np.zeros(n, dtype=bool),
        {"gyro_z": rate_dps}, {"temperature_c": temperature_c}, {}, "profile",
    )  # fmt: skip
    (marked,) = check_thermometers(series)
    assert marked.finding.what == "thermometer"
    return marked.finding.text


@pytest.fixture
def noise() -> np.random.Generator:
    return np.random.default_rng(4)


@pytest.mark.parametrize("temperatures_c", [(0.0, 25.0, 50.0), (10.0, 40.0)])
def test_the_same_rates_at_each_temperature_are_soaks(
    temperatures_c: tuple[float, ...], noise: np.random.Generator
) -> None:
    rates = np.tile(np.repeat(RATES_DPS, HELD), len(temperatures_c)) + noise.normal(
        0.0, 0.02, 100 * len(temperatures_c)
    )
    warm = np.repeat(temperatures_c, 100) + noise.normal(0.0, 0.05, len(rates))
    text = said_of(warm, rates)
    assert f"so {len(temperatures_c)} soaks were joined without the time between them" in text
    assert "give each row its true time" in text
    assert "stood still" not in text


def test_a_thermometer_that_jumps_in_a_motion_is_no_soak(noise: np.random.Generator) -> None:
    rates = 100.0 * np.sin(np.arange(300) / 7.0)
    warm = np.repeat([10.0, 40.0], 150) + noise.normal(0.0, 0.05, 300)
    assert "the thermometer stood still before, or was exchanged or moved" in said_of(warm, rates)


def test_a_thermometer_that_stood_still_while_others_rates_were_turned_is_no_soak(noise: np.random.Generator) -> None:
    rates = np.repeat([-100.0, -50.0, 50.0, 100.0], 50)
    warm = np.concatenate([np.full(100, 20.0), np.linspace(30.0, 60.0, 100)]) + noise.normal(0.0, 0.05, 200)
    assert "import only that" in said_of(warm, rates)
