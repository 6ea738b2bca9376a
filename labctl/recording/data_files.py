"""Data files to columns and back: Parquet and CSV, with the file, the column and the row in every complaint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.columns import BY_NAME, Kind
from labctl.recording.recording import Columns


def read_table(path: Path) -> dict[str, NDArray[Any]]:
    """Read a .parquet or .csv file into named columns; raises BadRecording naming file, column and row."""
    if path.stat().st_size == 0:
        raise BadRecording(f"{path}: the file is empty; expected a header and at least one row")
    table = _parquet(path) if path.suffix == ".parquet" else _csv(path)
    doubled = {name for name in table.column_names if table.column_names.count(name) > 1}
    if doubled:
        raise BadRecording(f"{path}: column {min(doubled)!r} stands more than once in the header")
    if table.num_rows == 0:
        raise BadRecording(f"{path}: no rows below the header; expected at least one")
    return {name: _column(path, name, table.column(name)) for name in table.column_names}


def write_table(columns: Columns, path: Path) -> None:
    """Write columns as a .parquet or .csv file."""
    table: Any = pa.table({name: pa.array(values) for name, values in columns.items()})
    if path.suffix == ".parquet":
        floats = [name for name in table.column_names if pa.types.is_floating(table.schema.field(name).type)]
        others = [name for name in table.column_names if name not in floats]
        pq.write_table(table, path, compression="zstd", use_dictionary=others, use_byte_stream_split=floats)
    else:
        pacsv.write_csv(table, path)


def _parquet(path: Path) -> pa.Table:
    try:
        return pq.read_table(path)
    except (pa.ArrowInvalid, pa.ArrowIOError, OSError, EOFError) as error:
        first = str(error).splitlines()[0]
        raise BadRecording(f"{path}: not a whole Parquet file (truncated?): {first}") from error


def _csv(path: Path) -> pa.Table:
    """Read everything as text first, so that a complaint can name the row; numbers are converted column by column."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            header = file.readline().rstrip("\r\n")
    except UnicodeDecodeError as error:
        raise BadRecording(f"{path}: not UTF-8 text: {error.reason} at byte {error.start}") from error
    if ";" in header and "," not in header:
        raise BadRecording(f"{path}: columns are separated by ';'; expected ',' between columns and '.' in numbers")
    names = [name.strip().strip('"') for name in header.split(",")]
    options = pacsv.ConvertOptions(
        column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False, quoted_strings_can_be_null=False
    )
    try:
        return pacsv.read_csv(
            path, read_options=pacsv.ReadOptions(column_names=names, skip_rows=1), convert_options=options
        )
    except pa.ArrowInvalid as error:
        first = str(error).splitlines()[0]
        raise BadRecording(
            f"{path}: {first}; expected {len(names)} columns in each row, "
            "'.' as decimal point, ',' only between columns"
        ) from error


def _column(path: Path, name: str, column: pa.ChunkedArray) -> NDArray[Any]:
    kind: Kind | None = BY_NAME[name].kind if name in BY_NAME else None
    if kind == "text":
        return np.asarray(column.cast(pa.string()).to_pylist(), dtype=np.str_)
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        return _numbers_from_text(path, name, column, kind)
    if kind == "integer":
        return _integers(path, name, column)
    if column.null_count:
        column = pc.fill_null(column.cast(pa.float64()), float("nan"))
    return np.asarray(column.cast(pa.float64()).to_numpy(), dtype=np.float64)


def _numbers_from_text(path: Path, name: str, column: pa.ChunkedArray, kind: Kind | None) -> NDArray[Any]:
    text = pc.utf8_trim_whitespace(column)
    empty = pc.or_(pc.equal(text, ""), pc.equal(pc.utf8_lower(text), "nan"))
    filled = pc.if_else(empty, "nan", text)
    try:
        values = np.asarray(filled.cast(pa.float64()).to_numpy(), dtype=np.float64)
    except pa.ArrowInvalid:
        if kind is None:  # an extra column of words is kept as words
            return np.asarray(text.to_pylist(), dtype=np.str_)
        _refuse_text(path, name, filled)
    return _whole(path, name, values) if kind == "integer" else values


def _refuse_text(path: Path, name: str, text: pa.ChunkedArray) -> None:
    for row, word in enumerate(text.to_pylist(), start=1):
        try:
            float(word)
        except ValueError:
            hint = "; write a decimal point, not a comma" if "," in word else ""
            raise BadRecording(
                f"{path}: column {name!r}, row {row}: {word!r} is not a number (expected {_expected(name)}){hint}"
            ) from None


def _expected(name: str) -> str:
    column = BY_NAME.get(name)
    return f"{column.meaning}, {column.unit}" if column and column.unit else (column.meaning if column else "a number")


def _integers(path: Path, name: str, column: pa.ChunkedArray) -> NDArray[np.int64]:
    if column.null_count:
        row = int(np.argmax(np.asarray(column.is_null()))) + 1
        raise BadRecording(f"{path}: column {name!r}, row {row}: empty (expected a whole number)")
    return _whole(path, name, np.asarray(column.cast(pa.float64()).to_numpy(), dtype=np.float64))


def _whole(path: Path, name: str, values: NDArray[np.float64]) -> NDArray[np.int64]:
    bad = ~np.isfinite(values) | (values != np.round(values))
    if bad.any():
        row = int(np.argmax(bad))
        raise BadRecording(f"{path}: column {name!r}, row {row + 1}: {values[row]:g} is not a whole number")
    return values.astype(np.int64)
