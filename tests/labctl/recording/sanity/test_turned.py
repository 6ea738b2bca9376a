"""Sanity of turns: one sentence for a turn that came out otherwise, and none for how a hand turns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from labctl.recording import Recording, to_points
from labctl.recording.checks import checked
from labctl.recording.files import read_recording
from labctl.recording.sanity import Finding, inspect_recording
from studies.hand_turns import Unit, measured
from tests.helpers.paths import ROOT

EXAMPLE = ROOT / "labctl" / "examples" / "imucal-turns"


@pytest.fixture
def turned() -> Recording:
    rng = np.random.default_rng(7)
    return measured(rng, Unit.drawn(rng), 1.0, 1, 360.0)


def said_otherwise(recording: Recording, dataset: int, turn_deg: float) -> Recording:
    """The same readings, with another angle said of one data set."""
    here = np.asarray(recording.columns["dataset"]) == dataset
    turn = np.where(here, turn_deg, np.asarray(recording.columns["turn_deg"], dtype=np.float64))
    columns = {**recording.columns, "turn_deg": turn}
    return replace(recording, columns=checked(Path("turns"), recording.info, columns))


def only(findings: list[Finding]) -> Finding:
    assert len(findings) == 1, [finding.text for finding in findings]
    return findings[0]


def test_turns_by_hand_get_no_finding(turned: Recording) -> None:
    assert inspect_recording(turned) == []
    assert inspect_recording(to_points(turned)) == []


def test_published_turns_get_no_finding() -> None:
    assert inspect_recording(read_recording(EXAMPLE)) == []


@pytest.mark.parametrize("as_points", [False, True])
def test_a_turn_that_came_out_short_is_told_in_one_sentence(turned: Recording, as_points: bool) -> None:
    wrong = said_otherwise(turned, 9, 432.0)  # 360 deg were turned: five sixths of it
    finding = only(inspect_recording(to_points(wrong) if as_points else wrong))
    assert (finding.what, finding.severity) == ("turn", "certain")
    assert finding.text.startswith("data set 9, axis y: the integral of the output is only 36")
    assert "deg instead of 432 deg (expected 432 +- 43 deg); repeat the turn, or correct turn_deg" in finding.text


def test_a_turn_in_the_other_sense_is_told_as_such(turned: Recording) -> None:
    finding = only(inspect_recording(said_otherwise(turned, 9, -360.0)))
    assert "correct the sign of turn_deg or of the position" in finding.text


def test_one_wrong_turn_of_three_accuses_no_other() -> None:
    published = read_recording(EXAMPLE)
    assert "data set 8, axis y" in only(inspect_recording(said_otherwise(published, 8, 432.0))).where


def test_another_unit_of_all_turns_is_no_other_angle(turned: Recording) -> None:
    outputs = {name: np.deg2rad(v) if name.startswith("gyro_") else v for name, v in turned.columns.items()}
    found = inspect_recording(replace(turned, columns=outputs))
    assert {finding.what for finding in found} == {"unit"}


def test_a_missing_uncertainty_is_told_with_what_is_taken_for_it(turned: Recording) -> None:
    columns = {name: values for name, values in turned.columns.items() if name != "turn_u_deg"}
    finding = only(inspect_recording(replace(turned, columns=columns)))
    assert "column turn_u_deg: the column is missing, so 1 deg is used for every turn" in finding.text


def test_motion_during_a_rest_is_reported(turned: Recording) -> None:
    rests = np.asarray(turned.columns["dataset"]) == 3
    shaken = np.asarray(turned.columns["gyro_x"], dtype=np.float64).copy()
    shaken[rests] += 20.0 * np.sin(np.arange(rests.sum()) / 7.0)
    found = inspect_recording(replace(turned, columns={**turned.columns, "gyro_x": shaken}))
    assert any("turn_deg is given as 0, but the output changes" in finding.text for finding in found)
