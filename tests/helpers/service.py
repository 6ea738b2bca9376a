"""The HTTP application in process: with a simulated bench in virtual time, and what it holds."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import httpx
from fastapi import FastAPI
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from labctl.api import create_app
from labctl.recording import Recording
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database

#: What an answer says beside its content.
SAID = ("content-type", "etag", "x-labctl-state", "x-labctl-due", "x-labctl-withdrawn", "warning")


def open_client(database: Path, bench: str = "single-axis-sim") -> TestClient:
    """Return a client of a service over `database`; entering it starts the service, leaving it closes it."""
    store = Store(Database(str(database), write=True))
    return TestClient(create_app(LabService(store, SystemClock(), BenchRunner(store, load_bench(bench), VirtualClock))))


def service_of(client: TestClient) -> LabService:
    """Return the service behind a client."""
    return cast(LabService, cast(FastAPI, client.app).state.service)


def add_recording(client: TestClient, recording: Recording) -> int:
    """Store a recording without a request; returns its number."""
    return service_of(client).store.recordings.add_import(recording, recording.info.started_at)


def transport_to(client: TestClient) -> httpx.MockTransport:
    """Return a transport whose requests reach the service of a test client without a port."""

    def answer(request: httpx.Request) -> httpx.Response:
        request.read()
        given = client.request(request.method, str(request.url), content=request.content, headers=dict(request.headers))
        headers = {name: given.headers[name] for name in SAID if name in given.headers}
        return httpx.Response(given.status_code, content=given.content, headers=headers)

    return httpx.MockTransport(answer)
