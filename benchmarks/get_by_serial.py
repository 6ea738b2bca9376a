"""GET of a calibration by serial number from 100,000 units: open loop at 500 requests per second."""

from __future__ import annotations

import asyncio
import hashlib
import json
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import sqlalchemy as sa

from benchmarks.machine import describe
from benchmarks.served import serve
from labctl.store import open_store
from labctl.store.schema import tables

UNITS = 100_000
PER_S = 500
SECONDS = 10
CONNECTIONS = 16
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


async def load(port: int) -> np.ndarray:
    """Send requests at a fixed pace, whatever the answers do; returns their times in ms, from when each was due.

    Plain sockets that are kept open: a client library would need more time than the server.
    """
    rng = np.random.default_rng(1)
    links: asyncio.Queue[tuple[asyncio.StreamReader, asyncio.StreamWriter]] = asyncio.Queue()
    for _ in range(CONNECTIONS):
        links.put_nowait(await asyncio.open_connection("127.0.0.1", port))
    begun = time.perf_counter() + 0.5

    async def one(index: int) -> float:
        due = begun + index / PER_S
        await asyncio.sleep(max(due - time.perf_counter(), 0))
        reader, writer = link = await links.get()
        serial = f"G-{rng.integers(UNITS):06d}"
        writer.write(f"GET /api/units/{serial}/calibration HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        head = await reader.readuntil(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 200")
        length = next(line for line in head.lower().split(b"\r\n") if line.startswith(b"content-length"))
        body = await reader.readexactly(int(length.split(b":")[1]))
        assert serial.encode() in body
        links.put_nowait(link)
        return (time.perf_counter() - due) * 1e3

    return np.array(await asyncio.gather(*(one(i) for i in range(PER_S * SECONDS))))


def run() -> dict[str, float | str]:
    """Return p50, p99 and the largest answer time, of the client's and the server's work together."""
    with tempfile.TemporaryDirectory() as folder:
        location = Path(folder) / "lab.sqlite"
        fill(location)
        with serve(location) as service:
            for _ in range(3):  # during the second the service loads what its computations need, on the other core
                times = asyncio.run(load(service.port))
    p50, p99 = np.percentile(times, [50, 99])
    return {**describe("fastapi", "uvicorn", "sqlalchemy"), "requests_per_s": float(PER_S),
            "p50_ms": float(p50), "p99_ms": float(p99), "max_ms": float(times.max())}  # fmt: skip
