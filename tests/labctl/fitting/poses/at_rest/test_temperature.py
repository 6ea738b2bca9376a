"""Accelerometer over temperature, compared with units made with NumPy; the coverage is in `studies`."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting.poses.at_rest.temperature import different_temperatures
from studies.accelerometer_simulation import TrueUnit, poses_at_temperatures
from studies.accelerometer_temperature import calibrated, scores_of

UNIT = TrueUnit.drawn(np.random.default_rng(5))


def test_coefficients_are_found_within_their_uncertainty() -> None:
    scores: list[float] = []
    for seed in range(3):
        unit = TrueUnit.drawn(np.random.default_rng([seed, 9]))
        found = calibrated(poses_at_temperatures(seed, unit))
        assert found.adequacy.verdict == "adequate"
        assert (len(found.bias_g), len(found.scale_factor), found.temperatures) == (3, 1, 4)
        assert found.constant_g > 20 * found.adequacy.heldout_g
        scores += [abs(z) for values in scores_of(found, unit).values() for z in values]
    assert len(scores) == 3 * 21
    assert max(scores) < 4.5
    assert np.mean(np.array(scores) <= 2) > 0.85


def test_what_the_model_leaves_is_in_the_verdict_and_in_the_uncertainty() -> None:
    quiet = calibrated(poses_at_temperatures(1, UNIT))
    moved = calibrated(poses_at_temperatures(1, UNIT, pose_g=5e-4))
    assert moved.adequacy.verdict == "unexplained"
    assert np.all(np.diag(moved.covariance) > 2 * np.diag(quiet.covariance))


def test_a_scale_factor_that_bends_with_temperature_is_not_adequate() -> None:
    bent = TrueUnit(UNIT.bias_g, UNIT.errors, UNIT.bias_powers, np.array([[1e-4] * 3, [3e-6] * 3]), 25.0)
    assert calibrated(poses_at_temperatures(1, bent)).adequacy.verdict == "unexplained"


def test_two_temperatures_give_one_power() -> None:
    straight = TrueUnit(UNIT.bias_g, UNIT.errors, UNIT.bias_powers * [[1], [0], [0]], UNIT.scale_powers, 25.0)
    found = calibrated(poses_at_temperatures(2, straight, temperatures_c=(20.0, 40.0)))
    assert found.bias_g.shape == (1, 3)
    z = (found.bias_g[0] - straight.bias_powers[0]) / np.sqrt(np.diag(found.covariance))[9:12]
    assert np.all(np.abs(z) < 4)


def test_what_does_not_determine_them_is_refused_with_what_to_do() -> None:
    with pytest.raises(NotEnoughData, match=r"20\.0 to 20\.9 deg C.*span 5 K.*warmer or colder"):
        calibrated(poses_at_temperatures(1, UNIT, temperatures_c=(20.0,)))
    table = poses_at_temperatures(1, UNIT)
    pose = np.arange(len(table)) * 56 // len(table)
    with pytest.raises(NotEnoughData, match=r"23 rests at 4 temperatures; 21 coefficients need at least 24 rests"):
        calibrated(table[(pose < 14) | (pose % 14 < 3)])


def test_temperatures_count_where_they_are_apart() -> None:
    assert different_temperatures(np.array([20.0, 21.0, 21.9, 22.1, 30.0])) == 3
