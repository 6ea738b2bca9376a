"""Allan deviation of a unit's newest record at rest, or of a file: a recording, or a table with a column of times."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recordings import AllanResponse
from labctl.errors import BadInput, BadRecording, NotEnoughData
from labctl.fitting.data.static_record import ONE_TEMPERATURE_K, StaticRecord, static_record, stretch_of
from labctl.fitting.numeric.allan import MIN_READINGS, Allan, allan
from labctl.recording import Recording, read_recording
from labctl.recording.column_map import ColumnMap
from labctl.recording.data_files import read_table
from labctl.recording.recording import Columns, temperature_of
from labctl.recording.verification import fitted_part
from labctl.services.recordings.allan import allan_unit
from labctl.services.recordings.importers import as_interchange
from labctl.services.recordings.loading import newest_row
from labctl.store import Store

#: Files that are read as they are, a header and columns, where no recording.toml says more.
TABLES = frozenset({".csv", ".parquet"})


def allan_of_unit(store: Store, serial: str, recording: int | None, column: str | None) -> AllanResponse:
    """Return the Allan deviation of a unit's recording (default: the newest), or of one column of it.

    Raises NotFound, BadInput, NotEnoughData.
    """
    row = newest_row(store, serial, recording, to_fit=True)
    if column is None:
        return allan_unit(store, row.id, None)
    info = row.recording_info
    parts = [columns for _, columns in store.recordings.iter_datasets(row.id)]
    _refuse_unknown(f"recording {row.id}", column, parts[0] if parts else {})
    joined_columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return _of_recording(Recording(info, joined_columns), column, row.id)


def allan_of_recordings(
    store: Store, serial: str, recordings: Sequence[int], column: str | None
) -> list[AllanResponse]:
    """Return the Allan deviations of several recordings of a unit, or of its newest, to lay them over each other.

    Raises NotFound, BadInput, NotEnoughData, each naming the recording.
    """
    return [allan_of_unit(store, serial, number, column) for number in dict.fromkeys(recordings) or (None,)]


def allan_of_file(
    path: Path,
    column: str | None,
    *,
    column_map: ColumnMap | None = None,
    importer: str | None = None,
    options: Sequence[str] = (),
) -> AllanResponse:
    """Return the Allan deviation of a file: a folder or file that can be imported, or a table with a column `t_s`.

    With a map, or an importer by name with its options, it is read as an import would read it. Raises BadRecording,
    BadInput, NotEnoughData.
    """
    as_it_is = column_map is None and importer is None and not options
    if as_it_is and path.is_file() and path.suffix in TABLES:
        return _of_table(path, read_table(path), column)
    with as_interchange(path, importer, options, column_map) as folder:
        return _of_recording(read_recording(folder), column, None)


def _of_recording(recording: Recording, column: str | None, number: int | None) -> AllanResponse:
    if recording.info.kind != "samples":
        raise BadInput(
            f"{recording.info.serial}: the folder contains {recording.info.kind}, but an Allan deviation needs "
            "single readings; import the readings"
        )
    recording = fitted_part(recording)
    if column is None:
        record = static_record(recording)
        if record is None:
            raise NotEnoughData(
                f"{recording.info.serial}: no {MIN_READINGS} successive readings are at rest, at one temperature "
                "and without a gap; record the unit at rest"
            )
        return _answer(record, number, dict(recording.info.datasheet))
    _refuse_unknown(recording.info.serial, column, recording.columns)
    axis = column.removeprefix("gyro_")
    values = recording.gyro_dps(axis) if f"gyro_{axis}" == column else _floats(recording.columns[column])
    record = _of_course(recording.info.serial, {column: values}, recording.columns)
    return _answer(record, number, dict(recording.info.datasheet))


def _of_table(path: Path, columns: Columns, column: str | None) -> AllanResponse:
    if "t_s" not in columns:
        raise BadRecording(
            f"{path}: column 't_s' (time, s) is missing (the columns are {', '.join(list(columns)[:12])}); "
            "rename the column "
            "of times, or name a column map with --map"
        )
    names = [column] if column is not None else [name for name in columns if name.startswith("gyro_")]
    if not names:
        raise BadInput(
            f"{path}: no column name begins with gyro_; choose a column with --column ({', '.join(list(columns)[:12])})"
        )
    for name in names:
        _refuse_unknown(str(path), name, columns)
    record = _of_course(str(path), {name: _floats(columns[name]) for name in names}, columns)
    return _answer(record, None, {})


def _of_course(what: str, courses: dict[str, NDArray[np.float64]], columns: Columns) -> StaticRecord:
    """Return the noise of courses (n,) by the longest section at rest, at one temperature and without a gap."""
    t_s = _floats(columns["t_s"])
    spacing = float(np.median(np.diff(t_s))) if len(t_s) > 1 else 0.0
    if not spacing > 0:
        raise BadRecording(
            f"{what}: the times in column 't_s' do not increase (the median step is {spacing:g} s); check the column"
        )
    rows = stretch_of(columns)
    if rows is None:
        raise NotEnoughData(
            f"{what}: no section at rest, at one temperature (within {ONE_TEMPERATURE_K:g} K) and without a gap has "
            f"{MIN_READINGS} readings (it has {len(t_s)} readings in all); record the unit at rest for longer"
        )
    n = rows.stop - rows.start
    period_s = float((t_s[rows][-1] - t_s[rows][0]) / (n - 1))
    axes: dict[str, Allan] = {}
    for name, values in courses.items():
        if not np.all(np.isfinite(values[rows])):
            row = rows.start + int(np.argmin(np.isfinite(values[rows])))
            raise BadRecording(
                f"{what}: column {name!r}, row {row + 1}: {values[row]} is not a number; leave the row out"
            )
        if (noise := allan(values[rows], period_s)) is not None:
            axes[name] = noise
    if not axes:
        raise NotEnoughData(f"{what}: its readings are all equal, so the noise cannot be estimated; check the column")
    temperature_c = temperature_of(columns)
    mean_c = float("nan") if temperature_c is None else float(temperature_c[rows].mean())
    first, last = (
        int(np.asarray(columns["dataset"])[k]) if "dataset" in columns else 1 for k in (rows.start, rows.stop - 1)
    )
    return StaticRecord(first, last, mean_c, n * period_s, axes)


def _refuse_unknown(what: str, column: str, columns: Columns) -> None:
    if column not in columns:
        raise BadInput(f"{what}: there is no column {column!r}; choose one of {', '.join(list(columns)[:20])}")
    if np.asarray(columns[column]).dtype.kind not in "fiu":
        raise BadInput(f"{what}: column {column!r} holds text, not numbers; name another column")


def _floats(values: NDArray[np.generic]) -> NDArray[np.float64]:
    return np.asarray(values, dtype=np.float64)


def _answer(record: StaticRecord, recording: int | None, datasheet: dict[str, float]) -> AllanResponse:
    answer = {"recording": recording, "datasheet": datasheet, **record.to_json()}
    return AllanResponse.model_validate(answer, extra="forbid")
