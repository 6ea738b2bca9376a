"""A Parquet file as columns: its footer first, which states the unpacked size, then rows in pieces."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.columns import BY_NAME, holds_flags
from labctl.recording.data_files.damaged_files import parsed_by_library
from labctl.recording.data_files.limits import VALUE_BYTES, Space, checked_names, refuse_too_large, refuse_too_many
from labctl.recording.data_files.values import ColumnValues, holds_words

#: Rows that are unpacked at a time.
PIECE_ROWS = 1 << 16
#: Bytes that are read at a time from each column of a row group.
BUFFER_BYTES = 1 << 20
#: Above this, no footer of so few columns is one: 256 columns of 100,000 rows a group need a tenth of it.
MAX_FOOTER_BYTES = 16 << 20
MAGIC = b"PAR1"


def read_parquet(
    path: Path, accept: Callable[[pa.Schema], None] | None = None, *, with_stamps: bool = False
) -> dict[str, NDArray[np.generic]]:
    """Read a Parquet file into named columns; raises BadRecording naming file, column and row.

    Rows x columns and the size unpacked are compared with the limits by the footer alone, before a value is read.
    `accept` is shown the types of the columns before that, and raises where they are not wanted. `with_stamps`: columns
    of time stamps are read too, as ns since 1970.
    """
    with parsed_by_library(path, "Parquet file", "write or copy it again"):
        return _read(path, accept, with_stamps=with_stamps)


def refuse_booleans(path: Path, schema: pa.Schema) -> None:
    """Raise BadRecording for a column of a recording whose readings are true and false instead of numbers."""
    for field in schema:
        column_spec = BY_NAME.get(field.name)
        if (
            column_spec is not None
            and not (column_spec.kind == "text" or holds_flags(column_spec.name))
            and is_boolean(field.type)
        ):
            raise _of_another_type(path, field)


def is_boolean(kind: pa.DataType) -> bool:
    """Whether values of a type are true and false, also where a dictionary stands for them."""
    return bool(pa.types.is_boolean(kind.value_type if pa.types.is_dictionary(kind) else kind))


def _read(
    path: Path, accept: Callable[[pa.Schema], None] | None, *, with_stamps: bool
) -> dict[str, NDArray[np.generic]]:
    refuse_large_footer(path)
    with pq.ParquetFile(path, buffer_size=BUFFER_BYTES, pre_buffer=False) as opened:
        metadata, schema = opened.metadata, opened.schema_arrow
    rows = metadata.num_rows
    checked_names(path, schema.names)
    for field in schema:
        _refuse_type(path, field, with_stamps=with_stamps)
    if accept is not None:
        accept(schema)
    refuse_too_many(path, rows, len(schema.names))
    refuse_too_large(path, _unpacked_bytes(metadata))
    if rows <= 0:
        raise BadRecording(f"{path}: no rows below the header; expected at least one")
    words = [field.name for field in schema if holds_words(field.type)]
    space = Space(path)
    columns = [ColumnValues(path, name, space) for name in schema.names]
    for column in columns:
        if column.name not in words:
            space.take(column.name, rows * VALUE_BYTES)
    # words stay numbers of a dictionary: one long word in a million rows is one word
    options = {"buffer_size": BUFFER_BYTES, "pre_buffer": False, "page_checksum_verification": True}
    with pq.ParquetFile(path, read_dictionary=words, **options) as opened:
        for group in range(metadata.num_row_groups):
            for piece in opened.iter_batches(PIECE_ROWS, row_groups=[group], use_threads=False):
                for column, values in zip(columns, piece.columns, strict=True):
                    column.add(_without_stamps(values))
    if any(column.rows != rows for column in columns):
        raise BadRecording(
            f"{path}: its footer states {rows} rows, but the file has {columns[0].rows}; write the file again"
        )
    return {column.name: column.whole() for column in columns}


def _without_stamps(stamps: pa.Array) -> pa.Array:
    """Return time stamps as ns since 1970, UTC, to 256 ns, without a zone as they are written; other values as is."""
    if not pa.types.is_timestamp(stamps.type):
        return stamps
    return stamps.cast(pa.timestamp("ns", stamps.type.tz)).cast(pa.int64()).cast(pa.float64(), safe=False)


def refuse_large_footer(path: Path) -> None:
    """Raise BadRecording for a Parquet file whose footer is larger than any of a recording."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 8))
        tail = file.read(8)
    size = int.from_bytes(tail[:4], "little")
    if tail[4:] == MAGIC and size > MAX_FOOTER_BYTES:
        raise BadRecording(
            f"{path}: its footer has {size} bytes; at most {MAX_FOOTER_BYTES} are read; write larger row groups"
        )


def _refuse_type(path: Path, field: pa.Field, *, with_stamps: bool) -> None:
    if with_stamps and pa.types.is_timestamp(field.type):
        return
    kind = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
    number = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
    if number or holds_words(kind) or pa.types.is_boolean(kind) or pa.types.is_null(kind):
        return
    raise _of_another_type(path, field)


def _of_another_type(path: Path, field: pa.Field) -> BadRecording:
    kind = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
    column_spec = BY_NAME.get(field.name)
    wanted_type = (
        "text"
        if column_spec and column_spec.kind == "text"
        else f"numbers{f', {column_spec.unit}' if column_spec and column_spec.unit else ''}"
    )
    advice = "write such a column so" if column_spec else "leave the column out, or write it so"
    return BadRecording(
        f"{path}: column {field.name[:80]!r} holds {str(kind)[:80]}; expected {wanted_type}; {advice}"
        + ("; an instant is the seconds since started_at" if pa.types.is_temporal(kind) else "")
    )


def _unpacked_bytes(metadata: pq.FileMetaData) -> int:
    size = 0
    for group in range(metadata.num_row_groups):
        chunks = metadata.row_group(group)
        size += sum(chunks.column(index).total_uncompressed_size for index in range(chunks.num_columns))
    return size
