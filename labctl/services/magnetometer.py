"""Hard and soft iron of a magnetometer from a table of its readings, as a response."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput, BadRecording, NotEnoughData
from labctl.fitting.magnetometer.alignment import FieldAlignment, align_field
from labctl.fitting.magnetometer.calibrate import AXES, MOST_LEFT_OUT, Magnetometer, calibrate_magnetometer
from labctl.fitting.magnetometer.ellipsoid import PLACES
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.fit import solve
from labctl.fitting.poses.readings import PoseReadings, readings_of
from labctl.json_types.poses import FieldAlignmentJson
from labctl.recording.data_files import read_table
from labctl.recording.files import read_recording
from labctl.services.schemas.reports.magnetometer import Estimate, MagnetometerResponse
from labctl.services.table_readings import numbers_of

#: Units of readings, in uT.
UNITS_UT = {"uT": 1.0, "nT": 1e-3, "mT": 1e3, "T": 1e6, "gauss": 100.0, "mgauss": 0.1}
COLUMNS = ("mag_x", "mag_y", "mag_z")
ALIGNMENT = (
    "rotation vector from the axes of the corrected force and rate to those of the corrected field, about the former; "
    "dip: of the field below the horizontal"
)


@dataclass(frozen=True)
class Source:
    """How a table of readings is read; a recording says it itself."""

    columns: Sequence[str] = COLUMNS  #: x, y and z
    unit: str = "uT"
    field_ut: float | None = None  #: size of the local field

    @property
    def text(self) -> str:
        """What was read, in one line."""
        field_text = "" if self.field_ut is None else f", field {self.field_ut:g} uT"
        return f"columns {', '.join(self.columns)} in {self.unit}{field_text}"


def magnetometer_of_file(path: Path, source: Source, serial: str | None = None) -> MagnetometerResponse:
    """Return the calibration of the readings of a table, in order of time, or of a recording in poses.

    `serial` is the unit's serial number where it is known: a recording of another unit is refused. Raises BadInput,
    BadRecording, NotEnoughData.
    """
    columns, unit, field_ut = source.columns, source.unit, source.field_ut
    if unit not in UNITS_UT:
        raise BadInput(f"--unit {unit}: give one of {', '.join(UNITS_UT)}")
    if field_ut is not None and not (np.isfinite(field_ut) and field_ut > 0):
        raise BadInput(f"--field-ut {field_ut:g}: give the size of the local field in uT, such as 49.2")
    if path.is_dir():
        return _of_recording(path, field_ut, serial)
    if not path.is_file():
        raise BadRecording(
            f"{path}: not found; name a CSV or Parquet file with the readings of a magnetometer, or the folder of a "
            "recording in poses"
        )
    if len(columns) != len(AXES):
        raise BadInput(f"--columns {','.join(columns)}: name three columns, of x, y and z")
    readings = UNITS_UT[unit] * numbers_of(path, read_table(path), columns, "the three columns")
    result = calibrate_magnetometer(str(path), readings, field_ut)
    return _response(result, given=field_ut is not None)


def _of_recording(path: Path, field_ut: float | None, serial: str | None) -> MagnetometerResponse:
    """Return the calibration of a recording in poses, with the alignment where rests and turns determine it."""
    recording = read_recording(path)
    if serial is not None and recording.info.serial != serial:
        raise BadInput(
            f"{path}: this recording is of unit {recording.info.serial}, but --serial is {serial}; name its unit"
        )
    absent = [f"field_{a}_ut" for a in AXES if f"field_{a}_ut" not in recording.columns]
    if absent:
        raise BadRecording(
            f"{path}: this recording has no column {absent[0]}; record field_x_ut, field_y_ut and field_z_ut, uT, "
            "in every pose"
        )
    readings = readings_of(recording)
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=np.bool_)
    field = np.column_stack([np.asarray(columns[f"field_{a}_ut"], dtype=np.float64)[valid] for a in AXES])
    if not np.isfinite(field).all():
        row = int(np.flatnonzero(~np.isfinite(field).all(axis=1))[0])
        raise BadRecording(
            f"{path}: the field at t_s = {readings.t_s[row]:.6g} is not a number; mark such readings with valid = 0"
        )
    calibration = calibrate_magnetometer(recording.info.serial, field, field_ut)
    return _with_alignment(_response(calibration, given=field_ut is not None), readings, field, calibration)


def _with_alignment(
    answer: MagnetometerResponse, readings: PoseReadings, field: NDArray[np.float64], magnetometer: Magnetometer
) -> MagnetometerResponse:
    try:
        aligned = align_field(readings, solve(readings), field, magnetometer)
    except NotEnoughData as error:
        text = f"Alignment of the magnetometer: unknown: {error}"
        return answer.model_copy(update={"text": [text, *answer.text]})
    angles = ", ".join(
        f"{value:.2f} +- {2 * u:.2f}"
        for value, u in zip(np.degrees(aligned.angles_rad), np.degrees(aligned.u_rad[:3]), strict=True)
    )
    text = (
        f"Magnetometer turned from the accelerometer's axes about x, y, z by {angles} deg (U, k = 2); the field dips "
        f"by {np.degrees(aligned.dip_rad):.1f} deg."
    )
    # the last sentence is that of the verdict, which a refusal of an export cites
    return answer.model_copy(update={"alignment": _alignment(aligned), "text": [text, *answer.text]})


def _alignment(field: FieldAlignment) -> FieldAlignmentJson:
    angles: Array = np.degrees(field.angles_rad)
    u = np.degrees(field.u_rad)
    return {
        "axes": {axis: {"value": float(angles[i]), "u": float(u[i]), "unit": "deg"} for i, axis in enumerate(AXES)},
        "dip": {"value": float(np.degrees(field.dip_rad)), "u": float(u[3]), "unit": "deg"},
        "covariance_deg2": (field.covariance * np.degrees(1.0) ** 2).tolist(),
        "place_deg": float(np.degrees(field.place_rad)), "rests": field.rests, "moves": field.moves,
        "definition": ALIGNMENT,
    }  # fmt: skip


def _response(result: Magnetometer, *, given: bool) -> MagnetometerResponse:
    u = result.u
    hard = {axis: Estimate(value=float(value), u=float(u[i])) for i, (axis, value) in
            enumerate(zip(AXES, result.hard_iron_ut, strict=True))}  # fmt: skip
    soft = {
        f"{AXES[i]}{AXES[j]}": Estimate(value=float(result.soft_iron[i, j]), u=float(u[3 + k]))
        for k, (i, j) in enumerate(PLACES)
    }
    return MagnetometerResponse(
        verdict=result.verdict, hard_iron_ut=hard, soft_iron=soft,
        field_ut=Estimate(value=result.field_ut, u=None if given else float(u[9])),
        covariance=result.covariance.tolist(), readings=len(result.used), left_out=int((~result.used).sum()),
        before_ut=result.before_ut, residual_ut=result.residual_ut, heldout_ut=result.heldout_ut,
        noise_ut=result.noise_ut, repetition=result.repetition, heading_error_deg=result.heading_error_deg,
        largest_gap_deg=result.largest_gap_deg, text=list(_text(result, given=given)),
    )  # fmt: skip


def _text(result: Magnetometer, *, given: bool) -> Iterator[str]:
    worst = float(result.u[:3].max())
    size = "given" if given else "by the readings, with a soft iron of determinant 1"
    yield f"Magnetometer: hard iron with u up to {worst:.2g} uT; field {result.field_ut:.4g} uT, {size}."
    yield (
        f"Size of the field: scatter {result.before_ut:.3g} uT before, {result.heldout_ut:.2g} uT after, of readings "
        f"that were left out; the direction of a single reading is off by about {result.heading_error_deg:.2g} deg."
    )
    if result.verdict == "adequate":
        return
    if result.left_out_share > MOST_LEFT_OUT:
        yield (
            f"{100 * result.left_out_share:.0f} % of the readings are on no ellipsoid with the others: the field was "
            "disturbed while the unit turned"
        )
    else:
        yield (
            f"what is left is {result.heldout_ut / result.noise_ut:.1f} times the noise from one reading to the next, "
            f"and alike over {result.repetition:.0f} readings: the field was not constant in place or time, or the "
            "output is not linear"
        )
