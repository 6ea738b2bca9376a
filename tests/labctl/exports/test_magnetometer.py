"""Parameters of a magnetometer: the autopilots' own formulas, written anew, give what labctl gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.exports.flight_controllers.magnetometer import ardupilot, px4
from labctl.exports.sensors.parameters import MagnetometerParameters
from labctl.fitting.magnetometer.calibrate import calibrate_magnetometer
from tests.helpers.magnetic_turns import FIELD_UT, fields, readings_of


def parameters(readings: np.ndarray) -> MagnetometerParameters:
    found = calibrate_magnetometer("m", readings, FIELD_UT)
    return MagnetometerParameters(found.hard_iron_ut, found.soft_iron, found.covariance)


@pytest.fixture(scope="module")
def calibrated() -> tuple[np.ndarray, MagnetometerParameters, np.ndarray]:
    readings = readings_of(fields(600), 1)
    found = parameters(readings)
    return readings, found, (readings - found.hard_iron_ut) @ found.soft_iron.T


def symmetric(diagonal: list[float], xy: float, xz: float, yz: float) -> np.ndarray:
    return np.array([[diagonal[0], xy, xz], [xy, diagonal[1], yz], [xz, yz, diagonal[2]]])


def test_px4_corrects_as_labctl(calibrated: tuple[np.ndarray, MagnetometerParameters, np.ndarray]) -> None:
    readings, found, expected = calibrated
    lines = [line.split("\t") for line in px4(found, ["head"], 2, 77).splitlines() if not line.startswith("#")]
    values = {line[2]: float(line[3]) for line in lines}
    assert values.pop("CAL_MAG2_ID") == 77
    assert len(values) == 9
    offset = np.array([values[f"CAL_MAG2_{axis}OFF"] for axis in "XYZ"])
    scale = symmetric(
        [values[f"CAL_MAG2_{axis}SCALE"] for axis in "XYZ"], *(values[f"CAL_MAG2_{axis}ODIAG"] for axis in "XYZ")
    )
    gauss = (readings / 100 - offset) @ scale.T
    assert 100 * gauss == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(("instance", "number"), [(1, ""), (3, "3")])
def test_ardupilot_corrects_as_labctl(
    calibrated: tuple[np.ndarray, MagnetometerParameters, np.ndarray], instance: int, number: str
) -> None:
    readings, found, expected = calibrated
    text = ardupilot(found, ["head"], instance, None)
    values = {name: float(value) for name, value in
              (line.split(",") for line in text.splitlines() if not line.startswith("#"))}  # fmt: skip
    assert len(values) == 10
    offset = np.array([values[f"COMPASS_OFS{number}_{axis}"] for axis in "XYZ"])
    matrix = symmetric(
        [values[f"COMPASS_DIA{number}_{axis}"] for axis in "XYZ"],
        *(values[f"COMPASS_ODI{number}_{axis}"] for axis in "XYZ"),
    )
    mgauss = ((readings * 10 + offset) * values[f"COMPASS_SCALE{number}"]) @ matrix.T
    assert mgauss / 10 == pytest.approx(expected, abs=1e-4)


def test_what_an_autopilot_does_not_take_is_refused(
    calibrated: tuple[np.ndarray, MagnetometerParameters, np.ndarray],
) -> None:
    with pytest.raises(BadInput, match=r"format px4: --instance 4: give a number from 0 to 3"):
        px4(calibrated[1], [], 4, None)
    far = parameters(calibrated[0] + 300.0)
    with pytest.raises(BadInput, match=r"mgauss, but ArduPilot takes at most 1800"):
        ardupilot(far, [], 1, None)


def test_a_rotation_is_said_to_be_lost(calibrated: tuple[np.ndarray, MagnetometerParameters, np.ndarray]) -> None:
    turned = replace(calibrated[1], turned_rad=np.radians([3.0, 0.0, 4.0]))
    for text in (px4(turned, [], 0, None), ardupilot(turned, [], 1, None)):
        assert "LOST alignment: turned by 5 deg from the accelerometer" in text
    assert "LOST alignment" not in px4(calibrated[1], [], 0, None)
