"""Hard and soft iron of a magnetometer from a table of its readings, as a response."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.answers.magnetometer import Estimate, MagnetometerResponse
from labctl.answers.poses import AccelerometerCoefficient, FieldAlignmentJson
from labctl.errors import BadInput, BadRecording, NotEnoughData
from labctl.fitting.magnetometer.alignment import FieldAlignment, align_field
from labctl.fitting.magnetometer.calibrate import AXES, MAX_LEFT_OUT, Magnetometer, calibrate_magnetometer
from labctl.fitting.magnetometer.ellipsoid import PLACES
from labctl.fitting.poses.at_rest.rests import find_rests, rest_of_each
from labctl.fitting.poses.readings import PoseReadings, readings_of
from labctl.probability_text import share_text
from labctl.recording.data_files import read_table
from labctl.recording.files import read_recording
from labctl.services.pose_triads import Earlier, require_one, solved_of
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
    temperature: str | None = None  #: where the accelerometer of a recording is fitted over it; None: it is not
    earlier: Earlier | None = None  #: version of the unit's accelerometer that the alignment uses too

    @property
    def text(self) -> str:
        """What was read, in one line."""
        field_text = "" if self.field_ut is None else f", field {self.field_ut:g} uT"
        return f"columns {', '.join(self.columns)} in {self.unit}{field_text}{self.levels}"

    @property
    def levels(self) -> str:
        """What tells the accelerometer beside the poses, after a comma; empty: nothing."""
        if self.temperature is not None:
            return ", accelerometer over temperature"
        return "" if self.earlier is None else f", with version {self.earlier.version} of the accelerometer"


def magnetometer_of_file(path: Path, source: Source, serial: str | None = None) -> MagnetometerResponse:
    """Return the calibration of the readings of a table, in order of time, or of a recording in poses.

    `serial` is the unit's serial number where it is known: a recording of another unit is refused. Raises BadInput,
    BadRecording, NotEnoughData.
    """
    require_one(source.temperature, source.earlier)
    columns, unit, field_ut = source.columns, source.unit, source.field_ut
    if unit not in UNITS_UT:
        raise BadInput(f"--unit {unit}: give one of {', '.join(UNITS_UT)}")
    if field_ut is not None and not (np.isfinite(field_ut) and field_ut > 0):
        raise BadInput(f"--field-ut {field_ut:g}: give the size of the local field in uT, such as 49.2")
    if path.is_dir():
        return _of_recording(path, source, serial)
    if not path.is_file():
        raise BadRecording(
            f"{path}: not found; name a CSV or Parquet file with the readings of a magnetometer, or the folder of a "
            "recording in poses"
        )
    if source.temperature is not None or source.earlier is not None:
        option = "--earlier" if source.temperature is None else "--temperature"
        raise BadInput(
            f"{path}: {option} is for the alignment, which a table of a magnetometer's readings does not tell; name "
            "the folder of a recording in poses, or leave it out"
        )
    if len(columns) != len(AXES):
        raise BadInput(f"--columns {','.join(columns)}: name three columns, of x, y and z")
    readings = UNITS_UT[unit] * numbers_of(path, read_table(path), columns, "the three columns")
    result = calibrate_magnetometer(str(path), readings, field_ut)
    return _response(result, has_field=field_ut is not None)


def _of_recording(path: Path, source: Source, serial: str | None) -> MagnetometerResponse:
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
    magnetometer = calibrate_magnetometer(recording.info.serial, field, source.field_ut, _rests(readings))
    return _with_alignment(
        _response(magnetometer, has_field=source.field_ut is not None), readings, field, magnetometer, source
    )


def _rests(readings: PoseReadings) -> NDArray[np.int64] | None:
    """Return the number of the rest of each reading; None where nothing rests."""
    try:
        return rest_of_each(find_rests(readings), len(readings), readings.spacing_s)
    except NotEnoughData:
        return None


def _with_alignment(
    answer: MagnetometerResponse, readings: PoseReadings, field: NDArray[np.float64], magnetometer: Magnetometer,
    source: Source,
) -> MagnetometerResponse:  # fmt: skip
    try:
        solved = solved_of(readings, source.earlier, over_temperature=source.temperature is not None)
        aligned = align_field(readings, solved, field, magnetometer)
    except NotEnoughData as error:
        sentence = f"Alignment of the magnetometer: unknown: {error}"
        return answer.model_copy(update={"text": [sentence, *answer.text]})
    angles = ", ".join(
        f"{value:.2f} +- {expanded:.2f}"
        for value, expanded in zip(np.degrees(aligned.angles_rad), np.degrees(aligned.expanded_rad[:3]), strict=True)
    )
    sentence = (
        f"Magnetometer turned from the accelerometer's axes about x, y, z by {angles} deg (U, 95.45 %{source.levels}); "
        f"the field dips by {np.degrees(aligned.dip_rad):.1f} deg."
    )
    # the last sentence is that of the verdict, which a refusal of an export cites
    return answer.model_copy(update={"alignment": _alignment(aligned), "text": [sentence, *answer.text]})


def _alignment(alignment: FieldAlignment) -> FieldAlignmentJson:
    values = np.degrees(np.append(alignment.angles_rad, alignment.dip_rad))
    u = np.degrees(alignment.u_rad)
    each: list[AccelerometerCoefficient] = [
        {
            "value": float(values[i]),
            "u": float(u[i]),
            "unit": "deg",
            "degrees_of_freedom": float(alignment.u_freedom[i]),
        }
        for i in range(len(values))
    ]
    return {
        "axes": dict(zip(AXES, each, strict=False)),
        "dip": each[-1],
        "covariance_deg2": (alignment.covariance * np.degrees(1.0) ** 2).tolist(),
        "place_deg": float(np.degrees(alignment.place_rad)), "rests": alignment.rests, "moves": alignment.moves,
        "definition": ALIGNMENT,
    }  # fmt: skip


def _response(result: Magnetometer, *, has_field: bool) -> MagnetometerResponse:

    def estimate(value: float, place: int) -> Estimate:
        freedom = float(result.u_freedom[place])
        return Estimate(value=float(value), u=float(result.u[place]), degrees_of_freedom=freedom)

    hard = {axis: estimate(result.hard_iron_ut[i], i) for i, axis in enumerate(AXES)}
    soft = {f"{AXES[i]}{AXES[j]}": estimate(result.soft_iron[i, j], 3 + k) for k, (i, j) in enumerate(PLACES)}
    field = Estimate(value=result.field_ut, u=None) if has_field else estimate(result.field_ut, 9)
    return MagnetometerResponse(
        verdict=result.verdict, hard_iron_ut=hard, soft_iron=soft,
        field_ut=field,
        covariance=result.covariance.tolist(), readings=len(result.used), left_out=int((~result.used).sum()),
        before_ut=result.before_ut, residual_ut=result.residual_ut, heldout_ut=result.heldout_ut,
        noise_ut=result.noise_ut, repetition=result.repetition, heading_error_deg=result.heading_error_deg,
        largest_gap_deg=result.largest_gap_deg, text=list(_text(result, has_field=has_field)),
    )  # fmt: skip


def _text(result: Magnetometer, *, has_field: bool) -> Iterator[str]:
    worst = float(result.u[:3].max())
    size = "given" if has_field else "by the readings, with a soft iron of determinant 1"
    yield f"Magnetometer: hard iron with u up to {worst:.2g} uT; field {result.field_ut:.4g} uT, {size}."
    yield (
        f"Size of the field: scatter {result.before_ut:.3g} uT before, {result.heldout_ut:.2g} uT after, of readings "
        f"that were left out; the direction of a single reading is off by about {result.heading_error_deg:.2g} deg."
    )
    if result.verdict == "adequate":
        return
    if result.left_out_share > MAX_LEFT_OUT:
        yield (
            f"{share_text(result.left_out_share)} of the readings are on no ellipsoid with the others: the field was "
            "disturbed while the unit turned"
        )
    else:
        yield (
            f"what is left is {result.heldout_ut / result.noise_ut:.1f} times the noise from one reading to the next, "
            f"and alike over {result.repetition:.0f} readings: the field was not constant in place or time, or the "
            "output is not linear"
        )
