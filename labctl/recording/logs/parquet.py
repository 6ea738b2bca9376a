"""Parquet files with columns of any names as a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from labctl.recording.data_files.parquet import MAGIC, is_boolean, read_parquet
from labctl.recording.importer import TableImporter, TableOptions
from labctl.recording.logs.recognition import head_of
from labctl.recording.raw_table import RawColumn, RawTable


def probe(path: Path) -> float:
    """Return 0.9 for a file that begins as Parquet files do."""
    if not path.is_file():
        return 0.0
    with path.open("rb") as file:
        return 0.9 if file.read(len(MAGIC)) == MAGIC else 0.0


def read(path: Path, _: TableOptions) -> RawTable:
    """Return the table of a Parquet file; raises BadRecording naming file, column and row."""
    head_of(path)
    booleans: list[str] = []
    columns = read_parquet(path, lambda schema: booleans.extend(f.name for f in schema if is_boolean(f.type)))
    rows = len(next(iter(columns.values()), ()))
    return RawTable(
        path,
        {name: _column(name, values, is_boolean=name in booleans) for name, values in columns.items()},
        rows,
    )


def _column(name: str, values: np.ndarray, *, is_boolean: bool) -> RawColumn:
    if values.dtype.kind == "U":
        return RawColumn(name, np.full(len(values), np.nan), words=values.astype(np.str_))
    return RawColumn(name, values.astype(np.float64), is_boolean=is_boolean)


IMPORTER = TableImporter("a Parquet file", probe, read, TableOptions)
