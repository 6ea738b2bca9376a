"""Rotation of the gyro triad from the accelerometer triad: its definition, and against known turns."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.fitting.live import PoseRequest
from labctl.fitting.live.directions import DIRECTIONS
from labctl.fitting.poses.alignment import frame_of, rotation_between
from labctl.fitting.poses.fit import Solved, solve
from labctl.fitting.poses.readings import readings_of
from labctl.recording import Recording, RecordingInfo
from studies.poses import turned_deg
from tests.helpers.turned_unit import TurnedUnit

INFO = RecordingInfo(
    serial="HAND-1", axes=("x", "y", "z"), kind="samples", motion="poses", started_at=datetime(2026, 1, 5, tzinfo=UTC)
)
#: Scale factors and misalignments of a gyro and of an accelerometer, all of some per cent.
GYRO = np.array([[0.02, -0.03, 0.01], [0.05, -0.01, 0.04], [-0.02, 0.03, 0.03]])
ACCELEROMETER = np.array([[0.01, 0.02, -0.03], [0.0, -0.02, 0.05], [0.0, 0.0, 0.01]])


def turn(vector: list[float]) -> NDArray[np.float64]:
    """The rotation by a rotation vector, rad (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = np.array(vector) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def test_a_triad_that_is_turned_as_a_whole_is_turned_by_that_vector() -> None:
    vector = [0.02, -0.05, 0.08]
    turned = (np.eye(3) + ACCELEROMETER) @ turn(vector).T - np.eye(3)  # each axis of it, as a row, turned by it
    assert rotation_between(turned, ACCELEROMETER) == pytest.approx(frame_of(ACCELEROMETER) @ vector, abs=1e-12)
    square = turn(vector).T - np.eye(3)
    assert rotation_between(square, np.zeros((3, 3))) == pytest.approx(vector, abs=1e-12)


def test_neither_the_body_axes_nor_scale_factors_have_a_part_in_it() -> None:
    found = rotation_between(GYRO, ACCELEROMETER)
    body = turn([0.4, -1.2, 0.7])
    scales = np.diag([1.3, 0.8, 1.1])
    again = rotation_between(
        scales @ (np.eye(3) + GYRO) @ body - np.eye(3), (np.eye(3) + ACCELEROMETER) @ body - np.eye(3)
    )
    assert again == pytest.approx(found, abs=1e-12)
    assert turned_deg(GYRO, ACCELEROMETER) == pytest.approx(np.degrees(found), abs=1e-9)


def solved(unit: TurnedUnit) -> Solved:
    parts = []
    for k in range(24):
        unit.see(PoseRequest(DIRECTIONS[k * 7 % 26], 2.0))
        parts.append(unit.block(4.65))
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return solve(readings_of(Recording(INFO, {"dataset": np.ones(len(columns["t_s"]), dtype=np.int64), **columns})))


@pytest.mark.slow
def test_the_uncertainty_covers_known_turns() -> None:
    z = []
    for seed in range(8):
        unit = TurnedUnit(seed)
        found = solved(unit).alignment
        z.extend((found.angles_rad - np.radians(turned_deg(unit.gyro, unit.accel))) / found.u_rad)
        assert found.u_rad.max() < 4e-4
    assert np.mean(np.abs(z) <= 2) > 0.85
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.4
