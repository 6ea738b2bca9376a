"""A sensor's calibration in another format, from its response: that of a fit now, or of a version that was kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from labctl.answers.accelerometer import AccelerometerResponse, AccelerometerTemperature
from labctl.answers.magnetometer import MagnetometerResponse
from labctl.errors import BadInput
from labctl.exports.sensors.formats import written
from labctl.exports.sensors.parameters import (
    AccelerometerParameters,
    MagnetometerParameters,
    TemperatureParameters,
)
from labctl.fitting.magnetometer.calibrate import AXES
from labctl.fitting.magnetometer.ellipsoid import PLACES
from labctl.fitting.poses.triad import UPPER

Calibrated = AccelerometerResponse | MagnetometerResponse


def export_of(answer: Calibrated, name: str, instance: int | None = None, device_id: int | None = None) -> str:
    """Return a calibration in a format. Raises BadInput for what the format cannot express."""
    if isinstance(answer, AccelerometerResponse):
        return written(_accelerometer(answer), answer.text, name, instance, device_id)
    if answer.verdict != "adequate":
        raise BadInput(
            f"--export {name}: the readings are not those of a constant field ({answer.text[-1]}); record them again"
        )
    return written(_magnetometer(answer), answer.text, name, instance, device_id)


def check_export(name: str | None, out: Path | None) -> None:
    """Raise BadInput where a format or a file is given without the other: before a fit that takes its time."""
    if (name is None) != (out is None):
        raise BadInput("give --export and --out together: the format, and the file to write")


def write_export(
    answer: Calibrated, name: str | None, out: Path | None, instance: int | None, device_id: int | None
) -> None:
    """Write a calibration in a format to a file, where one is asked for. Raises BadInput."""
    if name is not None and out is not None:
        out.write_text(export_of(answer, name, instance, device_id), encoding="utf-8")


def _accelerometer(answer: AccelerometerResponse) -> AccelerometerParameters:
    errors = np.zeros((3, 3))
    for i, j in UPPER:
        place = answer.scale_factor[AXES[i]] if i == j else answer.misalignment[AXES[i] + AXES[j]]
        errors[i, j] = place.value
    return AccelerometerParameters(
        np.array([answer.bias_g[axis].value for axis in AXES]), errors, answer.gravity_g,
        np.array(answer.covariance), max(answer.noise_density_m_s2.values()),
        None if answer.temperature is None else _temperature(answer.temperature),
        None if answer.alignment is None else np.radians([answer.alignment["axes"][axis]["value"] for axis in AXES]),
    )  # fmt: skip


def _temperature(answer: AccelerometerTemperature) -> TemperatureParameters:
    bias, scale = (
        np.array([[each.value for each in terms[axis]] for axis in AXES]).T
        for terms in (answer.bias_g, answer.scale_factor)
    )
    return TemperatureParameters(answer.reference_c, answer.range_c, bias, scale)


def _magnetometer(answer: MagnetometerResponse) -> MagnetometerParameters:
    soft = np.zeros((3, 3))
    for i, j in PLACES:
        soft[i, j] = soft[j, i] = answer.soft_iron[AXES[i] + AXES[j]].value
    return MagnetometerParameters(
        np.array([answer.hard_iron_ut[axis].value for axis in AXES]), soft, np.array(answer.covariance),
        None if answer.alignment is None else np.radians([answer.alignment["axes"][axis]["value"] for axis in AXES]),
    )  # fmt: skip
