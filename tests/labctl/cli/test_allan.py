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
    assert (
        "has 300 readings (it has 20 readings in all); record the unit" in lab.run("allan", str(table), status=2).stderr
    )


def test_a_log_is_read_by_its_map(lab: Lab) -> None:
    table, column_map = lab.folder / "log.csv", lab.folder / "map.toml"
    readings = np.random.default_rng(5).normal(0, 0.05, 3000)
    table.write_text("ms,wz\n" + "\n".join(f"{10 * k},{np.deg2rad(x):.9f}" for k, x in enumerate(readings)))
    column_map.write_text(
        'serial = "LOG-1"\nmotion = "rest"\nstarted_at = 2026-01-01T00:00:00Z\n[columns]\n'
        't_s = {from = "ms", unit = "ms"}\ngyro_z = {from = "wz", unit = "rad/s"}\n'
    )
    found = lab.json("allan", str(table), "--map", str(column_map))["axes"]["z"]["N"]
    assert found["value"] == pytest.approx(0.3, abs=4 * found["u"])
    refused = lab.run("allan", "LOG-1", "--map", str(column_map), status=2).stderr
    assert "leave out --map, --format and --option, which need a file" in refused
    assert "leave --recording out" in lab.run("allan", str(table), "--recording", "1", status=2).stderr


def test_recordings_stand_side_by_side_with_the_same_figures_as_one_by_one(lab: Lab) -> None:
    for number in (1, 2):
        folder = lab.folder / f"recording-{number}"
        write_recording(at_rest(("z",), thermometer=False, seed=number), folder, "csv")
        lab.run("import", str(folder))
    both = lab.json("allan", "REST-1", "--recording", "1,2")
    assert [answer["recording"] for answer in both] == [1, 2]
    assert both == [lab.json("allan", "REST-1", "--recording", str(number)) for number in (1, 2)]
    text = lab.run("allan", "REST-1", "--recording", "1,2").stdout
    assert "1 z: N " in text
    assert "2 z: N " in text


def test_a_table_with_a_thermometer_is_used_at_one_temperature(lab: Lab) -> None:
    """What `criticise` would use of the same readings: a bare table says no more about them than a recording does."""
    table = lab.folder / "log.csv"
    readings = np.random.default_rng(5).normal(0, 0.05, 4000)
    warm = np.where(np.arange(4000) < 3000, 20.0, 25.0)
    rows = zip(readings, warm, strict=True)
    lines = [f"{k * 0.01:.2f},{x:.6f},{c}" for k, (x, c) in enumerate(rows)]
    table.write_text("t_s,gyro_z,temperature_c\n" + "\n".join(lines))
    found = lab.json("allan", str(table))
    assert found["duration_s"] == pytest.approx(30.0, rel=0.01)
    assert found["temperature_c"] == pytest.approx(20.0)
