"""A recording in parts, rows and packed blocks ready to insert: each small enough for one short transaction.

All that takes time (means, packing) is done here, outside of any transaction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from labctl.recording import Recording, dataset_starts
from labctl.recording.columns import VERIFICATION
from labctl.recording.recording import Columns
from labctl.store import sample_codec
from labctl.store.dataset_statistics import Row, means_rows
from labctl.store.manifests.digests import block_digests

#: Number of the blocks that hold a whole table of points or coefficients.
WHOLE_TABLE = 0
#: What one part holds at most. Measured: one transaction takes 20 ms of one core with this many bytes, 33 ms with this
#: many rows.
MAX_ROWS, MAX_BYTES = 2000, 1 << 21
#: Readings of one block, before they are packed: of a long data set several blocks are made.
BLOCK_BYTES = 2 << 20

#: The tables that a part has rows of, in the order in which they refer to each other.
TABLES = ("data_sets", "data_set_means", "sample_blocks", "block_digests", "environment")
ENVIRONMENT = ("t_s", "run", "temperature_c", "chamber_c", "chamber_setpoint_c")

#: Rows by the name of their table, and the block of each row of sample_blocks.
Piece = tuple[dict[str, list[Row]], list[bytes]]


@dataclass
class ImportPart:
    """Rows to insert in one transaction, by the name of their table; those of sample_blocks without their blocks.

    JSON, as which a part reaches the process that writes, cannot distinguish bytes among the values of a row from text.
    """

    rows: dict[str, list[Row]] = field(default_factory=lambda: {name: [] for name in TABLES})
    packed: list[bytes] = field(default_factory=list)  #: the block of each row of sample_blocks
    n: int = 0
    packed_bytes: int = 0

    def takes(self, n: int, size: int) -> bool:
        """Whether `n` more rows, with blocks of `size` bytes, still fit; an empty part takes anything."""
        return not self.n or (self.n + n <= MAX_ROWS and self.packed_bytes + size <= MAX_BYTES)


def import_parts(number: int, recording: Recording) -> Iterator[ImportPart]:
    """Yield the parts of the recording of this number, in the order in which they are to be inserted."""
    part = ImportPart()
    for rows, packed in _pieces(number, recording):
        n = sum(map(len, rows.values()))
        size = sum(map(len, packed))
        if not part.takes(n, size):
            yield part
            part = ImportPart()
        for name, some in rows.items():
            part.rows[name] += some
        part.packed += packed
        part.n, part.packed_bytes = part.n + n, part.packed_bytes + size
    if part.n:
        yield part


def block_row(recording: int, number: int, seq: int, block: sample_codec.Block) -> Row:
    """Return a row of sample_blocks, without the packed block (`data`)."""
    return {
        "recording_id": recording,
        "number": number,
        "seq": seq,
        "n": block.n,
        "codec": block.codec,
        "crc32": block.crc32,
    }


def _pieces(number: int, recording: Recording) -> Iterator[Piece]:
    """Yield rows that stand together: a data set with its means, a block, some of the environment."""
    columns = {name: np.asarray(values) for name, values in recording.columns.items()}
    if recording.info.kind == "samples":
        yield from _data_sets(number, columns)
    else:
        if recording.info.kind == "points":
            yield from _points(number, columns)
        yield from _blocks(number, WHOLE_TABLE, columns)
    if recording.environment is not None:
        yield from _environment(number, recording.environment)


def _data_sets(recording: int, columns: Columns) -> Iterator[Piece]:
    starts = dataset_starts(np.asarray(columns["dataset"], dtype=np.int64))
    ends = np.append(starts[1:], len(columns["dataset"]))
    for start, end in zip(starts, ends, strict=True):
        part = {name: values[start:end] for name, values in columns.items()}
        number = int(part["dataset"][0])
        valid = part["valid"] != 0 if "valid" in part else np.ones(end - start, dtype=bool)
        counted = {name: values[valid] for name, values in part.items()} if valid.any() else part
        rows = {
            "data_sets": [_head(recording, number, counted, int(valid.sum()))],
            "data_set_means": means_rows(recording, number, part, valid),
        }
        yield rows, []
        yield from _blocks(recording, number, part)


def _points(recording: int, columns: Columns) -> Iterator[Piece]:
    for row in range(len(columns["dataset"])):
        part = {name: values[row : row + 1] for name, values in columns.items()}
        n = int(part["n"][0]) if "n" in part else 1
        yield {"data_sets": [{**_head(recording, int(part["dataset"][0]), part, n), "power_on_s": None}]}, []


def _head(recording: int, number: int, part: Columns, n: int) -> Row:
    angle, setpoint = part.get("table_angle_deg"), part.get("chamber_setpoint_c")
    power = part.get("power_s")
    return {
        "recording_id": recording,
        "number": number,
        "state": "complete",
        "reason": "",
        "position": str(part["position"][0]),
        "run": int(part["run"][0]) if "run" in part else 1,
        "mounting": int(part["mounting"][0]) if "mounting" in part else 1,
        # 0 for a motion that no rate table made: its readings have no such column
        "table_rate_dps": float(part["table_rate_dps"].mean()) if "table_rate_dps" in part else 0.0,
        "table_angle_deg": None if angle is None else float(angle[0]),
        "chamber_setpoint_c": None if setpoint is None else float(setpoint[0]),
        "gate_from_s": float(part["t_s"][0]) if "t_s" in part else None,
        "gate_until_s": float(part["t_s"][-1]) if "t_s" in part else None,
        "power_on_s": None if power is None else float(part["t_s"][0] - power[0]),
        "n": n,
        "verification": bool(part[VERIFICATION][0]) if VERIFICATION in part else False,
    }


def _blocks(recording: int, number: int, columns: Columns) -> Iterator[Piece]:
    """Yield the packed blocks of a data set, or of a whole table; one at least."""
    length = len(next(iter(columns.values()), ()))
    row_bytes = sum(max(values.dtype.itemsize, 1) for values in columns.values())
    at_once = max(BLOCK_BYTES // max(row_bytes, 1), 1)
    for seq, start in enumerate(range(0, max(length, 1), at_once)):
        block = {name: values[start : start + at_once] for name, values in columns.items()}
        packed = sample_codec.pack(block, sample_codec.FINAL)
        rows: dict[str, list[Row]] = {
            "sample_blocks": [block_row(recording, number, seq, packed)],
            "block_digests": [{"recording_id": recording, "number": number, "seq": seq, **block_digests(block)}],
        }
        yield rows, [packed.data]


def _environment(recording: int, environment: Columns) -> Iterator[Piece]:
    columns = {name: np.asarray(environment[name]).tolist() for name in ENVIRONMENT if name in environment}
    for values in zip(*columns.values(), strict=True):
        yield {"environment": [{"recording_id": recording, **dict(zip(columns, values, strict=True))}]}, []
