"""The accelerometer by gravity: nine parameters with their uncertainty, wrong rests, and poses that are missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labctl.errors import NotEnoughData
from labctl.fitting.poses.at_rest.accelerometer import MIN_POSES, SizeLaw, calibrate_accelerometer, fit_sizes
from labctl.fitting.poses.at_rest.gravity import STANDARD_GRAVITY, local_gravity_g
from labctl.fitting.poses.at_rest.rests import find_rests
from labctl.fitting.poses.readings import readings_of
from labctl.fitting.poses.triad import UPPER
from studies.poses_simulation import Session, simulate_session
from tests.helpers.poses_at_rest import BIAS_G, ERRORS, poses


@pytest.mark.parametrize(
    ("latitude_deg", "gravity"), [(0.0, 9.7803253359), (45.0, 9.806199), (-90.0, 9.8321849379), (None, 9.80665)]
)
def test_gravity_is_that_of_the_tables_of_wgs_84(latitude_deg: float | None, gravity: float) -> None:
    recording, _ = simulate_session(1, Session(rests=2))
    info = recording.info.model_copy(update={"latitude_deg": latitude_deg})
    assert local_gravity_g(info) * STANDARD_GRAVITY == pytest.approx(gravity, abs=2e-6)


@pytest.mark.slow
def test_nine_parameters_cover_the_truth() -> None:
    scores = []
    for seed in range(12):
        recording, truth = simulate_session(seed, Session(rests=24, latitude_deg=48.0))
        readings = readings_of(recording)
        found = calibrate_accelerometer(readings, find_rests(readings))
        true = np.concatenate([truth.accel_bias_g, [truth.accel[place] for place in UPPER]])
        value = np.concatenate([found.bias_g, [found.errors[place] for place in UPPER]])
        scores.append((value - true) / np.sqrt(np.diag(found.covariance)))
    z = np.abs(scores)
    assert np.mean(z <= 2) > 0.88
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=0.3)


def test_a_rest_that_was_pushed_is_left_out() -> None:
    recording, truth = simulate_session(2, Session(rests=24, latitude_deg=48.0))
    readings = readings_of(recording)
    rests = find_rests(readings)
    accel = rests.accel_g.copy()
    accel[7] *= 1.02
    found = calibrate_accelerometer(readings, replace(rests, accel_g=accel))
    assert np.flatnonzero(~found.used).tolist() == [7]
    assert found.bias_g == pytest.approx(truth.accel_bias_g, abs=1e-3)


def test_poses_that_do_not_determine_it_are_refused_with_the_face_that_is_missing() -> None:
    recording, _ = simulate_session(2, Session(rests=24))
    readings = readings_of(recording)
    rests = find_rests(readings)
    few = replace(rests, accel_g=np.repeat(rests.accel_g[:6], 4, axis=0))
    with pytest.raises(NotEnoughData, match=r"24 rests in 6 different poses; .* at least 12 for .*: lay the unit down"):
        calibrate_accelerometer(readings, few)
    about_z = Rotation.from_rotvec(np.linspace(0, 5.8, 24)[:, None] * [0.0, 0.0, 1.0]).apply([1.0, 0.0, 0.05])
    with pytest.raises(NotEnoughData, match=r"with -z up too \(the nearest pose is 9\d deg from it\)"):
        calibrate_accelerometer(readings, replace(rests, accel_g=about_z))


def kept_rests(seed: int, rests: int, wrong_g: float = 0.0) -> np.ndarray:
    """Return which rests a fit uses, of which the fourth is off by `wrong_g`; 0.2 mg from rest to rest."""
    force = poses(rests, seed)
    force[3] *= 1 + wrong_g
    noise_g = np.random.default_rng(seed).normal(0, 2e-4, force.shape)
    readings = force @ (np.eye(3) + ERRORS).T + BIAS_G + noise_g
    return fit_sizes(SizeLaw(readings), 1.0, np.full(rests, 1e-8), MIN_POSES)[2]


@pytest.mark.slow
def test_no_rest_is_left_out_because_few_others_predict_it_badly() -> None:
    assert all(kept_rests(seed, rests).all() for rests in (13, 16, 20) for seed in range(60))


def test_a_wrong_rest_among_few_is_left_out() -> None:
    for seed in range(30):
        assert np.flatnonzero(~kept_rests(seed, 20, wrong_g=0.01)).tolist() == [3]
