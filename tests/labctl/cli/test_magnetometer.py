"""`labctl magnetometer`: a table of readings becomes hard and soft iron, a verdict, and parameters of an autopilot."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from labctl.cli.app import app
from labctl.recording import Recording, write_recording
from studies.triads import recording_of
from studies.triads_simulation import TrueTriads, turned_by_hand, vector_of
from tests.helpers.magnetic_turns import FIELD_UT, HARD_IRON_UT, SOFT_IRON, fields, readings_of


def run(*arguments: str, status: int = 0) -> Result:
    result = CliRunner().invoke(app, ["magnetometer", *arguments])
    assert result.exit_code == status, result.output + result.stderr
    return result


def answer(*arguments: str) -> dict[str, Any]:
    return dict(json.loads(run(*arguments, "--json").stdout))


def written(folder: Path, readings: np.ndarray, names: str = "mag_x,mag_y,mag_z") -> str:
    path = folder / "turns.csv"
    np.savetxt(path, readings, delimiter=",", header=names, comments="", fmt="%.6f")
    return str(path)


def test_turns_become_a_calibration_and_parameters(tmp_path: Path) -> None:
    path = written(tmp_path, readings_of(fields(1200), 1) / 100, "bx,by,bz")
    out = tmp_path / "mag.params"
    options = ("--columns", "bx,by,bz", "--unit", "gauss", "--field-ut", str(FIELD_UT))
    found = answer(path, *options, "--export", "px4", "--out", str(out))
    assert found["verdict"] == "adequate"
    for axis, true in zip("xyz", HARD_IRON_UT, strict=True):
        each = found["hard_iron_ut"][axis]
        assert each["value"] == pytest.approx(true, abs=4 * each["u"])
    assert found["soft_iron"]["xy"]["value"] == pytest.approx(SOFT_IRON[0, 1], abs=4 * found["soft_iron"]["xy"]["u"])
    assert np.array(found["covariance"]).shape == (10, 10)
    assert "CAL_MAG0_XSCALE" in out.read_text()
    text = run(path, *options).stdout
    assert "verdict: adequate" in text
    assert "hard iron x" in text


def test_what_is_wrong_is_said_once(tmp_path: Path) -> None:
    path = written(tmp_path, readings_of(fields(1200), 1))
    for options, said in (
        (("--columns", "a,b,c"), "there is no column 'a' (the columns are mag_x, mag_y, mag_z)"),
        (("--unit", "LSB"), "--unit LSB: give one of uT"),
        (("--field-ut", "-1"), "--field-ut -1: give the size of the local field"),
        (("--export", "px4"), "give --export and --out together"),
        (
            ("--export", "betaflight", "--out", "x"),
            "this magnetometer is exported to px4, ardupilot",
        ),
    ):
        assert said in run(path, *options, status=2).stderr
    assert "not found" in run("nothing.csv", status=2).stderr


def test_a_disturbed_field_is_not_exported(tmp_path: Path) -> None:
    field = fields(1500)
    path = written(tmp_path, readings_of(field * (1 + 0.05 * np.sin(np.linspace(0, 9, 1500)))[:, None], 4))
    assert answer(path)["verdict"] == "unexplained"
    refused = run(path, "--export", "px4", "--out", str(tmp_path / "x"), status=2).stderr
    assert "the readings are not those of a constant field" in refused
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_a_recording_in_poses_gives_the_alignment_too(tmp_path: Path) -> None:
    unit = TrueTriads.drawn(np.random.default_rng(5))
    recording = recording_of(*turned_by_hand(5, unit, 14))
    write_recording(recording, tmp_path / "poses")
    out = tmp_path / "mag.json"
    found = answer(str(tmp_path / "poses"), "--export", "json", "--out", str(out))
    for axis, true in zip("xyz", np.degrees(vector_of(unit.turned)), strict=True):
        each = found["alignment"]["axes"][axis]
        assert each["value"] == pytest.approx(true, abs=5 * each["u"])
    assert "Magnetometer turned from the accelerometer's axes about x, y, z by" in found["text"][0]
    matrix = np.array(json.loads(out.read_text())["alignment"]["matrix"])
    assert matrix == pytest.approx(unit.turned, abs=3e-3)
    said = run(str(tmp_path / "poses"), "--serial", "OTHER", status=2).stderr
    assert "this recording is of unit TRIADS-1, but --serial is OTHER" in said
    without = Recording(recording.info, {k: v for k, v in recording.columns.items() if not k.startswith("field")})
    write_recording(without, tmp_path / "without")
    assert "this recording has no column field_x_ut" in run(str(tmp_path / "without"), status=2).stderr
