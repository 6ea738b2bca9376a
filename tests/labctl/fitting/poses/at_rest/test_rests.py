"""Rests are found from the readings, with a threshold from their own noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting.poses.at_rest.rests import find_rests
from labctl.fitting.poses.readings import PoseReadings, readings_of
from labctl.recording import Recording
from studies.poses_simulation import Session, simulate_session


def spoilt(recording: Recording, **columns: np.ndarray) -> PoseReadings:
    return readings_of(replace(recording, columns={**recording.columns, **columns}))


def test_every_rest_is_found_and_nothing_else_whatever_the_noise() -> None:
    for noise in (0.005, 0.05, 0.3):
        recording, _ = simulate_session(3, Session(rests=14, gyro_noise_dps=noise))
        rests = find_rests(readings_of(recording))
        assert len(rests) == 14
        assert np.all((rests.duration_s > 2.0) & (rests.duration_s < 3.0))
        assert rests.noise[3:] == pytest.approx(noise, rel=0.1)


def test_the_noise_of_a_mean_is_that_of_noise_whose_readings_agree_with_their_neighbours() -> None:
    recording, _ = simulate_session(3, Session(rests=14))
    rng = np.random.default_rng(1)
    noise = np.convolve(rng.normal(0, 0.3, len(recording) + 19), np.ones(20) / 20, mode="valid")
    gyro = np.asarray(recording.columns["gyro_x"], dtype=np.float64) + noise
    rests = find_rests(spoilt(recording, gyro_x=gyro))
    expected = 0.3**2 * 0.01  # variance of a mean over one second: of a moving mean that of what went into it
    assert rests.density[3] == pytest.approx(expected, rel=0.5)
    assert rests.density[3] > 5 * rests.noise[3] ** 2 * 0.01


def test_a_steady_turn_about_the_vertical_is_no_rest() -> None:
    recording, _ = simulate_session(3, Session(rests=14))
    gyro = np.asarray(recording.columns["gyro_z"], dtype=np.float64).copy()
    rests = find_rests(readings_of(recording))
    gyro[rests.begin[5] - 40 : rests.end[5] + 40] += 20.0
    assert len(find_rests(spoilt(recording, gyro_z=gyro))) == 13


def test_a_rest_ends_at_a_gap_and_at_a_power_on() -> None:
    recording, _ = simulate_session(3, Session(rests=14))
    rests = find_rests(readings_of(recording))
    run = np.ones(len(recording), dtype=np.int64)
    run[(rests.begin[5] + rests.end[5]) // 2 :] = 2
    assert len(find_rests(spoilt(recording, run=run))) == 15
    valid = np.ones(len(recording), dtype=np.int64)
    valid[(rests.begin[7] + rests.end[7]) // 2 - 10 :][:20] = 0
    assert len(find_rests(spoilt(recording, valid=valid))) == 15


def test_motion_without_a_rest_is_refused_with_what_to_do() -> None:
    recording, _ = simulate_session(3, Session(rests=14))
    t_s = np.asarray(recording.columns["t_s"])
    shaken = {
        f"gyro_{a}": 40 * np.sin(2 * np.pi * (f + 0.05 * t_s) * t_s)
        for a, f in zip("xyz", (0.7, 0.9, 1.3), strict=True)
    }
    with pytest.raises(
        NotEnoughData, match=r"the unit is never at rest in this recording: .* lay the unit down"
    ) as refused:
        find_rests(spoilt(recording, **shaken))
    assert "\n" not in str(refused.value)
