"""The log of a service: one stream of its processes, without a secret, and without power over the bench."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from labctl.answers.admin import KeyRequest, Role
from labctl.services.admin.api_keys import create_key
from labctl.store import open_store
from tests.helpers.forked_commands import run_labctl
from tests.helpers.log_records import Record
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess, end_of, running

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
CAMPAIGN = {"json": {"recipe": "short"}, "headers": {"X-Request-ID": "begin-1"}}


def records(log: Path) -> list[Record]:
    """Return the records in what a service wrote to standard error; its last words to a person are none."""
    lines = log.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if not line.startswith("{")] == [
        line for line in lines if line.startswith("labctl: stopped")
    ]
    return [json.loads(line) for line in lines if line.startswith("{")]


def done(service: ServiceProcess, **request: object) -> int:
    """Run a campaign to its end; returns its number."""
    answer = service.http.post("/api/campaigns", **request)  # type: ignore[arg-type]
    assert answer.status_code == 201, answer.text
    campaign = int(answer.json()["id"])
    with service.following(campaign) as lines:
        assert any("campaign done" in line for line in lines)
    return campaign


def end(service: ServiceProcess) -> int:
    service.process.send_signal(signal.SIGTERM)
    return service.process.wait(timeout=WAIT_S)


def test_a_campaign_is_followed_through_all_processes_and_no_key_is_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LABCTL_LOG_LEVEL", "debug")  # all that there is
    database, log = tmp_path / "lab.sqlite", tmp_path / "log"
    with open_store(str(database), write=True) as store:
        keys = {role: create_key(store, KeyRequest(name=role.value, role=role), AT).key for role in Role}
    with running(database, "--speed", "0", "--require-keys", log=log) as service:
        service.http.headers["Authorization"] = f"Bearer {keys[Role.APPROVER]}"
        campaign = done(service, **CAMPAIGN)
        made = service.http.post("/api/keys", json={"name": "new", "role": "viewer"}).json()["key"]
        wrong = "labctl_" + "x" * 43
        assert service.http.get(f"/api/units?key={wrong}", headers={"Authorization": wrong}).status_code == 401
        fitted = service.http.post("/api/units/FOG-0001/calibrations", json={"effects": ["bias", "scale_factor"]})
        assert fitted.status_code == 201, fitted.text
        assert end(service) == 0
    text, reported = log.read_text(encoding="utf-8"), records(log)
    assert not [secret for secret in (*keys.values(), made, wrong, "Bearer") if secret in text]
    for process in ("supervisor", "bench", "web"):
        of_it = [each["event"] for each in reported if each["process"] == process]
        assert "process.started" in of_it, process
        assert of_it[-1] == "process.ended", process
    begun = [(each["process"], each["event"]) for each in reported if each.get("request_id") == "begin-1"]
    assert {("web", "request.ended"), ("bench", "campaign.planned")} <= set(begun)
    states = [each["state"] for each in reported if each["event"] == "campaign.state" and each["campaign"] == campaign]
    assert states == ["running", "done"]
    workers = [each["event"] for each in reported if each["event"].startswith("worker.")]
    assert workers == ["worker.started", "worker.ended"]


@pytest.mark.slow
@pytest.mark.parametrize(("shell", "log"), [("exec 2>&-", None), ("", Path("/dev/full"))])
def test_a_service_whose_log_cannot_be_written_runs_its_campaign(tmp_path: Path, shell: str, log: Path | None) -> None:
    """Only a shell starts a process with its standard error closed; one that is full is given to any process."""
    database = tmp_path / "lab.sqlite"
    with running(database, "--speed", "0", shell=shell, log=log) as service:
        campaign = done(service, **CAMPAIGN)
        assert service.http.get("/metrics").status_code == 200
        end(service)
    assert end_of(database, campaign) == ("done", "all steps done")


@pytest.fixture
def logging_service(tmp_path: Path) -> Iterator[tuple[ServiceProcess, Path]]:
    with running(tmp_path / "lab.sqlite", log=tmp_path / "log") as made:
        yield made, tmp_path / "log"


def test_a_child_that_dies_is_told_with_how_it_ended(logging_service: tuple[ServiceProcess, Path]) -> None:
    service, log = logging_service
    os.kill(service.web_pid, signal.SIGKILL)
    assert service.http.get("/health").status_code == 200  # by the next one
    assert end(service) == 0
    reported = [each for each in records(log) if each["event"].startswith("child.")]
    assert [(each["event"], each["child"], each.get("status")) for each in reported] == [
        ("child.ended", "web", -signal.SIGKILL), ("child.restarted", "web", None),
    ]  # fmt: skip
    assert reported[0]["child_pid"] == service.web_pid != reported[1]["child_pid"]


def test_a_command_logs_only_when_it_is_asked_to(tmp_path: Path) -> None:
    def run(level: str | None, status: int) -> subprocess.CompletedProcess[str]:
        environment = {name: value for name, value in os.environ.items() if name != "LABCTL_LOG_LEVEL"}
        environment |= {} if level is None else {"LABCTL_LOG_LEVEL": level}
        command = ["campaign", "start", "short", "--json", "--database", str(tmp_path / "lab.sqlite")]
        ended = run_labctl(command, environment=environment)
        assert ended.returncode == status, ended.stderr
        return ended

    quiet, asked, wrong = run(None, 0), run("info", 0), run("loud", 2)
    assert "{" not in quiet.stderr
    assert json.loads(quiet.stdout)["state"] == json.loads(asked.stdout)["state"] == "done"
    reported = [json.loads(line) for line in asked.stderr.splitlines() if line.startswith("{")]
    assert [each["state"] for each in reported if each["event"] == "campaign.state"] == ["running", "done"]
    assert (
        wrong.stderr
        == "labctl: LABCTL_LOG_LEVEL=loud is not a log level; set it to one of debug, info, warning, error, critical\n"
    )
