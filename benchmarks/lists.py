"""Long lists: 10,000 certified units, 200 versions of one, 20,000 recordings, 2,000 campaigns with 200 events each."""

from __future__ import annotations

import tempfile
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

import sqlalchemy as sa
from fastapi.testclient import TestClient

from benchmarks.machine import describe
from instruments.clock import VirtualClock
from labctl.api import create_app
from labctl.recording import RecordingInfo
from labctl.services.lab_service import LabService
from labctl.store import NewCampaign, Store
from labctl.store.connection.database import Database
from labctl.store.schema import tables

UNITS, VERSIONS, RECORDINGS_OF_A_UNIT = 10_000, 200, 2
CAMPAIGNS, EVENTS, STEPS = 2_000, 200, 60
REPEATS = 7
#: A limit that the project has set itself, of one part of a list.
LIMIT_MS = 100.0
AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
#: When versions in force are due: after the time of the requests, and before it.
DUE = (datetime(2096, 1, 5, tzinfo=UTC), datetime(2020, 1, 5, tzinfo=UTC))
#: What pages and people ask for: the first part, a part in the middle, a search that finds one row, and few.
REQUESTS = {
    "units_first": "/api/units?limit=100",
    "units_middle": "/api/units?limit=100&after=G05000",
    "units_search": "/api/units?limit=100&search=g0777",
    "units_without_calibration": "/api/units?limit=100&calibration=none",
    "units_overdue": "/api/units?limit=100&calibration=overdue",
    "units_by_verdict": "/api/units?limit=100&verdict=missing",
    "units_due": "/api/units?limit=100&due_within=30d",
    "unit_with_200_versions": "/api/units/G00000",
    "recordings_first": "/api/recordings?limit=100",
    "recordings_search": "/api/recordings?limit=100&search=G07777",
    "campaigns_first": "/api/campaigns?limit=100",
    "campaigns_search": "/api/campaigns?limit=100&search=bench 7",
    "units_all": "/api/units",
}


def run() -> dict[str, float | str]:
    """Fill a database, then ask for parts of its lists; returns the median of each request's real and processor time.

    On a busy machine the real time is mostly that of other programs.
    """
    with tempfile.TemporaryDirectory() as folder:
        database = Database(str(Path(folder) / "lab.sqlite"), write=True)
        fill(Store(database), database)
        figures: dict[str, float] = {}
        with TestClient(create_app(LabService(Store(database), VirtualClock()))) as client:
            for name, address in REQUESTS.items():
                times, processor = [], []
                for _ in range(REPEATS):
                    begun_s, processor_s = perf_counter(), process_time()
                    client.get(address).raise_for_status()
                    times.append(perf_counter() - begun_s)
                    processor.append(process_time() - processor_s)
                figures |= {f"{name}_ms": 1000 * median(times), f"{name}_processor_ms": 1000 * median(processor)}
    return {**describe("fastapi", "sqlalchemy", "pydantic"), **figures}


def fill(store: Store, database: Database) -> None:
    """Write units with recordings and versions, and campaigns that have ended with steps and events."""
    step = {"kind": "acquire", "expected_s": 60.0, "rate_dps": 10.0}
    campaigns = [
        store.campaigns.create(NewCampaign("short", {}, f"bench {k % 50}", {}, "hash", 3600.0, [step] * STEPS, ()), AT)
        for k in range(CAMPAIGNS)
    ]
    event = {"at": AT, "kind": "note", "level": "info", "message": "something that happened in the campaign"}
    head = {"serial": "G", "axes": ["z"], "kind": "points", "started_at": AT}
    info = RecordingInfo.model_validate(head).model_dump(mode="json")
    made = {"document": b"{}", "answer": {}, "created_at": AT}
    with database.writing() as connection:
        connection.execute(sa.update(tables.campaigns).values(state="done"))
        for number in campaigns:
            rows = [{**event, "campaign_id": number, "t_s": float(k)} for k in range(EVENTS)]
            connection.execute(sa.insert(tables.events), rows)
        serials = [f"G{k:05d}" for k in range(UNITS)]
        units = [{"serial": serial, "model": "VG-35", "technology": "fog", "first_seen_at": AT} for serial in serials]
        connection.execute(sa.insert(tables.units), units)
        recordings = [
            {"serial": serial, "kind": "points", "info": {**info, "serial": serial}, "channels": [], "created_at": AT}
            for serial in serials
            for _ in range(RECORDINGS_OF_A_UNIT)
        ]
        connection.execute(sa.insert(tables.recordings), recordings)
        versions = [
            {"serial": "G00000", "version": k + 1, "model": "cubic", "hash": f"{k:064x}", **made}
            for k in range(VERSIONS)
        ]
        certified = [serial for k, serial in enumerate(serials) if k % 10]
        versions += [
            {"serial": serial, "version": 1, "model": "cubic", "hash": serial.zfill(64), **made} for serial in certified
        ]
        connection.execute(sa.insert(tables.calibrations), versions)
        act = {"version": 1, "act": "certify", "by": "Ada", "reason": "", "at": AT, "override": False}
        acts = [
            {**act, "serial": serial, "verdict": ("adequate", "missing")[k % 7 == 0], "due_at": DUE[k % 5 == 0]}
            for k, serial in enumerate(certified)
        ]
        connection.execute(sa.insert(tables.certifications), acts)
