"""Delay and bandwidth from rates that change: found with their uncertainty, and no error of the scale factor."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting import fit
from labctl.fitting.effects import parse_term
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import is_exported
from labctl.recording import Recording
from tests.helpers.profiles import profile_recording, ramp, sweep

PLAIN = ["bias", "scale_factor"]
DELAY_S, BANDWIDTH_HZ, SCALE, BIAS_DPS = 0.005, 40.0, 0.024, 0.05


@pytest.fixture(scope="module")
def swept() -> Recording:
    """Return a sweep from 0.1 to 10 Hz through a delay of 5 ms and a bandwidth of 40 Hz."""
    return profile_recording(
        sweep(120.0, 0.1, 10.0, 50.0, 100.0), delay_s=DELAY_S, bandwidth_hz=BANDWIDTH_HZ, scale=SCALE, bias_dps=BIAS_DPS
    )


def value_and_u(result: FitResult, name: str) -> tuple[float, float]:
    """Return one coefficient of axis z with its standard uncertainty."""
    entry = result.to_json()["axes"]["z"]["coefficients"][name]
    assert isinstance(entry, dict)
    value, u = entry["value"], entry["u"]
    assert isinstance(value, float)
    assert isinstance(u, float)
    return value, u


@pytest.mark.slow
def test_a_delay_and_a_bandwidth_are_found_and_the_scale_factor_is_not_biased(swept: Recording) -> None:
    result = fit(swept, None, [*PLAIN, "time_delay", "bandwidth"])
    true = {"delay": DELAY_S, "bandwidth": BANDWIDTH_HZ, "scale_factor": SCALE, "bias": BIAS_DPS}
    for name, expected in true.items():
        value, u = value_and_u(result, name)
        assert abs(value - expected) < 3 * u, name
        assert u < 0.01 * abs(expected), name
    assert result.error.noise_floor_dps == pytest.approx(0.02, rel=0.05)
    assert result.error.rms_dps == pytest.approx(0.02, rel=0.05)


def test_without_them_the_scale_factor_is_off_and_says_so_by_its_uncertainty(swept: Recording) -> None:
    result = fit(swept, None, PLAIN)
    value, u = value_and_u(result, "scale_factor")
    assert abs(value - SCALE) > 0.02
    assert u > 1e-3
    assert result.error.noise_floor_dps == pytest.approx(0.02, rel=0.05)  # whatever the model
    assert result.error.rms_dps is not None
    assert result.error.rms_dps > 100 * 0.02


@pytest.mark.slow
def test_windows_of_several_readings_give_the_same(swept: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    one = fit(swept, None, [*PLAIN, "time_delay", "bandwidth"])
    monkeypatch.setattr("labctl.recording.motions.windows.MAX_WINDOWS", 3000)
    four = fit(swept, None, [*PLAIN, "time_delay", "bandwidth"])
    for name in ("delay", "time_constant", "scale_factor", "bias"):
        value, u = value_and_u(four, name)
        assert value == pytest.approx(value_and_u(one, name)[0], abs=3 * u)
        assert u < 1.5 * value_and_u(one, name)[1]


@pytest.mark.slow
def test_a_delay_of_many_periods_is_found() -> None:
    """The grid of beginnings matters: at 10 Hz and 120 ms the first step would go to the wrong period."""
    late = profile_recording(sweep(60.0, 0.5, 10.0, 50.0, 100.0), delay_s=0.12)
    value, u = value_and_u(fit(late, None, [*PLAIN, "time_delay"]), "delay")
    assert value == pytest.approx(0.12, abs=3 * u)


def test_a_bandwidth_beyond_the_readings_is_bounded_and_not_named() -> None:
    quick = profile_recording(sweep(60.0, 0.1, 5.0, 20.0, 50.0), sample_hz=50.0)
    coefficients = fit(quick, None, [*PLAIN, "time_delay", "bandwidth"]).to_json()["axes"]["z"]["coefficients"]
    band = coefficients["bandwidth"]
    assert isinstance(band, dict)
    assert band["identified"] is False
    assert band["u"] is None
    assert isinstance(band["value"], float)
    assert band["value"] > 50.0


@pytest.mark.slow
def test_a_delay_on_a_ramp_that_goes_one_way_is_a_bias() -> None:
    one_way = profile_recording(ramp(60.0, -60.0, 60.0, 100.0)[20:], delay_s=DELAY_S, scale=SCALE)
    bias, u = value_and_u(fit(one_way, None, PLAIN), "bias")
    assert bias == pytest.approx(-DELAY_S * 2.0, abs=5 * u)  # 2 deg/s^2
    both = fit(one_way, None, [*PLAIN, "time_delay"])
    assert value_and_u(both, "delay")[1] > 20 * DELAY_S
    assert value_and_u(both, "bias")[1] > 20 * DELAY_S * 2.0
    scale, u = value_and_u(both, "scale_factor")
    assert scale == pytest.approx(SCALE, abs=3 * u)
    assert u < 1e-4


@pytest.mark.slow
def test_a_delay_on_a_ramp_there_and_back_is_told_from_a_bias_and_its_uncertainty_says_how_well() -> None:
    up = ramp(60.0, -60.0, 60.0, 100.0)
    both = profile_recording(np.concatenate([up, up[::-1]]), delay_s=DELAY_S, scale=SCALE, bias_dps=BIAS_DPS)
    result = fit(both, None, [*PLAIN, "time_delay"])
    delay, u = value_and_u(result, "delay")
    assert u == pytest.approx(0.02 / np.sqrt(12_000) / 2.0, rel=0.2)  # noise of the mean over the acceleration
    assert delay == pytest.approx(DELAY_S, abs=3 * u)
    for name, expected in (("bias", BIAS_DPS), ("scale_factor", SCALE)):
        value, u = value_and_u(result, name)
        assert value == pytest.approx(expected, abs=3 * u)


def test_at_constant_rates_neither_can_be_seen() -> None:
    still = profile_recording(np.full(20 * 2000, 30.0))
    with pytest.raises(NotEnoughData):
        fit(still, None, ["time_delay", "bandwidth"])


def test_neither_is_corrected_where_the_gyro_is_used() -> None:
    assert not is_exported(parse_term("time_delay"))
    assert not is_exported(parse_term("bandwidth"))
