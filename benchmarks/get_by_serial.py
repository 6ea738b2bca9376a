"""GET of a calibration by serial number from 100,000 units: open loop at 500 requests per second."""

from __future__ import annotations

import asyncio
import hashlib
import json
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

import httpx
import numpy as np
import sqlalchemy as sa

from benchmarks.machine import describe
from labctl.store import open_store, tables

UNITS = 100_000
PER_S = 500
SECONDS = 10
AT = datetime(2026, 1, 1, tzinfo=UTC)


def fill(location: Path) -> None:
    """Write the units, each with one certified calibration of half a kilobyte."""
    with open_store(str(location), write=True):
        pass
    engine = sa.create_engine(f"sqlite:///{location}")
    with engine.begin() as connection:
        for start in range(0, UNITS, 10_000):
            serials = [f"G-{i:06d}" for i in range(start, start + 10_000)]
            documents = [json.dumps({"serial": s, "coefficients": [0.123456789] * 35}).encode() for s in serials]
            connection.execute(
                sa.insert(tables.units),
                [{"serial": s, "model": "", "technology": None, "first_seen_at": AT} for s in serials],
            )
            connection.execute(
                sa.insert(tables.calibrations),
                [
                    {
                        "serial": s, "version": 1, "parent": None, "recording_id": None, "model": "m", "created_at": AT,
                        "hash": hashlib.sha256(d).hexdigest(), "document": d, "answer": {},
                    }
                    for s, d in zip(serials, documents, strict=True)
                ],
            )  # fmt: skip
            connection.execute(
                sa.insert(tables.certifications),
                [
                    {"serial": s, "version": 1, "act": "certify", "by": "b", "reason": "r", "at": AT, "due_at": None}
                    for s in serials
                ],
            )
    engine.dispose()


async def load(url: str) -> np.ndarray:
    """Send requests at a fixed pace, whatever the answers do; returns their times in ms, from when each was due."""
    rng = np.random.default_rng(1)
    limits = httpx.Limits(max_connections=64, max_keepalive_connections=64)
    async with httpx.AsyncClient(base_url=url, limits=limits, timeout=30) as client:
        begun = time.perf_counter() + 0.5

        async def one(index: int) -> float:
            due = begun + index / PER_S
            await asyncio.sleep(max(due - time.perf_counter(), 0))
            answer = await client.get(f"/api/units/G-{rng.integers(UNITS):06d}/calibration")
            assert answer.status_code == 200
            return (time.perf_counter() - due) * 1e3

        return np.array(await asyncio.gather(*(one(i) for i in range(PER_S * SECONDS))))


def run() -> dict[str, float | str]:
    """Return p50, p99 and the largest answer time, of the client's and the server's work together."""
    with tempfile.TemporaryDirectory() as folder:
        location = Path(folder) / "lab.sqlite"
        fill(location)
        command = [sys.executable, "-m", "labctl", "serve", "--port", "0", "--json", "--database", str(location)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as service:
            assert service.stdout is not None
            url = next(line for line in service.stdout if '"url"' in line).split('"')[3]
            asyncio.run(load(url))
            times = asyncio.run(load(url))
            service.terminate()
    p50, p99 = np.percentile(times, [50, 99])
    return {**describe("fastapi", "uvicorn", "sqlalchemy", "httpx"), "requests_per_s": float(PER_S),
            "p50_ms": float(p50), "p99_ms": float(p99), "max_ms": float(times.max())}  # fmt: skip
