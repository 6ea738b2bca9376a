"""Parquet files whose footers say much about few bytes."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

TAIL = 8  #: bytes of the footer's length and the magic word


def write_constant_rows(path: Path, group_rows: int, groups: int) -> None:
    """Write a file of `groups` row groups of constant rows. All of them are the same bytes, so the file stays small."""
    number, zero = pa.array(np.ones(group_rows, dtype=np.int64)), pa.array(np.zeros(group_rows))
    names = ["dataset", "t_s", "table_rate_dps", "temperature_c", "gyro_z"]
    pq.write_table(pa.table([number, zero, zero, zero, zero], names=names), path, compression="zstd")
    metadata = pq.read_metadata(path)
    for _ in range(groups - 1):
        metadata.append_row_groups(pq.read_metadata(path))
    footer = io.BytesIO()
    metadata.write_metadata_file(footer)
    pages = path.read_bytes()
    path.write_bytes(pages[: -TAIL - int.from_bytes(pages[-TAIL:-4], "little")] + footer.getvalue()[4:])
