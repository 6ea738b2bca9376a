"""Versions of sensors on the command line and in the database: numbered, sealed, shown again as they were."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from labctl.cli.app import app
from labctl.recording.files import write_recording
from labctl.store import check
from studies.accelerometer_simulation import TrueUnit, poses_at_temperatures
from studies.poses_simulation import Session, simulate_session
from tests.helpers.magnetic_turns import fields, readings_of
from tests.helpers.poses_at_rest import BIAS_G, poses, readings_in, write_readings


@pytest.fixture
def database(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "lab.sqlite"
    monkeypatch.setenv("LABCTL_DATABASE", str(path))
    return path


def run(*arguments: str, status: int = 0) -> Result:
    result = CliRunner().invoke(app, list(arguments))
    assert result.exit_code == status, result.output + result.stderr
    return result


def answer(*arguments: str) -> Any:
    return json.loads(run(*arguments, "--json").stdout)


def test_a_version_is_shown_and_exported_as_its_fit_was(tmp_path: Path, database: Path) -> None:
    path = write_readings(tmp_path / "a.csv", readings_in(poses(26, 1), 1))
    out, again = tmp_path / "acc.yaml", tmp_path / "again.yaml"
    fitted = answer("accelerometer", path)
    options = ("--latitude", "48.1", "--by", "Ada", "--export", "kalibr", "--out", str(out))
    kept = answer("accelerometer", path, "--serial", "IMU-7", *options)
    assert (kept["version"], kept["by"], kept["verdict"]) == (1, "Ada", "adequate")
    assert kept["data"]["read_as"].endswith("gravity at latitude 48.1 deg")
    assert answer("accelerometer", path, "--serial", "IMU-7")["result"] == fitted
    shown = answer(
        "sensors", "show", "IMU-7", "accelerometer", "--version", "1", "--export", "kalibr", "--out", str(again)
    )
    assert shown == kept
    assert again.read_bytes() == out.read_bytes()
    text = run("sensors", "show", "IMU-7", "accelerometer").stdout
    assert "version 2" in text
    assert "a.csv" in text
    field = tmp_path / "m.csv"
    np.savetxt(field, readings_of(fields(600), 1), delimiter=",", header="mag_x,mag_y,mag_z", comments="")
    run("magnetometer", str(field), "--serial", "IMU-7")
    rows = answer("sensors", "list", "IMU-7")
    assert [(row["sensor"], row["version"]) for row in rows] == [
        ("accelerometer", 2), ("accelerometer", 1), ("magnetometer", 1),
    ]  # fmt: skip
    assert check(str(database)).findings == ()
    assert "name accelerometer or magnetometer" in run("sensors", "show", "IMU-7", "gyro", status=2).stderr
    assert "has no version 9" in run("sensors", "show", "IMU-7", "magnetometer", "--version", "9", status=2).stderr


def test_four_poses_are_enough_with_an_earlier_version(tmp_path: Path, database: Path) -> None:
    whole = write_readings(tmp_path / "a.csv", readings_in(poses(26, 1), 1))
    four = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]) / np.sqrt(3)
    few = write_readings(tmp_path / "b.csv", readings_in(four, 2))
    assert "4 rests in 4 different poses" in run("accelerometer", few, status=2).stderr
    assert "--earlier needs --serial" in run("accelerometer", few, "--earlier", "0", status=2).stderr
    options = ("--serial", "IMU-7", "--earlier", "0")
    assert "has no version" in run("accelerometer", few, *options, status=2).stderr
    run("accelerometer", whole, "--serial", "IMU-7")
    kept = answer("accelerometer", few, *options)
    found = kept["result"]
    assert (kept["version"], found["earlier"]["version"], found["verdict"]) == (2, 1, "adequate")
    assert "the rests agree with it" in found["text"][-1]
    for i, axis in enumerate("xyz"):
        each = found["bias_g"][axis]
        assert each["value"] == pytest.approx(BIAS_G[i], abs=4 * each["u"])
    assert "--scale-change -1" in run("accelerometer", few, *options, "--scale-change", "-1", status=2).stderr
    assert database.is_file()


def test_coefficients_of_temperature_are_kept_shown_and_exported(tmp_path: Path, database: Path) -> None:
    unit = TrueUnit.drawn(np.random.default_rng(5))
    path = tmp_path / "warm.csv"
    head = "t_s,accel_x_g,accel_y_g,accel_z_g,temp_c"
    np.savetxt(path, poses_at_temperatures(1, unit), delimiter=",", header=head, comments="", fmt="%.7f")
    out = tmp_path / "acc.params"
    options = ("--temperature", "temp_c", "--serial", "IMU-7")
    kept = answer("accelerometer", str(path), *options, "--export", "px4", "--out", str(out))
    found = kept["result"]["temperature"]
    assert found["temperatures"] == 4
    assert kept["data"]["read_as"].endswith("temperature temp_c in deg C")
    for i, axis in enumerate("xyz"):
        each = found["scale_factor"][axis][0]
        assert each["value"] == pytest.approx(unit.scale_powers[0, i], abs=4 * each["u"])
    assert "TC_A0_X3_2" in out.read_text(encoding="ascii")
    assert answer("sensors", "show", "IMU-7", "accelerometer") == kept
    text = run("sensors", "show", "IMU-7", "accelerometer").stdout
    assert "g/K^3" in text
    assert "constants would leave" in text
    assert "leave one out" in run("accelerometer", str(path), *options, "--earlier", "0", status=2).stderr
    assert "temp_f" in run("accelerometer", str(path), "--temperature", "temp_f", status=2).stderr
    assert database.is_file()


def test_a_version_that_was_changed_is_found(tmp_path: Path, database: Path) -> None:
    path = write_readings(tmp_path / "a.csv", readings_in(poses(26, 1), 1))
    run("accelerometer", path, "--serial", "IMU-7")
    with closing(sqlite3.connect(database)) as connection, connection:
        connection.execute("UPDATE sensor_versions SET document = replace(document, 'adequate', 'Adequate')")
    findings = [each.text for each in check(str(database)).findings]
    assert any("accelerometer IMU-7 version 1: document changed" in text for text in findings)
    assert "was changed after it was stored" in run("sensors", "show", "IMU-7", "accelerometer", status=2).stderr


def test_a_recording_of_another_unit_is_refused(tmp_path: Path, database: Path) -> None:
    recording, _ = simulate_session(2, Session(rests=24))
    write_recording(recording, tmp_path / "poses")
    said = run("accelerometer", str(tmp_path / "poses"), "--serial", "IMU-7", status=2).stderr
    assert f"is of unit {recording.info.serial}, but --serial is IMU-7" in said
    kept = answer("accelerometer", str(tmp_path / "poses"), "--serial", recording.info.serial)
    assert [each["name"] for each in kept["data"]["files"]] == ["recording.toml", "samples.parquet"]
    assert database.is_file()
