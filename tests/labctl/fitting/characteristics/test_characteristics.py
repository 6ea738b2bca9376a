"""Characteristics beside independent witnesses: numbers worked out by hand, and SciPy's polar decomposition."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import polar as scipy_polar
from scipy.spatial.transform import Rotation

from labctl.fitting.characteristics.alignment import alignment_of, polar
from labctl.fitting.characteristics.at_rest import g_sensitivity, repeatability
from labctl.fitting.characteristics.estimate import Estimate
from labctl.fitting.characteristics.scale_factor import (
    asymmetry_ppm,
    nonlinearity_ppm,
    slope_over,
    straight_line,
)


def test_the_best_straight_line_and_its_nonlinearity_as_worked_out_by_hand() -> None:
    """output = 0.5 + 2 r + 0.001 r^2 at r = -2 .. 2: slope 2, intercept 0.502, largest deviation 0.002 at 0 and 2.

    Referred to the input 0.001 deg/s, of 2 deg/s full scale: 500 ppm.
    """
    rate = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    line = straight_line(rate, 0.5 + 2 * rate + 0.001 * rate**2)
    assert line is not None
    assert line.scale_factor.value == pytest.approx(2.0)
    assert line.bias_dps.value == pytest.approx(0.502)
    np.testing.assert_allclose(line.residual_dps, [0.002, -0.001, -0.002, -0.001, 0.002], atol=1e-12)
    found = nonlinearity_ppm(line, 2.0, np.full(5, 1e-4))
    assert found.value == pytest.approx(500.0)
    assert found.u == pytest.approx(1e-4 / 2 / 2 * 1e6)
    # s^2 = sum of squares / (5 - 2) = 14e-6 / 3; u(slope) = s / sqrt(sum r^2) = s / sqrt(10)
    assert line.scale_factor.u == pytest.approx(np.sqrt(14e-6 / 3 / 10))


def test_asymmetry_is_the_difference_of_the_slopes_over_their_mean() -> None:
    rate = np.array([-100.0, -50.0, 0.0, 50.0, 100.0])
    output = 0.1 + np.where(rate > 0, 1.0003, 0.9999) * rate
    found = asymmetry_ppm(rate, output)
    assert found is not None
    assert found.value == pytest.approx(400.0 / 1.0001)
    assert found.u == pytest.approx(0.0, abs=1e-3)
    assert asymmetry_ppm(np.abs(rate), output) is None


def test_a_slope_over_temperature_carries_the_larger_uncertainty() -> None:
    exact = [Estimate(value, 1.0) for value in (10.0, 12.0, 14.0)]
    found = slope_over(np.array([0.0, 10.0, 20.0]), exact)
    assert found is not None
    assert (found.value, found.u) == (pytest.approx(0.2), pytest.approx(1 / np.sqrt(200)))
    assert slope_over(np.array([25.0, 25.1]), exact[:2]) is None


def test_polar_decomposition_agrees_with_scipy() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        k = np.eye(3) + rng.normal(0, 0.03, (3, 3))
        symmetric, rotation = polar(k)
        witness_rotation, witness = scipy_polar(k, side="left")
        np.testing.assert_allclose(symmetric, witness, atol=1e-12)
        np.testing.assert_allclose(rotation, witness_rotation, atol=1e-12)
        assert symmetric @ rotation == pytest.approx(k, abs=1e-12)


def test_a_turned_triad_is_misaligned_and_orthogonal() -> None:
    turned_deg = np.array([0.3, -0.2, 1.1])
    triad = Rotation.from_rotvec(turned_deg, degrees=True).as_matrix()  # columns: the sensing axes in the body
    found = alignment_of(np.diag([1.01, 0.99, 1.0]) @ triad.T, np.full((3, 3), 1e-5))
    assert [each.value for each in found.orthogonality_deg] == pytest.approx([0, 0, 0], abs=1e-12)
    assert [each.value for each in found.misalignment_deg] == pytest.approx(turned_deg.tolist(), abs=1e-9)
    # small angles: each is half the difference of two elements, 1e-5 / sqrt(2) rad
    assert [each.u for each in found.misalignment_deg] == pytest.approx([np.rad2deg(1e-5 / np.sqrt(2))] * 3, rel=0.03)


def test_axes_that_are_not_at_right_angles_are_seen_whatever_the_rotation() -> None:
    skewed = np.eye(3)
    skewed[0] = [np.cos(np.deg2rad(0.5)), np.sin(np.deg2rad(0.5)), 0.0]  # x and y are 89.5 deg apart
    turn = Rotation.from_rotvec([2.0, 1.0, -3.0], degrees=True).as_matrix()
    for k in (skewed, skewed @ turn):
        assert [each.value for each in alignment_of(k, None).orthogonality_deg] == pytest.approx([0.5, 0, 0], abs=1e-9)


def test_a_mirrored_matrix_is_refused() -> None:
    with pytest.raises(ValueError, match="reflection"):
        polar(np.diag([1.0, 1.0, -1.0]))


def test_repeatability_pools_what_runs_differ_by_at_one_temperature_and_position() -> None:
    """Deviations 1, -1 and 2, 0, -2: sum of squares 10 over 3 degrees of freedom."""
    found = repeatability([{1: 11.0, 2: 9.0}, {1: 52.0, 2: 50.0, 3: 48.0}, {4: 7.0}])
    assert found is not None
    estimate, runs = found
    assert runs == 3
    assert estimate.value == pytest.approx(np.sqrt(10 / 3))
    assert estimate.u == pytest.approx(np.sqrt(10 / 3) / np.sqrt(6))
    assert repeatability([{1: 5.0}]) is None


def test_g_sensitivity_needs_each_axis_up_and_down() -> None:
    position = np.array(["x", "-x", "y", "-y", "z", "-z"])
    output = np.array([0.3, 0.1, 0.2, 0.2, 0.25, 0.15])  # bias 0.2, 0.1 per g along x, 0 along y, 0.05 along z
    found = g_sensitivity(position, output)
    assert found is not None
    assert [each.value for each in found] == pytest.approx([0.1, 0.0, 0.05], abs=1e-12)
    assert g_sensitivity(position[:5], output[:5]) is None
