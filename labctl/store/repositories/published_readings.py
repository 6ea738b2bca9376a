"""Readings of recordings from copies in the interchange format, each checked by the digests that the database has.

A copy of a campaign's readings holds them in their units. What the devices sent is computed back from it, compared with
the digests of the blocks, and put into units again by the rows of the database: so every result is that of the database
itself, to the last digit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray

from labctl.answers.raw_channels import RawChannelJson
from labctl.errors import BadRecording, LabctlError, NotFound
from labctl.recording.columns import ARRIVAL_S, DEVICE_S
from labctl.recording.recording import Columns
from labctl.store.manifests.digests import GROUPS, block_digests
from labctl.store.repositories.sample_blocks import STORED_TIMES, channels_of, head_of, in_units
from labctl.store.schema import tables

#: Bytes that a row of a copy has at most: 256 columns of 8 bytes; and what a file has beside its rows.
MAX_ROW_BYTES, MAX_BESIDE_BYTES = 256 * 8, 16 << 20
#: What to do about a copy that is not as it was written.
PUBLISH_AGAIN = "publish it again with --again"
#: Copies a data file, by the number of a recording and the file's name, to a path. Raises NotFound, BadRecording.
Fetch = Callable[[int, str, Path, int], None]
Block = dict[str, NDArray[np.generic]]


@dataclass(frozen=True)
class _StoredBlock:
    """What the database says of a block without its readings."""

    number: int
    n: int
    digests: dict[str, str | None]


@dataclass(frozen=True)
class _Checked:
    """A copy whose content is that of the database: number -> rows of the file, from and to."""

    file: Path
    rows: dict[int, tuple[int, int]]
    channels: list[RawChannelJson]


class PublishedReadings:
    """Returns the blocks of recordings from copies of their readings, which are kept in a folder meanwhile."""

    def __init__(self, fetch: Fetch, folder: Path, shown: Callable[[int, str], str]) -> None:
        """`shown` is what messages call a data file, by the number of a recording and the file's name."""
        self._fetch, self._folder, self._shown = fetch, folder, shown
        self._checked: dict[int, _Checked] = {}

    def __call__(self, connection: sa.Connection, recording: int, numbers: Sequence[int]) -> dict[int, list[Block]]:
        """Return number -> blocks of some data sets. Raises NotFound, BadRecording."""
        from labctl.recording.data_files.row_ranges import RowRanges  # noqa: PLC0415  slow to load, for copies alone

        checked = self._checked.get(recording)
        if checked is None:
            checked = self._checked[recording] = self._check(connection, recording)
        ranges = RowRanges(checked.file, PUBLISH_AGAIN)
        return {
            number: [raw_of(ranges.read(*checked.rows[number]), checked.channels)]
            for number in numbers
            if number in checked.rows
        }

    def _check(self, connection: sa.Connection, recording: int) -> _Checked:
        """Fetch a copy and compare all of it with the database. Raises NotFound, BadRecording."""
        r = tables.recordings.c
        name = f"{connection.scalar(sa.select(r.kind).where(r.id == recording))}.parquet"
        target = self._folder / f"{recording}-{name}"
        blocks, shown = _stored_blocks(connection, recording), self._shown(recording, name)
        n = sum(block.n for block in blocks)
        try:
            self._fetch(recording, name, target, n * MAX_ROW_BYTES + MAX_BESIDE_BYTES)
            return self._compared(connection, recording, target, blocks)
        except NotFound:
            raise
        except LabctlError as error:
            raise BadRecording(str(error).replace(str(target), shown)) from error

    @staticmethod
    def _compared(connection: sa.Connection, recording: int, file: Path, blocks: Sequence[_StoredBlock]) -> _Checked:
        from labctl.recording.data_files.row_ranges import RowRanges  # noqa: PLC0415  as above

        ranges, n = RowRanges(file, PUBLISH_AGAIN), sum(block.n for block in blocks)
        if ranges.rows != n:
            raise BadRecording(
                f"{file}: has {ranges.rows} rows, but recording {recording} has {n} in its complete data sets; "
                "publish it again with --again"
            )
        checked = _Checked(file, _rows_of(blocks), channels_of(connection, recording))
        query = sa.select(tables.data_sets).where(tables.data_sets.c.recording_id == recording)
        heads = {head["number"]: head for head in connection.execute(query).mappings()}
        for number, (start, stop) in checked.rows.items():
            own = [block for block in blocks if block.number == number]
            if differing := _differing(ranges.read(start, stop), own, checked.channels, heads.get(number)):
                what = f"data set {number}" if number in heads else "the table"
                raise BadRecording(
                    f"{file}: {what} is not that of recording {recording} in the database ({differing}); "
                    "publish it again with --again"
                )
        return checked


def _stored_blocks(connection: sa.Connection, recording: int) -> list[_StoredBlock]:
    """Return the blocks of the complete data sets of a recording, or of its table, in order."""
    b, g, d = tables.sample_blocks.c, tables.block_digests.c, tables.data_sets
    same = sa.and_(g.recording_id == b.recording_id, g.number == b.number, g.seq == b.seq)
    complete = sa.exists().where(d.c.recording_id == recording, d.c.number == b.number, d.c.state == "complete")
    is_table = sa.exists().where(tables.recordings.c.id == recording, tables.recordings.c.kind != "samples")
    query = (
        sa.select(b.number, b.n, g.readings, g.temperatures, g.table_rates)
        .select_from(tables.sample_blocks.outerjoin(tables.block_digests, same))
        .where(b.recording_id == recording, sa.or_(is_table, complete))
        .order_by(b.number, b.seq)
    )
    return [
        _StoredBlock(number, n, dict(zip(GROUPS, digests, strict=True)))
        for number, n, *digests in connection.execute(query).all()
    ]


def _rows_of(blocks: Sequence[_StoredBlock]) -> dict[int, tuple[int, int]]:
    rows: dict[int, tuple[int, int]] = {}
    end = 0
    for block in blocks:
        start = rows.get(block.number, (end, end))[0]
        end += block.n
        rows[block.number] = start, end
    return rows


def _differing(
    copied: Block, blocks: Sequence[_StoredBlock], channels: list[RawChannelJson], head: sa.RowMapping | None
) -> str:
    """Return what of a data set is not what the database has, in words; empty: nothing."""
    try:
        raw = raw_of(copied, channels)
    except KeyError as error:
        return f"column {error.args[0]!r} is missing"
    except ValueError:
        return "a column of numbers holds text"
    start = 0
    for block in blocks:
        digests = block_digests({name: values[start : start + block.n] for name, values in raw.items()})
        start += block.n
        if differing := [group.replace("_", " ") for group in GROUPS if digests[group] != block.digests[group]]:
            return f"the digest of its {' and '.join(differing)} differs"
    if not channels or head is None:
        return ""
    whole = in_units([raw], head_of(head), channels, times=True)
    wrong = [name for name, values in whole.items() if name not in copied or not _equal(values, copied[name])]
    return f"column {wrong[0]!r} differs" if wrong else ""


def _equal(values: NDArray[np.generic], others: NDArray[np.generic]) -> bool:
    return bool(np.array_equal(values, others, equal_nan=values.dtype.kind == "f"))


def raw_of(columns: Columns, channels: Sequence[RawChannelJson]) -> Block:
    """Return a data set as its blocks hold it from its columns in their units, the inverse of `in_units`.

    Raises KeyError for a column that is missing. An imported recording has no channels, and its columns are its blocks.
    """
    if not channels:
        return dict(columns)
    replaced = {channel.get("stands_for") for channel in channels}

    def own(name: str) -> NDArray[np.float64]:
        return np.asarray(columns[f"own_{name}" if name in replaced else name], dtype=np.float64)

    raw: Block = {"t_ns": _whole(own("t_s") * 1e9), "valid": columns["valid"]}
    for channel in channels:
        raw[channel["name"]] = _whole((own(channel["name"]) - channel["offset"]) / channel["scale"])
    for name in (DEVICE_S, ARRIVAL_S):
        if name in columns:
            stored, per_s = STORED_TIMES[name]
            raw[stored] = _whole(own(name) * per_s)
    is_channel = any(channel["name"] == "chamber_c" for channel in channels)
    if not is_channel and ("own_chamber_c" if "chamber_c" in replaced else "chamber_c") in columns:
        raw["chamber_mc"] = _whole(own("chamber_c") * 1e3)
    return raw


def _whole(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the nearest whole numbers; for what is none, or too large for one, another one, which a digest finds."""
    with np.errstate(invalid="ignore"):
        return np.rint(values).astype(np.int64)
