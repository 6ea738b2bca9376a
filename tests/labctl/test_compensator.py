"""A calibration file alone is enough: corrected rates, and flags outside of the calibrated range."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration, read_calibration
from labctl.compensator import Compensator
from labctl.errors import BadCalibrationFile, BadInput
from labctl.fitting import Channels, fit, fit_data_of
from labctl.recording import Recording, to_points
from tests.helpers.calibrations import calibrated, inside

Grid = tuple[np.ndarray, np.ndarray]


def test_every_fast_way_agrees_with_the_model(any_calibration: Calibration) -> None:
    raw, warm = inside(any_calibration)
    found = Compensator(any_calibration).compensate(raw, warm)
    outputs = {axis: raw[:, i] for i, axis in enumerate(any_calibration.axes)}
    expected = any_calibration.fitted.compensate(outputs, Channels({"temperature_c": warm}, outputs))
    for i, axis in enumerate(any_calibration.axes):
        assert found.rate_dps[:, i] == pytest.approx(expected[axis], abs=1e-10)
    assert not found.outside.any()


def test_sample_by_sample_is_the_same_as_arrays(any_calibration: Calibration) -> None:
    raw, warm = inside(any_calibration, 20)
    compensator = Compensator(any_calibration)
    whole = compensator.compensate(raw, warm)
    for row in range(20):
        rate, outside = compensator.step(raw[row], warm[row])
        assert rate == pytest.approx(whole.rate_dps[row], abs=1e-12)
        assert not outside


def test_yang_undoes_k_and_b(mems: Calibration, triaxial: Callable[[int], Any]) -> None:
    unit = triaxial(2)
    true = np.array([120.0, -35.0, 300.0])
    for warm in (-38.0, 3.0, 47.0):
        output = unit.k(warm) @ true + unit.bias(warm)
        rate, _ = Compensator(mems).step(output, warm)
        assert rate == pytest.approx(true, abs=0.02)
        assert np.max(np.abs(output - true)) > 1.0


def test_outside_is_flagged_or_refused_never_silent(fog: Calibration) -> None:
    clamp, refuse = Compensator(fog), Compensator(fog, outside="refuse")
    raw = np.array([10.0, 10.0, 500.0, np.nan, 10.0])
    warm = np.array([35.0, 60.0, 35.0, 35.0, np.nan])
    found = clamp.compensate(raw, warm)
    assert found.outside.tolist() == [False, True, True, True, True]
    assert found.rate_dps[1] == pytest.approx(clamp.compensate(raw[:1], np.array([45.0])).rate_dps[0])
    assert np.isnan(found.rate_dps[3])
    with pytest.raises(BadInput, match=r"sample 2: temperature \[60.0\] deg C outside 25 to 45 deg C"):
        refuse.compensate(raw[:2], warm[:2])
    with pytest.raises(BadInput, match=r"sample 1: rate \[500.0\] deg/s outside"):
        refuse.compensate(raw[2:3], warm[2:3])


def test_volts_are_converted_first(make_points: Callable[..., Recording], grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    volts = 2.5 + 0.022 * (1.01 * rate)
    recording = make_points(rate, warm, volts, output={"z": {"unit": "V", "offset": 2.5, "scale": 0.022}})
    compensator = Compensator(calibrated(recording, effects=["scale_factor"]))
    found = compensator.compensate_output(volts, warm)
    assert found.rate_dps == pytest.approx(rate, abs=1e-9)


def test_the_file_survives_the_way_to_disk(any_calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    path.write_bytes(any_calibration.to_bytes())
    back = read_calibration(path)
    assert back.hash == any_calibration.hash
    assert back.to_bytes() == any_calibration.to_bytes()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda text: text.replace('"version":1', '"version":7'), "was edited or damaged"),
        (lambda text: text[: len(text) // 2], "truncated"),
        (lambda text: text.replace("labctl-calibration/1", "labctl-calibration/9"), "this version of labctl reads"),
        (lambda _: "[]", "schema None"),
    ],
)
def test_a_spoilt_file_is_refused(fog: Calibration, tmp_path: Path, spoil: Callable[[str], str], said: str) -> None:
    path = tmp_path / "calibration.json"
    path.write_text(spoil(fog.to_bytes().decode()))
    with pytest.raises(BadCalibrationFile, match=said):
        Compensator.from_file(path)


def test_only_what_belongs_to_the_unit_leaves_the_house(fog: Calibration, mems: Calibration) -> None:
    assert fog.document["left_out"] == []
    assert {effect["effect"] for effect in mems.document["model"]["terms"]} == {"bias", "scale_factor", "misalignment"}
    assert json.loads(mems.to_bytes())["papers"]["yang2018"][0].keys() >= {"Kxx", "Kxy", "Kyx", "Bz", "temperature_c"}


def test_a_calibrations_own_readings_are_inside(at_rest: Recording, single_axis_run: Recording) -> None:
    """Validity is that of the readings: means alone leave out the hottest and coldest of them."""
    for recording, calibration in (
        (at_rest, calibrated(at_rest, effects=["bias", "bias_temperature"])),
        (single_axis_run, calibrated(single_axis_run, "ojeda2000")),
    ):
        warm = recording.columns["temperature_c"]
        assert calibration.temperature_c == (warm.min(), warm.max())
        found = Compensator(calibration, "refuse").compensate(recording.gyro_dps("z"), warm)
        assert not found.outside.any()


def test_means_keep_the_range_of_their_readings(single_axis_run: Recording) -> None:
    covered = fit_data_of(single_axis_run).covered
    result = fit(to_points(single_axis_run), "ojeda2000", covered=covered)
    assert result.temperature_c == fit(single_axis_run, "ojeda2000").temperature_c
