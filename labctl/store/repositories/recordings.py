"""Recordings: everything measured on one unit in one campaign or import, read back as points, readings or rows."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
from itertools import groupby
from operator import itemgetter

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray

from labctl.answers.json_object import JsonObject
from labctl.answers.recording_head import RecordingKind
from labctl.errors import LabctlError, NotFound
from labctl.recording import Recording, refuse_too_many_data_sets
from labctl.recording.columns import RATE_TIME_U, READING_TIMES, VERIFICATION
from labctl.store.connection.database import Database
from labctl.store.import_parts import WHOLE_TABLE, import_parts
from labctl.store.paging import Page, PageRequest, newest_rows
from labctl.store.records import DataSetRow, MeanRow, RecordingRow
from labctl.store.repositories.imports import Imports
from labctl.store.repositories.records_by_name import records_of
from labctl.store.repositories.sample_blocks import (
    ReadBlocks,
    blocks_of_sets,
    channels_of,
    head_of,
    in_units,
    join_blocks,
)
from labctl.store.schema import tables


def points_columns(connection: sa.Connection, recording: int) -> dict[str, NDArray[np.generic]]:
    """Return the points of a recording's complete data sets, column by column, from rows alone."""
    d, m = tables.data_sets.c, tables.data_set_means.c
    heads = connection.execute(
        sa.select(
            d.number, d.position, d.run, d.mounting, d.table_rate_dps, d.table_angle_deg, d.chamber_setpoint_c,
            d.gate_from_s, d.gate_until_s, d.power_on_s, d.n, d.verification,
        )
        .where(d.recording_id == recording, d.state == "complete", d.n > 0)
        .order_by(d.number)
    ).all()  # fmt: skip
    index = {row[0]: i for i, row in enumerate(heads)}
    columns: dict[str, NDArray[np.generic]] = {"dataset": np.array([row[0] for row in heads], dtype=np.int64)}
    begin, end = _floats(heads, 7), _floats(heads, 8)
    t_s = (begin + end) / 2
    columns["t_s"], columns["duration_s"] = t_s, end - begin
    columns["position"] = np.array([row[1] for row in heads], dtype=np.str_)
    columns["run"] = np.array([row[2] for row in heads], dtype=np.int64)
    columns["mounting"] = np.array([row[3] for row in heads], dtype=np.int64)
    if any(row[11] for row in heads):
        columns[VERIFICATION] = np.array([bool(row[11]) for row in heads], dtype=np.int64)
    columns["table_rate_dps"] = _floats(heads, 4)
    channels = {
        "table_angle_deg": _floats(heads, 5),
        "chamber_setpoint_c": _floats(heads, 6),
        "power_s": t_s - _floats(heads, 9),
    }
    columns |= {name: values for name, values in channels.items() if np.isfinite(values).all()}
    columns["n"] = np.array([row[10] for row in heads], dtype=np.int64)
    means = connection.execute(
        sa.select(m.channel, m.number, m.mean, m.std, m.white_std).where(m.recording_id == recording)
    )
    for channel, number, *values in means.all():
        if number not in index:
            continue
        row = index[number]
        names = (channel, f"{channel}_std", f"{channel}_white_std") if channel.startswith("gyro_") else (channel,)
        for name, value in zip(names, values, strict=False):
            if value is None:
                continue
            if name not in columns:
                columns[name] = np.full(len(heads), np.nan)
            columns[name][row] = value
    return {name: values for name, values in columns.items() if values.dtype.kind != "f" or np.isfinite(values).all()}


def _floats(rows: Sequence[Sequence[object]], column: int) -> NDArray[np.float64]:
    return np.array([np.nan if row[column] is None else row[column] for row in rows], dtype=np.float64)


#: Readings of short data sets that are fetched together, which takes fewer statements and little memory.
READ_AT_ONCE = 20_000


class Recordings:
    """Everything measured on one unit in one campaign or import."""

    def __init__(self, database: Database, read_blocks: ReadBlocks = blocks_of_sets) -> None:
        """`read_blocks` returns the blocks of readings, and of tables that were imported."""
        self._database, self._read_blocks = database, read_blocks

    def add_import(self, recording: Recording, at: datetime, simulated: JsonObject | None = None) -> int:
        """Import a recording made elsewhere; returns its number. All of it is kept, or nothing. Raises BadRecording.

        It is no transaction, but a sequence of short ones; what takes time is done between them. `simulated` says,
        for the audit trail, what a simulated recording was made from.
        """
        refuse_too_many_data_sets("the recording", recording.info, recording.columns)
        info, imports = recording.info, Imports(self._database)
        ticket = imports.begin(info, at)
        try:
            for part in import_parts(ticket.recording, recording):
                imports.add_part(ticket, part)
            details = {"serial": info.serial, "kind": info.kind, "rows": len(recording), **(simulated or {})}
            return imports.finish(ticket, at, "import" if simulated is None else "simulate", details)
        except BaseException:
            with suppress(LabctlError):  # what is left is discarded when the database is next opened for writing
                imports.discard(ticket)
            raise

    def get(self, recording: int) -> RecordingRow:
        """Return one recording's head; raises NotFound."""
        heads = self._heads(tables.recordings.c.id == recording)
        if not heads:
            raise NotFound(f"recording {recording} is not in this database; check its number")
        return heads[0]

    def environment(self, recording: int) -> dict[str, NDArray[np.generic]]:
        """Return the temperatures around a recording in order of time, by column (n,); empty where none was logged."""
        with self._database.reading() as connection:
            return _environment(connection, recording) or {}

    def of_unit(self, serial: str) -> list[RecordingRow]:
        """Return a unit's recordings, newest first."""
        return self._heads(tables.recordings.c.serial == serial)

    def all(self) -> list[RecordingRow]:
        """Return every recording, newest first."""
        return self._heads(sa.true())

    def page(
        self, request: PageRequest[int], serial: str | None = None, kind: RecordingKind | None = None
    ) -> Page[RecordingRow, int]:
        """Return recordings, newest first, of one unit with `serial`, of one `kind`.

        Searched are serial numbers and notes.
        """
        r = tables.recordings.c
        matching = sa.and_(
            request.matching((r.serial, r.info["notes"].as_string())),
            sa.true() if serial is None else r.serial == serial,
            sa.true() if kind is None else r.kind == kind,
            # no index: a search reads the rows themselves, in the order of their numbers
            sa.func.coalesce(r.importing, "") == "" if request.search else r.importing.is_(None),
        )
        with self._database.reading() as connection:
            of_page, total = newest_rows(connection, r.id, matching, request)
        return Page.of(self._heads(of_page), lambda row: row.id, request, total)

    def _heads(self, condition: sa.ColumnElement[bool]) -> list[RecordingRow]:
        r, d = tables.recordings.c, tables.data_sets.c
        counts = (
            sa.select(d.recording_id, sa.func.count().label("datasets"), sa.func.sum(d.n).label("readings"))
            .where(d.state == "complete", d.recording_id.in_(sa.select(r.id).where(condition)))
            .group_by(d.recording_id)
            .subquery()
        )
        query = (
            sa.select(
                r.id,
                r.serial,
                r.campaign_id.label("campaign"),
                r.gyro,
                r.kind,
                r.info,
                r.created_at,
                _whole_number(counts.c.datasets).label("datasets"),
                _whole_number(counts.c.readings).label("readings"),
            )
            .outerjoin(counts, counts.c.recording_id == r.id)
            .where(condition, r.importing.is_(None))
            .order_by(r.id.desc())
        )
        with self._database.reading() as connection:
            return records_of(RecordingRow, connection.execute(query))

    def fingerprint(self, recording: int, *, complete: bool = False, head: RecordingRow | None = None) -> str:
        """Return a digest of all that a recording holds now: equal only where every answer about it is.

        The whole rows of data sets count: rates of data sets that were measured are corrected by a timed step clock.
        With `complete` of its complete data sets alone, so that it stays while the next one is measured. `head` is the
        recording's head where it was read already.
        """
        head = head or self.get(recording)
        d, b, e = tables.data_sets.c, tables.sample_blocks.c, tables.environment.c
        sets = sa.select(tables.data_sets).where(d.recording_id == recording).order_by(d.number)
        packed = sa.select(b.number, b.seq, b.n, b.crc32).where(b.recording_id == recording)
        if complete:
            is_complete = sa.and_(d.recording_id == recording, d.state == "complete")
            sets, packed = sets.where(is_complete), packed.where(b.number.in_(sa.select(d.number).where(is_complete)))
        ours = (
            sets,
            packed.order_by(b.number, b.seq),
            sa.select(sa.func.count(), sa.func.max(e.t_s)).where(e.recording_id == recording),
        )
        with self._database.reading() as connection:
            rows = [[tuple(row) for row in connection.execute(query)] for query in ours[: 2 if complete else 3]]
        content = json.dumps([head.serial, head.campaign, head.kind, dict(head.info), rows], sort_keys=True)
        return hashlib.sha256(content.encode()).hexdigest()

    def points(self, recording: int, *, head: RecordingRow | None = None) -> Recording:
        """Return one row per complete data set, from the statistics alone (kind "points"), or the table imported.

        `head` is the recording's head where it was read already.
        """
        head = head or self.get(recording)
        info = head.recording_info
        with self._database.reading() as connection:
            environment = _environment(connection, recording)
            if head.kind != "samples":
                blocks = self._read_blocks(connection, recording, [WHOLE_TABLE]).get(WHOLE_TABLE, [])
                return Recording(info, join_blocks(blocks), environment)
            columns = points_columns(connection, recording)
        return Recording(info.model_copy(update={"kind": "points"}), columns, environment)

    def samples(self, recording: int, *, times: bool = False) -> Recording:
        """Return every reading of the complete data sets; points and coefficients return as they were imported.

        With `times` also the times of the unit's own clock and of arrival, where they are stored.
        """
        head = self.get(recording)
        if head.kind != "samples":
            return self.points(recording)
        info = head.recording_info
        parts = [columns for _, columns in self.iter_datasets(recording, times=times)]
        names = dict.fromkeys(name for part in parts for name in part)
        # a campaign of before they were stored may end with them
        for name in (READING_TIMES | RATE_TIME_U) & names.keys():
            if any(name not in part for part in parts):
                del names[name]
        columns = {name: np.concatenate([part[name] for part in parts]) for name in names}
        with self._database.reading() as connection:
            return Recording(info, columns, _environment(connection, recording))

    def iter_datasets(
        self, recording: int, *, times: bool = False
    ) -> Iterator[tuple[int, dict[str, NDArray[np.generic]]]]:
        """Yield (number, columns of readings) of each complete data set, in the order of measurement.

        `times` as in `samples`.
        """
        d = tables.data_sets.c
        with self._database.reading() as connection:
            heads = connection.execute(
                sa.select(tables.data_sets)
                .where(d.recording_id == recording, d.state == "complete", _whole(recording))
                .order_by(d.number)
            )
            rows = list(heads.mappings())
            channels = channels_of(connection, recording)
        is_marked = any(head["verification"] for head in rows)
        is_timed = any("time_u_s" in (head["encoder"] or {}) for head in rows)
        for together in _by_readings(rows):
            with self._database.reading() as connection:
                blocks = self._read_blocks(connection, recording, [int(head["number"]) for head in together])
            for head in together:
                number = int(head["number"])
                columns = in_units(blocks.pop(number, []), head_of(head), channels, times=times)
                if is_marked and VERIFICATION not in columns:
                    columns[VERIFICATION] = np.zeros(len(columns["dataset"]), dtype=np.int64)
                if is_timed and "course" not in (head["encoder"] or {}):  # of a constant rate no time matters
                    columns |= {name: np.zeros(len(columns["dataset"])) for name in sorted(RATE_TIME_U)}
                yield number, columns

    def check_readings(self, recording: int) -> None:
        """Compare the readings with the digests in the database where they are from elsewhere. Raises BadRecording."""
        with self._database.reading() as connection:
            self._read_blocks(connection, recording, [])

    def data_sets(self, recording: int) -> list[DataSetRow]:
        """Return every data set of a recording, also those that were not completed, in order."""
        d = tables.data_sets.c
        query = sa.select(
            d.number, d.state, d.reason, d.position, d.run, d.mounting, d.table_rate_dps, d.table_angle_deg,
            d.chamber_setpoint_c, d.gate_from_s.label("t_from_s"),
            d.gate_until_s.label("t_until_s"), d.n, d.lost, d.damaged, d.verification,
        )  # fmt: skip
        with self._database.reading() as connection:
            rows = connection.execute(query.where(d.recording_id == recording, _whole(recording)).order_by(d.number))
            return records_of(DataSetRow, rows)

    def means(self, recording: int) -> list[MeanRow]:
        """Return mean and standard deviation of every data set and channel, as far as they are kept as rows."""
        m = tables.data_set_means.c
        query = sa.select(m.number, m.channel, m.mean, m.std).where(m.recording_id == recording, _whole(recording))
        with self._database.reading() as connection:
            return records_of(MeanRow, connection.execute(query.order_by(m.channel, m.number)))

    def dataset(self, recording: int, number: int) -> dict[str, NDArray[np.generic]]:
        """Return the readings of one data set, column by column, in the interchange format's units."""
        with self._database.reading() as connection:
            chosen = sa.select(tables.data_sets).where(
                tables.data_sets.c.recording_id == recording, tables.data_sets.c.number == number, _whole(recording)
            )
            head = connection.execute(chosen).mappings().first()
            if head is None:
                raise NotFound(f"recording {recording} has no data set {number}; check its number")
            blocks = self._read_blocks(connection, recording, [number]).get(number, [])
            return in_units(blocks, head_of(head), channels_of(connection, recording))


def _by_readings(heads: Sequence[sa.RowMapping]) -> Iterator[list[sa.RowMapping]]:
    """Yield data sets in groups of about `READ_AT_ONCE` readings, in their order."""
    begins = np.cumsum([head["n"] or 0 for head in heads], dtype=np.int64) // READ_AT_ONCE
    for _, group in groupby(zip(begins.tolist(), heads, strict=True), key=itemgetter(0)):
        yield [head for _, head in group]


def _whole_number(count: sa.ColumnElement[int]) -> sa.ColumnElement[int]:
    """Return a count as a whole number, 0 where there is nothing to count; PostgreSQL sums to a decimal number."""
    return sa.cast(sa.func.coalesce(count, 0), sa.BigInteger)


def _whole(recording: int) -> sa.ColumnElement[bool]:
    """Return the condition that a recording is not being imported."""
    r = tables.recordings.c
    return sa.exists().where(r.id == recording, r.importing.is_(None))


def _environment(connection: sa.Connection, recording: int) -> dict[str, NDArray[np.generic]] | None:
    e = tables.environment.c
    names = ("t_s", "run", "temperature_c", "chamber_c", "chamber_setpoint_c")
    query = sa.select(*(e[name] for name in names)).where(e.recording_id == recording).order_by(e.id)
    rows = connection.execute(query).all()
    if not rows:
        return None
    columns = dict(zip(names, zip(*rows, strict=True), strict=True))
    return {
        name: np.asarray(values, dtype=np.int64 if name == "run" else np.float64)
        for name, values in columns.items()
        if any(value is not None for value in values)
    }
