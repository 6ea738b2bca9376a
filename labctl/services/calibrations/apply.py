"""Correcting a file of readings by a calibration file; no database."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv
import pyarrow.parquet as pq

from labctl.answers.calibrations import CompensationResponse
from labctl.calibration.certification import CalibrationWarning
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.numeric.arrays import Array
from labctl.recording.data_files import read_table
from labctl.recording.recording import Column


def compensate_file(calibration: Path, source: Path, target: Path, outside: str) -> CompensationResponse:
    """Write `source` with a corrected rate per axis and a flag; returns how many rows, and how many lay outside.

    Raises BadCalibrationFile, BadRecording, BadInput.
    """
    if outside not in {"clamp", "refuse"}:
        raise BadInput(f"--outside {outside!r} is not known; give clamp or refuse")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CalibrationWarning)  # the answer says it
        compensator = Compensator.from_file(calibration, outside=outside)  # type: ignore[arg-type]
    if not source.is_file():
        raise BadInput(f"{source}: no such file; check the path")
    columns = read_table(source)
    if target.resolve() == source.resolve():
        raise BadInput(f"{target}: this is the input; name another file for the result")
    if target.suffix not in {".csv", ".parquet"}:
        raise BadInput(f"{target}: the result is a table; name a file that ends in .csv or .parquet")
    thermometer = ("temperature_c",) if compensator.needs_temperature or "temperature_c" in columns else ()
    for name in (*(f"gyro_{axis}" for axis in compensator.axes), *thermometer, *compensator.needs):
        if name not in columns:
            raise BadInput(
                f"{source}: column {name!r} is missing; add it (the calibration has axes {compensator.axes})"
            )
    raw = np.column_stack([_floats(columns[f"gyro_{axis}"]) for axis in compensator.axes])
    force_g, left_out = _specific_force(compensator, columns)
    corrected = compensator.compensate_output(
        raw,
        _floats(columns["temperature_c"]) if thermometer else None,
        {name: _floats(columns[name]) for name in compensator.needs},
        specific_force_g=force_g,
    )
    for index, axis in enumerate(compensator.axes):
        columns[f"rate_{axis}_dps"] = corrected.rate_dps[:, index]
    columns["outside"] = corrected.outside.astype(np.int64)
    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    if target.suffix == ".parquet":
        pq.write_table(table, target)
    else:
        pacsv.write_csv(table, target)
    return CompensationResponse(
        rows=len(raw), outside=int(corrected.outside.sum()), file=str(target), warning=compensator.warning,
        left_out=left_out,
    )  # fmt: skip


def _specific_force(compensator: Compensator, columns: Mapping[str, Column]) -> tuple[Array | None, str]:
    """Return forces (n, 3) g of a file, None without them, and what is therefore not corrected; empty: nothing.

    A column that no coefficient needs may be missing.
    """
    force = compensator.force_sensitivity
    if force is None:
        return None, ""
    lacking = [f"accel_{axis}_g" for axis in force.needs if f"accel_{axis}_g" not in columns]
    if lacking:
        return None, f"column {', '.join(lacking)} is missing: {force.sentence()}"
    n = len(next(iter(columns.values())))
    force_columns = [_floats(columns[f"accel_{axis}_g"]) if axis in force.needs else np.zeros(n) for axis in BODY_AXES]
    return np.column_stack(force_columns), ""


def _floats(column: Column) -> Array:
    return np.asarray(column, dtype=np.float64)
