"""What 50 watching clients cost a running campaign: each holds an event stream, as the bench page does."""

from __future__ import annotations

import asyncio
import tempfile
from pathlib import Path
from typing import Any

import httpx

from benchmarks.machine import describe
from benchmarks.served import Served, serve

WATCHERS = 50
POLL_INTERVAL_S = 0.25
DURATION_S, RATES = 4, 11
#: Three channels at 125 readings per second, in real time; only the soak is short.
RECIPE = f"""
format = "labctl-recipe/1"
name = "watched"
temperatures_c = [25]
rates_dps = [{", ".join(str(10 * (k - RATES // 2)) for k in range(RATES))}]
positions = ["z"]

[soak]
hold_s = 10
max_drift_c = 1.0
drift_window_s = 5

[acquire]
duration_s = {DURATION_S}
settle_s = 1
"""


def run() -> dict[str, float | str]:
    """Run the same campaign alone and with watching clients; returns what each took."""
    with tempfile.TemporaryDirectory() as folder, serve(Path(folder) / "lab.sqlite", "--simulate") as service:
        alone, watched = (asyncio.run(_campaign(service, watchers)) for watchers in (0, WATCHERS))
    return {
        **describe("fastapi", "uvicorn", "sqlalchemy"),
        "watchers": float(WATCHERS),
        **{
            f"{name}_{when}": value
            for when, found in (("alone", alone), ("watched", watched))
            for name, value in found.items()
        },
    }


async def _campaign(service: Served, watchers: int) -> dict[str, float]:
    """Run a campaign with a number of watching clients; returns the bench's time, the processor's share."""
    async with httpx.AsyncClient(base_url=service.url, timeout=60) as client:
        before = service.processor_s()
        status = (await client.post("/api/campaigns", json={"recipe": RECIPE})).raise_for_status().json()
        path = f"/api/campaigns/{status['id']}"
        looking = [asyncio.create_task(_look(service.port, path)) for _ in range(watchers)]
        while not (status := (await client.get(path)).json())["ended_at"]:
            await asyncio.sleep(POLL_INTERVAL_S)
        heard = sum(await asyncio.gather(*looking))
        taken = service.processor_s() - before
        recording = next(iter(status["recordings"].values()))
        sets: dict[str, Any] = (await client.get(f"/api/recordings/{recording}/datasets")).json()
        about: dict[str, Any] = (await client.get(f"/api/recordings/{recording}")).json()
    rate_hz = about["info"]["sample_rate_hz"]
    return {
        "bench_s": status["t_s"],
        "processor_percent": 100 * taken / status["t_s"],
        "datasets": float(len(sets["n"])),
        "datasets_short": float(sum(n < 0.99 * DURATION_S * rate_hz for n in sets["n"])),
        "pictures_heard": float(heard),
    }


async def _look(port: int, path: str) -> int:
    """Read an event stream to its end; returns how often it sent the status of the campaign."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(f"GET {path}/events HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
    heard = 0
    while line := await reader.readline():
        heard += line.startswith(b"event: progress")
    writer.close()
    return heard
