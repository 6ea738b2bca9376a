"""Writes recordings: the row of a measured one, and an imported one, marked as unfinished until it is complete.

An import is a sequence of short transactions, so that a campaign's journal never waits for a long one. No method
reads an unfinished recording; `Imports.discard_unfinished` discards those of a process that was killed.
"""

from __future__ import annotations

import secrets
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.answers.json_object import JsonObject
from labctl.answers.raw_channels import RawChannelJson
from labctl.errors import Conflict
from labctl.recording import RecordingInfo
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.import_parts import MAX_BYTES, MAX_ROWS, TABLES, ImportPart
from labctl.store.manifests.contents import RECORDING
from labctl.store.repositories.audit import append
from labctl.store.repositories.records_by_name import records_of
from labctl.store.repositories.units import add_missing_unit, remember_unit
from labctl.store.schema import tables
from labctl.store.sealing.seals import prepared_recordings, seal

#: Where several processes write (PostgreSQL): an import without a heartbeat for so long has no process any more.
ABANDONED_AFTER = timedelta(minutes=15)


#: Tables with rows of a recording, other than its blocks, and the column by which rows are removed in batches.
_REST = (("block_digests", "number"), ("data_set_means", "number"), ("data_sets", "number"), ("environment", "id"))


@dataclass(frozen=True)
class ImportTicket:
    """The right to write to an unfinished recording; a number may be used again, a token may not."""

    recording: int
    token: str


def new_recording(
    connection: sa.Connection,
    info: RecordingInfo,
    at: datetime,
    *,
    campaign: int | None = None,
    gyro: str | None = None,
    channels: tuple[RawChannelJson, ...] = (),
) -> int:
    """Make the row of a recording, and of its unit where that is new; returns the recording's number."""
    remember_unit(connection, info.serial, info.model, info.technology, at)
    values = {"campaign_id": campaign, "gyro": gyro, "channels": [dict(channel) for channel in channels]}
    return _insert_recording(connection, info, at, values)


def _insert_recording(connection: sa.Connection, info: RecordingInfo, at: datetime, values: dict[str, Any]) -> int:
    row = sa.insert(tables.recordings).values(
        serial=info.serial, kind=info.kind, info=info.model_dump(mode="json"), created_at=at, **values
    )
    return int(connection.scalar(row.returning(tables.recordings.c.id)) or 0)


class Imports:
    """Recordings that are being imported. Each method is one short transaction, or a few of them."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def begin(self, info: RecordingInfo, at: datetime) -> ImportTicket:
        """Make an unfinished recording without content."""
        token = secrets.token_hex(16)
        marked = {"channels": [], "importing": token, "import_sign_at": sa.func.now()}
        with self._database.writing(synced=False) as connection:
            add_missing_unit(connection, info.serial, info.model, info.technology, at)
            return ImportTicket(_insert_recording(connection, info, at, marked), token)

    @transaction
    def add_part(self, ticket: ImportTicket, part: ImportPart) -> None:
        """Insert one part's rows. Raises Conflict when the import was discarded meanwhile."""
        with self._database.writing(synced=False) as connection:
            _give_sign(connection, ticket)
            for name in TABLES:
                rows: list[dict[str, Any]] = [*part.rows[name]]
                if name == tables.sample_blocks.name:
                    rows = [{**row, "data": data} for row, data in zip(rows, part.packed, strict=True)]
                if rows:
                    connection.execute(sa.insert(tables.metadata.tables[name]), rows)

    @transaction
    def finish(self, ticket: ImportTicket, at: datetime, action: str, detail: JsonObject) -> int:
        """Mark a recording as complete and write the audit row; returns its number. Raises Conflict as `add_part`."""
        r, record = tables.recordings, (RECORDING.name, str(ticket.recording))
        parts = prepared_recordings(self._database, [record])[record]
        with self._database.writing() as connection:
            _give_sign(connection, ticket)
            values = {"importing": None, "import_sign_at": None}
            info = RecordingInfo.model_validate(
                connection.scalar(sa.update(r).where(r.c.id == ticket.recording).values(**values).returning(r.c.info))
            )
            remember_unit(connection, info.serial, info.model, info.technology, at)
            append(connection, at, action, f"recording {ticket.recording}", detail)
            seal(connection, record, at, action, parts)
        return ticket.recording

    @transaction
    def discard(self, ticket: ImportTicket) -> None:
        """Remove an unfinished recording in short transactions; does nothing where it was removed before."""
        with suppress(Conflict):
            while self._discard_some(ticket):
                pass

    def discard_unfinished(self) -> int:
        """Discard the imports of processes that ended during them; returns their number.

        SQLite has one service or command at a time, so every unfinished import is an abandoned one. Elsewhere another
        process may still write: its import is discarded only after 15 minutes without a heartbeat, by the clock of
        the server.
        """
        r = tables.recordings.c
        with self._database.reading() as connection:
            query = sa.select(r.id.label("recording"), r.importing.label("token")).where(r.importing.is_not(None))
            if connection.dialect.name != "sqlite":
                query = query.where(r.import_sign_at < sa.func.now() - ABANDONED_AFTER)
            tickets = records_of(ImportTicket, connection.execute(query))
        for ticket in tickets:
            with suppress(Conflict):
                self.discard(self.claim(ticket))
        return len(tickets)

    @transaction
    def claim(self, ticket: ImportTicket) -> ImportTicket:
        """Return a new ticket; with the previous ticket no further part can be written.

        Raises Conflict when the import was discarded or finished meanwhile.
        """
        mine = ImportTicket(ticket.recording, secrets.token_hex(16))
        with self._database.writing(synced=False) as connection:
            _give_sign(connection, ticket, token=mine.token)
        return mine

    def _discard_some(self, ticket: ImportTicket) -> bool:
        """Delete a batch of rows of a recording, last its own row; returns whether rows are left."""
        number = ticket.recording
        with self._database.writing(synced=False) as connection:
            _give_sign(connection, ticket)
            if _delete_blocks(connection, number):
                return True
            for name, key in _REST:
                if _delete_rows(connection, tables.metadata.tables[name], key, number):
                    return True
            r = tables.recordings
            serial = connection.scalar(sa.delete(r).where(r.c.id == number).returning(r.c.serial))
        # a unit is only ever added by a recording; where an import that begins just now needs the row, it stays
        with suppress(exc.IntegrityError), self._database.writing(synced=False) as connection:
            u = tables.units.c
            unused = ~sa.exists().where(r.c.serial == u.serial)
            connection.execute(sa.delete(tables.units).where(u.serial == serial, unused))
        return False


def _give_sign(connection: sa.Connection, ticket: ImportTicket, *, token: str | None = None) -> None:
    """Write the heartbeat of an import, and a new token if given. Raises Conflict when it is discarded or finished."""
    r = tables.recordings
    mine = sa.and_(r.c.id == ticket.recording, r.c.importing == ticket.token)
    signed = sa.update(r).where(mine).values(import_sign_at=sa.func.now(), importing=token or ticket.token)
    if connection.execute(signed).rowcount == 0:
        raise Conflict(
            f"recording {ticket.recording}: the process that wrote it was restarted, so the import was "
            "discarded and nothing was stored; import the recording again"
        )


def _delete_rows(connection: sa.Connection, table: sa.Table, key: str, recording: int) -> bool:
    """Delete some rows of a recording, those of the lowest keys; returns whether any were there."""
    mine, keys = table.c.recording_id == recording, table.c[key]
    query = sa.select(keys).where(mine).order_by(keys).limit(1)
    last = connection.scalar(query.offset(MAX_ROWS - 1))
    some = mine if last is None else sa.and_(mine, keys <= last)
    return connection.execute(sa.delete(table).where(some)).rowcount > 0


def _delete_blocks(connection: sa.Connection, recording: int) -> bool:
    """Delete some blocks of a recording, as many as a part may have bytes; returns whether any were there."""
    b = tables.sample_blocks.c
    query = sa.select(b.id, sa.func.length(b.data)).where(b.recording_id == recording)
    chosen: list[int] = []
    size = 0
    for block, length in connection.execute(query.order_by(b.number, b.seq).limit(MAX_ROWS)).all():
        size += length
        if chosen and size > MAX_BYTES:
            break
        chosen.append(block)
    if chosen:
        connection.execute(sa.delete(tables.sample_blocks).where(b.id.in_(chosen)))
    return bool(chosen)
