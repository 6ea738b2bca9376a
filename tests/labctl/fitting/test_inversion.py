"""Inversion of a forward law: a root where there is one, an error where there is none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from labctl.fitting.models.inversion import NotConverged, invert

OUTPUTS = {"z": np.array([-200.0, -3.0, 0.5, 150.0])}


def law(gain: float, bias: float = 0.0):  # type: ignore[no-untyped-def]
    return lambda rates, axis: (gain - 1.0) * rates[axis] + bias


@pytest.mark.parametrize("gain", [0.55, 1.0, 1.02, 1.9, 16384.0])
def test_a_gain_is_inverted(gain: float) -> None:
    assert invert(OUTPUTS, law(gain, 0.2), "m")["z"] == pytest.approx((OUTPUTS["z"] - 0.2) / gain, abs=1e-9)


def test_a_steep_flank_is_inverted_by_bisection() -> None:
    def flank(rates: Mapping[str, np.ndarray], axis: str) -> np.ndarray:
        return 3.0 * np.tanh(20.0 * (rates[axis] - 1.0))

    found = invert(OUTPUTS, flank, "m")["z"]
    assert found + flank({"z": found}, "z") == pytest.approx(OUTPUTS["z"], abs=1e-8)


@pytest.mark.parametrize("gain", [0.0, 0.01745, -1.0, 0.3, 1e-3])
def test_where_no_rate_near_an_output_has_it_nothing_is_returned(gain: float) -> None:
    outputs = {"z": np.array([-200.0, -150.0, 100.0, 150.0])}
    with pytest.raises(NotConverged, match="cannot be inverted") as error:
        invert(outputs, law(gain), "yang2018")
    assert "\n" not in str(error.value)


def test_outputs_that_are_no_numbers_stay_so_beside_the_others() -> None:
    outputs = {"z": np.array([np.nan, 10.0]), "x": np.array([1.0, 2.0])}
    found = invert(outputs, law(1.1), "m")
    assert np.isnan(found["z"][0])
    assert found["z"][1] == pytest.approx(10 / 1.1)
    assert found["x"] == pytest.approx(outputs["x"] / 1.1)


@pytest.mark.parametrize("size", [0.935, 1.0, 1.025])
def test_noise_within_a_dead_band_is_not_taken_for_its_edges(size: float) -> None:
    band, bias, rng = 1.0, 0.2, np.random.default_rng(3)

    def dead(rates: Mapping[str, np.ndarray], axis: str) -> np.ndarray:
        rate = rates[axis]
        return bias + size * (np.sign(rate) * np.sqrt(np.maximum(rate**2 - band**2, 0.0)) - rate)

    true = np.concatenate([np.zeros(40), np.array([-30.0, -4.0, -1.2, 1.2, 4.0, 30.0])])
    output = true + dead({"z": true}, "z") + rng.normal(0, 0.003, len(true))
    found = invert({"z": output}, dead, "m")["z"]
    assert np.abs(found[:40]).max() < 0.015
    assert found[40:] == pytest.approx(true[40:], abs=0.02)


def test_a_saturated_output_is_that_of_a_rate_where_it_begins() -> None:
    def clipped(rates: Mapping[str, np.ndarray], axis: str) -> np.ndarray:
        return 100.0 * np.tanh(rates[axis] / 100.0) - rates[axis]

    assert invert({"z": np.array([76.159, -90.0])}, clipped, "m")["z"] == pytest.approx([100.0, -147.2], rel=0.001)


def test_of_rates_with_the_same_output_the_nearest_is_returned() -> None:
    def wave(rates: Mapping[str, np.ndarray], axis: str) -> np.ndarray:
        return 4.0 * np.sin(rates[axis])  # the output 0 is that of -2.5, 0 and 2.5 deg/s

    assert invert({"z": np.array([0.01])}, wave, "m")["z"] == pytest.approx([0.002], abs=1e-4)


def test_numbers_beside_no_numbers_are_inverted_by_bisection_too() -> None:
    def flank(rates: Mapping[str, np.ndarray], axis: str) -> np.ndarray:
        return 3.0 * np.tanh(20.0 * (rates[axis] - 1.0))

    found = invert({"z": np.array([np.nan, 0.5])}, flank, "m")["z"]
    assert np.isnan(found[0])
    assert found[1] + flank({"z": found[1:]}, "z")[0] == pytest.approx(0.5, abs=1e-8)
