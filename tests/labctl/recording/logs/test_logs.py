"""ULog, bags and Parquet as recordings: which gyro, units, thermometer, and what is not there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from labctl.errors import BadInput, BadRecording
from tests.helpers.bags import bag, imported
from tests.helpers.written_logs import at_rest, in_poses, resting_ulog, write_ulog

ROWS = at_rest()


def test_a_ulog_gives_the_raw_gyro_with_its_own_thermometer(tmp_path: Path) -> None:
    recording = imported(resting_ulog(tmp_path / "log.ulg"))
    assert recording.info.motion == "rest"
    assert recording.info.output["x"].unit == "rad/s"
    for axis, column in zip("xyz", ROWS.T[1:4], strict=True):
        np.testing.assert_allclose(recording.gyro_dps(axis), column, atol=1e-5)
    np.testing.assert_allclose(np.asarray(recording.columns["t_s"]), 10 + ROWS[:, 0], atol=1e-6)
    np.testing.assert_allclose(np.asarray(recording.columns["temperature_c"]), ROWS[:, 4], atol=1e-4)
    np.testing.assert_allclose(np.asarray(recording.columns["accel_z_g"]), -1.0, atol=1e-6)
    assert recording.info.notes.startswith("PX4 ULog, sensor_gyro 0 (of sensor_gyro 0, sensor_gyro 1)")
    assert recording.info.serial == "00ab12cd-0"


def test_an_instance_of_a_ulog_is_a_recording_of_its_own(tmp_path: Path) -> None:
    path = resting_ulog(tmp_path / "log.ulg")
    other = imported(path, instance="1")
    difference = other.gyro_dps("x") - imported(path).gyro_dps("x")
    np.testing.assert_allclose(difference, np.degrees(0.1), atol=1e-4)
    assert other.info.serial == "00ab12cd-1"
    with pytest.raises(BadInput, match=r"no instance 7 \(instances: sensor_gyro 0, sensor_gyro 1\)"):
        imported(path, instance="7")
    with pytest.raises(BadInput, match="option topic"):
        imported(path, topic="sensor_mag")


def test_integrated_angles_of_a_ulog_become_rates_with_the_temperature_of_the_raw_gyro(tmp_path: Path) -> None:
    stamps = 1e6 * ROWS[:, :1]
    dt_us = np.full((len(ROWS), 1), 5000.0)
    angles = np.radians(ROWS[:, 1:4]) * 5e-3
    path = write_ulog(
        tmp_path / "imu.ulg",
        {
            ("vehicle_imu", 0): (
                ("timestamp", "delta_angle_dt", "delta_angle[0]", "delta_angle[1]", "delta_angle[2]"),
                np.column_stack([stamps, dt_us, angles]),
            ),
            ("sensor_gyro", 0): (
                ("timestamp", "x", "y", "z", "temperature"),
                np.column_stack([stamps, np.zeros((len(ROWS), 3)), ROWS[:, 4]])[::40],
            ),
        },
    )
    recording = imported(path, topic="vehicle_imu")
    np.testing.assert_allclose(recording.gyro_dps("y"), ROWS[:, 2], atol=1e-5)
    at = np.asarray(recording.columns["temperature_c"])
    assert at[:360] == pytest.approx(ROWS[:360, 4], abs=1e-3)


IMU, THERMOMETER = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"


@pytest.mark.parametrize("name", ["log.bag", "log"])
def test_a_bag_gives_rates_force_and_temperature_by_the_time_of_the_heads(tmp_path: Path, name: str) -> None:
    recording = imported(bag(tmp_path / name))
    assert recording.info.motion == "rest"
    assert recording.info.started_at.timestamp() == pytest.approx(1_700_000_000, abs=1e-3)
    np.testing.assert_allclose(np.asarray(recording.columns["t_s"]), ROWS[:, 0], atol=1e-8)
    np.testing.assert_allclose(recording.gyro_dps("z"), ROWS[:, 3], atol=1e-9)
    np.testing.assert_allclose(np.asarray(recording.columns["accel_z_g"]), 1.0, rtol=1e-9)
    np.testing.assert_allclose(np.asarray(recording.columns["temperature_c"]), ROWS[:, 4], atol=1e-9)


def test_of_several_topics_one_is_chosen_and_a_force_that_is_not_there_is_left_out(tmp_path: Path) -> None:
    path = bag(tmp_path / "two.bag", ("/a", "/b"), force=False)
    with pytest.raises(BadInput, match="/a and /b are all of sensor_msgs/msg/Imu; choose one with --option topic=NAME"):
        imported(path)
    with pytest.raises(BadInput, match="no topic '/c'"):
        imported(path, topic="/c")
    assert "accel_x_g" not in imported(path, topic="/b").columns


def test_a_bag_without_a_gyro_says_what_it_has(tmp_path: Path) -> None:
    with pytest.raises(BadRecording, match=r"no topic of sensor_msgs/msg/Imu \(its topics: /temp"):
        imported(bag(tmp_path / "none.bag", ()))


def test_parquet_with_names_of_its_own_is_read_as_csv_is(tmp_path: Path) -> None:
    names = ["time [s]", "gyro_x [deg/s]", "gyro_y [deg/s]", "gyro_z [deg/s]", "temp [degC]"]
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(dict(zip(names, ROWS.T, strict=True))), path)
    recording = imported(path)
    np.testing.assert_array_equal(recording.gyro_dps("x"), ROWS[:, 1])
    assert recording.info.motion == "rest"


def test_a_parquet_of_poses_is_known_by_gravity(tmp_path: Path) -> None:
    names = ["t_s", "wx (deg/s)", "wy (deg/s)", "wz (deg/s)", "ax", "ay", "az"]
    path = tmp_path / "poses.parquet"
    pq.write_table(pa.table(dict(zip(names, in_poses().T, strict=True))), path)
    recording = imported(path)
    assert recording.info.motion == "poses"
    force = np.column_stack([np.asarray(recording.columns[f"accel_{axis}_g"]) for axis in "xyz"])
    assert np.median(np.linalg.norm(force, axis=1)) == pytest.approx(1.0, abs=0.01)
