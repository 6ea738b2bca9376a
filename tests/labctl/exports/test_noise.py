"""Kalibr's and ROS 2's files: their densities, turned into readings by the consumer's formula, are those given."""

from __future__ import annotations

import json

import numpy as np
import pytest

from labctl.answers.noise import AllanJson, NoiseFigure
from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.services.calibrations.served import noise_options
from tests.helpers.exported import exported, stated

#: 0.15 deg/sqrt(h) and 6 deg/h/sqrt(h), as of a data sheet, in deg/s/sqrt(Hz) and deg/s^2/sqrt(Hz).
WHITE, WALK = 0.15 / 60, 6.0 / 3600 / 60
KEYS = {
    "accelerometer_noise_density",
    "accelerometer_random_walk",
    "gyroscope_noise_density",
    "gyroscope_random_walk",
    "rostopic",
    "update_rate",
}


def keys_of(text: str) -> dict[str, str]:
    """Return the keys of a file of one-line YAML values."""
    lines = (line.partition("#")[0].strip() for line in text.splitlines())
    return {key: value.strip() for key, _, value in (line.partition(":") for line in lines) if value}


def test_kalibrs_file_has_its_keys_and_units(mems: Calibration) -> None:
    white = ",".join(str(WHITE * share) for share in (1.0, 0.5, 0.8))
    text, written = exported(
        mems, "kalibr", noise_dps_rthz=white, walk_dps_s_rthz=str(WALK), rate_hz="200", rostopic="/imu7"
    )
    found = {name: float(value) if name != "rostopic" else value for name, value in keys_of(text).items()}
    assert set(found) == KEYS
    assert all(value > 0 for value in found.values() if isinstance(value, float))
    assert (found["update_rate"], found["rostopic"]) == (200.0, "/imu7")
    # ImuParameters of Kalibr: a reading's standard deviation is the density times sqrt(update_rate)
    reading_dps = np.rad2deg(float(found["gyroscope_noise_density"]) * np.sqrt(float(found["update_rate"])))
    assert reading_dps == pytest.approx(WHITE * np.sqrt(200.0), rel=1e-9)
    # after t seconds a random walk has moved by density sqrt(t): 6 deg/h after one hour
    assert np.rad2deg(float(found["gyroscope_random_walk"]) * np.sqrt(3600.0)) * 3600 == pytest.approx(6.0, rel=1e-9)
    assert "LOST lower noise of other axes (one number for all; the largest is written): up to 2 times" in text
    assert stated(text, "LOST the correction of bias, scale factor and misalignment") > 9
    assert len(written.losses) == 2


def test_the_covariance_is_noise_at_the_rate_of_messages_plus_the_calibrations_error(mems: Calibration) -> None:
    text, _ = exported(mems, "ros2-imu", noise_dps_rthz=f"{WHITE},{2 * WHITE},{WHITE}", rate_hz="100")
    found = np.array(json.loads(keys_of(text)["angular_velocity_covariance"])).reshape(3, 3)
    error_dps = mems.document["error"]["heldout_rms_dps"]
    assert error_dps is not None
    expected = np.deg2rad(np.hypot(np.array([1, 2, 1]) * WHITE * np.sqrt(100.0), error_dps))
    assert np.sqrt(np.diag(found)) == pytest.approx(expected, rel=1e-8)
    assert np.count_nonzero(found) == 3


def figure(value: float, unit: str) -> NoiseFigure:
    return {"value": value, "u": None, "unit": unit, "at_most": None, "why": ""}


def test_allan_figures_become_densities() -> None:
    axis: AllanJson = {
        "tau_s": [0.005], "deviation_dps": [], "low_dps": [], "high_dps": [], "model_dps": [], "trend_dps": None,
        "N": figure(0.15, "deg/sqrt(h)"), "B": figure(1.0, "deg/h"), "K": figure(6.0, "deg/h/sqrt(h)"),
        "replaces_datasheet": False,
    }  # fmt: skip
    found = noise_options([axis])
    assert float(found["noise_dps_rthz"]) == pytest.approx(WHITE)
    assert float(found["walk_dps_s_rthz"]) == pytest.approx(WALK)
    assert found["rate_hz"] == "200"


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("kalibr", {}, r"noise_dps_rthz of SIM-2 is not known .*; record the unit at rest, or give option"),
        ("kalibr", {"noise_dps_rthz": "0.1"}, "rate_hz of SIM-2 is not known"),
        (
            "kalibr",
            {"noise_dps_rthz": "0.1", "rate_hz": "9"},
            "needs a value above 0; record the unit at rest for longer",
        ),
        ("kalibr", {"noise_dps_rthz": "0.1,0.2"}, "give a number above 0, or 3 of them with commas, one for each of x"),
        ("ros2-imu", {"noise_dps_rthz": "-1"}, "option noise_dps_rthz = '-1': give a number above 0"),
        ("ros2-imu", {"walk_dps_s_rthz": "1"}, "option 'walk_dps_s_rthz' is not known; options of this format: noise"),
    ],
)
def test_noise_that_is_not_known_is_asked_for(mems: Calibration, name: str, options: dict[str, str], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        exported(mems, name, **options)


def test_a_gyro_of_one_axis_has_no_covariance_of_three(fog: Calibration) -> None:
    with pytest.raises(
        BadInput, match=r"needs covariances of x, y and z, but .* is calibrated only along z; calibrate x, y too"
    ):
        exported(fog, "ros2-imu", noise_dps_rthz="0.1", rate_hz="100")
