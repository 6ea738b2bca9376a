"""`labctl allan`: of a unit, of a folder, of a bare table; no fit, no thermometer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.recording import write_recording
from tests.helpers.lab import Lab
from tests.helpers.rest import NOISE_DPS, RATE_HZ, at_rest

#: Angle random walk of the readings, deg/sqrt(h).
WALK = NOISE_DPS / np.sqrt(RATE_HZ) * 60.0


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


def test_of_a_unit_and_of_its_folder_without_a_thermometer(lab: Lab) -> None:
    folder = lab.folder / "recording"
    write_recording(at_rest(("z",), thermometer=False, datasheet={"bias_stability_dps": 0.002}), folder, "csv")
    of_folder = lab.json("allan", str(folder))
    lab.run("import", str(folder))
    of_unit = lab.json("allan", "REST-1")
    assert of_unit["recording"] == 1
    assert of_folder["recording"] is None
    assert of_unit["axes"] == of_folder["axes"]
    assert of_unit["datasheet"] == {"bias_stability_dps": 0.002}
    found = of_unit["axes"]["z"]["N"]
    assert found["value"] == pytest.approx(WALK, abs=4 * found["u"])
    assert of_unit["axes"]["z"]["tau_s"][0] == pytest.approx(1 / RATE_HZ)


def test_of_any_column_of_a_table(lab: Lab) -> None:
    table = lab.folder / "log.csv"
    readings = np.random.default_rng(5).normal(0, 0.05, 3000)
    table.write_text("t_s,gyro_z,note\n" + "\n".join(f"{k * 0.01:.2f},{x:.6f},a" for k, x in enumerate(readings)))
    found = lab.json("allan", str(table), "--column", "gyro_z")["axes"]["gyro_z"]["N"]
    assert found["value"] == pytest.approx(0.3, abs=4 * found["u"])
    assert "there is no column 'gyro_y'" in lab.run("allan", str(table), "--column", "gyro_y", status=2).stderr
    assert "holds text" in lab.run("allan", str(table), "--column", "note", status=2).stderr
    table.write_text("time,gyro_z\n0,1\n")
    assert "column 't_s' (time, s) is missing" in lab.run("allan", str(table), status=2).stderr
    table.write_text("t_s,gyro_z\n" + "\n".join(f"{k},{k % 3}" for k in range(20)))
    assert "has 20 readings; an Allan deviation needs 300" in lab.run("allan", str(table), status=2).stderr
