"""The audit trail: rows are only ever added, each carries the hash of the one before, and a head counts them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from labctl.acting_user import actor
from labctl.answers.json_object import JsonObject
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests import chain
from labctl.store.paging import parts_of
from labctl.store.records import AuditRow
from labctl.store.repositories.records_by_name import records_of
from labctl.store.schema import tables
from labctl.store.schema.types import EPOCH

FIRST = "0" * 64
HEAD_ID = 1


@dataclass(frozen=True)
class Head:
    """How long the trail is, and the hash of its last row."""

    length: int
    hash: str


@dataclass(frozen=True)
class Broken:
    """The first row of the trail that does not fit, and why."""

    row: int
    what: str


def append(
    connection: sa.Connection,
    at: datetime,
    action: str,
    subject: str,
    detail: JsonObject,
    *,
    who: str | None = None,
) -> None:
    """Add a row to the trail, inside the transaction of the act that it records.

    `who` names the one who acted where that is not the authenticated caller; both are then in the row.
    """
    caller = actor()
    detail = {**detail, **({"via": caller.via} if caller.via else {})}
    if who is not None and who != caller.name:
        detail["caller"] = caller.name
    who = (who or caller.name)[:200]
    subject = subject[:300]
    h = tables.audit_head
    head = connection.execute(sa.select(h.c.length, h.c.hash).where(h.c.id == HEAD_ID).with_for_update()).first()
    previous = head.hash if head is not None else _last_hash(connection)
    digest = _hash(previous, at, who, action, subject, detail)
    connection.execute(
        sa.insert(tables.audit).values(
            at=at, actor=who, action=action, subject=subject, detail=detail, previous_hash=previous, hash=digest
        )
    )
    chain.note_audit_row(connection, at)
    if head is not None:  # a head that was removed is never made again: verification reports that it is missing
        connection.execute(sa.update(h).where(h.c.id == HEAD_ID).values(length=head.length + 1, hash=digest))


def _last_hash(connection: sa.Connection) -> str:
    a = tables.audit.c
    return connection.scalar(sa.select(a.hash).order_by(a.id.desc()).limit(1)) or FIRST


def _hash(previous: str, at: datetime, who: str, action: str, subject: str, detail: JsonObject) -> str:
    body = json.dumps([previous, at.isoformat(), who, action, subject, detail], sort_keys=True, allow_nan=False)
    return hashlib.sha256(body.encode()).hexdigest()


def _hash_of_row(previous: str, at_us: Any, who: Any, action: Any, subject: Any, detail: Any) -> str | None:
    """Return the hash of a row as it is in the table; None when its content is nothing that labctl writes."""
    try:
        at = EPOCH + timedelta(microseconds=int(at_us))
        return _hash(previous, at, who, action, subject, json.loads(detail))
    except (ValueError, TypeError, OverflowError):
        return None


def first_broken(connection: sa.Connection, anchor: Head | None = None) -> Broken | None:
    """Return the first row that was changed, moved, or follows a missing one; None when all fit.

    The head tells of rows cut off the end. An `anchor` is a head that was noted down elsewhere: with it even a trail
    that was written anew from some row on is found.
    """
    a = tables.audit.c
    previous, last, length = FIRST, 0, 0
    # not converted: what another program wrote there need not be an instant, or JSON
    at, detail = sa.type_coerce(a.at, sa.BigInteger), sa.cast(a.detail, sa.Text)
    query = sa.select(a.id, at, a.actor, a.action, a.subject, detail, a.previous_hash, a.hash).order_by(a.id)
    for number, *content, before, digest in connection.execute(query):
        if digest != _hash_of_row(before, *content):
            return Broken(int(number), "its content was changed")
        if before != previous:
            return Broken(
                int(number), f"this row does not follow row {last}: a row between them is missing, or rows were moved"
            )
        previous, last, length = digest, int(number), length + 1
        if anchor is not None and length == anchor.length and digest != anchor.hash:
            return Broken(last, "this row is not the row that the anchor names: the trail was rewritten")
    if anchor is not None and length < anchor.length:
        return Broken(last + 1, f"{anchor.length - length} rows that the anchor counts are missing at the end")
    return _end_broken(connection, Head(length, previous), last)


def _end_broken(connection: sa.Connection, stored_head: Head, last: int) -> Broken | None:
    head = head_of(connection)
    if head is None:
        return Broken(last, "the head of the trail, which counts its rows, is missing")
    if stored_head.length < head.length:
        return Broken(last + 1, f"{head.length - stored_head.length} rows are missing at the end")
    if stored_head != head:
        return Broken(
            last, "this row is not the last row that the head of the trail names: rows were added without labctl"
        )
    return None


def head_of(connection: sa.Connection) -> Head | None:
    """Return the head of the trail; None when it was removed."""
    h = tables.audit_head.c
    row = connection.execute(sa.select(h.length, h.hash).where(h.id == HEAD_ID)).first()
    return None if row is None else Head(int(row.length), str(row.hash))


class Audit:
    """The audit trail of a database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def record(self, at: datetime, action: str, subject: str, detail: JsonObject, *, who: str | None = None) -> None:
        """Add a row for an act that changes nothing else in the database."""
        with self._database.writing() as connection:
            append(connection, at, action, subject, detail, who=who)

    def rows(self, *, since: datetime | None = None, after: int = 0, limit: int = 1000) -> list[AuditRow]:
        """Return rows in order: those from `since` on, with a number above `after`, at most `limit`."""
        a = tables.audit.c
        query = sa.select(a.id, a.at, a.actor.label("who"), a.action, a.subject, a.detail, a.hash).where(a.id > after)
        if since is not None:
            query = query.where(a.at >= since)
        with self._database.reading() as connection:
            return records_of(AuditRow, connection.execute(query.order_by(a.id).limit(limit)))

    def simulated_recordings(self, recordings: Sequence[int]) -> set[int]:
        """Return which of some recordings were made by a simulation in this database, as its act says."""
        a = tables.audit.c
        subjects = {f"recording {number}": number for number in recordings}
        simulated: set[int] = set()
        with self._database.reading() as connection:
            for some in parts_of(list(subjects)):
                query = sa.select(a.subject).where(a.action == "simulate", a.subject.in_(some))
                simulated |= {subjects[subject] for subject in connection.scalars(query)}
        return simulated

    def head(self) -> Head | None:
        """Return how long the trail is and the hash of its last row; None when the head was removed."""
        with self._database.reading() as connection:
            return head_of(connection)

    def first_broken(self, anchor: Head | None = None) -> Broken | None:
        """Return the first row that does not fit; None when the trail is whole."""
        with self._database.reading() as connection:
            return first_broken(connection, anchor)
