"""A service with a simulated bench, asked in process."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from tests.helpers.service import open_client


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with open_client(tmp_path / "lab.sqlite") as opened:
        yield opened


@pytest.fixture
def ran(client: TestClient) -> TestClient:
    """Return a service that has run a campaign: recording 1, 15 data sets of 10 s on one axis."""
    number = client.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    assert "campaign done" in client.get(f"/api/campaigns/{number}/events").text
    return client
