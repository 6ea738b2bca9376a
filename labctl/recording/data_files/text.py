"""A CSV file as columns. Everything is read as text first, so that a complaint can name the row."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.data_files.last_line import cut_last_line
from labctl.recording.data_files.limits import VALUE_BYTES, Space, checked_names, refuse_too_many
from labctl.recording.data_files.values import ColumnValues

#: The longest header that is read.
MAX_HEADER_BYTES = 1 << 16


def read_csv(path: Path) -> dict[str, NDArray[np.generic]]:
    """Read a CSV file into named columns, block by block; raises BadRecording naming file, column and row."""
    names = _header(path)
    checked_names(path, names)
    space = Space(path)
    columns = [ColumnValues(path, name, space) for name in names]
    options = pacsv.ConvertOptions(
        column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False, quoted_strings_can_be_null=False
    )
    layout = pacsv.ReadOptions(column_names=names, skip_rows=1)
    rows = 0
    try:
        with pacsv.open_csv(path, read_options=layout, convert_options=options) as blocks:
            for block in blocks:
                rows += block.num_rows
                refuse_too_many(path, rows, len(names))
                for column, values in zip(columns, block.columns, strict=True):
                    if column.kind in {"integer", "number"}:
                        space.take(column.name, len(values) * VALUE_BYTES)
                    column.add(values)
    except pa.ArrowInvalid as error:
        first = str(error).splitlines()[0]
        if "UTF8" in first:
            raise BadRecording(f"{path}: not UTF-8 text after row {rows}, write it as UTF-8: {first[:300]}") from error
        raise BadRecording(
            f"{path}: {first[:300]}; expected {len(names)} columns in each row, "
            "'.' as decimal point, ',' only between columns"
        ) from error
    if rows == 0:
        raise BadRecording(f"{path}: no rows below the header; expected at least one")
    columns_read = {column.name: column.whole() for column in columns}
    if (cut := cut_last_line(path, "utf-8", ",")) is not None:
        raise BadRecording(f"{path}: {cut.text}; write the file again or remove its last line")
    return columns_read


def _header(path: Path) -> list[str]:
    with path.open("rb") as file:
        line = re.split(rb"[\r\n]", file.read(MAX_HEADER_BYTES + 1), maxsplit=1)[0]
    if len(line) > MAX_HEADER_BYTES:
        raise BadRecording(
            f"{path}: the first line is longer than {MAX_HEADER_BYTES} bytes; expected a text file that begins with a "
            "line of column names; check that this is the right file"
        )
    try:
        header = line.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadRecording(
            f"{path}: not UTF-8 text, write it as UTF-8: {error.reason} at byte {error.start}"
        ) from error
    if ";" in header and "," not in header:
        raise BadRecording(f"{path}: columns are separated by ';'; expected ',' between columns and '.' in numbers")
    return [name.strip().strip('"') for name in header.split(",")]
