"""A recording in poses through the services: import, fit, file, verification, and what is refused in one sentence."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import read_calibration
from labctl.compensator import Compensator
from labctl.recording import read_recording, write_recording
from studies.poses_simulation import Session, simulate_session
from tests.helpers.c_header import in_c
from tests.helpers.lab import Lab

HAND = "HAND-1"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """A lab with two sessions of a unit, one fitted."""
    lab = Lab(tmp_path_factory.mktemp("poses"))
    for seed in (1, 1 << 20):
        recording, _ = simulate_session(seed, Session(rests=20, latitude_deg=48.0, temperature_c=23.5))
        write_recording(recording, lab.folder / f"session-{seed}")
    imported = lab.json("import", str(lab.folder / "session-1"))
    assert imported["suggested_model"] == "poses"
    assert imported["warnings"] == []
    lab.json("fit", HAND, "--model", imported["suggested_model"])
    return lab


def test_the_answer_has_the_accelerometer_beside_the_gyro(lab: Lab) -> None:
    answer = lab.json("fit", HAND, "--model", "poses")
    _, truth = simulate_session(1, Session(rests=20, latitude_deg=48.0, temperature_c=23.5))
    assert answer["model"]["effects"][:3] == ["bias", "scale_factor", "misalignment"]
    accelerometer = answer["poses"]["accelerometer"]
    assert accelerometer["gravity_source"] == "latitude, at sea level"
    for i, axis in enumerate("xyz"):
        bias = accelerometer["axes"][axis]["bias"]
        assert abs(bias["value"] - truth.accel_bias_g[i]) < 4 * bias["u"]
        assert bias["unit"] == "g"
    assert answer["poses"]["rests"]["count"] == 20
    assert answer["poses"]["moves"]["used"] == 19
    assert answer["validity"]["temperature_c"] == [23.5, 23.5]
    assert answer["error"]["noise_floor_source"] == "noise of rests and moves"


def test_what_is_printed_says_rests_turns_and_what_is_not_determined(lab: Lab) -> None:
    said = lab.run("fit", HAND, "--model", "poses").stdout
    assert "accelerometer" in said
    assert "20 rests in" in said
    assert "19 of 19 turns used" in said
    assert "not determined: the mounting of the body axes in the case" in said


def test_the_calibration_file_corrects_readings_and_holds_the_accelerometer(lab: Lab) -> None:
    content = lab.run("calibration", HAND, "--version", "1").stdout.encode()
    calibration = read_calibration(content)
    assert json.loads(content)["poses"]["accelerometer"]["axes"]["z"]["bias"]["unit"] == "g"
    assert [each["effect"] for each in calibration.document["left_out"]] == ["g_sensitivity", "cross_g_sensitivity"]
    _, truth = simulate_session(1, Session(rests=20, latitude_deg=48.0, temperature_c=23.5))
    rate = np.array([[50.0, -80.0, 20.0], [0.0, 0.0, 100.0]])
    output = truth.bias_dps + rate @ (np.eye(3) + truth.gyro).T
    found = Compensator(calibration).compensate(output, np.full(2, 23.5))
    assert found.rate_dps == pytest.approx(rate, abs=0.1)
    assert not found.outside.any()


@pytest.mark.needs_cc
def test_the_c_header_computes_the_same(lab: Lab, tmp_path: Path) -> None:
    calibration = read_calibration(lab.run("calibration", HAND, "--version", "1").stdout.encode())
    raw, warm = np.array([[50.0, -80.0, 20.0], [0.0, 3.0, 100.0]]), np.full(2, 23.5)
    expected = Compensator(calibration).compensate(raw, warm)
    assert in_c(calibration, raw, warm, tmp_path)[:, 1:] == pytest.approx(expected.rate_dps, abs=1e-9)


def test_a_version_is_verified_by_its_own_and_by_another_units_session(lab: Lab) -> None:
    own = lab.json("verify", HAND, "--version", "1", "--recording", "1")
    assert (own["seen"], own["ok"], own["datasets"]) == (True, True, 19)
    assert own["rms_dps"] == pytest.approx(own["expected_dps"], rel=1e-6)
    assert set(own["axes"]) == {"x", "y", "z"}
    lab.json("import", str(lab.folder / f"session-{1 << 20}"))
    other = lab.json("verify", HAND, "--version", "1", "--recording", "2", status=1)
    assert (other["seen"], other["ok"]) == (False, False)
    assert other["rms_dps"] > 10 * own["rms_dps"]


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("criticise", HAND, "--version", "1", "--recording", "1"), "before and after each turn, but no rate"),
        (
            ("improve", HAND, "--version", "1", "--recording", "1", "--add", "bias_drift"),
            "before and after each turn, but no rate",
        ),
        (("fit", HAND, "--recording", "1", "--model", "yang2018"), "with --model poses and without added effects"),
    ],
)
def test_what_poses_cannot_carry_is_refused_in_one_line(lab: Lab, command: tuple[str, ...], said: str) -> None:
    answer = lab.run(*command, status=2)
    assert said in answer.stderr
    assert len(answer.stderr.strip().splitlines()) == 1


def test_an_export_imports_again_and_gives_the_same_fit(lab: Lab, tmp_path: Path) -> None:
    lab.json("export", "recording", "1", "--out", str(tmp_path / "again"))
    again = read_recording(tmp_path / "again")
    assert again.info.motion == "poses"
    assert "table_rate_dps" not in again.columns


def test_free_motion_is_told_what_would_do_instead(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    recording, _ = simulate_session(1, Session(rests=2))
    folder = tmp_path / "free"
    write_recording(recording, folder)
    head = folder / "recording.toml"
    head.write_text(head.read_text(encoding="utf-8").replace('motion = "poses"', 'motion = "rates"'), encoding="utf-8")
    said = lab.run("import", str(folder), status=2).stderr
    assert "free motion alone cannot calibrate a gyro; write motion = 'rest'" in said
    assert "'turns' with column turn_deg" in said
    assert "'poses' with columns accel_x_g" in said
    assert len(said.strip().splitlines()) == 1
