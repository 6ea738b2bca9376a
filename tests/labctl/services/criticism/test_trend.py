"""A unit over the years: as found, as left, drift, and when it leaves its limit; on the command line and over HTTP."""

from __future__ import annotations

import shutil
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from labctl.recording import write_recording
from tests.helpers.joint_recordings import EFFECTS, recording_of_day
from tests.helpers.lab import Lab
from tests.helpers.service import open_client

YEAR_DAYS = 365.25
DRIFT_DPS_PER_YEAR = 0.02


def lab_over_years(folder: Path, years: int, drift_dps_per_year: float = DRIFT_DPS_PER_YEAR) -> Lab:
    """Return a database with one recording a year of a unit whose bias drifts, each year shifted a little by chance."""
    rng, lab = np.random.default_rng(8), Lab(folder)
    for year in range(years):
        shift = drift_dps_per_year * year + rng.normal(0, 1e-3)
        write_recording(recording_of_day(rng, YEAR_DAYS * year, bias_shift_dps=shift), folder / f"year-{year}")
        lab.run("import", str(folder / f"year-{year}"))
        lab.run("fit", "J-1", "--effects", ",".join(EFFECTS))
    return lab


@pytest.fixture(scope="module")
def five_years(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """Return a lab over five years; nothing is added to it."""
    return lab_over_years(tmp_path_factory.mktemp("five-years"), 5)


def test_the_drift_of_a_unit_is_found_with_its_uncertainty_and_when_it_leaves_its_limit(five_years: Lab) -> None:
    lab = five_years
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
    assert any(
        line.startswith("Axis z: the bias passes the limit of 0.15 deg/s: expected 2033-") for line in found["text"]
    )
    said = lab.run("trend", "J-1").stdout
    assert "Axis z, bias: drifts by 0.02 deg/s/year (95 %:" in said
    assert "Axis z, scale_factor: no drift beyond repeatability" in said


def test_the_line_and_its_interval_go_on_beyond_the_limit(five_years: Lab) -> None:
    lab = five_years
    with open_client(lab.database) as client:
        answer = client.get("/api/units/J-1/trend", params={"version": 1, "limit_dps": 0.15})
        assert answer.status_code == 200
        found = answer.json()
    assert found == lab.json("trend", "J-1", "--limit-dps", "0.15")
    bias = next(each for each in found["drifts"] if (each["axis"], each["what"]) == ("z", "bias"))
    at = [datetime.fromisoformat(each) for each in bias["line"]["at"]]
    years = np.array([(each - at[0]).total_seconds() / 86400 / YEAR_DAYS for each in at])
    value, low, high = (np.array(bias["line"][name]) for name in ("value", "low", "high"))
    assert np.diff(value) / np.diff(years) == pytest.approx(bias["per_year"])
    assert ((low < value) & (value < high)).all()
    # the line goes through the points, weighted alike, at their mean
    points = [point["axes"]["z"]["bias_dps"] for point in found["points"]]
    assert np.interp(2.0, years, value) == pytest.approx(np.mean(points), abs=2e-4)
    (leaves,) = found["leaves"]
    assert not leaves["outside"]
    assert np.interp(0.15, value, years) == pytest.approx(
        (datetime.fromisoformat(leaves["expected"]) - at[0]).days / YEAR_DAYS, abs=0.02
    )
    assert at[-1] > datetime.fromisoformat(leaves["expected"])


@pytest.mark.slow
def test_a_bias_that_is_outside_its_limit_is_said_to_be_outside_already(five_years: Lab, tmp_path: Path) -> None:
    lab = Lab(shutil.copytree(five_years.folder, tmp_path / "lab"))
    found = lab.json("trend", "J-1", "--limit-dps", "0.03")
    assert [each["outside"] for each in found["leaves"]] == [True]
    assert "Axis z: the bias is already outside 0.03 deg/s at the newest recording." in found["text"]
    joint = lab.json("fit", "J-1", "--recording", "1,2,3", "--effects", ",".join(EFFECTS))
    expected = lab.json("verify", "J-1", "--version", str(joint["version"]), "--recording", "1")["expected_dps"]
    limit = lab.json("trend", "J-1", "--version", str(joint["version"]))["limit_dps"]
    assert limit == pytest.approx(2 * expected)  # what `verify` accepts of a version of several recordings


def test_a_drift_that_is_not_significant_has_no_expected_date_in_the_text(tmp_path: Path) -> None:
    found = lab_over_years(tmp_path, 3, 0.0).json("trend", "J-1", "--limit-dps", "0.02")
    (bias,) = (each for each in found["drifts"] if each["what"] == "bias")
    (leaves,) = found["leaves"]
    assert not bias["significant"]
    # the first crossing of the limit by the interval of the line is what the text states
    at = [datetime.fromisoformat(each).timestamp() for each in bias["line"]["at"]]
    crossing = [
        np.interp(0.02, bias["line"]["high"], at),
        np.interp(0.02, [-low for low in bias["line"]["low"]], at),
    ]
    assert datetime.fromisoformat(leaves["earliest"]).timestamp() == pytest.approx(min(crossing), abs=5e6)
    limit = "Axis z: with 95 % confidence the bias stays within 0.02 deg/s until"
    assert f"{limit} {leaves['earliest'][:10]}." in found["text"]
    assert not any("expected" in line for line in found["text"])


@pytest.mark.slow
def test_two_recordings_have_a_drift_without_an_uncertainty_and_say_so(tmp_path: Path) -> None:
    found = lab_over_years(tmp_path, 2).json("trend", "J-1")
    assert all(each["u"] is None and each["low"] is None for each in found["drifts"])
    assert any("from two recordings; its uncertainty needs 3 recordings" in line for line in found["text"])
    assert [leaves["earliest"] for leaves in found["leaves"]] == [None]


def test_recordings_of_the_same_instant_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    rng, lab = np.random.default_rng(9), Lab(tmp_path)
    for name in ("one", "other"):
        write_recording(recording_of_day(rng, 0.0), tmp_path / name)
        lab.run("import", str(tmp_path / name))
    lab.run("fit", "J-1", "--effects", ",".join(EFFECTS))
    assert [point["recording"] for point in lab.json("trend", "J-1")["points"]] == [1, 2]


def test_one_recording_has_no_drift(tmp_path: Path) -> None:
    lab = lab_over_years(tmp_path, 1)
    found = lab.json("trend", "J-1")
    assert (found["drifts"], found["leaves"]) == ([], [])
    assert found["text"] == ["1 recording in time: a drift needs two recordings, and its uncertainty three."]
    assert "give a number above 0" in lab.run("trend", "J-1", "--limit-dps", "-1", status=2).stderr
