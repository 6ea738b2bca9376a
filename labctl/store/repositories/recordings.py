"""Recordings: imported ones taken in whole, measured ones read back; points from the statistics alone."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray

from labctl.errors import NotFound
from labctl.recording import Recording, RecordingInfo, dataset_starts
from labctl.store import sample_codec
from labctl.store.connection.database import Database
from labctl.store.dataset_means import means_rows, points_columns
from labctl.store.records import DataSetRow, MeanRow, RecordingRow
from labctl.store.repositories.audit import append
from labctl.store.repositories.units import remember_unit
from labctl.store.schema import tables

WHOLE_TABLE = 0
#: A column of these belongs to the data set as a whole.
OF_THE_SET = ("dataset", "position", "run", "mounting")


def _blocks_query() -> sa.Select[int, int, int, bytes]:
    b = tables.sample_blocks.c
    ours = (b.recording_id == sa.bindparam("recording"), b.number == sa.bindparam("number"))
    return sa.select(b.n, b.codec, b.crc32, b.data).where(*ours).order_by(b.seq)


#: Made once: it is asked for every data set of a recording.
_BLOCKS = _blocks_query()


class Recordings:
    """Everything measured on one unit in one campaign or import."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add_import(self, recording: Recording, at: datetime, simulated: Mapping[str, Any] | None = None) -> int:
        """Take in a recording made elsewhere; returns its number. All of it is kept, or nothing.

        `simulated` says what it was made from, for the audit trail, where nobody measured it.
        """
        info = recording.info
        with self._database.writing() as connection:
            number = new_recording(connection, info, at)
            if info.kind == "samples":
                _add_samples(connection, number, recording)
            else:
                _add_table(connection, number, recording)
            _add_environment(connection, number, recording)
            what = {"serial": info.serial, "kind": info.kind, "rows": len(recording)}
            act = "import" if simulated is None else "simulate"
            append(connection, at, act, f"recording {number}", {**what, **(simulated or {})})
        return number

    def get(self, recording: int) -> RecordingRow:
        """Return one recording's head; raises NotFound."""
        found = self._heads(tables.recordings.c.id == recording)
        if not found:
            raise NotFound(f"recording {recording} is not in this database")
        return found[0]

    def of_unit(self, serial: str) -> list[RecordingRow]:
        """Return a unit's recordings, newest first."""
        return self._heads(tables.recordings.c.serial == serial)

    def all(self) -> list[RecordingRow]:
        """Return every recording, newest first."""
        return self._heads(sa.true())

    def _heads(self, condition: sa.ColumnElement[bool]) -> list[RecordingRow]:
        counts = (
            sa.select(
                tables.data_sets.c.recording_id,
                sa.func.count().label("datasets"),
                sa.func.sum(tables.data_sets.c.n).label("readings"),
            )
            .where(tables.data_sets.c.state == "complete")
            .group_by(tables.data_sets.c.recording_id)
            .subquery()
        )
        r = tables.recordings.c
        query = (
            sa.select(
                r.id,
                r.serial,
                r.campaign_id,
                r.gyro,
                r.kind,
                r.info,
                r.created_at,
                counts.c.datasets,
                counts.c.readings,
            )
            .outerjoin(counts, counts.c.recording_id == r.id)
            .where(condition)
            .order_by(r.id.desc())
        )
        with self._database.reading() as connection:
            return [RecordingRow(*row[:7], int(row[7] or 0), int(row[8] or 0)) for row in connection.execute(query)]

    def fingerprint(self, recording: int, *, complete: bool = False, head: RecordingRow | None = None) -> str:
        """Return a digest of all that a recording holds now: equal only where every answer about it is.

        With `complete` of its complete data sets alone, so that it stays while the next one is measured. `head` is the
        recording's head where it was read already.
        """
        head = head or self.get(recording)
        d, b, e = tables.data_sets.c, tables.sample_blocks.c, tables.environment.c
        sets = sa.select(d.number, d.state, d.n).where(d.recording_id == recording).order_by(d.number)
        packed = sa.select(b.number, b.seq, b.n, b.crc32).where(b.recording_id == recording)
        if complete:
            whole = sa.and_(d.recording_id == recording, d.state == "complete")
            sets, packed = sets.where(whole), packed.where(b.number.in_(sa.select(d.number).where(whole)))
        ours = (
            sets,
            packed.order_by(b.number, b.seq),
            sa.select(sa.func.count(), sa.func.max(e.t_s)).where(e.recording_id == recording),
        )
        with self._database.reading() as connection:
            rows = [[tuple(row) for row in connection.execute(query)] for query in ours[: 2 if complete else 3]]
        said = json.dumps([head.serial, head.campaign, head.kind, dict(head.info), rows], sort_keys=True)
        return hashlib.sha256(said.encode()).hexdigest()

    def points(self, recording: int, *, head: RecordingRow | None = None) -> Recording:
        """Return one row per complete data set, from the statistics alone (kind "points"), or the table imported.

        `head` is the recording's head where it was read already.
        """
        head = head or self.get(recording)
        info = RecordingInfo.model_validate(head.info)
        with self._database.reading() as connection:
            environment = _environment(connection, recording)
            if head.kind != "samples":
                return Recording(info, blocks_of(connection, recording, WHOLE_TABLE)[0], environment)
            columns = points_columns(connection, recording)
        return Recording(info.model_copy(update={"kind": "points"}), columns, environment)

    def samples(self, recording: int) -> Recording:
        """Return every reading of the complete data sets; points and coefficients return as they were imported."""
        head = self.get(recording)
        if head.kind != "samples":
            return self.points(recording)
        info = RecordingInfo.model_validate(head.info)
        parts = [columns for _, columns in self.iter_datasets(recording)]
        names = dict.fromkeys(name for part in parts for name in part)
        columns = {name: np.concatenate([part[name] for part in parts]) for name in names}
        with self._database.reading() as connection:
            return Recording(info, columns, _environment(connection, recording))

    def iter_datasets(self, recording: int) -> Iterator[tuple[int, dict[str, NDArray[Any]]]]:
        """Yield (number, columns of readings) of each complete data set, in the order of measurement."""
        d = tables.data_sets.c
        with self._database.reading() as connection:
            heads = connection.execute(
                sa.select(tables.data_sets).where(d.recording_id == recording, d.state == "complete").order_by(d.number)
            )
            rows = [dict(head) for head in heads.mappings()]
            channels = _channels(connection, recording)
        for head in rows:
            with self._database.reading() as connection:
                columns = _in_units(connection, head, channels)
            yield int(head["number"]), columns

    def data_sets(self, recording: int) -> list[DataSetRow]:
        """Return every data set of a recording, also those that were not completed, in order."""
        d = tables.data_sets.c
        query = sa.select(
            d.number, d.state, d.reason, d.position, d.run, d.mounting, d.table_rate_dps, d.table_angle_deg,
            d.chamber_setpoint_c, d.gate_from_s.label("t_from_s"),
            d.gate_until_s.label("t_until_s"), d.n, d.lost, d.damaged,
        )  # fmt: skip
        with self._database.reading() as connection:
            rows = connection.execute(query.where(d.recording_id == recording).order_by(d.number))
            return [DataSetRow(**dict(row)) for row in rows.mappings()]

    def means(self, recording: int) -> list[MeanRow]:
        """Return mean and standard deviation of every data set and channel, as far as they are kept as rows."""
        m = tables.data_set_means.c
        query = sa.select(m.number, m.channel, m.mean, m.std).where(m.recording_id == recording)
        with self._database.reading() as connection:
            return [MeanRow(*row) for row in connection.execute(query.order_by(m.channel, m.number))]

    def dataset(self, recording: int, number: int) -> dict[str, NDArray[Any]]:
        """Return the readings of one data set, column by column, in the interchange format's units."""
        with self._database.reading() as connection:
            chosen = sa.select(tables.data_sets).where(
                tables.data_sets.c.recording_id == recording, tables.data_sets.c.number == number
            )
            head = connection.execute(chosen).mappings().first()
            if head is None:
                raise NotFound(f"recording {recording} has no data set {number}")
            return _in_units(connection, dict(head), _channels(connection, recording))


def _channels(connection: sa.Connection, recording: int) -> list[dict[str, Any]]:
    query = sa.select(tables.recordings.c.channels).where(tables.recordings.c.id == recording)
    return connection.scalar(query) or []


def _in_units(
    connection: sa.Connection, head: Mapping[str, Any], channels: list[dict[str, Any]]
) -> dict[str, NDArray[Any]]:
    """Return the readings of one data set: as they came in from elsewhere, or in their units from what was sent."""
    raw = _joined(blocks_of(connection, head["recording_id"], head["number"]))
    return scaled(raw, channels, head) if channels else raw


def new_recording(
    connection: sa.Connection,
    info: RecordingInfo,
    at: datetime,
    *,
    campaign: int | None = None,
    gyro: str | None = None,
    channels: tuple[Mapping[str, Any], ...] = (),
) -> int:
    """Make the row of a recording, and of its unit where that is new; returns the recording's number."""
    remember_unit(connection, info.serial, info.model, info.technology, at)
    row = sa.insert(tables.recordings).values(
        serial=info.serial,
        campaign_id=campaign,
        gyro=gyro,
        kind=info.kind,
        info=info.model_dump(mode="json"),
        channels=[dict(channel) for channel in channels],
        created_at=at,
    )
    return int(connection.scalar(row.returning(tables.recordings.c.id)) or 0)


def scaled(
    raw: dict[str, NDArray[Any]], channels: list[dict[str, Any]], head: Mapping[str, Any]
) -> dict[str, NDArray[Any]]:
    """Return readings in their units from what the device sent, with the data set's own columns beside them."""
    t_s = raw["t_ns"] / 1e9
    n = len(t_s)
    columns: dict[str, NDArray[Any]] = {
        "dataset": np.full(n, head["number"], dtype=np.int64),
        "t_s": t_s,
        "position": np.full(n, head["position"]),
        "run": np.full(n, head["run"], dtype=np.int64),
        "mounting": np.full(n, head["mounting"], dtype=np.int64),
        "table_rate_dps": np.full(n, head["table_rate_dps"]),
        "table_angle_deg": head["table_angle_deg"] + head["table_rate_dps"] * (t_s - head["gate_from_s"]),
    }
    if head["power_on_s"] is not None:
        columns["power_s"] = t_s - head["power_on_s"]
    for channel in channels:
        columns[channel["name"]] = channel["offset"] + channel["scale"] * raw[channel["name"]]
    per_axis = [columns[f"temperature_{a}_c"] for a in "xyz" if f"temperature_{a}_c" in columns]
    if "temperature_c" not in columns and per_axis:
        columns["temperature_c"] = np.mean(per_axis, axis=0)
    columns["chamber_c"] = raw["chamber_mc"] / 1e3
    columns["valid"] = raw["valid"]
    return columns


def _add_samples(connection: sa.Connection, recording: int, samples: Recording) -> None:
    columns = {name: np.asarray(values) for name, values in samples.columns.items()}
    starts = dataset_starts(columns["dataset"])
    ends = np.append(starts[1:], len(columns["dataset"]))
    heads, means, packed = [], [], []
    for start, end in zip(starts, ends, strict=True):
        part = {name: values[start:end] for name, values in columns.items()}
        number = int(part["dataset"][0])
        valid = part["valid"] != 0 if "valid" in part else np.ones(end - start, dtype=bool)
        counted = {name: values[valid] for name, values in part.items()} if valid.any() else part
        heads.append(_head_of(recording, number, counted, int(valid.sum())))
        means += means_rows(recording, number, part, valid)
        packed.append(block_row(recording, number, 0, sample_codec.pack(part, sample_codec.FINAL)))
    _insert(connection, (tables.data_sets, heads), (tables.data_set_means, means), (tables.sample_blocks, packed))


def _head_of(recording: int, number: int, part: dict[str, NDArray[Any]], n: int) -> dict[str, Any]:
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
        "table_rate_dps": float(part["table_rate_dps"].mean()),
        "table_angle_deg": None if angle is None else float(angle[0]),
        "chamber_setpoint_c": None if setpoint is None else float(setpoint[0]),
        "gate_from_s": float(part["t_s"][0]) if "t_s" in part else None,
        "gate_until_s": float(part["t_s"][-1]) if "t_s" in part else None,
        "power_on_s": None if power is None else float(part["t_s"][0] - power[0]),
        "n": n,
    }


def _add_table(connection: sa.Connection, recording: int, table: Recording) -> None:
    columns = {name: np.asarray(values) for name, values in table.columns.items()}
    packed = [block_row(recording, WHOLE_TABLE, 0, sample_codec.pack(columns, sample_codec.FINAL))]
    heads: list[dict[str, Any]] = []
    if table.info.kind == "points":
        for row in range(len(table)):
            part = {name: values[row : row + 1] for name, values in columns.items()}
            n = int(part["n"][0]) if "n" in part else 1
            heads.append({**_head_of(recording, int(part["dataset"][0]), part, n), "power_on_s": None})
    _insert(connection, (tables.data_sets, heads), (tables.sample_blocks, packed))


def _add_environment(connection: sa.Connection, recording: int, source: Recording) -> None:
    if source.environment is None:
        return
    known = ("t_s", "run", "temperature_c", "chamber_c", "chamber_setpoint_c")
    columns = {name: np.asarray(source.environment[name]).tolist() for name in known if name in source.environment}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    _insert(connection, (tables.environment, [{"recording_id": recording, **row} for row in rows]))


def _environment(connection: sa.Connection, recording: int) -> dict[str, NDArray[Any]] | None:
    e = tables.environment.c
    names = ("t_s", "run", "temperature_c", "chamber_c", "chamber_setpoint_c")
    query = sa.select(*(e[name] for name in names)).where(e.recording_id == recording).order_by(e.id)
    rows = [tuple(row) for row in connection.execute(query)]
    if not rows:
        return None
    columns = dict(zip(names, zip(*rows, strict=True), strict=True))
    return {
        name: np.asarray(values, dtype=np.int64 if name == "run" else np.float64)
        for name, values in columns.items()
        if any(value is not None for value in values)
    }


def block_row(recording: int, number: int, seq: int, block: sample_codec.Block) -> dict[str, Any]:
    """Return a row of sample_blocks."""
    return {
        "recording_id": recording,
        "number": number,
        "seq": seq,
        "n": block.n,
        "codec": block.codec,
        "crc32": block.crc32,
        "data": block.data,
    }


def blocks_of(connection: sa.Connection, recording: int, number: int) -> list[dict[str, NDArray[Any]]]:
    """Return the unpacked blocks of a data set, in order."""
    found = connection.execute(_BLOCKS, {"recording": recording, "number": number})
    return [sample_codec.unpack(sample_codec.Block(*row)) for row in found]


def _joined(parts: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    if len(parts) == 1:
        return parts[0]
    return {name: np.concatenate([part[name] for part in parts]) for name in (parts[0] if parts else {})}


def _insert(connection: sa.Connection, *pieces: tuple[sa.Table, list[dict[str, Any]]]) -> None:
    for table, rows in pieces:
        if rows:
            connection.execute(sa.insert(table), rows)
