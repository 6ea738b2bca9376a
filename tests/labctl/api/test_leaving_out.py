"""HTTP: readings that are left out of an import by choice, with how many and why, as on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.services.recordings.importers import as_interchange
from tests.helpers.forked_commands import run_labctl

LOGS, PREVIEW = "/api/recordings/logs", "/api/recordings/logs/preview"
KINDS = ("time_back", "thermometer", "spikes")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log of 200 s at rest: three spikes, ten readings of a thermometer that is not there, and two rows exchanged."""
    rng, n = np.random.default_rng(7), 2000
    output, warm = 0.3 + 0.05 * rng.normal(size=n), 25 + 0.01 * rng.normal(size=n)
    output[[100, 700, 1500]] += 5.0
    warm[1000:1010] = -127.0
    order = np.arange(n)
    order[[50, 51]] = order[[51, 50]]
    lines = [f"{0.1 * k:.2f},{output[k]:.6f},{warm[k]:.3f}" for k in order]
    path = tmp_path / "worn.csv"
    path.write_text("\n".join(["time_s,gyro_z_dps,temperature_c", *lines]) + "\n")
    return path


def sent(path: Path) -> dict[str, tuple[str, bytes]]:
    return {"file": (path.name, path.read_bytes())}


def test_a_preview_says_what_is_wrong_and_what_can_be_left_out(client: TestClient, log: Path) -> None:
    seen = client.post(PREVIEW, files=sent(log)).json()
    assert {each["what"]: each["may_leave_out"] for each in seen["warnings"]} == {"time_back": True}
    assert "does not follow" in seen["problems"][0]
    again = client.post(PREVIEW, files=sent(log), data={"leave_out": ["time_back"]}).json()
    assert again["problems"] == []
    assert {each["what"] for each in again["warnings"]} == set(KINDS)


def test_what_is_left_out_is_what_the_command_leaves_out(client: TestClient, log: Path, tmp_path: Path) -> None:
    made = client.post(LOGS, files=sent(log), data={"leave_out": list(KINDS)})
    assert made.status_code == 201, made.text
    options = [word for kind in KINDS for word in ("--leave-out", kind)]
    database = ["--database", str(tmp_path / "other.db")]
    said = run_labctl(["import", str(log), "--accept-map", *options, "--json", *database])
    assert made.json()["left_out"] == json.loads(said.stdout)["left_out"]
    assert {each["what"]: each["n"] for each in made.json()["left_out"]}["thermometer"] == 10
    assert client.get("/api/recordings/1/inspection").json()["left_out"] == made.json()["left_out"]
    valid = np.asarray(client.get("/api/recordings/1/samples?dataset=1").json()["columns"]["valid"])
    assert (valid == 0).sum() == sum(each["n"] for each in made.json()["left_out"] if each["what"] != "time_back")


def test_a_recording_in_the_own_format_is_imported_without_them_too(client: TestClient, log: Path) -> None:
    with as_interchange(log, leave_out=["time_back"]) as folder:
        files = [("files", (path.name, path.read_bytes())) for path in sorted(folder.iterdir())]
    made = client.post("/api/recordings", files=files, data={"leave_out": ["spikes"]})
    assert made.status_code == 201, made.text
    assert {each["what"] for each in made.json()["left_out"]} == {"time_back", "spikes"}
    assert "spikes" not in {each["what"] for each in made.json()["warnings"]}


@pytest.mark.parametrize("path", [LOGS, PREVIEW])
def test_a_kind_that_cannot_be_left_out_is_refused(client: TestClient, log: Path, path: str) -> None:
    refused = client.post(path, files=sent(log), data={"leave_out": "gaps"})
    assert refused.status_code == 400
    assert "gaps: readings of this kind cannot be left out; choose from time_back, frozen" in refused.json()["detail"]
    assert client.get("/api/recordings").json() == []
