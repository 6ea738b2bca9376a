"""A unit over the years: as found, as left, drift, and when it leaves its limit; on the command line and over HTTP."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.recording import write_recording
from tests.helpers.joint_recordings import EFFECTS, recording_of_day
from tests.helpers.lab import Lab

YEAR_DAYS = 365.25
DRIFT_DPS_PER_YEAR = 0.02


def lab_over_years(folder: Path, years: int) -> Lab:
    """Return a database with one recording a year of a unit whose bias drifts, each year shifted a little by chance."""
    rng, lab = np.random.default_rng(8), Lab(folder)
    for year in range(years):
        shift = DRIFT_DPS_PER_YEAR * year + rng.normal(0, 1e-3)
        write_recording(recording_of_day(rng, YEAR_DAYS * year, bias_shift_dps=shift), folder / f"year-{year}")
        lab.run("import", str(folder / f"year-{year}"))
        lab.run("fit", "J-1", "--effects", ",".join(EFFECTS))
    return lab


def test_the_drift_of_a_unit_is_found_with_its_uncertainty_and_when_it_leaves_its_limit(tmp_path: Path) -> None:
    lab = lab_over_years(tmp_path, 5)
    found = lab.json("trend", "J-1", "--limit-dps", "0.15")
    assert (found["version"], found["limit_dps"]) == (1, 0.15)
    first, *later = found["points"]
    assert first["as_found"] is None
    assert [point["as_found"]["version"] for point in later] == [1, 2, 3, 4]
    assert [point["as_left"]["version"] for point in found["points"]] == [1, 2, 3, 4, 5]
    assert all(point["as_left"]["rms_dps"] < point["as_found"]["rms_dps"] for point in later)
    assert [point["rms_dps"] for point in later] == pytest.approx([0.02, 0.04, 0.06, 0.08], abs=4e-3)
    drifts = {(each["axis"], each["what"]): each for each in found["drifts"]}
    bias, scale = drifts["z", "bias"], drifts["z", "scale_factor"]
    assert bias["low"] < DRIFT_DPS_PER_YEAR < bias["high"]
    assert bias["significant"]
    assert bias["unit"] == "deg/s/year"
    assert bias["repeatability"] == pytest.approx(1e-3, rel=0.9)
    assert not scale["significant"]
    (leaves,) = found["leaves"]
    assert leaves["earliest"] < leaves["expected"] < leaves["latest"]
    assert leaves["expected"].startswith("2033")  # 0.15 deg/s at 0.02 deg/s a year, from 2026 on
    said = lab.run("trend", "J-1").stdout
    assert "Axis z, bias: drifts by 0.02 deg/s/year (95 %:" in said
    assert "Axis z, scale_factor: no drift beyond repeatability" in said


def test_two_recordings_have_a_drift_without_an_uncertainty_and_say_so(tmp_path: Path) -> None:
    found = lab_over_years(tmp_path, 2).json("trend", "J-1")
    assert all(each["u"] is None and each["low"] is None for each in found["drifts"])
    assert any("by two recordings; an uncertainty takes 3" in line for line in found["text"])
    assert [leaves["earliest"] for leaves in found["leaves"]] == [None]


def test_one_recording_has_no_drift(tmp_path: Path) -> None:
    lab = lab_over_years(tmp_path, 1)
    found = lab.json("trend", "J-1")
    assert (found["drifts"], found["leaves"]) == ([], [])
    assert found["text"] == ["1 recording in time: a drift takes two, and its uncertainty three."]
    assert "give a number above 0" in lab.run("trend", "J-1", "--limit-dps", "-1", status=2).stderr
