"""The list of campaigns: `GET /api/campaigns` over 1,000 campaigns with 1,000 events each."""

from __future__ import annotations

import tempfile
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter

import sqlalchemy as sa
from fastapi.testclient import TestClient

from benchmarks.machine import describe
from instruments.clock import VirtualClock
from labctl.api import create_app
from labctl.services.lab_service import LabService
from labctl.store import NewCampaign, Store
from labctl.store.connection.database import Database
from labctl.store.schema import tables

CAMPAIGNS, EVENTS, STEPS = 1000, 1000, 60
REPEATS = 5
AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


def run() -> dict[str, float | str]:
    """Fill a database, then list its campaigns; returns the time and the number of SQL statements of one request."""
    with tempfile.TemporaryDirectory() as folder:
        database = Database(str(Path(folder) / "lab.sqlite"), write=True)
        store = Store(database)
        fill(store, database, CAMPAIGNS, EVENTS)
        statements: list[str] = []
        sa.event.listen(sa.Engine, "before_cursor_execute", lambda *given: statements.append(given[2]))
        with TestClient(create_app(LabService(store, VirtualClock()))) as client:
            client.get("/api/campaigns").raise_for_status()
            statements.clear()
            begun_s = perf_counter()
            for _ in range(REPEATS):
                client.get("/api/campaigns").raise_for_status()
            took_s = (perf_counter() - begun_s) / REPEATS
    return {
        **describe("fastapi", "sqlalchemy", "pydantic"),
        "campaigns": float(CAMPAIGNS),
        "events_per_campaign": float(EVENTS),
        "request_s": took_s,
        "statements_per_request": len(statements) / REPEATS,
    }


def fill(store: Store, database: Database, campaigns: int, events: int) -> None:
    """Write campaigns that have ended, each with steps and events, into an empty database."""
    step = {"kind": "acquire", "expected_s": 60.0, "rate_dps": 10.0}
    for _ in range(campaigns):
        store.campaigns.create(NewCampaign("short", {}, "bench", {}, "hash", 3600.0, [step] * STEPS, ()), AT)
    event = {"at": AT, "kind": "note", "level": "info", "message": "something that happened in the campaign"}
    with database.writing() as connection:
        connection.execute(sa.update(tables.campaigns).values(state="done"))
        for number in range(1, campaigns + 1):
            connection.execute(
                sa.insert(tables.events), [{**event, "campaign_id": number, "t_s": float(k)} for k in range(events)]
            )
