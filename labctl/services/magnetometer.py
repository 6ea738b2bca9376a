"""Hard and soft iron of a magnetometer from a table of its readings, as a response."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from labctl.errors import BadInput, BadRecording
from labctl.fitting.magnetometer.calibrate import AXES, MOST_LEFT_OUT, Magnetometer, calibrate_magnetometer
from labctl.fitting.magnetometer.ellipsoid import PLACES
from labctl.recording.data_files import read_table
from labctl.services.schemas.reports.magnetometer import Estimate, MagnetometerResponse
from labctl.services.table_readings import numbers_of

#: Units of readings, in uT.
UNITS_UT = {"uT": 1.0, "nT": 1e-3, "mT": 1e3, "T": 1e6, "gauss": 100.0, "mgauss": 0.1}
COLUMNS = ("mag_x", "mag_y", "mag_z")


@dataclass(frozen=True)
class Source:
    """How a table of readings is read."""

    columns: Sequence[str] = COLUMNS  #: x, y and z
    unit: str = "uT"
    field_ut: float | None = None  #: size of the local field

    @property
    def text(self) -> str:
        """What was read, in one line."""
        given = "" if self.field_ut is None else f", field {self.field_ut:g} uT"
        return f"columns {', '.join(self.columns)} in {self.unit}{given}"


def magnetometer_of_file(path: Path, source: Source) -> MagnetometerResponse:
    """Return the calibration of a table's readings, in order of time. Raises BadInput, BadRecording, NotEnoughData."""
    columns, unit, field_ut = source.columns, source.unit, source.field_ut
    if unit not in UNITS_UT:
        raise BadInput(f"--unit {unit}: give one of {', '.join(UNITS_UT)}")
    if field_ut is not None and not (np.isfinite(field_ut) and field_ut > 0):
        raise BadInput(f"--field-ut {field_ut:g}: give the size of the local field in uT, such as 49.2")
    if not path.is_file():
        raise BadRecording(f"{path}: not found; name a CSV or Parquet file with the readings of a magnetometer")
    if len(columns) != len(AXES):
        raise BadInput(f"--columns {','.join(columns)}: name three columns, of x, y and z")
    readings = UNITS_UT[unit] * numbers_of(path, read_table(path), columns, "the three columns")
    result = calibrate_magnetometer(str(path), readings, field_ut)
    return _response(result, given=field_ut is not None)


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
