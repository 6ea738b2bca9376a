"""Requests to certify a version that a second person has to release: the newest of a version counts, until an act."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import RELEASE_REQUEST
from labctl.store.repositories.audit import append
from labctl.store.repositories.records_by_name import records_of
from labctl.store.schema import tables
from labctl.store.sealing.seals import seal


@dataclass(frozen=True)
class NewReleaseRequest:
    """What a first person asks to certify."""

    serial: str
    version: int
    by: str
    by_key: str
    reason: str
    at: datetime
    due_days: int | None
    override: bool


@dataclass(frozen=True)
class ReleaseRequestRow(NewReleaseRequest):
    """Such a request as it is kept."""

    id: int


class ReleaseRequests:
    """Every such request; one that was released, or that an act on its version has overtaken, waits no longer."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def add(self, new: NewReleaseRequest) -> ReleaseRequestRow:
        """Keep a request; an earlier one of the version waits no longer."""
        r = tables.release_requests
        with self._database.writing() as connection:
            values = {
                "serial": new.serial, "version": new.version, "by": new.by, "by_key": new.by_key, "reason": new.reason,
                "at": new.at, "due_days": new.due_days, "override": new.override,
                "after_act": newest_act(connection, new.serial, new.version),
            }  # fmt: skip
            number = int(connection.scalar(sa.insert(r).values(**values).returning(r.c.id)) or 0)
            detail = {"by": new.by, "reason": new.reason, "due_days": new.due_days, "override": new.override}
            append(connection, new.at, "certify request", f"{new.serial} version {new.version}", detail, who=new.by_key)
            seal(connection, (RELEASE_REQUEST.name, str(number)), new.at, "asked for")
        return ReleaseRequestRow(**vars(new), id=number)

    def waiting(self, serial: str) -> list[ReleaseRequestRow]:
        """Return the requests of a unit that wait for a second person, newest first."""
        r, x = tables.release_requests.c, tables.certifications.c
        newer = tables.release_requests.alias()
        query = sa.select(
            r.serial, r.version, r.by, r.by_key, r.reason, r.at, r.due_days, r.override, r.id
        ).where(
            r.serial == serial,
            ~sa.exists().where(x.serial == r.serial, x.version == r.version, x.id > r.after_act),
            ~sa.exists().where(newer.c.serial == r.serial, newer.c.version == r.version, newer.c.id > r.id),
        )  # fmt: skip
        with self._database.reading() as connection:
            return records_of(ReleaseRequestRow, connection.execute(query.order_by(r.id.desc())))


def newest_act(connection: sa.Connection, serial: str, version: int) -> int:
    """Return the number of the newest act of certifying or revoking a version; 0 where there is none."""
    x = tables.certifications.c
    query = sa.select(sa.func.max(x.id)).where(x.serial == serial, x.version == version)
    return int(connection.scalar(query) or 0)


def waits(connection: sa.Connection, request: int, serial: str, version: int) -> bool:
    """Return whether a request still waits, inside the transaction that releases it."""
    r = tables.release_requests.c
    newest = connection.execute(
        sa.select(r.id, r.after_act).where(r.serial == serial, r.version == version).order_by(r.id.desc()).limit(1)
    ).first()
    return newest is not None and newest.id == request and newest.after_act == newest_act(connection, serial, version)
