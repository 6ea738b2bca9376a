"""`labctl accelerometer`: files of readings in poses become nine parameters, a verdict, and those of an autopilot."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from labctl.cli.app import app
from labctl.recording.files import write_recording
from studies.poses_simulation import Session, simulate_session
from tests.helpers.poses_at_rest import BIAS_G, ERRORS, RATE_HZ, poses, readings_in, write_readings


def run(*arguments: str, status: int = 0) -> Result:
    result = CliRunner().invoke(app, ["accelerometer", *arguments])
    assert result.exit_code == status, result.output + result.stderr
    return result


def answer(*arguments: str) -> dict[str, Any]:
    return dict(json.loads(run(*arguments, "--json").stdout))


def test_poses_become_nine_parameters_and_those_of_autopilots(tmp_path: Path) -> None:
    directions = poses(26, 1)
    path = write_readings(tmp_path / "a.csv", readings_in(directions, 1))
    out = tmp_path / "acc.params"
    found = answer(path, "--export", "px4", "--out", str(out), "--device-id", "9")
    assert found["verdict"] == "adequate"
    assert found["rests"] == 26
    for i, axis in enumerate("xyz"):
        for each, true in ((found["bias_g"][axis], BIAS_G[i]), (found["scale_factor"][axis], ERRORS[i, i])):
            assert each["value"] == pytest.approx(true, abs=4 * each["u"])
        density = 0.001 / np.sqrt(RATE_HZ) * 9.80665
        assert found["noise_density_m_s2"][axis] == pytest.approx(density, rel=0.2)
    yz = found["misalignment"]["yz"]
    assert yz["value"] == pytest.approx(ERRORS[1, 2], abs=4 * yz["u"])
    lines = [line.split("\t") for line in out.read_text().splitlines() if not line.startswith("#")]
    values = {line[2]: float(line[3]) for line in lines}
    assert values["CAL_ACC0_ID"] == 9
    readings = (directions @ (np.eye(3) + np.diag(np.diag(ERRORS))).T + BIAS_G) * 9.80665
    offset, scale = (np.array([values[f"CAL_ACC0_{a}{kind}"] for a in "XYZ"]) for kind in ("OFF", "SCALE"))
    assert (readings - offset) * scale == pytest.approx(directions * 9.80665, abs=0.01)
    assert "LOST misalignments" in out.read_text()
    run(path, "--export", "ardupilot", "--out", str(out), "--instance", "2")
    rows = dict(line.split(",") for line in out.read_text().splitlines() if not line.startswith("#"))
    assert sorted(rows) == [f"INS_ACC2{kind}_{a}" for kind in ("OFFS", "SCAL") for a in "XYZ"]
    assert "verdict: adequate" in run(path).stdout


def test_sessions_of_one_unit_are_joined(tmp_path: Path) -> None:
    first = write_readings(tmp_path / "a.csv", readings_in(poses(8, 1), 1))
    second = write_readings(tmp_path / "b.csv", readings_in(poses(10, 2), 2))
    assert "8 rests in 8 different poses" in run(first, status=2).stderr
    assert answer(first, second)["rests"] == 18


def test_what_the_noise_does_not_explain_is_said_and_is_in_the_uncertainty(tmp_path: Path) -> None:
    readings = readings_in(poses(26, 3), 3)
    readings[:, 1:] += 0.003 * np.sin(readings[:, :1] / 5)
    found = answer(write_readings(tmp_path / "a.csv", readings))
    assert found["verdict"] == "unexplained"
    assert found["heldout_g"] > 3 * found["expected_g"]
    assert "the uncertainties include it" in found["text"][-1]


def test_what_is_wrong_is_said_once(tmp_path: Path) -> None:
    readings = readings_in(np.repeat(np.eye(3)[:2], 4, axis=0), 1)
    path = write_readings(tmp_path / "a.csv", readings)
    for options, said in (
        ((), "no pose yet with -x, -y, z, -z up"),
        (("--columns", "a,b,c,d"), "there is no column 'a' (the columns are t_s, accel_x_g"),
        (("--columns", "a"), "name four columns"),
        (("--unit", "LSB"), "--unit LSB: give one of g, mg, m/s2"),
        (("--latitude", "91"), "--latitude 91: give the latitude in deg"),
        (("--export", "px4"), "give --export and --out together"),
    ):
        assert said in run(path, *options, status=2).stderr.replace("\n", " ")
    assert "not found" in run("nothing.csv", status=2).stderr
    write_readings(tmp_path / "b.csv", readings[::-1])
    assert "row 2: the time does not increase" in run(str(tmp_path / "b.csv"), status=2).stderr


def test_the_folder_of_a_recording_in_poses_is_read(tmp_path: Path) -> None:
    recording, truth = simulate_session(2, Session(rests=24))
    write_recording(recording, tmp_path / "poses")
    found = answer(str(tmp_path / "poses"))
    for i, axis in enumerate("xyz"):
        assert found["bias_g"][axis]["value"] == pytest.approx(truth.accel_bias_g[i], abs=2e-3)
    table = write_readings(tmp_path / "a.csv", readings_in(poses(8, 1), 1))
    mixed = run(str(tmp_path / "poses"), table, status=2).stderr.replace("\n", " ")
    assert "one is a recording with a gyro, the other a table without" in mixed
