"""The audit trail: rows are only ever added, and each carries the hash of the one before."""

from __future__ import annotations

import hashlib
import json
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from labctl.store import tables

FIRST = "0" * 64


def append(
    connection: sa.Connection, at: datetime, actor: str, action: str, subject: str, detail: dict[str, Any]
) -> None:
    """Add a row to the trail, inside the transaction of the act that it records."""
    a = tables.audit.c
    previous = connection.scalar(sa.select(a.hash).order_by(a.id.desc()).limit(1)) or FIRST
    connection.execute(
        sa.insert(tables.audit).values(
            at=at,
            actor=actor,
            action=action,
            subject=subject,
            detail=detail,
            previous_hash=previous,
            hash=_hash(previous, at, actor, action, subject, detail),
        )
    )


def _hash(previous: str, at: datetime, actor: str, action: str, subject: str, detail: dict[str, Any]) -> str:
    body = json.dumps([previous, at.isoformat(), actor, action, subject, detail], sort_keys=True)
    return hashlib.sha256(body.encode()).hexdigest()


def first_broken(connection: sa.Connection) -> int | None:
    """Return the number of the first row that was changed, or follows one that is missing; None when all fit."""
    a = tables.audit.c
    previous = FIRST
    query = sa.select(a.id, a.at, a.actor, a.action, a.subject, a.detail, a.previous_hash, a.hash).order_by(a.id)
    for number, at, actor, action, subject, detail, before, own in connection.execute(query):
        if before != previous or own != _hash(before, at, actor, action, subject, detail):
            return int(number)
        previous = own
    return None
