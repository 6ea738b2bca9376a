"""A Parquet file that was written in parts, read a range of rows at a time."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.data_files.damaged_files import parsed_by_library
from labctl.recording.data_files.limits import MAX_UNPACKED_BYTES, checked_names
from labctl.recording.data_files.parquet import refuse_large_footer
from labctl.recording.data_files.values import holds_words
from labctl.recording.recording import Columns


def write_parts(parts: Iterable[Columns], path: Path) -> None:
    """Write tables of the same columns as one Parquet file, each in row groups of its own.

    Raises BadRecording for a part with other columns than the first, or where there is none.
    """
    remaining = iter(parts)
    first = next(remaining, None)
    if first is None:
        raise BadRecording(f"{path.name}: there are no rows to write; measure or import some first")
    table = table_of(first)
    with pq.ParquetWriter(path, table.schema, **layout_of(table.schema)) as writer:
        writer.write_table(table)
        for part in remaining:
            if sorted(part) != sorted(first):
                different = sorted(set(part) ^ set(first))
                raise BadRecording(
                    f"{path.name}: some data sets have the columns {', '.join(different)} and others do not, so that "
                    "they are no one table; use the database for this recording"
                )
            writer.write_table(table_of({name: part[name] for name in first}))


def table_of(columns: Columns) -> pa.Table:
    """Return columns as a table of Arrow."""
    return pa.table({name: pa.array(values) for name, values in columns.items()})


def layout_of(schema: pa.Schema) -> dict[str, object]:
    """Return the options by which a Parquet file of a recording is written."""
    floats = [field.name for field in schema if pa.types.is_floating(field.type)]
    return {
        "compression": "zstd",
        "use_dictionary": [name for name in schema.names if name not in floats],
        "use_byte_stream_split": floats,
        "write_page_checksum": True,
    }


class RowRanges:
    """A Parquet file of numbers and words; its values keep their kind: whole numbers, float64 or text."""

    def __init__(self, path: Path, advice: str = "write or copy it again") -> None:
        """Read the footer alone; `advice` says what to do about a file that is damaged. Raises BadRecording."""
        self._path, self._advice = path, advice
        with parsed_by_library(path, "Parquet file", advice):
            refuse_large_footer(path)
            with pq.ParquetFile(path) as opened:
                metadata, schema = opened.metadata, opened.schema_arrow
        checked_names(path, schema.names)
        self._words = [field.name for field in schema if holds_words(field.type)]
        for field in schema:
            if field.name not in self._words and field.type not in {pa.int64(), pa.float64()}:
                raise BadRecording(
                    f"{path}: column {field.name[:80]!r} holds {str(field.type)[:80]}; expected int64, double or "
                    f"string; {advice}"
                )
        groups = [metadata.row_group(index) for index in range(metadata.num_row_groups)]
        self._ends = [0, *np.cumsum([group.num_rows for group in groups], dtype=np.int64).tolist()]
        self._sizes = [group.total_byte_size for group in groups]
        self.rows = int(self._ends[-1])

    def read(self, start: int, stop: int) -> dict[str, NDArray[np.generic]]:
        """Return rows `start` to `stop` (excluded) by column. Raises BadRecording."""
        wanted = [i for i, (begin, end) in enumerate(pairwise(self._ends)) if begin < stop and end > start]
        size = sum(self._sizes[index] for index in wanted)
        if size > MAX_UNPACKED_BYTES:
            raise BadRecording(
                f"{self._path}: a data set has an unpacked size of {size / 1e6:g} MB; at most "
                f"{MAX_UNPACKED_BYTES / 1e6:g} MB are read; {self._advice}"
            )
        with (
            parsed_by_library(self._path, "Parquet file", self._advice),
            pq.ParquetFile(self._path, read_dictionary=self._words, page_checksum_verification=True) as opened,
        ):
            table = opened.read_row_groups(wanted, use_threads=False)
            first = self._ends[wanted[0]] if wanted else start
            table = table.slice(start - first, stop - start)
            return {name: self._values(table.column(name)) for name in table.column_names}

    def _values(self, column: pa.ChunkedArray) -> NDArray[np.generic]:
        if column.null_count:
            raise BadRecording(f"{self._path}: an empty value among {column.type}; expected none; {self._advice}")
        if not pa.types.is_dictionary(column.type):
            return np.asarray(column.to_numpy())
        parts = [(chunk.dictionary.to_pylist(), chunk.indices.to_numpy()) for chunk in column.chunks]
        if not any(len(indices) for _, indices in parts):
            return np.zeros(0, dtype=np.str_)
        return np.concatenate([np.array([*words], dtype=np.str_)[indices] for words, indices in parts if len(indices)])
