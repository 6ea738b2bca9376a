"""How a unit was set is in its recording, its calibration and what is exported, and is compared when that is used."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.configuration import changed
from labctl.calibration import Calibration, read_calibration
from labctl.errors import OtherConfiguration
from labctl.recording import Recording, write_recording
from tests.helpers.calibrations import calibrated
from tests.helpers.exported import exported
from tests.helpers.joint_recordings import EFFECTS, recording_of_day
from tests.helpers.lab import Lab

SET = {"filter_hz": "262", "firmware": "12"}


def measured(**configuration: str) -> Recording:
    recording = recording_of_day(np.random.default_rng(2))
    return Recording(recording.info.model_copy(update={"configuration": configuration}), recording.columns)


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return read_calibration(calibrated(measured(**SET), effects=EFFECTS).to_bytes())


def test_a_calibration_says_how_the_unit_was_set(calibration: Calibration) -> None:
    assert calibration.configuration == SET
    assert calibrated(measured(), effects=EFFECTS).configuration == {}
    assert "configuration" not in calibrated(measured(), effects=EFFECTS).document


@pytest.mark.parametrize(
    "reported", [{"filter_hz": "262", "serial": "N1"}, {"filter_hz": "262", "range_dps": "400"}, {}], ids=str
)
def test_a_unit_that_is_set_as_it_was_is_accepted(calibration: Calibration, reported: dict[str, str]) -> None:
    calibration.require_configuration(reported)
    assert changed(calibration.configuration, reported) == {}


def test_a_unit_that_is_set_otherwise_is_refused(calibration: Calibration) -> None:
    with pytest.raises(OtherConfiguration) as told:
        calibration.require_configuration({"filter_hz": "16", "firmware": "12"})
    assert str(told.value) == (
        "calibration of J-1 version 1: the unit is set otherwise than when it was measured: filter_hz was 262 and is "
        "16; set it as it was, or calibrate it as it is"
    )


def test_exports_state_the_configuration(calibration: Calibration) -> None:
    header, _ = exported(calibration, "c")
    assert " * The unit was set to: filter_hz = 262; firmware = 12.\n" in header
    module: dict[str, Any] = {}
    exec(exported(calibration, "python")[0], module)
    assert module["CALIBRATION"]["configuration"] == SET
    bare = calibrated(measured(), effects=EFFECTS)
    assert "was set to" not in exported(bare, "c")[0]


@pytest.mark.slow
def test_recordings_of_two_settings_are_not_taken_for_one_unit_in_silence(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    for number, filter_hz in enumerate(("262", "262", "16")):
        write_recording(measured(filter_hz=filter_hz), tmp_path / f"{number}")
        lab.run("import", str(tmp_path / f"{number}"))
    same = lab.json("fit", "J-1", "--recording", "1,2", "--effects", ",".join(EFFECTS))
    assert not [each for each in same["warnings"] if each["what"] == "configuration"]
    both = lab.json("fit", "J-1", "--recording", "1,3", "--effects", ",".join(EFFECTS), "--accept-warnings")
    (warning,) = [each for each in both["warnings"] if each["what"] == "configuration"]
    assert warning["text"] == (
        "recording 3: the unit is set otherwise than in recording 1: filter_hz was 262 and is 16; fit the recordings "
        "of each setting by themselves"
    )
