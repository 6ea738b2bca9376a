"""Transitions of a draft that another transaction makes: that of its campaign's plan, and of its version."""

from __future__ import annotations

from collections.abc import Mapping

import sqlalchemy as sa

from labctl.errors import Conflict
from labctl.store.schema import tables


def make_due(connection: sa.Connection, campaign: int, recordings: Mapping[int, str]) -> None:
    """Write down, with the plan of a campaign, that each of its recordings ends in a draft; recording -> serial."""
    rows = [
        {"recording_id": number, "campaign_id": campaign, "serial": serial, "state": "due"}
        for number, serial in recordings.items()
    ]
    if rows:
        connection.execute(sa.insert(tables.drafts), rows)


def mark_fitted(connection: sa.Connection, recording: int, version: int) -> None:
    """Note, in the transaction that keeps it, which version is the draft of a recording.

    Raises Conflict where another process has made it meanwhile.
    """
    d = tables.drafts
    mine = sa.update(d).where(d.c.recording_id == recording, d.c.state.in_(("due", "failed")))
    if connection.execute(mine.values(state="fitted", version=version, reason="")).rowcount != 1:
        raise Conflict(
            f"another process has made the draft of recording {recording} in the meantime; use the version that it made"
        )
