"""Data files to columns and back: Parquet and CSV, with the file, the column and the row in every complaint.

Both are read in pieces, and a file that holds more than `limits` allow is refused before its values are.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.data_files.parquet import read_parquet, refuse_booleans
from labctl.recording.data_files.text import read_csv
from labctl.recording.recording import Columns


def read_table(path: Path) -> dict[str, NDArray[np.generic]]:
    """Read a .parquet or .csv file into named columns; raises BadRecording naming file, column and row."""
    if path.stat().st_size == 0:
        raise BadRecording(f"{path}: the file is empty; expected a header and at least one row")
    if path.suffix == ".parquet":
        return read_parquet(path, partial(refuse_booleans, path))
    return read_csv(path)


def write_table(columns: Columns, path: Path) -> None:
    """Write columns as a .parquet or .csv file."""
    table: Any = pa.table({name: pa.array(values) for name, values in columns.items()})
    if path.suffix == ".parquet":
        floats = [name for name in table.column_names if pa.types.is_floating(table.schema.field(name).type)]
        other_columns = [name for name in table.column_names if name not in floats]
        pq.write_table(
            table,
            path,
            compression="zstd",
            use_dictionary=other_columns,
            use_byte_stream_split=floats,
            write_page_checksum=True,
        )
    else:
        pacsv.write_csv(table, path)
