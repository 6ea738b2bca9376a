"""Blocks of readings: rows of sample_blocks, and the readings of a data set in their units."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NotRequired

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray
from typing_extensions import TypedDict

from labctl.answers.json_object import JsonObject
from labctl.answers.raw_channels import RawChannelJson
from labctl.recording.columns import ARRIVAL_S, DEVICE_S, READING_TIMES, TIME_COMMON_U_S, TIME_U_S, VERIFICATION
from labctl.store import sample_codec
from labctl.store.import_parts import block_row
from labctl.store.manifests.digests import block_digests
from labctl.store.schema import tables
from procedures.contracts.journal import TableAngles
from procedures.contracts.measured_course import MeasuredCourse


def _blocks_query() -> sa.Select[int, int, int, int, bytes]:
    b = tables.sample_blocks.c
    ours = (b.recording_id == sa.bindparam("recording"), b.number.in_(sa.bindparam("numbers", expanding=True)))
    return sa.select(b.number, b.n, b.codec, b.crc32, b.data).where(*ours).order_by(b.number, b.seq)


#: Times of readings beside `t_s`: column -> name in a block, and how many of its whole numbers are 1 s. A time of
#: arrival is not known better than to some ms, and each further digit costs 0.4 bytes per reading.
STORED_TIMES = {DEVICE_S: ("device_ns", 1e9), ARRIVAL_S: ("arrival_100us", 1e4)}
#: Built once: it is run for all data sets of a recording, some at a time.
_BLOCKS = _blocks_query()
_ADD_BLOCK = sa.insert(tables.sample_blocks)


def write_block(connection: sa.Connection, recording: int, number: int, seq: int, block: sample_codec.Block) -> None:
    """Write one block of the readings of a data set; `seq` counts the blocks of a data set from 0."""
    connection.execute(_ADD_BLOCK, {**block_row(recording, number, seq, block), "data": block.data})


def write_final_block(
    connection: sa.Connection, recording: int, number: int, columns: dict[str, NDArray[np.generic]]
) -> None:
    """Put one block in the place of all blocks of a data set, packed for good, with the digests of its columns."""
    b, d = tables.sample_blocks, tables.block_digests
    for table in (b, d):
        connection.execute(sa.delete(table).where(table.c.recording_id == recording, table.c.number == number))
    write_block(connection, recording, number, 0, sample_codec.pack(columns, sample_codec.FINAL))
    row = {"recording_id": recording, "number": number, "seq": 0, **block_digests(columns)}
    connection.execute(sa.insert(d).values(**row))


class EncoderAngles(TypedDict):
    """What the table's encoder said during a data set: times of the recording, and the line through the angles."""

    t_s: list[float]
    angle_deg: list[float]
    rate_dps: float
    rate_u_dps: float
    angle_from_deg: float  #: when the gate opened
    computed_dps: float  #: the rate that the table was taken to run at
    course: NotRequired[JsonObject]  #: of a rate that changes, as MeasuredCourse says it; the rates are then means
    is_reference: NotRequired[bool]  #: with `course`: whether the measured rates are the reference, not the commanded
    time_u_s: NotRequired[float]  #: with `course`: standard uncertainty of the time of the reference in this data set
    time_common_u_s: NotRequired[float]  #: the same, of what all data sets have in common


class DataSetHead(TypedDict):
    """The row of a data set, as far as its readings need it."""

    recording_id: int
    number: int
    position: str
    run: int
    mounting: int
    table_rate_dps: float
    table_angle_deg: float | None
    gate_from_s: float
    power_on_s: float | None
    turn_deg: float | None
    turn_u_deg: float | None
    encoder: EncoderAngles | None
    verification: bool


def head_of(row: sa.RowMapping) -> DataSetHead:
    """Return a row of the data sets, as far as its readings need it. Raises KeyError for a column that is absent."""
    return DataSetHead(
        recording_id=row["recording_id"], number=row["number"], position=row["position"], run=row["run"],
        mounting=row["mounting"], table_rate_dps=row["table_rate_dps"], table_angle_deg=row["table_angle_deg"],
        gate_from_s=row["gate_from_s"], power_on_s=row["power_on_s"], turn_deg=row["turn_deg"],
        turn_u_deg=row["turn_u_deg"], encoder=row["encoder"], verification=row["verification"],
    )  # fmt: skip


#: Returns number -> blocks, in order, of some data sets of a recording: of the database, or of a copy of its readings.
ReadBlocks = Callable[[sa.Connection, int, Sequence[int]], dict[int, list[dict[str, NDArray[np.generic]]]]]


def blocks_of(connection: sa.Connection, recording: int, number: int) -> list[dict[str, NDArray[np.generic]]]:
    """Return the unpacked blocks of a data set, in order."""
    return blocks_of_sets(connection, recording, [number]).get(number, [])


def blocks_of_sets(
    connection: sa.Connection, recording: int, numbers: Sequence[int]
) -> dict[int, list[dict[str, NDArray[np.generic]]]]:
    """Return number -> unpacked blocks, in order, of some data sets."""
    blocks: dict[int, list[dict[str, NDArray[np.generic]]]] = {}
    for number, n, codec, crc32, data in connection.execute(
        _BLOCKS, {"recording": recording, "numbers": list(numbers)}
    ):
        blocks.setdefault(number, []).append(sample_codec.unpack(sample_codec.Block(n, codec, crc32, data)))
    return blocks


def join_blocks(parts: list[dict[str, NDArray[np.generic]]]) -> dict[str, NDArray[np.generic]]:
    """Return blocks of the same columns as one."""
    if len(parts) == 1:
        return parts[0]
    return {name: np.concatenate([part[name] for part in parts]) for name in (parts[0] if parts else {})}


def channels_of(connection: sa.Connection, recording: int) -> list[RawChannelJson]:
    """Return name, unit, scale and offset of each raw channel; empty for a recording that was imported."""
    query = sa.select(tables.recordings.c.channels).where(tables.recordings.c.id == recording)
    return connection.scalar(query) or []


def in_units(
    blocks: list[dict[str, NDArray[np.generic]]],
    head: DataSetHead,
    channels: list[RawChannelJson],
    *,
    times: bool = False,
) -> dict[str, NDArray[np.generic]]:
    """Return the readings of one data set from its unpacked blocks.

    With `times` also those of the unit's own clock and of arrival, where they are stored: `t_s` is computed from them,
    and no quantity depends on them.
    """
    raw = join_blocks(blocks)
    if not channels:
        return raw if times else {name: values for name, values in raw.items() if name not in READING_TIMES}
    columns = scaled(raw, channels, head)
    if not times:
        return columns
    beside = {name: _floats(raw[stored]) / per_s for name, (stored, per_s) in STORED_TIMES.items() if stored in raw}
    before = {name: columns[name] for name in ("dataset", "t_s")}
    return {**before, **beside, **columns}


def scaled(
    raw: dict[str, NDArray[np.generic]], channels: list[RawChannelJson], head: DataSetHead
) -> dict[str, NDArray[np.generic]]:
    """Return readings in their units from what the device sent, with the data set's own columns beside them."""
    t_s = np.asarray(raw["t_ns"], dtype=np.int64) / 1e9
    n = len(t_s)
    columns: dict[str, NDArray[np.generic]] = {
        "dataset": np.full(n, head["number"], dtype=np.int64),
        "t_s": t_s,
        "position": np.full(n, head["position"]),
        "run": np.full(n, head["run"], dtype=np.int64),
        "mounting": np.full(n, head["mounting"], dtype=np.int64),
        "table_rate_dps": np.full(n, head["table_rate_dps"]),
    }
    if head["verification"]:
        columns[VERIFICATION] = np.ones(n, dtype=np.int64)
    encoder = head["encoder"]
    course = None if encoder is None else encoder.get("course")
    if encoder is not None and course is not None:
        columns |= _of_course(encoder, course, t_s)
    elif encoder is not None:
        columns["table_angle_deg"] = encoder["angle_from_deg"] + encoder["rate_dps"] * (t_s - head["gate_from_s"])
        columns["computed_rate_dps"] = np.full(n, encoder["computed_dps"])
        columns["encoder_rate_dps"] = np.full(n, encoder["rate_dps"])
        columns["encoder_rate_u_dps"] = np.full(n, encoder["rate_u_dps"])
    elif head["table_angle_deg"] is not None:
        columns["table_angle_deg"] = head["table_angle_deg"] + head["table_rate_dps"] * (t_s - head["gate_from_s"])
    if head["turn_deg"] is not None:
        columns |= _turned(head["turn_deg"], head["turn_u_deg"] or 0.0, t_s[raw["valid"] != 0], n)
    if head["power_on_s"] is not None:
        columns["power_s"] = t_s - head["power_on_s"]
    for channel in channels:
        columns[channel["name"]] = channel["offset"] + channel["scale"] * _floats(raw[channel["name"]])
    per_axis = [_floats(columns[f"temperature_{a}_c"]) for a in "xyz" if f"temperature_{a}_c" in columns]
    if "temperature_c" not in columns and per_axis:
        columns["temperature_c"] = np.mean(per_axis, axis=0)
    if "chamber_mc" in raw:
        columns["chamber_c"] = _floats(raw["chamber_mc"]) / 1e3
    _put_references(columns, channels)
    columns["valid"] = raw["valid"]
    return columns


def _put_references(columns: dict[str, NDArray[np.generic]], channels: list[RawChannelJson]) -> None:
    """Put a reference instrument's column in the place of the unit's own, which is kept as own_..."""
    for channel in channels:
        if (column := channel.get("stands_for")) is not None:
            if column in columns:
                columns[f"own_{column}"] = columns[column]
            columns[column] = columns[channel["name"]]


def _of_course(
    encoder: EncoderAngles, document: JsonObject, t_s: NDArray[np.float64]
) -> dict[str, NDArray[np.generic]]:
    """Return the columns, (n,), of a rate that changes: means over the period that ends with each reading."""
    course = MeasuredCourse.of_json(document)
    period_s = float(np.median(np.diff(t_s))) if len(t_s) > 1 else 1.0
    measured, commanded = course.rates_dps(t_s, period_s)
    course_columns: dict[str, NDArray[np.generic]] = {
        "table_rate_dps": measured if encoder.get("is_reference", True) else commanded,
        "table_angle_deg": course.angle_deg(t_s - period_s / 2),  # at the middle of what a reading averages
        "computed_rate_dps": commanded,
        "encoder_rate_dps": measured,
        "encoder_rate_u_dps": np.full(len(t_s), encoder["rate_u_dps"]),
    }
    if "time_u_s" in encoder and "time_common_u_s" in encoder:  # an older version did not record them
        course_columns[TIME_U_S] = np.full(len(t_s), encoder["time_u_s"])
        course_columns[TIME_COMMON_U_S] = np.full(len(t_s), encoder["time_common_u_s"])
    return course_columns


def angle_values(angles: TableAngles) -> dict[str, object]:
    """Return what a data set's row has of the table's encoder; the rate is the reference where that is said."""
    encoder: EncoderAngles = {
        "t_s": list(angles.t_s), "angle_deg": list(angles.angle_deg), "rate_dps": angles.rate_dps,
        "rate_u_dps": angles.rate_u_dps, "angle_from_deg": angles.angle_from_deg, "computed_dps": angles.computed_dps,
    }  # fmt: skip
    if angles.course is not None:
        encoder["course"], encoder["is_reference"] = angles.course.to_json(), angles.is_reference
    if angles.time is not None:
        encoder["time_u_s"], encoder["time_common_u_s"] = angles.time.own_u_s, angles.time.common_u_s
    values: dict[str, object] = {"encoder": encoder, "table_angle_deg": angles.angle_from_deg}
    return values | ({"table_rate_dps": angles.rate_dps} if angles.is_reference else {})


def _turned(turn_deg: float, turn_u_deg: float, valid_s: NDArray[np.float64], n: int) -> dict[str, NDArray[np.generic]]:
    """Return the columns, (n,), of a turn by hand or a rest beside it; `valid_s` are the times of its valid readings.

    The rate is the mean over the turn: the angle over the time from the first valid reading to the last.
    """
    duration_s = float(valid_s[-1] - valid_s[0]) if len(valid_s) > 1 else 0.0
    rate_dps = turn_deg / duration_s if duration_s > 0 else 0.0
    columns = {"table_rate_dps": rate_dps, "turn_deg": turn_deg, "turn_u_deg": turn_u_deg}
    return {name: np.full(n, value) for name, value in columns.items()}


def _floats(values: NDArray[np.generic]) -> NDArray[np.float64]:
    return np.asarray(values, dtype=np.float64)
