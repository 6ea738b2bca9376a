"""Versions of a unit's accelerometer and magnetometer: kept, listed, shown again."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from labctl.answers.accelerometer import AccelerometerResponse, AccelerometerTemperature
from labctl.answers.json_object import JsonDocument
from labctl.answers.magnetometer import Estimate, MagnetometerResponse
from labctl.answers.sensors import (
    AccelerometerRequest,
    AccelerometerVersion,
    MagnetometerRequest,
    MagnetometerVersion,
    MeasuredData,
    MeasuredFile,
    SensorName,
    SensorVersionResponse,
)
from labctl.canonical_json import canonical
from labctl.errors import BadInput, NotFound
from labctl.exports.sensors.formats import SENSOR_FORMATS
from labctl.fitting.magnetometer.calibrate import AXES
from labctl.fitting.magnetometer.ellipsoid import PLACES
from labctl.fitting.poses.triad import UPPER
from labctl.recording.files import FILE_NAMES
from labctl.recording.info import SERIAL_PATTERN, SERIAL_RULE
from labctl.services.sensor_coefficients import coefficients_of
from labctl.services.sensor_exports import export_of
from labctl.store import NewSensorVersion, SensorVersionRow, Store

#: What is stored of each sensor.
RESULTS: Mapping[SensorName, type[AccelerometerResponse | MagnetometerResponse]] = {
    "accelerometer": AccelerometerResponse, "magnetometer": MagnetometerResponse,
}  # fmt: skip
#: Largest difference between a stated uncertainty and that of the covariance, relative.
ROUNDING = 1e-6


def measured_data(paths: Sequence[Path], read_as: str) -> MeasuredData:
    """Return the names and hashes of files, and of the files in the folders of recordings."""
    files = []
    for path in paths:
        inside = sorted(each for each in path.glob("*") if each.name in FILE_NAMES) if path.is_dir() else [path]
        files += [MeasuredFile(name=each.name, sha256=hashlib.sha256(each.read_bytes()).hexdigest()) for each in inside]
    return MeasuredData(files=files, read_as=read_as)


@dataclass(frozen=True)
class VersionFile:
    """A version in a format."""

    name: str
    content: str
    media_type: str
    etag: str


def keep_accelerometer(store: Store, serial: str, request: AccelerometerRequest, at: datetime) -> AccelerometerVersion:
    """Keep a result as a unit's next version. Raises BadInput for one that contradicts itself; VersionTaken."""
    return AccelerometerVersion.model_validate(_kept(store, serial, "accelerometer", request, at))


def keep_magnetometer(store: Store, serial: str, request: MagnetometerRequest, at: datetime) -> MagnetometerVersion:
    """Keep a result as a unit's next version. Raises BadInput for one that contradicts itself; VersionTaken."""
    return MagnetometerVersion.model_validate(_kept(store, serial, "magnetometer", request, at))


def _kept(
    store: Store, serial: str, sensor: SensorName, request: AccelerometerRequest | MagnetometerRequest, at: datetime
) -> dict[str, object]:
    if re.fullmatch(SERIAL_PATTERN, serial) is None:
        raise BadInput(f"serial number {serial[:80]!r} cannot be used; give {SERIAL_RULE}")
    result = request.result.model_dump(mode="json")
    problem = _problem(_estimates(request.result), request.result.covariance) or _not_json(result)
    if problem is None and isinstance(request.result, AccelerometerResponse) and request.result.temperature is not None:
        problem = _problem(
            _over_temperature(request.result, request.result.temperature), request.result.temperature.covariance
        )
    if problem is not None:
        raise BadInput(f"result of the {sensor}: {problem}; send what `labctl {sensor} FILE --json` prints, unchanged")
    data = request.data.model_dump(mode="json")
    new = NewSensorVersion(serial, sensor, request.result.verdict, data, result, request.by)
    return _fields(store.sensor_versions.add(new, at), whole=True)


def list_versions(store: Store, serial: str) -> list[SensorVersionResponse]:
    """Return every version of a unit's accelerometer and magnetometer, newest first. Raises NotFound."""
    stored_serial = store.units.get(serial).serial
    return [_answer(row) for row in store.sensor_versions.of_unit(stored_serial)]


def one_accelerometer(store: Store, serial: str, version: int | None = None) -> AccelerometerVersion:
    """Return a version, or the newest. Raises NotFound."""
    row = store.sensor_versions.get(serial, "accelerometer", version)
    return AccelerometerVersion.model_validate(_fields(row, whole=True))


def one_magnetometer(store: Store, serial: str, version: int | None = None) -> MagnetometerVersion:
    """Return a version, or the newest. Raises NotFound."""
    row = store.sensor_versions.get(serial, "magnetometer", version)
    return MagnetometerVersion.model_validate(_fields(row, whole=True))


def one_version(
    store: Store, serial: str, sensor: str, version: int | None = None
) -> AccelerometerVersion | MagnetometerVersion:
    """Return a version of a sensor by its name, or the newest. Raises NotFound."""
    if sensor == "accelerometer":
        return one_accelerometer(store, serial, version)
    if sensor == "magnetometer":
        return one_magnetometer(store, serial, version)
    raise NotFound(f"sensor {sensor!r}: name accelerometer or magnetometer")


def version_file(
    store: Store,
    serial: str,
    sensor: str,
    version: int | None,
    format_name: str,
    instance: int | None = None,
    device_id: int | None = None,
) -> VersionFile:
    """Return a version in a format: the bytes that its fit exported. Raises NotFound, BadInput."""
    version_row = one_version(store, serial, sensor, version)
    content = export_of(version_row.result, format_name, instance, device_id)
    chosen = SENSOR_FORMATS[version_row.sensor][format_name]
    etag = hashlib.sha256(content.encode()).hexdigest()
    return VersionFile(f"{version_row.sensor}-{version_row.version}.{chosen.suffix}", content, chosen.media_type, etag)


def _estimates(result: AccelerometerResponse | MagnetometerResponse) -> list[Estimate | None]:
    """Return the estimates of a result in the order of its covariance; None: one that is not there."""
    if isinstance(result, AccelerometerResponse):
        errors: Mapping[str, Estimate] = {
            **{a + a: each for a, each in result.scale_factor.items()},
            **result.misalignment,
        }
        return [result.bias_g.get(a) for a in AXES] + [errors.get(AXES[i] + AXES[j]) for i, j in UPPER]
    return [
        *(result.hard_iron_ut.get(a) for a in AXES), *(result.soft_iron.get(AXES[i] + AXES[j]) for i, j in PLACES),
        result.field_ut,
    ]  # fmt: skip


def _over_temperature(result: AccelerometerResponse, law: AccelerometerTemperature) -> list[Estimate | None]:
    """Return the nine estimates and those of temperature, by power and axis, in the order of the covariance."""
    sensor_estimates = _estimates(result)
    for terms in (law.bias_g, law.scale_factor):
        powers = max((len(term) for term in terms.values()), default=0)
        sensor_estimates += [
            dict(enumerate(terms.get(axis, []))).get(power) for power in range(powers) for axis in AXES
        ]
    return sensor_estimates


def _not_json(result: JsonDocument) -> str | None:
    """Return in words why a result cannot be written as JSON; None: it can."""
    try:
        canonical(result)
    except ValueError as error:  # not a number, or half a character
        return f"a value cannot be stored ({error})"
    return None


def _problem(estimates: Sequence[Estimate | None], covariance: Sequence[Sequence[float]]) -> str | None:
    """Return in words why a result does not come from a fit; None: it may."""
    sensor_estimates, size = [estimate for estimate in estimates if estimate is not None], len(estimates)
    if len(sensor_estimates) != size:
        return f"{size - len(sensor_estimates)} of {size} parameters are missing"
    if len(covariance) != size or any(len(row) != size for row in covariance):
        return f"the covariance is not {size} by {size}"
    matrix = np.array(covariance, dtype=np.float64)
    with np.errstate(over="ignore"):
        if not (np.isfinite(matrix).all() and np.allclose(matrix, matrix.T, rtol=ROUNDING, atol=0)):
            return "the covariance is not finite and symmetric"
    if np.diag(matrix).min() < 0:
        return "a variance is negative"
    for sensor_estimate, u in zip(sensor_estimates, np.sqrt(np.diag(matrix)), strict=True):
        if sensor_estimate.u is not None and not abs(sensor_estimate.u - u) <= ROUNDING * u:
            return f"u = {sensor_estimate.u:.3g} where the covariance says {u:.3g}"
    return None


def _answer(row: SensorVersionRow) -> SensorVersionResponse:
    return SensorVersionResponse.model_validate(_fields(row))


def _fields(row: SensorVersionRow, *, whole: bool = False) -> dict[str, object]:
    result: dict[str, object] = {"result": row.result} if whole else {}
    adequate = row.sensor == "accelerometer" or row.verdict == "adequate"
    parameters = RESULTS[row.sensor].model_validate(row.result)
    formats = {
        name: each for name, each in SENSOR_FORMATS[row.sensor].items()
        if adequate and (parameters.alignment is not None or not each.of_alignment)
    }  # fmt: skip
    return result | {
        "serial": row.serial, "sensor": row.sensor, "version": row.version, "verdict": row.verdict, "at": row.at,
        "by": row.by, "by_key": row.by_key, "data": row.data, "hash": row.hash, "summary": row.result["text"],
        "coefficients": coefficients_of(parameters),
        "formats": [{"id": name, "title": each.title, "suffix": each.suffix} for name, each in formats.items()],
    }  # fmt: skip
