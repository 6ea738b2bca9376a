"""Versions fitted to several recordings: on the command line, in the database, and in what is said of them later."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from labctl.recording import write_recording
from tests.helpers.joint_recordings import EFFECTS, recordings
from tests.helpers.lab import Lab


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    """Return a database with three recordings of one unit, ten days apart."""
    made = Lab(tmp_path)
    for number, recording in recordings(12, (0.0, 10.0, 20.0)).items():
        folder = tmp_path / f"recording-{number}"
        write_recording(recording, folder)
        made.run("import", str(folder))
    return made


@pytest.mark.slow
def test_a_version_keeps_all_its_recordings_and_what_they_say_together(lab: Lab) -> None:
    answer = lab.json("fit", "J-1", "--recording", "1,2", "--effects", ",".join(EFFECTS))
    assert (answer["recording"], answer["recordings"]) == (2, [1, 2])
    assert answer["joint"]["recordings"] == [1, 2]
    said = lab.run("fit", "J-1", "--recording", "1,2,3", "--effects", ",".join(EFFECTS)).stdout
    assert "recordings         1, 2, 3, fitted together" in said
    assert "bias repeatability, turn-on to turn-on" in said
    ladder = lab.json("ladder", "J-1")
    (step,) = ladder["steps"]
    assert (ladder["recording"], step["recordings"]) == (3, [1, 2, 3])
    left = lab.json("verify", "J-1", "--version", "2", "--recording", "3")["rms_dps"]
    assert step["applied_rms_dps"] == pytest.approx(left, rel=1e-12)
    assert step["rms_dps"] != pytest.approx(left, rel=1e-3)  # which is of all three
    one = lab.json("fit", "J-1", "--recording", "3", "--effects", ",".join(EFFECTS))
    assert (one["recording"], one["recordings"], one["joint"]) == (3, [3], None)
    steps = lab.json("ladder", "J-1", "--recording", "3")
    assert [step["version"] for step in steps["steps"]] == [3]
    assert [(step["version"], step["recordings"]) for step in steps["others"]] == [(1, [1, 2]), (2, [1, 2, 3])]
    assert lab.json("verify", "J-1", "--version", "2", "--recording", "1")["seen"]


@pytest.mark.slow
def test_recordings_of_which_one_has_no_date_have_no_order(lab: Lab, tmp_path: Path) -> None:
    undated = recordings(1, (0.0,))[1]
    head = undated.info.model_copy(update={"date_known": False})
    write_recording(replace(undated, info=head), tmp_path / "undated")
    number = lab.json("import", str(tmp_path / "undated"))["recording"]
    answer = lab.json("fit", "J-1", "--recording", f"1,{number}", "--effects", ",".join(EFFECTS))
    said = [warning["text"] for warning in answer["warnings"] if warning["what"] == "date"]
    assert len(said) == 1
    assert said[0].startswith(f"recording {number} has no date of measurement, so their order is not known")
    dated = lab.json("fit", "J-1", "--recording", "1,2", "--effects", ",".join(EFFECTS))
    assert not [w for w in dated["warnings"] if w["what"] == "date"]


@pytest.mark.slow
def test_a_later_recording_is_as_expected_of_a_version_of_several(lab: Lab) -> None:
    """What a later day is off by is known from the recordings themselves: each was predicted by the others."""
    lab.run("fit", "J-1", "--recording", "1,2", "--effects", ",".join(EFFECTS))
    found = lab.json("verify", "J-1", "--recording", "1")
    joint = lab.json("fit", "J-1", "--recording", "1,2", "--effects", ",".join(EFFECTS))["joint"]
    assert found["expected_dps"] == joint["heldout_rms_dps"]


@pytest.mark.slow
def test_a_criticism_and_a_change_of_several_recordings(lab: Lab) -> None:
    lab.run("fit", "J-1", "--recording", "1,2", "--effects", ",".join(EFFECTS))
    found = lab.json("criticise", "J-1", "--recording", "1,2")
    assert (found["recording"], found["recordings"], found["verdict"]) == (2, [1, 2], "adequate")
    assert any("turn-on to turn-on" in line for line in found["text"])
    changed = lab.json("improve", "J-1", "--add", "scale_factor_even")
    assert changed["recordings"] == [1, 2]  # those of the version that was changed
    again = lab.json("improve", "J-1", "--version", "1", "--add", "scale_factor_even", "--recording", "3")
    assert again["recordings"] == [3]


@pytest.mark.parametrize(("given", "said"), [("1,x", "'x' is not a rec"), ("1,99", "recording 99"), ("", "'' is no")])
def test_recordings_that_are_none_are_refused_in_one_line(lab: Lab, given: str, said: str) -> None:
    result = lab.run("fit", "J-1", "--recording", given, "--effects", "bias", status=2)
    assert said in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
