"""Exports of an accelerometer over temperature: the autopilots' own formulas on the numbers of each file."""

from __future__ import annotations

import json

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.exports.sensors.formats import written
from labctl.exports.sensors.parameters import AccelerometerParameters, TemperatureParameters
from tests.helpers.poses_at_rest import BIAS_G

G = 9.80665
ERRORS = np.diag([0.01, -0.008, 0.005])
WARM = TemperatureParameters(
    20.0,
    (-10.0, 60.0),
    np.array([[4e-4, -3e-4, 1e-4], [5e-6, 2e-6, -4e-6], [1e-7, -5e-8, 2e-8]]),
    np.array([[1e-4] * 3]),
)
FOUND = AccelerometerParameters(BIAS_G, ERRORS, 1.0, np.eye(9), 0.0013, WARM)
TEMPERATURES = (-30.0, -10.0, 5.0, 20.0, 47.0, 60.0, 75.0)


def bias_m_s2(temperature_c: float) -> np.ndarray:
    """Return the true bias (3,), clamped to the range as autopilots do."""
    away = float(np.clip(temperature_c, *WARM.range_c)) - WARM.reference_c
    return np.asarray(G * (BIAS_G + sum(away ** (k + 1) * row for k, row in enumerate(WARM.bias_g))))


def values_of(text: str, separator: str, name: int) -> dict[str, float]:
    rows = [line.split(separator) for line in text.splitlines() if line and not line.startswith("#")]
    return {row[name]: float(row[name + 1]) for row in rows}


def test_px4_subtracts_the_bias_at_every_temperature() -> None:
    text = written(FOUND, ["head"], "px4", 1, 1310988)
    found = values_of(text, "\t", 2)
    for temperature_c in TEMPERATURES:
        d = float(np.clip(temperature_c, found["TC_A1_TMIN"], found["TC_A1_TMAX"])) - found["TC_A1_TREF"]
        for i, axis in enumerate("XYZ"):
            thermal = sum(found[f"TC_A1_X{power}_{i}"] * d**power for power in range(4))
            assert thermal + found[f"CAL_ACC1_{axis}OFF"] == pytest.approx(bias_m_s2(temperature_c)[i], abs=1e-6)
            assert found[f"CAL_ACC1_{axis}SCALE"] == pytest.approx(1 / (1 + ERRORS[i, i]))
    assert found["TC_A_ENABLE"] == 1
    assert found["TC_A1_ID"] == found["CAL_ACC1_ID"] == 1310988
    assert "LOST temperature: over -10.0 to 60.0 deg C the scale factors by up to 0.004 g" in text


@pytest.mark.parametrize("instance", [1, 2])
def test_ardupilot_subtracts_the_bias_at_every_temperature(instance: int) -> None:
    text = written(FOUND, ["head"], "ardupilot", instance, None)
    found = values_of(text, ",", 0)
    thermal, number = f"INS_TCAL{instance}_", "" if instance == 1 else str(instance)

    def polynomial(temperature_c: float, axis: str) -> float:
        d = float(np.clip(temperature_c, found[f"{thermal}TMIN"], found[f"{thermal}TMAX"])) - 35.0
        return 1e-6 * sum(found[f"{thermal}ACC{power}_{axis}"] * d**power for power in (1, 2, 3))

    for temperature_c in TEMPERATURES:
        for i, axis in enumerate("XYZ"):
            moved = polynomial(temperature_c, axis) - polynomial(found[f"INS_ACC{instance}_CALTEMP"], axis)
            whole = moved + found[f"INS_ACC{number}OFFS_{axis}"]
            assert whole == pytest.approx(bias_m_s2(temperature_c)[i], abs=1e-6)
    assert "their coefficients (GYR*) are not in this file" in text


def test_ardupilot_refuses_a_range_that_it_cannot_hold() -> None:
    hot = TemperatureParameters(20.0, (-10.0, 95.0), WARM.bias_g, WARM.scale_factor)
    with pytest.raises(BadInput, match=r"-10 to 95 deg C.*-70 to 80 deg C; use --export json or px4"):
        written(AccelerometerParameters(BIAS_G, ERRORS, 1.0, np.eye(9), 0.0013, hot), [], "ardupilot", 1, None)


@pytest.mark.parametrize("name", ["kalibr", "ros", "python", "c"])
def test_formats_without_a_temperature_say_what_is_lost(name: str) -> None:
    said = written(FOUND, ["head"], name, None, None)
    worst = np.abs(WARM.bias_change_g(WARM.grid())).max()
    assert f"the bias by up to {worst:.2g} g and the scale factors by up to 0.004 g of 1 g differ" in said


def test_json_has_the_coefficients() -> None:
    found = json.loads(written(FOUND, [], "json", None, None))["temperature"]
    assert found["offset_per_k"] == pytest.approx(WARM.bias_g * G)
    assert (found["reference_c"], found["range_c"]) == (20.0, [-10.0, 60.0])
