"""A service is killed between the last step of a campaign and its draft: the next one makes the draft, once."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from labctl.store import open_store
from tests.helpers.drafted_recipe import DRAFTED
from tests.helpers.processes import ServiceProcess, running

FAST = ("--speed", "0")
UNIT = "FOG-0001"


def drafts(database: Path) -> list[tuple[str, int | None]]:
    with open_store(str(database), write=False) as store:
        return [(row.state, row.version) for row in store.drafts.of_campaign(1)]


def versions(database: Path) -> list[int]:
    with open_store(str(database), write=False) as store:
        return list(store.calibrations.versions(UNIT))


def traces(database: Path) -> tuple[int, int]:
    """Return how many events and audit entries tell of a draft."""
    with open_store(str(database), write=False) as store:
        events = [event for event in store.campaigns.events(1) if event.kind == "draft"]
        return len(events), len([row for row in store.audit.rows() if row.action == "draft"])


def until_done(database: Path) -> None:
    """Wait, without the service's help, until the last step is written."""
    with open_store(str(database), write=False) as store:
        while store.campaigns.get(1).state != "done":
            pass  # the test has a time-out


def until_drafted(service: ServiceProcess) -> None:
    while service.http.get("/api/campaigns/1").json()["drafts"][0]["state"] != "made":
        pass  # the test has a time-out


@pytest.mark.slow
def test_a_draft_that_was_due_when_everything_was_killed_is_made_once_by_the_next_service(tmp_path: Path) -> None:
    database = tmp_path / "lab.sqlite"
    with running(database, *FAST) as service:
        service.http.post("/api/campaigns", json={"recipe": DRAFTED}).raise_for_status()
        os.kill(service.process.pid, signal.SIGSTOP)  # it would start another web process,
        os.kill(service.web_pid, signal.SIGSTOP)  # which makes drafts; the bench process goes on alone
        until_done(database)
    assert drafts(database) == [("due", None)]  # all three were killed in between
    assert versions(database) == []

    with running(database, *FAST) as heir:
        until_drafted(heir)
        found = heir.http.get("/api/campaigns/1").json()["drafts"]
        assert [(each["state"], each["version"], each["certified"]) for each in found] == [("made", 1, False)]
        assert heir.http.post("/api/campaigns/1/drafts", json={"again": True}).json()["drafts"] == found
    assert drafts(database) == [("made", 1)]
    assert versions(database) == [1]
    assert traces(database) == (1, 1)
