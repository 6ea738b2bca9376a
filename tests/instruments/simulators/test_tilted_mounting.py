"""A tilted unit in the simulated world: its rates, gravity and the Earth, against rotations by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from instruments.positions import Position
from instruments.simulators.physics.bench_errors import UPRIGHT, BenchErrors, felt
from instruments.simulators.physics.body_kinematics import BodyFrame, EarthRotation
from instruments.standards import Standard

DIRECTIONS = ("x+y+z", "-x+y-z", "3x-4z")


@pytest.mark.parametrize("end", DIRECTIONS)
def test_each_axis_turns_and_feels_gravity_by_its_share(end: str) -> None:
    position = Position.of(end)
    frame = BodyFrame.of(position)
    rates = frame.in_body(EarthRotation(None, 0.0).body_rates(frame, np.array([90.0, -30.0]), np.zeros(2)))
    np.testing.assert_allclose(rates, np.outer([90.0, -30.0], position.up), atol=1e-12)
    np.testing.assert_allclose(frame.gravity(2), np.tile(position.up, (2, 1)), atol=1e-15)
    assert end != "x+y+z" or rates[0] == pytest.approx(np.full(3, 90.0 / np.sqrt(3.0)))


@pytest.mark.parametrize("end", [*DIRECTIONS, "z", "-y"])
def test_the_rotation_of_the_earth_goes_round_as_scipy_turns_it(end: str) -> None:
    frame = BodyFrame.of(Position.of(end))
    angles = np.array([0.0, 20.0, 75.0])
    rates = frame.in_body(EarthRotation(45.0, 10.0).body_rates(frame, np.zeros(3), angles))
    up = np.array(Position.of(end).up)
    for angle, rate in zip(angles, rates, strict=True):  # a table that turns by an angle turns the Earth's rate back
        back = Rotation.from_rotvec(-np.radians(angle - angles[0]) * up)
        np.testing.assert_allclose(rate, back.apply(rates[0]), atol=1e-15)
    assert np.linalg.norm(rates[0]) == pytest.approx(360.0 / 86164.0905)
    assert rates[0] @ up == pytest.approx(360.0 / 86164.0905 * np.sin(np.radians(45.0)))


def test_the_tilted_fixture_leans_by_what_its_own_standard_states() -> None:
    standards = (Standard(quantity="tilted_fixture_angle", u=0.1),)
    leans = [BenchErrors.drawn(standards, [seed]).lean_rad(Position.of("x+y+z"), 1) for seed in range(1000)]
    assert np.std(np.degrees(leans)) == pytest.approx(0.1, rel=0.05)
    errors = BenchErrors.drawn(standards, [1])
    assert errors.lean_rad(Position.of("x"), 1) == UPRIGHT
    assert errors.lean_rad(Position.of("x+y+z"), 1) != errors.lean_rad(Position.of("x+y-z"), 1)
    frame, lean = BodyFrame.of(Position.of("x+y+z")), errors.lean_rad(Position.of("x+y+z"), 1)
    turned = frame.in_body(felt(np.array([[0.0, 0.0, 100.0]]), frame, lean))[0]
    off_rad = np.arccos(turned @ np.array(Position.of("x+y+z").up) / 100.0)
    assert off_rad == pytest.approx(np.hypot(*lean), rel=1e-6)
