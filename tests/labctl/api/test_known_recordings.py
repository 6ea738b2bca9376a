"""A page has what it shows of a recording, and gets it anew as soon as another process has changed the recording."""

from __future__ import annotations

from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock
from labctl.api import create_app
from labctl.services.lab_service import LabService
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.recording_writer import another_process
from tests.helpers.service import open_client

PATHS = ("/api/recordings/1/trace?channel=gyro_z&points=50", "/api/recordings/1/inspection")


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with recording 1, 15 data sets of a campaign, that no process has open."""
    database = tmp_path_factory.mktemp("known") / "lab.sqlite"
    with open_client(database) as client:
        number = client.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
        assert "campaign done" in client.get(f"/api/campaigns/{number}/events").text
    return database


@pytest.mark.slow
def test_what_another_process_changes_is_answered_anew(measured: Path) -> None:
    web = LabService(Store(Database(str(measured), write=False)), SystemClock())
    with another_process(measured) as bench, TestClient(create_app(web)) as client:

        def statuses() -> list[int]:
            """Ask for each answer with the tag that the page has of it, and keep the new one."""
            answers = [client.get(path, headers={"If-None-Match": tags.get(path, "")}) for path in PATHS]
            for path, answer in zip(PATHS, answers, strict=True):
                tags[path] = answer.headers["etag"]
                if answer.status_code == 200:
                    assert client.get(path).json() == answer.json()
                    shown[path] = answer.json()
                else:
                    assert (answer.content, client.get(path).json()) == (b"", shown[path])
            return [answer.status_code for answer in answers]

        tags: dict[str, str] = {}
        shown: dict[str, object] = {}
        assert statuses() == [200, 200]
        assert statuses() == [304, 304]
        for act in ("append", "environment", "correct rates", "correct rates again", "withdraw"):
            bench.carry_out(act)
            assert statuses() == [200, 200], act
            assert statuses() == [304, 304], act
        bench.carry_out("import another")
        assert statuses() == [304, 304], "another recording is none of this one"
