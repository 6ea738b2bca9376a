"""A version applied without refitting: its figures equal an independent application of its file, and a changed unit is
detected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.answers.ladder import LadderResponse
from labctl.compensator import Compensator
from labctl.recording import read_recording, to_points, write_recording
from tests.helpers.lab import Lab
from tests.helpers.simulated_recordings import single_axis

#: The same question of the same recording is answered once for the whole run.
pytestmark = pytest.mark.usefixtures("shared_answers")

FOG = "FOG-0001"


@pytest.fixture(scope="module")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    folder = tmp_path_factory.mktemp("two_days")
    lab = Lab(folder)
    for day, hidden in ((1, {}), (2, {"scale_factor": 1e-3})):
        write_recording(single_axis(1, **hidden), folder / f"day-{day}", "parquet")
        lab.json("import", str(folder / f"day-{day}"))
        if day == 1:
            lab.json("fit", FOG, "--model", "ojeda2000")
    return lab


@pytest.fixture
def two_days(made_once: Lab, tmp_path: Path) -> Lab:
    """A lab with a recording, a version fitted to it, and a recording of the unit with a 0.1 % higher scale factor."""
    return made_once.copy(tmp_path)


def test_the_figures_are_those_of_the_file_applied_to_the_recording(two_days: Lab, tmp_path: Path) -> None:
    found = two_days.json("verify", FOG, "--recording", "2", status=1)
    file = tmp_path / "calibration.json"
    file.write_text(two_days.run("calibration", FOG, "--version", "1").stdout, encoding="utf-8")
    points = to_points(read_recording(tmp_path / "day-2"))
    corrected = Compensator.from_file(file).compensate(points.gyro_dps("z"), points.columns["temperature_c"]).rate_dps
    error = corrected - points.columns["table_rate_dps"]
    earth_dps = found["bias_dps"] - error.mean()  # the Earth's rate along the table axis, the same in every data set
    assert abs(earth_dps) < 0.0042
    assert found["rms_dps"] == pytest.approx(np.sqrt(np.mean((error + earth_dps) ** 2)), rel=1e-9)
    assert found["max_dps"] == pytest.approx(np.abs(error + earth_dps).max(), rel=1e-9)
    assert found["datasets"] == len(error)
    assert (found["seen"], found["ok"]) == (False, False)
    assert found["rms_dps"] == pytest.approx(1e-3 * np.sqrt(np.mean(points.columns["table_rate_dps"] ** 2)), rel=0.05)


def test_on_the_recording_of_its_fit_a_version_leaves_what_its_fit_said(two_days: Lab) -> None:
    found = two_days.json("verify", FOG, "--version", "1", "--recording", "1")
    fitted = two_days.json("ladder", FOG)["steps"][0]
    assert found["rms_dps"] == pytest.approx(fitted["rms_dps"], rel=1e-9)
    assert (found["seen"], found["ok"], found["outside_validity"]) == (True, True, 0)


def test_criticism_says_first_what_the_version_itself_leaves(two_days: Lab) -> None:
    said = two_days.json("criticise", FOG, "--version", "1", "--recording", "2")
    assert said["applied"] == two_days.json("verify", FOG, "--version", "1", "--recording", "2", status=1)
    assert said["applied"]["rms_dps"] > 20 * said["error"]["rms_dps"]
    lines = two_days.run("criticise", FOG, "--version", "1", "--recording", "2").stdout.splitlines()
    assert lines[0].startswith("Version 1 applied without refitting to recording 2")
    assert lines[1] == "Refitted to recording 2:"


@pytest.mark.slow
def test_a_recording_of_another_unit_needs_the_request(two_days: Lab, tmp_path: Path) -> None:
    other = single_axis(3)
    other = type(other)(other.info.model_copy(update={"serial": "FOG-9"}), other.columns, other.environment)
    write_recording(other, tmp_path / "other", "parquet")
    number = str(two_days.json("import", str(tmp_path / "other"))["recording"])
    refused = two_days.run("verify", FOG, "--recording", number, status=2)
    assert "is of unit 'FOG-9'" in refused.stderr
    found = two_days.json("verify", FOG, "--recording", number, "--other-unit", status=1)
    assert (found["serial"], found["recorded_unit"]) == (FOG, "FOG-9")


@pytest.mark.slow
def test_a_ladder_is_of_one_recording_and_follows_parentage(two_days: Lab) -> None:
    two_days.json("fit", FOG, "--recording", "2", "--model", "bias_scale")
    two_days.json("improve", FOG, "--version", "1", "--recording", "1", "--add", "saturation")
    first = LadderResponse.model_validate(two_days.json("ladder", FOG, "--recording", "1"))
    assert [(step.version, step.parent) for step in first.steps] == [(1, None), (3, 1)]
    assert [(step.version, step.recording) for step in first.others] == [(2, 2)]
    verified = two_days.json("verify", FOG, "--version", "2", "--recording", "1")
    assert first.others[0].applied_rms_dps == pytest.approx(verified["rms_dps"], rel=1e-12)
    second = two_days.json("ladder", FOG, "--recording", "2")
    assert ([step["version"] for step in second["steps"]], second["recording"]) == ([2], 2)
