"""An accelerometer's nine parameters: on a triad made with NumPy, and on the Xsens MTi of imu_tk with its result."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import rq

from labctl.fitting.poses.at_rest.accelerometer import Accelerometer, calibrate_accelerometer
from labctl.fitting.poses.at_rest.adequacy import Adequacy, adequacy_of
from labctl.fitting.poses.at_rest.rests import find_rests
from labctl.fitting.poses.readings import AXES, PoseReadings
from labctl.fitting.poses.triad import UPPER
from labctl.recording import RecordingInfo
from labctl.recording.data_files import read_table
from labctl.recording.info import NO_DATE
from tests.helpers.paths import ROOT
from tests.helpers.poses_at_rest import BIAS_G, ERRORS, poses, readings_in

#: What imu_tk's test program prints of bin/test_data/xsens_acc.mat (A. Pretto, BSD): force, m/s2, = T K (words - B).
IMU_TK_T = np.array([[1.0, 0.0, 0.0], [-0.00354989, 1.0, 0.0], [-0.00890444, -0.0213032, 1.0]])
IMU_TK_K = np.diag([0.00241267, 0.00242659, 0.00241232])
IMU_TK_B = np.array([33124.2, 33275.2, 32364.4])
#: Local gravity that it counts on, m/s2.
IMU_TK_GRAVITY = 9.81744


def calibrated(rows: np.ndarray) -> tuple[Accelerometer, Adequacy]:
    info = RecordingInfo(serial="A", axes=AXES, kind="samples", motion="poses", started_at=NO_DATE)
    n = len(rows)
    readings = PoseReadings(info, rows[:, 0], rows[:, 1:], np.zeros((n, 3)), None, np.zeros(n, dtype=np.bool_))
    rests = find_rests(readings)
    found = calibrate_accelerometer(readings, rests)
    return found, adequacy_of(found, rests)


def symmetric_root(matrix: np.ndarray) -> np.ndarray:
    """Return the part of a matrix that sizes of forces tell: a rotation in front of it is no part of it."""
    values, vectors = np.linalg.eigh(matrix.T @ matrix)
    return np.asarray(vectors * np.sqrt(values) @ vectors.T)


def test_intervals_cover_the_truth_with_and_without_what_the_noise_does_not_explain() -> None:
    true = np.concatenate([BIAS_G, [ERRORS[place] for place in UPPER]])
    for extra_g, verdict in ((0.0, "adequate"), (4e-4, "unexplained")):
        inside = []
        for seed in range(20):
            rows = readings_in(poses(24, seed), 100 + seed)
            drift = np.random.default_rng(200 + seed).normal(0.0, extra_g, (24, 3))
            rows[:, 1:] += np.repeat(drift, 200, axis=0)
            found, worth = calibrated(rows)
            value = np.concatenate([found.bias_g, [found.errors[place] for place in UPPER]])
            inside.append(np.abs(value - true) <= 1.96 * np.sqrt(np.diag(found.covariance)))
            assert worth.verdict == verdict
        assert np.mean(inside) > 0.88


def test_held_out_rests_are_those_of_a_fit_without_them() -> None:
    rows = readings_in(poses(24, 5), 5)
    whole, worth = calibrated(rows)
    squares = []
    for k in range(24):
        without, _ = calibrated(np.delete(rows, slice(200 * k, 200 * k + 200), axis=0))
        mean = rows[200 * k + 80 : 200 * k + 170, 1:].mean(axis=0)
        force = np.linalg.solve(np.eye(3) + without.errors, mean - without.bias_g)
        squares.append((np.linalg.norm(force) - whole.gravity_g) ** 2)
    assert worth.heldout_g == pytest.approx(np.sqrt(np.mean(squares)), rel=0.25)


def test_an_xsens_is_what_imu_tk_prints_of_it() -> None:
    table = read_table(ROOT / "examples/published/xsens_acc.parquet")
    rows = np.column_stack([np.asarray(values, dtype=np.float64) for values in table.values()])
    rows[:, 1:] = (rows[:, 1:] - 33000.0) / 4070.0
    found, worth = calibrated(rows)
    assert 33000 + 4070 * found.bias_g == pytest.approx(IMU_TK_B, abs=0.8)
    ours = IMU_TK_GRAVITY / 4070 * np.linalg.inv(np.eye(3) + found.errors)
    published = symmetric_root(IMU_TK_T @ IMU_TK_K)
    assert symmetric_root(ours) / published[0, 0] == pytest.approx(published / published[0, 0], abs=5e-4)
    # in labctl's axes: words over force is upper triangular there
    words, _ = rq(np.linalg.inv(IMU_TK_T @ IMU_TK_K))
    errors = words * np.sign(np.diag(words)) * IMU_TK_GRAVITY / 4070 - np.eye(3)
    u = np.sqrt(np.diag(found.covariance))
    away = np.array([found.errors[place] - errors[place] for place in UPPER])
    assert np.all(np.abs(away) <= 2.5 * u[3:])
    assert u[3:].max() < 1e-3
    assert worth.heldout_g < 3e-4
