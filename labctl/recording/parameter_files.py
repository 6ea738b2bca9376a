"""Thermal calibrations of gyros in parameter files of PX4 and ArduPilot, as a table of coefficients.

A file has a bias over temperature, a cubic for each axis; a gyro's scale factor has no parameter there. The table has K
as the unit matrix and B of the cubic at `NODES` temperatures from TMIN to TMAX. Formulas: PX4 TemperatureCompensation,
ArduPilot AP_InertialSensor_tempcal.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from labctl.answers.recording_head import Axis
from labctl.errors import BadRecording
from labctl.recording.importer import Importer
from labctl.recording.info import RecordingInfo
from labctl.recording.recording import Column, Recording

#: Temperatures of the table: between them a calibration goes on a parabola, which leaves under 1e-5 of the cubic.
NODES = 41
MAX_BYTES = 1 << 20
AXES: tuple[Axis, ...] = ("x", "y", "z")
REFERENCE_C, SCALE = 35.0, 1e-6  #: of ArduPilot's cubic

Array = NDArray[np.float64]
_LINE = re.compile(r"^(?:\d+[\t ]+\d+[\t ]+)?([A-Z][A-Z0-9_]*)[\t ,]+([-+.0-9eE]+)(?:[\t ,]+\d+)?\s*$", re.MULTILINE)
_PX4 = re.compile(r"\bTC_G(\d)_X3_0\b")
_ARDUPILOT = re.compile(r"\bINS(?:_TCAL([1-3])|([45])_TCAL)_GYR1_X\b")
#: Names of parameters of a gyro.
_OF_GYRO = re.compile(r"\b(?:TC_G\d_|INS\d?_\w*GYR)")


class ParameterOptions(BaseModel):
    """What a parameter file does not say."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    serial: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._+# -]{0,63}$")
    started_at: AwareDatetime  #: when the vehicle was calibrated, with its time zone
    max_rate_dps: float | None = Field(default=None, gt=0)


def probe(path: Path) -> float:
    """Return 0.95 for a file with the parameters of a gyro's thermal calibration."""
    return 0.95 if path.is_file() and _kind(_text(path)) is not None else 0.0


def read(path: Path, options: ParameterOptions) -> Recording:
    """Return the table of the first gyro with a thermal calibration. Raises BadRecording naming file and parameter."""
    text = _text(path)
    kind = _kind(text)
    if kind is None:
        raise BadRecording(
            f"{path}: no parameter TC_G*_X3_0 (PX4) or INS_TCAL*_GYR1_X (ArduPilot), so it has no thermal calibration "
            "of a gyro; run the thermal calibration on the flight controller, then save its parameters again"
        )
    try:
        values = {name: float(number) for name, number in _LINE.findall(text)}
        temperatures_c, bias_rad_s = _px4(values, kind[1]) if kind[0] == "PX4" else _ardupilot(values, kind[1])
    except KeyError as error:
        raise BadRecording(
            f"{path}: parameter {error.args[0]} is missing; export the complete set of parameters"
        ) from error
    except ValueError as error:
        raise BadRecording(f"{path}: {error}; correct the file") from error
    _refuse_cut(path, text)
    notes = f"bias over temperature of {kind[0]}, gyro {kind[1]}; scale factor and misalignment are not in its file"
    info = RecordingInfo(
        serial=options.serial, axes=AXES, kind="coefficients", started_at=options.started_at,
        max_rate_dps=options.max_rate_dps, notes=notes,
    )  # fmt: skip
    gains = {
        f"k_{out}{body_axis}": np.full(len(temperatures_c), float(out == body_axis))
        for out in AXES
        for body_axis in AXES
    }
    biases = {f"b_{axis}": np.rad2deg(bias_rad_s[:, column]) for column, axis in enumerate(AXES)}
    columns: dict[str, Column] = {**gains, **biases, "temperature_c": temperatures_c}
    return Recording(info, columns)


def _refuse_cut(path: Path, text: str) -> None:
    """Raise BadRecording for a file that ends within a line of the gyro: a number that was cut off is a number too."""
    last = text.rpartition("\n")[2].strip()
    if _OF_GYRO.search(last):
        raise BadRecording(
            f"{path}: the last line has no line break and ends after {last[-20:]!r}, so the file may be cut off within "
            "it; export the parameters again, or end the line where it is complete"
        )


def _text(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(MAX_BYTES).decode("utf-8", errors="replace").replace("\r\n", "\n")


def _kind(text: str) -> tuple[str, int] | None:
    """Return the firmware and the number of its gyro."""
    if match := _PX4.search(text):
        return "PX4", int(match[1])
    if match := _ARDUPILOT.search(text):
        return "ArduPilot", int(match[1] or match[2])
    return None


def _temperatures(low: float, high: float) -> Array:
    if not (np.isfinite([low, high]).all() and high > low):
        raise ValueError(f"TMIN = {low:g} deg C must be below TMAX = {high:g} deg C")
    return np.linspace(low, high, NODES)


def _px4(values: Mapping[str, float], gyro: int) -> tuple[Array, Array]:
    """Return temperatures (n,) deg C and offsets (n, 3) rad/s."""
    prefix = f"TC_G{gyro}_"
    temperatures_c = _temperatures(values[f"{prefix}TMIN"], values[f"{prefix}TMAX"])
    d = temperatures_c - values[f"{prefix}TREF"]
    terms = [[values[f"{prefix}X{power}_{axis}"] * d**power for power in range(4)] for axis in range(3)]
    return temperatures_c, np.column_stack([np.sum(term, axis=0) for term in terms])


def _ardupilot(values: Mapping[str, float], imu: int) -> tuple[Array, Array]:
    """Return temperatures (n,) deg C and offsets (n, 3) rad/s: P(T) - P(CALTEMP) + GYROFFS."""
    late = imu > 3
    prefix = f"INS{imu}_TCAL_" if late else f"INS_TCAL{imu}_"
    offset = f"INS{imu}_GYROFFS_" if late else f"INS_GYR{'' if imu == 1 else imu}OFFS_"
    low, high = values[f"{prefix}TMIN"], values[f"{prefix}TMAX"]
    temperatures_c = _temperatures(low, high)
    at = float(np.clip(values[f"INS{imu}_GYR_CALTEMP" if late else f"INS_GYR{imu}_CALTEMP"], low, high))

    def cubic(temperature_c: Array, axis: str) -> Array:
        d = temperature_c - REFERENCE_C
        return np.sum([values[f"{prefix}GYR{power}_{axis}"] * SCALE * d**power for power in (1, 2, 3)], axis=0)

    bias = [cubic(temperatures_c, axis) - cubic(np.array([at]), axis) + values[f"{offset}{axis}"] for axis in "XYZ"]
    return temperatures_c, np.column_stack(bias)


IMPORTER = Importer("parameters of PX4 or ArduPilot with a gyro's thermal calibration", probe, read, ParameterOptions)
