"""PX4 and ArduPilot: their published formulas, in float32, on the exported parameters against the compensator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.exports.flight_controllers.ardupilot import parameter_names, write
from labctl.recording import Recording
from tests.helpers.calibrations import calibrated
from tests.helpers.exported import at_true_rate, exported, stated, whole_range
from tests.helpers.recordings import Triaxial

F = np.float32
Formula = Callable[[np.ndarray, np.ndarray], np.ndarray]
WORDS = {"px4": "PX4 has no parameter for", "ardupilot": "ArduPilot has no parameter for"}


def px4_formula(text: str) -> Formula:
    """TemperatureCompensation::calc_thermal_offsets_3D, subtracted from the sensor's rad/s."""
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    assert all(row[:2] == ["1", "1"] and row[4] in {"6", "9"} for row in rows)
    value = {row[2]: F(row[3]) for row in rows}
    x = [[value[f"TC_G0_X{power}_{axis}"] for axis in range(3)] for power in range(4)]

    def corrected(raw_rad_s: np.ndarray, warm: np.ndarray) -> np.ndarray:
        delta = np.clip(warm.astype(F), value["TC_G0_TMIN"], value["TC_G0_TMAX"]) - value["TC_G0_TREF"]
        offsets = [x[0][a] + x[1][a] * delta + x[2][a] * delta * delta + x[3][a] * delta**3 for a in range(3)]
        return raw_rad_s - np.column_stack(offsets)

    return corrected


def ardupilot_formula(text: str) -> Formula:
    """TCal::correct_sensor with the fixed 35 deg C, then the gyro's offsets."""
    value = {name: F(number) for name, number in (line.split(",") for line in text.splitlines() if line[0] != "#")}
    t_min, t_max = value["INS_TCAL1_TMIN"], value["INS_TCAL1_TMAX"]

    def polynomial(warm: np.ndarray) -> np.ndarray:
        d = np.clip(np.asarray(warm, dtype=F), t_min, t_max) - F(35.0)
        c = [[value[f"INS_TCAL1_GYR{k}_{axis}"] for axis in "XYZ"] for k in (1, 2, 3)]
        return np.column_stack([(c[0][a] + (c[1][a] + c[2][a] * d) * d) * d * F(1e-6) for a in range(3)])

    def corrected(raw_rad_s: np.ndarray, warm: np.ndarray) -> np.ndarray:
        rate = raw_rad_s - polynomial(warm) + polynomial(np.array([value["INS_GYR1_CALTEMP"]]))
        return rate - np.array([value[f"INS_GYROFFS_{axis}"] for axis in "XYZ"])

    return corrected


FORMULAS = {"px4": px4_formula, "ardupilot": ardupilot_formula}


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("which", ["mems", "open_loops"])
def test_the_controllers_formula_is_within_the_stated_bounds(
    request: pytest.FixtureRequest, name: str, which: str
) -> None:
    calibration: Calibration = request.getfixturevalue(which)
    text, written = exported(calibration, name)
    law = FORMULAS[name](text)
    warm = np.linspace(*calibration.temperature_c, 301)
    still = at_true_rate(calibration, 0.0, warm)
    left = np.rad2deg(law(np.deg2rad(still), warm))
    at_rest = stated(text, "Rates corrected by this file differ from those of the calibration")
    assert written.differs_dps is not None
    assert 0.9 * written.differs_dps <= np.abs(left).max() <= at_rest
    raw, hot = whole_range(calibration)
    apart = np.abs(np.rad2deg(law(np.deg2rad(raw), hot)) - Compensator(calibration).compensate(raw, hot).rate_dps)
    together = stated(text, "LOST both together")
    assert 0.5 * together < apart.max() <= together
    own, cross = (stated(text, f"LOST {what}") for what in ("scale factor", "misalignment"))
    assert max(own, cross) <= together <= 1.01 * (own + cross)
    assert text.count(WORDS[name]) == 2
    assert all(loss.text in text for loss in written.losses)


@pytest.mark.parametrize("name", FORMULAS)
def test_outside_the_limits_of_temperature_the_edge_is_used(mems: Calibration, name: str) -> None:
    law = FORMULAS[name](exported(mems, name)[0])
    low, high = mems.temperature_c
    zero = np.zeros((4, 3))
    held = law(zero, np.array([low, high, low - 40, high + 40]))
    assert np.abs(held[:2] - held[2:]).max() == pytest.approx(0, abs=1e-9)


def test_a_bias_that_is_a_cubic_is_carried_to_single_precision(at_rest: Recording) -> None:
    warm = np.asarray(at_rest.columns["temperature_c"], dtype=float)
    u = warm - 30.0
    columns = {name: at_rest.columns[name] for name in at_rest.columns if not name.startswith("gyro_")}
    noise = 1e-4 * np.random.default_rng(1).normal(size=(3, len(warm)))
    for k, axis in enumerate("xyz"):
        columns[f"gyro_{axis}"] = 0.5 * (k - 1) + 0.02 * u - 0.001 * k * u**2 + noise[k]
    info = at_rest.info.model_copy(update={"axes": ["x", "y", "z"], "latitude_deg": None})
    calibration = calibrated(replace(at_rest, info=info, columns=columns), effects=["bias", "bias_temperature:2"])
    for name, formula in FORMULAS.items():
        text, written = exported(calibration, name)
        assert written.differs_dps is not None
        assert written.differs_dps < 1e-6
        assert "LOST scale factor and misalignment are not in this calibration" in text
        hot = np.linspace(*calibration.temperature_c, 301)
        left = formula(text)(np.deg2rad(at_true_rate(calibration, 0.0, hot)), hot)
        assert np.rad2deg(np.abs(left)).max() < 1e-6


def test_names_and_limits_of_the_parameters(mems: Calibration) -> None:
    text, _ = exported(mems, "px4", device_id="2490378", instance="2")
    rows = [line.split("\t") for line in text.splitlines() if line[0] != "#"]
    assert ["1", "1", "TC_G2_ID", "2490378", "6"] in rows
    assert all(len(row[2]) <= 16 for row in rows)  # MAVLink
    assert "TC_G0_ID is not in this file" in exported(mems, "px4")[0]
    assert parameter_names(1) == ("INS_TCAL1_", "INS_GYROFFS_", "INS_GYR1_CALTEMP")
    assert parameter_names(3) == ("INS_TCAL3_", "INS_GYR3OFFS_", "INS_GYR3_CALTEMP")
    assert parameter_names(4) == ("INS4_TCAL_", "INS4_GYROFFS_", "INS4_GYR_CALTEMP")
    assert "INS_TCAL3_GYR3_Z," in exported(mems, "ardupilot", imu="3")[0]


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("px4", {"instance": "4"}, "option instance = '4': give a whole number from 0 to 3"),
        ("px4", {"device_id": "0"}, "option device_id = '0': give a whole number from 1 to 2147483647"),
        ("px4", {"imu": "1"}, "option 'imu' is not known; options of this format: device_id, instance, tolerance_dps"),
        ("ardupilot", {"tolerance_dps": "few"}, "option tolerance_dps = 'few' is not a number"),
        (
            "ardupilot",
            {"tolerance_dps": "0.5"},
            r"would be lost \(scale factor .* deg/s\), more than option tolerance_dps = 0.5 deg/s",
        ),
    ],
)
def test_wrong_options_are_refused(mems: Calibration, name: str, options: dict[str, str], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        exported(mems, name, **options)


@pytest.mark.parametrize("name", FORMULAS)
def test_what_a_controller_cannot_carry_is_refused(name: str, fog: Calibration, at_rest: Recording) -> None:
    with pytest.raises(BadInput, match=rf"format {name}: .* is calibrated along z alone"):
        exported(fog, name)
    run = Triaxial(2).campaign(2)
    columns = {key: values for key, values in run.columns.items() if key != "temperature_c"}
    still = np.asarray(columns["table_rate_dps"]) == 0
    columns = {key: np.asarray(values)[still] for key, values in columns.items()}
    info = run.info.model_copy(update={"motion": "rest"})
    constant = calibrated(replace(run, info=info, columns=columns), effects=["bias"])
    with pytest.raises(BadInput, match="was calibrated without a thermometer"):
        exported(constant, name)


def test_temperatures_beyond_a_controllers_limits_are_refused(mems: Calibration) -> None:
    document = {**mems.document, "validity": {"temperature_c": [90.0, 120.0], "rate_dps": [-1.0, 1.0]}}
    with pytest.raises(BadInput, match="from 90 to 120 deg C; TMIN and TMAX of ArduPilot go only from -70 to 80"):
        write(Calibration(document), {})
