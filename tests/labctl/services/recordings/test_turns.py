"""Turns by a known angle in the store: imported, fitted, criticised, verified, as from the files themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.fitting import fit
from labctl.recording import Recording, read_recording, write_recording
from studies.hand_turns import Unit, measured
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES

DERIVED = {"table_rate_dps", "run", "mounting"}


def session(seed: int, folder: Path, wrong: int | None = None) -> str:
    """Write a session of one unit as a person would; with the angle of one turn said wrong."""
    unit = Unit.drawn(np.random.default_rng(1))
    made = measured(np.random.default_rng(seed), unit, 1.0, 2, 360.0)
    columns = {name: values for name, values in made.columns.items() if name not in DERIVED}
    if wrong is not None:
        here = np.asarray(columns["dataset"]) == wrong
        columns["turn_deg"] = np.where(here, 432.0, np.asarray(columns["turn_deg"], dtype=np.float64))
    write_recording(Recording(made.info, columns), folder, "csv")
    return str(folder)


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.mark.slow
def test_the_published_turns_take_two_commands(lab: Lab) -> None:
    taken = lab.json("import", str(EXAMPLES / "imucal-turns"))
    assert (taken["datasets"], taken["suggested_model"], taken["warnings"]) == (9, "turns", [])
    stored = lab.json("fit", "IMUCAL-FERRARIS", "--model", taken["suggested_model"])
    assert stored["axes"] == fit(read_recording(EXAMPLES / "imucal-turns"), "turns").to_json()["axes"]
    low, high = stored["validity"]["rate_dps"]
    assert (round(low), round(high)) == (-49, 541)  # as fast as the turns went, not their mean
    assert "at least 4 more data sets" in lab.run("criticise", "IMUCAL-FERRARIS", status=1).stdout


@pytest.mark.slow
def test_a_session_is_adequate_and_holds_for_the_next_one(lab: Lab, tmp_path: Path) -> None:
    lab.run("import", session(2, tmp_path / "first"))
    lab.run("fit", "HAND", "--model", "turns")
    found = lab.json("criticise", "HAND")
    assert found["verdict"] == "adequate"
    hidden = {line["effect"]: line for line in found["not_testable"]}
    assert hidden["scale_factor_odd"]["needs"] == ["table_rate_dps"]
    printed = " ".join(lab.run("criticise", "HAND").stdout.split())
    assert "not recorded: the rate at each instant (table_rate_dps)" in printed
    lab.run("import", session(3, tmp_path / "second"))
    checked = lab.json("verify", "HAND", "--recording", "2")
    assert (checked["ok"], checked["seen"]) == (True, False)


def test_a_turn_that_came_out_short_is_no_calibration(lab: Lab, tmp_path: Path) -> None:
    taken = lab.json("import", session(2, tmp_path / "wrong", wrong=9))
    assert [warning["what"] for warning in taken["warnings"]] == ["turn"]
    refused = lab.run("fit", "HAND", "--model", "turns", status=2)
    assert "deg instead of 432 deg" in refused.stderr
    assert "repeat the turn, or correct turn_deg" in refused.stderr


@pytest.mark.slow
def test_a_law_of_the_rate_is_not_added_to_turns(lab: Lab, tmp_path: Path) -> None:
    lab.run("import", session(2, tmp_path / "first"))
    lab.run("fit", "HAND", "--model", "turns")
    refused = lab.run("improve", "HAND", "--add", "scale_factor_odd", status=2)
    assert "needs the rate at each instant, but only the mean rate of a turn is known" in refused.stderr
