"""Alignment over temperature and with an earlier accelerometer: against known turns, or with a reason."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from labctl.cli.app import app
from studies.poses import turned_deg
from studies.triads_simulation import TrueTriads, vector_of
from tests.helpers.turned_triads import unit_of, write_turned

SERIAL = "TRIADS-1"
EARLIER = ("--serial", SERIAL, "--earlier", "1")


@pytest.fixture(autouse=True)
def database(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "lab.sqlite"
    monkeypatch.setenv("LABCTL_DATABASE", str(path))
    return path


def run(*arguments: str, status: int = 0) -> Result:
    result = CliRunner().invoke(app, list(arguments))
    assert result.exit_code == status, result.output + result.stderr
    return result


def answer(*arguments: str) -> Any:
    found = json.loads(run(*arguments, "--json").stdout)
    return found.get("result", found)


def true_deg(unit: TrueTriads, sensor: str) -> np.ndarray:
    """Return the rotation vector (3,), deg, of a simulated unit's gyro triad or magnetometer."""
    if sensor == "magnetometer":
        return np.degrees(vector_of(unit.turned))
    return turned_deg(unit.gyro - np.eye(3), unit.force - np.eye(3))


def agrees(found: Any, unit: TrueTriads, sensor: str) -> None:
    for axis, true in zip("xyz", true_deg(unit, sensor), strict=True):
        each = found["alignment"]["axes"][axis]
        assert each["value"] == pytest.approx(true, abs=4 * each["u"])
        assert each["u"] < 0.15


@pytest.mark.slow
@pytest.mark.parametrize("sensor", ["accelerometer", "magnetometer"])
def test_the_alignment_is_told_over_temperature(tmp_path: Path, sensor: str) -> None:
    unit = unit_of(7)
    folder = str(write_turned(tmp_path / "warm", unit, 32, warm=True))
    constant, found = answer(sensor, folder), answer(sensor, folder, "--temperature", "its own")
    agrees(found, unit, sensor)
    u = [np.array([each["alignment"]["axes"][a]["u"] for a in "xyz"]) for each in (found, constant)]
    assert np.all(u[0] < 0.9 * u[1])  # constants leave what the temperature changes as scatter


@pytest.mark.slow
@pytest.mark.parametrize("sensor", ["accelerometer", "magnetometer"])
def test_an_earlier_version_makes_ten_rests_enough(tmp_path: Path, sensor: str) -> None:
    unit = unit_of(8)
    run("accelerometer", str(write_turned(tmp_path / "first", unit, 24)), "--serial", SERIAL)
    few = str(write_turned(tmp_path / "few", unit, 10, seed=6))
    assert "10 rests in 10 different poses" in said_or_text(sensor, few)
    found = answer(sensor, few, *EARLIER)
    agrees(found, unit, sensor)
    assert "version 1" in " ".join(found["text"])
    stored = json.loads(run("sensors", "show", SERIAL, sensor, "--json").stdout)
    assert stored["result"] == found


def said_or_text(sensor: str, folder: str) -> str:
    """Return what a command refuses ten rests with: the accelerometer's an error, the magnetometer's a sentence."""
    if sensor == "accelerometer":
        return run(sensor, folder, status=2).stderr
    return " ".join(answer(sensor, folder)["text"])


@pytest.mark.slow
@pytest.mark.parametrize("sensor", ["accelerometer", "magnetometer"])
def test_rests_that_do_not_agree_or_are_too_few_are_named_with_what_to_do(tmp_path: Path, sensor: str) -> None:
    unit = unit_of(9)
    run("accelerometer", str(write_turned(tmp_path / "first", unit, 24)), "--serial", SERIAL)
    bent = replace(unit, force=unit.force + 0.02 * np.diag([1.0, -1.0, 1.0]))
    found = answer(sensor, str(write_turned(tmp_path / "bent", bent, 12, seed=6)), *EARLIER)
    assert found["alignment"] is None
    text = " ".join(found["text"])
    assert "the rests do not agree with version 1 of the accelerometer (p = " in text
    assert "calibrate it without the earlier version" in text
    found = answer(sensor, str(write_turned(tmp_path / "few", unit, 8, seed=6)), *EARLIER)
    assert found["alignment"] is None
    rows = json.loads(run("sensors", "list", SERIAL, "--json").stdout)
    offered = {(row["sensor"], row["version"]): {each["id"] for each in row["formats"]} for row in rows}
    transforms = {"tf2", "urdf"}
    assert transforms <= offered["accelerometer", 1]  # the first session tells the alignment
    newest = max(version for name, version in offered if name == sensor)
    assert not transforms & offered[sensor, newest]
    assert "8 rests have 7 turns between them; nine coefficients of the gyro need at least 9" in " ".join(found["text"])


@pytest.mark.slow
def test_options_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    unit = unit_of(10)
    folder = str(write_turned(tmp_path / "first", unit, 24))
    run("accelerometer", folder, "--serial", SERIAL)
    both = run("magnetometer", folder, *EARLIER, "--temperature", "its own", status=2).stderr
    assert "--temperature with --earlier" in both
    assert "leave one out" in both
    assert "--earlier needs --serial" in run("magnetometer", folder, "--earlier", "0", status=2).stderr
    assert "no temperature was recorded" in " ".join(answer("magnetometer", folder, "--temperature", "t")["text"])
    table = tmp_path / "m.csv"
    table.write_text("mag_x,mag_y,mag_z\n1,2,3\n", encoding="utf-8")
    for options, named in ((EARLIER, "--earlier"), (("--temperature", "t"), "--temperature")):
        refused = run("magnetometer", str(table), *options, status=2).stderr
        assert f"{named} is for the alignment" in refused
        assert "name the folder of a recording in poses" in refused
