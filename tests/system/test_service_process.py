"""A running service holds the database: commands ask it, a second one is refused, and its end leaves the bench safe."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from labctl.answers.admin import KeyRequest, Role
from labctl.config import os_user
from labctl.services.admin.api_keys import create_key
from labctl.store import check, holder_of, open_store
from tests.helpers.paths import EXAMPLES
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess, end_of, labctl, running
from tests.helpers.waiting import before_next_request

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture
def service(tmp_path: Path) -> Iterator[ServiceProcess]:
    with running(tmp_path / "lab.sqlite") as made:
        yield made


@pytest.fixture(scope="module")
def lasting_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """A service for the tests that neither end it nor run a campaign, and leave nothing that another asks for.

    Its processes are those of a user: they load their modules. Answers are kept for the run (`cache_of_fixtures`).
    """
    with running(tmp_path_factory.mktemp("lasting") / "lab.sqlite", loads=True) as made:
        yield made


@pytest.mark.slow
def test_commands_ask_the_service_that_holds_the_database(lasting_service: ServiceProcess) -> None:
    service = lasting_service
    assert json.loads(service.run("import", str(EXAMPLES / "osu-fog"), "--json").stdout)["datasets"] == 695
    fitted = json.loads(service.run("fit", "OSU-FOG-2024", "--model", "ojeda2000", "--json").stdout)
    assert fitted["version"] == 1
    refused = service.run("fit", "NO_SERVICE", status=2)
    assert "unit 'NO_SERVICE' is not in this database" in refused.stderr
    service.run("certify", "OSU-FOG-2024", "1", "--by", "A. Person", "--reason", "first look")
    answer = service.http.get("/api/units/OSU-FOG-2024/calibration")
    assert answer.json()["version"] == 1
    again = service.http.get("/api/units/OSU-FOG-2024/calibration", headers={"If-None-Match": answer.headers["etag"]})
    assert again.status_code == 304
    service.run("revoke", "OSU-FOG-2024", "1", "--by", "A. Person", "--reason", "thought again")
    assert service.http.get("/api/units/OSU-FOG-2024/calibration").status_code == 404


def test_what_happens_to_the_terminal_of_a_service_is_not_for_its_processes(lasting_service: ServiceProcess) -> None:
    for pid in (lasting_service.bench_pid, lasting_service.web_pid):
        assert os.getsid(pid) == pid


def test_a_second_service_is_refused_and_told_where_the_first_is(lasting_service: ServiceProcess) -> None:
    refused = lasting_service.run("serve", "--port", "0", status=2)
    assert lasting_service.url in refused.stderr


def test_a_campaign_is_aborted_from_the_command_line(service: ServiceProcess) -> None:
    campaign = service.http.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    busy = service.http.post("/api/campaigns", json={"recipe": "short"})
    assert busy.status_code == 409
    answer = json.loads(service.run("campaign", "abort", str(campaign), "--reason", "tea", "--json").stdout)
    assert (answer["state"], "tea" in answer["reason"]) == ("aborted", True)
    assert json.loads(service.run("campaign", "status", str(campaign), "--json").stdout)["state"] == "aborted"
    again = service.run("campaign", "abort", str(campaign), status=2)
    assert "aborted" in again.stderr


@pytest.mark.slow
def test_a_service_begins_what_was_entered_before_it_ran_and_while_it_runs(tmp_path: Path) -> None:
    database = tmp_path / "lab.sqlite"
    command = labctl(database, "campaign", "start", "short", "--at", "now", "--json", "--bench", "single-axis-sim")
    before = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert (before["state"], "no service runs" in before["note"]) == ("waiting", True)
    with running(database) as service:
        assert begun(service, before["id"])["campaign"] == 1
        queued = json.loads(service.run("campaign", "start", "short", "--at", "now", "--json").stdout)
        assert "no service" not in queued["note"]
        assert service.http.get(f"/api/schedule/{queued['id']}").json()["history"] == []
        service.run("campaign", "abort", "1", status=0)
        service.run("bench", "clear", "single-axis-sim", "--by", "Ada")  # after a stop nothing moves by itself
        assert begun(service, queued["id"])["campaign"] == 2


def begun(service: ServiceProcess, start: int) -> Any:
    """Wait until an entry's first start was begun."""
    while True:
        history = service.http.get(f"/api/schedule/{start}").json()["history"]
        if history and history[0]["outcome"] != "claimed":
            assert history[0]["outcome"] == "started", history
            return history[0]
        before_next_request()


def test_sigterm_ends_the_campaign_in_the_safe_state(service: ServiceProcess) -> None:
    campaign = service.http.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    service.process.send_signal(signal.SIGTERM)
    assert service.process.wait(timeout=WAIT_S) in {0, -signal.SIGTERM}
    answer = json.loads(service.run("campaign", "status", str(campaign), "--json").stdout)
    assert answer["state"] == "aborted"
    assert "the service stops" in answer["reason"]


def test_a_listener_does_not_keep_a_service_from_making_its_bench_safe(service: ServiceProcess) -> None:
    campaign = service.http.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    with service.following(campaign) as reported:
        next(reported)
        service.process.send_signal(signal.SIGTERM)
        assert "event: state" in list(reported)  # the stream ends by itself, with the campaign
    assert service.process.wait(timeout=WAIT_S) == 0
    with open_store(str(service.database), write=False) as store:
        row = store.campaigns.get(campaign)
    assert (row.state, "the service stops" in row.reason) == ("aborted", True)
    assert row.started_at is not None
    assert row.ended_at is not None
    assert (row.ended_at - row.started_at).total_seconds() < 0.5 * row.expected_s  # not at its own end


def test_a_request_that_never_ends_does_not_either(service: ServiceProcess) -> None:
    campaign = service.http.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    address = service.url.partition("://")[2]
    with socket.create_connection(("127.0.0.1", int(address.rpartition(":")[2]))) as stalled:
        body = "Content-Type: multipart/form-data; boundary=x\r\nContent-Length: 1000\r\n\r\n"
        stalled.sendall(f"POST /api/recordings HTTP/1.1\r\nHost: {address}\r\n{body}".encode())
        assert service.http.get("/health").status_code == 200  # by now it waits for that body
        with service.following(campaign) as reported:
            next(reported)
            service.process.send_signal(signal.SIGTERM)
            assert "event: state" in list(reported)  # the stream ends with the campaign
        assert end_of(service.database, campaign)[0] == "aborted"
        service.process.send_signal(signal.SIGINT)
        assert service.process.wait(timeout=WAIT_S) == 0
    assert holder_of(str(service.database)) is None


def test_a_page_that_a_browser_was_led_to_cannot_reach_the_service(lasting_service: ServiceProcess) -> None:
    service = lasting_service
    assert service.http.get("/api/units").status_code == 200
    assert service.http.get("/api/units", headers={"Host": "evil.example"}).status_code == 403
    origin = {"Origin": "http://evil.example"}
    assert service.http.post("/api/campaigns", json={"recipe": "short"}, headers=origin).status_code == 403
    assert service.http.head("/api/units/NO_SERVICE/calibrations").status_code == 404


def test_a_backup_of_a_database_that_a_service_holds(service: ServiceProcess, tmp_path: Path) -> None:
    answer = json.loads(service.run("backup", str(tmp_path / "copy.sqlite"), "--json").stdout)
    assert (answer["noted"], answer["findings"]) == (True, [])
    (row,) = service.http.get("/api/audit").json()
    assert (row["who"], row["action"], row["subject"]) == (os_user(), "backup", "copy.sqlite")
    assert row["detail"] == {"bytes": answer["bytes"], "sha256": answer["sha256"], "via": "loopback"}
    assert check(str(service.database)).findings == ()


def test_a_service_with_keys_asks_the_command_line_too(tmp_path: Path) -> None:
    database = tmp_path / "lab.sqlite"
    with open_store(str(database), write=True) as store:
        keys = {role: create_key(store, KeyRequest(name=role.value, role=role), AT).key for role in Role}
    with running(database, "--host", "0.0.0.0") as service:
        assert service.url.startswith("http://0.0.0.0:")
        assert "$LABCTL_KEY" in service.run("import", str(EXAMPLES / "osu-fog"), status=2).stderr
        service.run("import", str(EXAMPLES / "osu-fog"), key=keys[Role.OPERATOR])
        approver = {"Authorization": f"Bearer {keys[Role.APPROVER]}", "Host": "lab.example"}
        service.http.post("/api/keys/operator/revoke", json={"reason": "lost"}, headers=approver)
        assert "revoked" in service.run("fit", "OSU-FOG-2024", status=2, key=keys[Role.OPERATOR]).stderr
        rows = service.http.get("/api/audit", headers=approver).json()[3:]
        reported = [(row["who"], row["action"], row["detail"]["via"]) for row in rows]
        assert reported == [("operator", "import", "key"), ("approver", "key revoke", "key")]
        assert service.http.get("/health").json().keys() == {"status", "version"}


def test_a_service_that_is_interrupted_twice_ends_its_campaign_first(service: ServiceProcess) -> None:
    service.run("campaign", "start", "short")
    service.wait_for_data_set(1)
    service.process.send_signal(signal.SIGINT)
    service.process.send_signal(signal.SIGINT)
    _, said = service.process.communicate(timeout=WAIT_S)
    assert "stopped; bench single-axis-sim is safe" in said
    state, reason = end_of(service.database)
    assert (state, "the service stops" in reason) == ("aborted", True)


@pytest.mark.slow
def test_a_proxy_of_the_laboratory_is_neither_asked_nor_told_a_key(
    lasting_service: ServiceProcess, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    service = lasting_service
    monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:9")
    monkeypatch.setenv("ALL_PROXY", "http://127.0.0.1:9")
    service.run("backup", str(tmp_path / "copy.sqlite"))
    assert "scheduled start 7 is not" in service.run("campaign", "schedule", "cancel", "7", status=2).stderr
