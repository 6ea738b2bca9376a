"""Data files to columns and back: Parquet and CSV, with the file, the column and the row in every complaint.

Both are read in pieces, and a file that holds more than `limits` allow is refused before its values are.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.data_files.parquet import read_parquet, refuse_booleans
from labctl.recording.data_files.row_ranges import layout_of, table_of
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
    table = table_of(columns)
    if path.suffix == ".parquet":
        pq.write_table(table, path, **layout_of(table.schema))
    else:
        pacsv.write_csv(table, path)
