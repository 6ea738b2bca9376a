"""Four poses with an earlier calibration of the unit: the stated interval holds the truth; a change is not hidden."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting.poses.at_rest.accelerometer import calibrate_accelerometer
from labctl.fitting.poses.at_rest.adequacy import adequacy_of
from labctl.fitting.poses.at_rest.fewer_poses import ByFewer, Known, Scatter, by_fewer_poses
from labctl.fitting.poses.at_rest.rests import find_rests
from labctl.fitting.poses.readings import AXES, PoseReadings
from labctl.fitting.poses.triad import UPPER
from labctl.recording import RecordingInfo
from labctl.recording.info import NO_DATE
from tests.helpers.poses_at_rest import BIAS_G, ERRORS, poses, readings_in

#: Allowed change of scale factors and misalignments since the earlier calibration.
CHANGE = np.repeat([1e-3, 5e-4], 3)
TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]) / np.sqrt(3)


def session(
    directions: np.ndarray, seed: int, errors: np.ndarray = ERRORS, bias_g: np.ndarray = BIAS_G
) -> PoseReadings:
    """Return the readings of a unit with other parameters than those of the helper."""
    table = readings_in(directions, seed)
    force = (table[:, 1:] - BIAS_G) @ np.linalg.inv(np.eye(3) + ERRORS).T
    info = RecordingInfo.model_construct(
        serial="A", axes=AXES, kind="samples", motion="poses", started_at=NO_DATE, latitude_deg=None
    )
    readings = force @ (np.eye(3) + errors).T + bias_g
    return PoseReadings(
        info, table[:, 0], readings, np.zeros((len(table), 3)), None, np.zeros(len(table), dtype=np.bool_)
    )


@pytest.fixture(scope="module")
def known() -> Known:
    readings = session(poses(24, 1), 1)
    found = calibrate_accelerometer(readings, find_rests(readings))
    values = np.array([found.errors[place] for place in UPPER])
    return Known(values, found.covariance[3:, 3:] + np.diag(CHANGE**2), found.bias_g)


def later(known: Known, directions: np.ndarray, seed: int, size: float = 1.0) -> tuple[ByFewer, np.ndarray, float]:
    """Return a later calibration of the unit, its true parameters, and held-out over expected error."""
    rng = np.random.default_rng(seed)
    errors, bias_g = ERRORS.copy(), BIAS_G + rng.normal(0, 0.01, 3)
    for place, change in zip(UPPER, CHANGE, strict=True):
        errors[place] += size * rng.normal(0, change)
    readings = session(directions, seed + 1000, errors, bias_g)
    rests = find_rests(readings)
    fewer = by_fewer_poses(readings, rests, known)
    worth = adequacy_of(fewer.accelerometer, rests, known.whitened)
    true = np.concatenate([bias_g, [errors[place] for place in UPPER]])
    return fewer, true, worth.heldout_g / worth.expected_g


def test_the_interval_of_four_poses_holds_the_truth(known: Known) -> None:
    inside, agree, ratios = [], [], []
    for seed in range(60):
        fewer, true, ratio = later(known, TETRAHEDRON, seed)
        theta = np.concatenate([fewer.accelerometer.bias_g, [fewer.accelerometer.errors[place] for place in UPPER]])
        inside += list(np.abs(theta - true) < 1.96 * np.sqrt(np.diag(fewer.accelerometer.covariance)))
        agree.append(fewer.agrees)
        ratios.append(ratio)
    assert 0.92 < np.mean(inside) < 0.98
    assert np.mean(agree) > 0.95
    assert np.sqrt(np.mean(np.square(ratios))) == pytest.approx(1.0, abs=0.25)


def test_a_unit_that_changed_by_more_is_said_to(known: Known) -> None:
    directions = np.vstack([np.eye(3), -np.eye(3), TETRAHEDRON])
    assert not any(later(known, directions, seed, size=20)[0].agrees for seed in range(10))


def test_poses_that_do_not_tell_the_bias_are_refused(known: Known) -> None:
    with pytest.raises(NotEnoughData, match="3 rests in 3 different poses; with an earlier version"):
        later(known, np.eye(3), 1)
    level = np.column_stack([poses(6, 1)[:, :2], np.zeros(6)])
    with pytest.raises(NotEnoughData, match="do not determine the bias"):
        later(known, level / np.linalg.norm(level, axis=1)[:, None], 1)


@pytest.mark.parametrize("off_plane", [0.003, 0.01])
def test_a_bias_square_to_the_plane_of_all_poses_is_refused_or_right(known: Known, off_plane: float) -> None:
    """The bias square to the plane changes sizes by its square only, unless the poses leave the plane by enough."""
    around = np.radians([0.0, 63.0, 117.0, 180.0])
    plane = np.column_stack([np.zeros(4), np.cos(around), np.sin(around)])
    refused: list[str] = []
    for seed in range(20):
        directions = plane + off_plane * np.random.default_rng(seed).normal(size=(4, 3))
        fewer, true, error = later_or_refused(known, directions / np.linalg.norm(directions, axis=1)[:, None], seed)
        if fewer is None:
            refused.append(error)
        else:
            assert np.all(np.abs(fewer.accelerometer.bias_g - true[:3]) < 4 * fewer.accelerometer.u[:3])
    assert len(refused) >= 10
    assert all("bias" in each and "up" in each for each in refused)


def later_or_refused(known: Known, directions: np.ndarray, seed: int) -> tuple[ByFewer | None, np.ndarray, str]:
    """Return a later calibration and its true parameters, or why it was refused."""
    try:
        fewer, true, _ = later(known, directions, seed)
    except NotEnoughData as error:
        return None, np.zeros(0), str(error)
    return fewer, true, ""


@pytest.mark.slow
def test_scatter_between_rests_is_known_from_the_earlier_session_too() -> None:
    """With 0.3 mg from rest to rest and six faces, U holds the truth, and the unit is not said to have changed."""
    scatter_g, inside, agree = 3e-4, [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        first = session(poses(24, seed) * (1 + rng.normal(0, scatter_g, (24, 1))), seed)
        rests = find_rests(first)
        was = calibrate_accelerometer(first, rests)
        used = int(np.count_nonzero(was.used))
        scatter = Scatter(was.residual_g**2 * used / was.freedom, float(rests.accel_white_var.mean()), was.freedom)
        values = np.array([was.errors[place] for place in UPPER])
        earlier = Known(values, was.covariance[3:, 3:] + np.diag(CHANGE**2), was.bias_g, scatter)
        faces = np.vstack([np.eye(3), -np.eye(3)]) * (1 + rng.normal(0, scatter_g, (6, 1)))
        fewer, true, _ = later(earlier, faces, seed)
        theta = np.concatenate([fewer.accelerometer.bias_g, [fewer.accelerometer.errors[place] for place in UPPER]])
        inside += list(np.abs(theta - true) < fewer.accelerometer.expanded)
        agree.append(fewer.agrees)
    assert 0.92 < np.mean(inside) < 0.985
    assert np.mean(agree) > 0.93


#: Means of six rests, one on each face, raw words: the annotated session of imucal (MaD-Lab Erlangen, MIT).
FACES = np.array([
    [2039.635, -62.713, 13.937], [-2051.673, -30.280, -76.004], [8.944, 1991.568, -55.811],
    [-20.197, -2088.144, -10.375], [-34.779, -24.790, 2077.468], [10.826, -121.301, -2135.400],
])  # fmt: skip
#: What imucal 2.6.0 publishes of it: offsets in words; words per m/s2, to be multiplied by its gravity, 9.81 m/s2.
IMUCAL_OFFSET = np.array([-6.019, -48.288, -28.966])
IMUCAL_PER_G = 9.81 * np.array([208.5457, 208.0011, 214.7846])
#: Words of 1 g, nominal, and of the mean's noise.
WORDS, NOISE = 2048.0, 0.25


def test_six_faces_agree_with_imucal() -> None:
    """imucal takes each face as exactly level; here the faces are level to 10 mrad, as the axes' alignment is known."""
    table = session(np.vstack([np.eye(3), -np.eye(3)]), 1)
    rests = find_rests(table)
    measured = replace(rests, accel_g=FACES / WORDS, density=np.full_like(rests.density, 0.0))
    loose = Known(
        np.zeros(6), np.diag(np.repeat([0.1, 0.01], 3) ** 2), np.zeros(3), Scatter((NOISE / WORDS) ** 2, 0.0, 1e6)
    )
    found = by_fewer_poses(table, measured, loose).accelerometer
    assert WORDS * found.bias_g == pytest.approx(IMUCAL_OFFSET, abs=0.6)  # 0.3 mg
    per_g = WORDS * np.linalg.norm(np.eye(3) + found.errors, axis=1)
    assert per_g == pytest.approx(IMUCAL_PER_G, rel=3e-4)
