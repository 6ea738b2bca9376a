"""How much a request may carry, and that no word in it becomes a path."""

from __future__ import annotations

import builtins
import io
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from instruments.clock import SystemClock, VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.api import create_app
from labctl.api.access_policy import AccessPolicy
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.commands.registry import FIT, IMPORT_RECORDING
from labctl.services.commands.requests import RecordingFolder, ToUnit
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.paths import EXAMPLES, RECIPES

BODY, UPLOAD = 2_000, 100_000
UNIT = "OSU-FOG-2024"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    store = Store(Database(str(tmp_path_factory.mktemp("limits") / "lab.sqlite"), write=True))
    lab_service = LabService(store, SystemClock(), BenchRunner(store, load_bench("single-axis-sim"), VirtualClock))
    lab_service.execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
    lab_service.execute(FIT, ToUnit(UNIT, FitRequest(effects=["bias", "scale_factor"])))
    with TestClient(create_app(lab_service, AccessPolicy(body_bytes=BODY, upload_bytes=UPLOAD))) as opened:
        yield opened


def in_pieces(size: int) -> Iterator[bytes]:
    """A body whose length was not declared."""
    for _ in range(0, size, 500):
        yield b" " * 500


def is_too_large(answer: Any) -> bool:
    assert answer.headers["content-type"] == "application/problem+json"
    return bool(answer.status_code == 413 and answer.json()["type"] == "urn:labctl:problem:too-large")


@pytest.mark.parametrize(
    "path",
    ["campaigns", "backups", f"units/{UNIT}/calibrations", f"units/{UNIT}/calibrations/1/certify"],
)
def test_a_body_is_bounded_declared_or_not(client: TestClient, path: str) -> None:
    path = f"/api/{path}"
    as_json = {"Content-Type": "application/json"}
    assert is_too_large(client.post(path, content=b" " * (BODY + 1), headers=as_json))
    assert is_too_large(client.post(path, content=in_pieces(BODY + 500), headers=as_json))
    assert client.post(path, content=in_pieces(BODY - 500), headers=as_json).status_code == 422


def test_websocket_connections_are_refused(client: TestClient) -> None:
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/api/campaigns"):
        pass


def test_a_recording_is_bounded_in_size_and_in_files(client: TestClient) -> None:
    head = (EXAMPLES / "osu-fog" / "recording.toml").read_bytes()
    large = [("files", ("recording.toml", head)), ("files", ("points.csv", b"x" * UPLOAD))]
    assert is_too_large(client.post("/api/recordings", files=large))
    many = [("files", (f"{index}.csv", b"x")) for index in range(5)]
    assert is_too_large(client.post("/api/recordings", files=many))
    twice = [("files", ("recording.toml", head)), ("files", ("recording.toml", head))]
    answer = client.post("/api/recordings", files=twice)
    assert (answer.status_code, "more than once" in answer.json()["detail"]) == (400, True)
    assert len(client.get(f"/api/units/{UNIT}").json()["recordings"]) == 1


def test_a_full_disk_is_a_problem_document(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("labctl.services.recordings.transfer.shutil.copyfileobj", full)
    answer = client.post("/api/recordings", files=[("files", ("recording.toml", b"x"))])
    assert answer.status_code == 507
    assert "the disk is full" in answer.json()["detail"]


@pytest.fixture
def traps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Files that a path could lead to, reached absolutely and from here."""
    folder = tmp_path / "private"
    folder.mkdir()
    recipe = RECIPES / "short.toml"
    (folder / "secret.toml").write_text(recipe.read_text())
    (folder / "formulas.toml").write_text('[[effects]]\nid = "stolen"\nformula = "table_rate_dps"\n')
    monkeypatch.chdir(folder)
    here = ["secret.toml", "./secret.toml", "../private/secret.toml", "secret.toml\x00", "formulas.toml"]
    there = [str(folder / "secret.toml"), str(folder / "formulas.toml"), "/etc/passwd", "/proc/self/environ", "/"]
    near = ["short.toml", "short\x00", "../recipes/short", "~/x.toml", "file:///etc/passwd", "", ".", "\x00"]
    return [*here, *there, *near]


class Opened:
    """Every path that is opened while it watches, by any of the ways there are."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.paths: list[str] = []
        for owner, name in ((builtins, "open"), (io, "open"), (os, "open")):
            monkeypatch.setattr(owner, name, self.watched(getattr(owner, name)))

    def watched(self, real: Callable[..., Any]) -> Callable[..., Any]:
        def opening(path: Any, *rest: Any, **named: Any) -> Any:
            self.paths.append(str(path))
            return real(path, *rest, **named)

        return opening


@pytest.mark.slow
def test_no_word_in_a_request_becomes_a_path(
    client: TestClient, traps: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = Opened(monkeypatch)
    units = f"/api/units/{UNIT}"
    for trap in traps:
        answers = [
            client.post("/api/campaigns", json={"recipe": trap}),
            client.post("/api/campaigns", json={"recipe": trap, "at": "now"}),
            client.post("/api/campaigns", json={"recipe": "short", "at": trap}),
            client.post("/api/campaigns", json={"recipe": "short", "cron": trap}),
            client.post("/api/campaigns", json={"recipe": "short", "at": "now", "time_zone": trap}),
            client.post(f"{units}/calibrations/1/improve", json={"add": ["bias"], "formula": [trap]}),
            client.post(f"{units}/calibrations/1/improve", json={"add": [trap]}),
            client.post(f"{units}/calibrations", json={"model": trap}),
            client.get(f"{units}/calibrations/1/criticism", params={"formula": trap}),
            client.get(f"{units}/calibration", params={"version": 1, "format": trap}),
            client.post("/api/recordings", files=[("files", (trap, b"x"))]),
        ]
        assert {answer.status_code for answer in answers} <= {400, 422}, (trap, [a.text for a in answers])
        assert not any("stolen" in answer.text or "root:" in answer.text for answer in answers)
    note = {"file": "../private/secret.toml", "bytes": 1, "sha256": "0" * 64}
    assert client.post("/api/backups", json=note).status_code == 204  # a word for the trail; nothing is opened by it
    assert len(opened.paths) > 0
    assert [path for path in opened.paths if "private" in path or "passwd" in path or "environ" in path] == []


@pytest.mark.parametrize("serial", ["..", "../x", "/etc/passwd", "a/b", "%00", "..%2f..%2fetc%2fpasswd", "x%00y"])
def test_a_serial_number_is_only_ever_compared(client: TestClient, serial: str) -> None:
    answer = client.get(f"/api/units/{serial}/calibration")
    assert answer.status_code in {400, 404}


@pytest.mark.parametrize(
    "formula", ["a: 9**9**9**9", "a: 1/0", "a: " + "-" * 400, "a: " + "(" * 240 + "1" + ")" * 240, "a: 1e999"]
)
def test_a_formula_costs_what_it_looks_like(client: TestClient, formula: str) -> None:
    answer = client.get(f"/api/units/{UNIT}/calibrations/1/criticism", params={"formula": formula})
    assert answer.status_code in {200, 400}


def lines(count: int) -> list[str]:
    return [f"f{index}: sin({index + 1} * table_rate_dps)" for index in range(count)]


@pytest.mark.timeout(20)  # 2,000 of them took 35 s
def test_a_request_has_at_most_20_formulas(client: TestClient) -> None:
    version = f"/api/units/{UNIT}/calibrations/1"
    most = {"formula": [f"f{index}: {index}" for index in range(40)]}
    asked = [
        client.post(f"{version}/preview", json=most),
        client.post(f"{version}/improve", json=most),
        client.get(f"{version}/criticism", params={"formula": lines(21)}),
        client.get(f"{version}/criticism/events", params={"formula": lines(21)}),
    ]
    assert [answer.status_code for answer in asked] == [400] * 4
    assert all("more than 20 formulas" in answer.json()["detail"] for answer in asked)
    answer = client.post(f"{version}/preview", json={"add": ["dead_band"] * 40})
    assert (answer.status_code, "is given 40 times" in answer.json()["detail"]) == (400, True)
