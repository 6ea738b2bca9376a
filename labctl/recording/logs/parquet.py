"""Parquet files with columns of any names as a table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.column_map.names import name_says
from labctl.recording.data_files.parquet import MAGIC, is_boolean, read_parquet
from labctl.recording.importer import TableImporter, TableOptions
from labctl.recording.logs.recognition import head_of
from labctl.recording.raw_table import RawColumn, RawTable
from labctl.recording.unread import share_text

#: No instrument gives a number above this; random bits do.
LARGEST_NUMBER = 1e30
#: Zeros in a row that no noise gives, among readings of which more than this share differ from each other.
MIN_ZEROS, MIN_DISTINCT_SHARE = 64, 0.5


def probe(path: Path) -> float:
    """Return 0.9 for a file that begins as Parquet files do."""
    if not path.is_file():
        return 0.0
    with path.open("rb") as file:
        return 0.9 if file.read(len(MAGIC)) == MAGIC else 0.0


def read(path: Path, _: TableOptions) -> RawTable:
    """Return the table of a Parquet file; raises BadRecording naming file, column and row."""
    head_of(path)
    types: dict[str, pa.DataType] = {}
    columns = read_parquet(
        path, lambda schema: types.update({each.name: each.type for each in schema}), with_stamps=True
    )
    _refuse_damaged_values(path, columns)
    rows = len(next(iter(columns.values()), ()))
    return RawTable(
        path,
        {name: _column(name, values, types[name]) for name, values in columns.items()},
        rows,
    )


def _refuse_damaged_values(path: Path, columns: Mapping[str, NDArray[np.generic]]) -> None:
    """Raise BadRecording for numbers that no instrument gives: pages without a checksum show damage by nothing else."""
    for name, values in columns.items():
        if values.dtype.kind == "f" and (odd := np.isfinite(values) & (np.abs(values) > LARGEST_NUMBER)).any():
            rows = np.flatnonzero(odd) + 1
            raise BadRecording(
                f"{path}: column {name[:80]!r}, rows {rows[0]} to {rows[-1]}: {share_text(len(rows) / len(values))} of "
                f"the numbers are larger than {LARGEST_NUMBER:g}, which damage leaves; write or copy the file again"
            )
        if values.dtype.kind == "f" and _varies(name) and (zeros := _zeroed(values)) is not None:
            raise BadRecording(
                f"{path}: column {name[:80]!r}, rows {zeros[0] + 1} to {zeros[1]}: {zeros[1] - zeros[0]} exact zeros "
                "in a row among readings that differ from each other, as an erased page leaves them; write or copy the "
                "file again, or leave these rows out"
            )


def _varies(name: str) -> bool:
    """Whether readings under a name vary by noise, so that long runs of them are never exactly 0."""
    return name_says(name).target.startswith(("gyro_", "accel_", "field_", "temperature_", "t_s"))


def _zeroed(values: NDArray[np.generic]) -> tuple[int, int] | None:
    """Return the longest run of exact zeros as (first row, row after the last), from 0; None where it is no damage.

    Readings in coarse steps are 0 by chance, and a column without use is 0 everywhere: of both most values are equal.
    """
    is_zero = values == 0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_zero, [False]]).astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return None
    longest = int(np.argmax(ends - starts))
    first, after = int(starts[longest]), int(ends[longest])
    others = np.concatenate([values[:first], values[after:]])
    if after - first < MIN_ZEROS or len(others) < MIN_ZEROS:
        return None
    return (first, after) if len(np.unique(others)) > MIN_DISTINCT_SHARE * len(others) else None


def _column(name: str, values: np.ndarray, kind: pa.DataType) -> RawColumn:
    if values.dtype.kind == "U":
        return RawColumn(name, np.full(len(values), np.nan), words=values.astype(np.str_))
    unit = "epoch ns" if pa.types.is_timestamp(kind) else ""
    return RawColumn(name, values.astype(np.float64), unit=unit, is_boolean=is_boolean(kind))


IMPORTER = TableImporter("a Parquet file", probe, read, TableOptions)
