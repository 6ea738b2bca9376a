"""Turns by a known angle: one turn in each data set, its mean rate over the integral's interval, what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadRecording
from labctl.recording import Recording, RecordingInfo, to_points
from labctl.recording.checks import checked
from labctl.recording.motions.turn_means import trapezoidal_mean
from studies.hand_turns import Unit, measured
from tests.helpers.recordings import STARTED

INFO = RecordingInfo(serial="T-1", axes=("z",), kind="samples", motion="turns", started_at=STARTED)


def one_turn(**columns: object) -> dict[str, np.ndarray]:
    """A rest of ten readings, and a turn of 90 deg in 11 readings at 9 deg/s: half a reading's step at either end."""
    t_s = np.concatenate([np.arange(10.0), 20.0 + np.arange(11.0)])
    found: dict[str, object] = {
        "dataset": np.repeat([1, 2], [10, 11]),
        "t_s": t_s,
        "turn_deg": np.repeat([0.0, 90.0], [10, 11]),
        "turn_u_deg": np.repeat([0.0, 0.5], [10, 11]),
        "gyro_z": np.repeat([0.0, 9.0], [10, 11]),
    }
    return {name: np.asarray(values) for name, values in {**found, **columns}.items()}


def recording(info: RecordingInfo = INFO, **columns: object) -> Recording:
    return Recording(info, checked(Path("turns.csv"), info, one_turn(**columns)))


def test_a_turn_is_a_mean_rate_over_the_time_between_its_readings() -> None:
    points = to_points(recording()).columns
    assert points["table_rate_dps"].tolist() == [0.0, 9.0]  # 90 deg in 10 s, not in the 11 s of eleven readings
    assert points["duration_s"].tolist() == [9.0, 10.0]
    assert points["gyro_z"].tolist() == [0.0, 9.0]


def test_the_mean_of_an_output_is_its_integral_over_uneven_times() -> None:
    """A rate of t deg/s over 10 s is 50 deg, wherever it is read; the plain mean of these readings is not 5 deg/s."""
    t_s = 20.0 + np.array([0, 0.5, 1, 1.5, 2, 2.5, 3, 4, 6, 8, 10.0])
    found = recording(t_s=np.concatenate([np.arange(10.0), t_s]), gyro_z=np.concatenate([np.zeros(10), t_s - 20.0]))
    assert to_points(found).columns["gyro_z"][1] == pytest.approx(5.0)
    assert trapezoidal_mean(np.array([3.0]), np.array([7.0])) == 7.0


def test_readings_that_are_not_valid_bound_no_turn() -> None:
    valid = np.ones(21, dtype=np.int64)
    valid[-1] = 0
    assert to_points(recording(valid=valid)).columns["table_rate_dps"][1] == pytest.approx(10.0)  # 90 deg in 9 s


def test_scattered_time_stamps_leave_something_in_a_mean() -> None:
    rng = np.random.default_rng(1)
    t_s = np.arange(2000) / 100.0
    rate = 100.0 * np.sin(np.pi * t_s / t_s[-1]) ** 2
    angle = float(np.trapezoid(rate, t_s))
    errors, said = [], []
    for _ in range(200):
        stamps = t_s + rng.normal(0, 1e-3, len(t_s))
        columns = {"dataset": np.ones(2000, dtype=np.int64), "t_s": np.sort(stamps), "gyro_z": rate}
        columns["turn_deg"] = np.full(2000, angle)
        points = to_points(Recording(INFO, checked(Path("turns.csv"), INFO, columns))).columns
        errors.append(float(points["gyro_z"][0] * points["duration_s"][0]) - angle)
        said.append(float(points["gyro_z_time_std"][0] * points["duration_s"][0]))
    assert np.std(errors) == pytest.approx(np.mean(said), rel=0.3)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"turn_deg": np.arange(21.0)}, "'turn_deg', row 2: 1 deg in data set 1, which began with 0 deg; a data set"),
        (
            {"turn_u_deg": np.full(21, -1.0)},
            "'turn_u_deg', row 1: -1 deg; give an uncertainty of at least 0 deg",
        ),
        ({"turn_u_deg": np.arange(21.0)}, "'turn_u_deg', row 2: 1 deg in data set 1"),
        ({"valid": np.repeat([1, 0], [11, 10])}, "'turn_deg', row 11: data set 2 has 1 valid readings"),
    ],
)
def test_what_is_no_turn_is_refused(columns: dict[str, object], message: str) -> None:
    with pytest.raises(BadRecording, match=r"turns\.csv") as refused:
        recording(**columns)
    assert message in str(refused.value)


def test_means_of_turns_need_their_length() -> None:
    info = INFO.model_copy(update={"kind": "points"})
    columns = {"dataset": np.array([1, 2]), "turn_deg": np.array([0.0, 360.0]), "gyro_z": np.array([0.1, 72.1])}
    with pytest.raises(BadRecording, match="'gyro_z_std' is missing; the weights of rests and turns"):
        checked(Path("turns.csv"), info, {**columns, "n": np.array([9, 9]), "duration_s": np.array([5.0, 5.0])})
    columns |= {"n": np.array([500, 500]), "gyro_z_std": np.array([0.1, 60.0])}
    with pytest.raises(BadRecording, match="'duration_s' is missing"):
        checked(Path("turns.csv"), info, dict(columns))
    with pytest.raises(BadRecording, match=r"'duration_s', row 2: 0 s"):
        checked(Path("turns.csv"), info, {**columns, "duration_s": np.array([5.0, 0.0])})
    found = checked(Path("turns.csv"), info, {**columns, "duration_s": np.array([5.0, 5.0])})
    assert found["table_rate_dps"].tolist() == [0.0, 72.0]


def test_a_long_turn_is_not_divided() -> None:
    """A rest through which the temperature moves is taken in pieces; a piece of a turn would be no known angle."""
    rng = np.random.default_rng(2)
    slow = measured(rng, Unit.drawn(rng), 0.01, 1, 36000.0, rate_hz=2.0)
    warm = np.linspace(20.0, 60.0, len(slow))
    points = to_points(replace(slow, columns={**slow.columns, "temperature_c": warm}))
    assert len(points) == 12
