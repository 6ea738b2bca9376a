"""HTTP: what the pages ask for, beside what the command line says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from labctl.api import create_app
from labctl.services.bench_runner import BenchRunner
from labctl.services.house import House
from labctl.services.planning import load_bench
from labctl.store import Store
from labctl.store.database import Database

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FOG = "/api/units/OSU-FOG-2024"


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    runner = BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)
    with TestClient(create_app(House(store, SystemClock(), runner))) as opened:
        yield opened


@pytest.fixture
def fog(client: TestClient) -> TestClient:
    files = [path for path in (EXAMPLES / "osu-fog").iterdir() if path.suffix in {".toml", ".csv"}]
    sent = client.post("/api/recordings", files=[("files", (path.name, path.read_bytes())) for path in files])
    assert sent.status_code == 201
    assert client.post(f"{FOG}/calibrations", json={"model": "ojeda2000"}).status_code == 201
    return client


def test_a_version_says_whether_it_is_in_force(fog: TestClient) -> None:
    fitted = fog.post(f"{FOG}/calibrations", json={"effects": ["bias", "scale_factor"]}).json()
    version = fog.get(f"{FOG}/calibrations/2").json()
    assert version | fitted == version
    assert (version["recording"], version["parent"], version["in_force"], version["certification"]) == (
        1, None, False, None,
    )  # fmt: skip
    assert version["created_at"].endswith("Z")
    fog.post(f"{FOG}/calibrations/2/certify", json={"by": "A", "reason": "fits", "due_days": 365})
    now = fog.get(f"{FOG}/calibrations/2").json()
    assert now["in_force"] is True
    assert now["due"] == now["certification"]["due"] > now["created_at"]
    fog.post(f"{FOG}/calibrations/1/certify", json={"by": "B", "reason": "better"})
    replaced = fog.get(f"{FOG}/calibrations/2").json()
    assert (replaced["in_force"], replaced["due"], replaced["certification"]["by"]) == (False, None, "A")
    assert fog.get(f"{FOG}/calibrations/3").status_code == 404


def test_certifications_are_listed_newest_first(fog: TestClient) -> None:
    assert fog.get(f"{FOG}/certifications").json() == []
    fog.post(f"{FOG}/calibrations/1/certify", json={"by": "A", "reason": "fits", "due_days": 1})
    fog.post(f"{FOG}/calibrations/1/revoke", json={"by": "B", "reason": "dropped"})
    history = fog.get(f"{FOG}/certifications").json()
    assert [(act["version"], act["act"], act["by"], act["reason"]) for act in history] == [
        (1, "revoke", "B", "dropped"), (1, "certify", "A", "fits"),
    ]  # fmt: skip
    assert history[0]["due"] is None
    assert history[1]["due"] > history[1]["at"]
    assert fog.get("/api/units/NOBODY/certifications").status_code == 404
