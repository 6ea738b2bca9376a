"""The audit trail: every act is in it, and changed, removed, moved or cut rows are detected."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from instruments.clock import SystemClock, VirtualClock
from labctl.acting_user import Actor, acting
from labctl.answers.campaigns import CampaignRequest, CampaignResponse, ConfirmRequest, ReasonRequest
from labctl.api import create_app
from labctl.api.access_policy import ASKING
from labctl.cli.app import app
from labctl.config import os_user
from labctl.errors import BadInput
from labctl.services.admin.audit import anchor_of, verify_audit
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.status import campaign_status
from labctl.services.commands.acts.abort import ABORT
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.acts.catalogue import CAMPAIGN_ACTS
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store, migrate, migrate_database, open_store
from labctl.store.connection.database import Database
from procedures.contracts.control import Control
from tests.helpers.certifying import OVERRIDE, OVERRIDE_OPTIONS, REASON
from tests.helpers.paths import EXAMPLES
from tests.helpers.written_logs import at_rest, csv_text

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture
def location(tmp_path: Path) -> str:
    return str(tmp_path / "lab.sqlite")


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    with open_store(location, write=True) as opened:
        for index in range(6):
            with acting(Actor(f"person {index}", "key")):
                opened.audit.record(AT + timedelta(hours=index), "test", f"thing {index}", {"value": 0.1 * index})
        yield opened


def tamper(location: str, *statements: str) -> None:
    with sqlite3.connect(location) as raw:
        for statement in statements:
            raw.execute(statement)
    raw.close()


def test_an_untouched_audit_trail_verifies(store: Store) -> None:
    assert store.audit.first_broken() is None
    answer = verify_audit(store)
    assert (answer.ok, answer.rows) == (True, 6)
    rows = store.audit.rows()
    assert [(row.who, row.action, row.subject) for row in rows[:2]] == [
        ("person 0", "test", "thing 0"),
        ("person 1", "test", "thing 1"),
    ]
    assert rows[1].detail == {"value": 0.1, "via": "key"}
    assert answer.anchor == f"6:{rows[-1].hash}"
    assert [row.id for row in store.audit.rows(since=AT + timedelta(hours=4))] == [5, 6]
    assert [row.id for row in store.audit.rows(after=1, limit=2)] == [2, 3]


@pytest.mark.parametrize(
    ("statements", "row", "says"),
    [
        (["UPDATE audit SET actor = 'somebody else' WHERE id = 2"], 2, "content"),
        (["UPDATE audit SET at = at + 1 WHERE id = 4"], 4, "content"),
        (["UPDATE audit SET detail = '{}' WHERE id = 6"], 6, "content"),
        (["UPDATE audit SET previous_hash = hash WHERE id = 1"], 1, "content"),
        (["DELETE FROM audit WHERE id = 1"], 2, "does not follow"),
        (["DELETE FROM audit WHERE id = 4"], 5, "does not follow row 3"),
        (["UPDATE audit SET id = 100 WHERE id = 3"], 4, "does not follow row 2"),
        (["UPDATE audit SET id = 107 - id WHERE id IN (3, 4)",
          "UPDATE audit SET id = id - 100 WHERE id > 100"], 3, "does not follow row 2"),
        (["DELETE FROM audit WHERE id = 6"], 6, "1 rows are missing at the end"),
        (["DELETE FROM audit WHERE id > 2"], 3, "4 rows are missing at the end"),
        (["DELETE FROM audit"], 1, "6 rows are missing at the end"),
        (["DELETE FROM audit_head"], 6, "head of the trail"),
        (["DELETE FROM audit WHERE id = 6", "UPDATE audit_head SET length = 5"], 5, "not the last row"),
    ],
)  # fmt: skip
def test_tampering_names_the_first_bad_row(
    store: Store, location: str, statements: list[str], row: int, says: str
) -> None:
    tamper(location, *statements)
    broken = store.audit.first_broken()
    assert broken is not None
    assert broken.row == row
    assert says in broken.what


def test_acts_after_the_tampering_do_not_heal_it(store: Store, location: str) -> None:
    tamper(location, "DELETE FROM audit WHERE id > 4")
    store.audit.record(AT, "test", "later", {})
    broken = store.audit.first_broken()
    assert broken is not None
    assert broken.row == 5
    tamper(location, "DELETE FROM audit_head")
    store.audit.record(AT, "test", "later still", {})
    assert store.audit.head() is None


def test_an_anchor_kept_elsewhere_finds_a_trail_that_was_written_anew(store: Store, location: str) -> None:
    anchor = verify_audit(store).anchor
    assert anchor is not None
    store.audit.record(AT, "test", "after the anchor", {})
    assert verify_audit(store, anchor).ok
    tamper(location, "DELETE FROM audit", f"UPDATE audit_head SET length = 0, hash = '{'0' * 64}'")
    for index in range(6):
        store.audit.record(AT, "test", f"a nicer thing {index}", {})
    assert verify_audit(store).ok
    answer = verify_audit(store, anchor)
    assert (answer.ok, answer.row) == (False, 6)
    for text in ("6", "x:" + "0" * 64, "6:abc", "0:" + "0" * 64):
        with pytest.raises(BadInput, match="--anchor"):
            anchor_of(text)


def test_rows_of_before_the_head_get_one(location: str) -> None:
    """A database that stood at the first step, with a trail in it, is whole after migrating."""
    database = Database(location, write=True)
    with Store(database).audit._database.writing() as connection:
        config = migrate.configuration(connection)
        command.downgrade(config, "0001")
    database.close()
    columns = "at, actor, action, subject, detail, previous_hash, hash"
    first = "36d0cc4b23df7b1a40e0cb3c9b5a6c5c9d4b4a9f5a9f6f4f7a8d9b0c1d2e3f40"
    tamper(location, f"INSERT INTO audit ({columns}) VALUES (1, 'A', 'fit', 'G 1', '{{}}', '{'0' * 64}', '{first}')")
    migrate_database(location, copy=False)
    with open_store(location, write=True) as store:
        head = store.audit.head()
        assert head is not None
        assert (head.length, head.hash) == (1, first)


@pytest.mark.slow
def test_a_campaign_is_recorded_in_the_audit_trail(location: str) -> None:
    with open_store(location, write=True) as store:
        with acting(Actor("A. Person", "key")):
            prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
        run(store, prepared)
        rows = store.audit.rows()
        story = [(row.who, row.action, row.detail.get("state", row.detail.get("recipe"))) for row in rows]
        assert story[0] == ("A. Person", "campaign start", "short")
        assert story[1] == ("labctl", "campaign state", "running")
        assert story[-1] == ("labctl", "campaign state", "done")
        assert verify_audit(store).ok


@pytest.fixture
def labctl(location: str) -> Callable[..., Any]:
    def run_command(*arguments: str, status: int = 0) -> Any:
        result = CliRunner().invoke(app, [*arguments, "--database", location])
        assert result.exit_code == status, result.output + result.stderr + repr(result.exception)
        return json.loads(result.stdout) if "--json" in arguments else result

    return run_command


@pytest.mark.slow
def test_what_a_person_does_on_the_command_line_is_in_it(labctl: Callable[..., Any], location: str) -> None:
    labctl("import", str(EXAMPLES / "osu-fog"))
    labctl("fit", "OSU-FOG-2024", "--effects", "bias,scale_factor")
    labctl("improve", "OSU-FOG-2024", "--remove", "scale_factor")
    labctl("certify", "OSU-FOG-2024", "1", "--by", "A. Person", *OVERRIDE_OPTIONS)
    labctl("revoke", "OSU-FOG-2024", "1", "--by", "B. Person", "--reason", "drifts")
    labctl("key", "create", "robot", "--role", "viewer")
    labctl("key", "revoke", "robot", "--reason", "lost")
    labctl("backup", f"{location}.copy")
    rows = labctl("audit", "list", "--json")
    me = os_user()
    assert [(row["who"], row["action"]) for row in rows] == [
        (me, "import"), (me, "fit"), (me, "improve"), ("A. Person", "certify"), ("B. Person", "revoke"),
        (me, "key create"), (me, "key revoke"), (me, "backup"),
    ]  # fmt: skip
    certified = {
        "by": "A. Person", "reason": REASON, "due": None, "via": "command line", "caller": me,
        "verdict": "ambiguous", "recording": 1, "override": True,
    }  # fmt: skip
    assert rows[3]["detail"] | certified == rows[3]["detail"]
    assert "the verdict on recording 1 is 'ambiguous'" in rows[3]["detail"]["objections"][0]
    assert rows[6]["detail"]["reason"] == "lost"
    assert labctl("audit", "verify", "--json")["ok"] is True
    assert labctl("audit", "list", "--since", "2999-01-01", "--json") == []
    anchor = labctl("audit", "verify", "--json")["anchor"]
    tamper(location, "UPDATE audit SET subject = 'OSU-FOG-2024 version 2' WHERE id = 4")
    refused = labctl("audit", "verify", status=1)
    assert "row 4: its content was changed" in refused.stderr
    assert labctl("audit", "verify", "--anchor", anchor, "--json", status=1)["row"] == 4


def upload(client: TestClient) -> Any:
    files = [
        ("files", (path.name, path.read_bytes())) for path in (EXAMPLES / "osu-fog").glob("*") if path.suffix != ".md"
    ]
    return client.post("/api/recordings", files=files)


def upload_log(client: TestClient) -> Any:
    return client.post("/api/recordings/logs", files={"file": ("chamber.csv", csv_text(at_rest()).encode())})


def cancel(client: TestClient) -> Any:
    later = client.post("/api/campaigns", json={"recipe": "short", "at": "2199-01-01T00:00Z"})
    return client.delete(f"/api/schedule/{later.json()['id']}")


def asks_running(act: CampaignAct[Any]) -> bool:
    """Return whether an act asks a running campaign for something; an abort comes later, when the rest is done."""
    return act.body is ReasonRequest and act is not ABORT


def asked(name: str) -> Callable[[TestClient], Any]:
    return lambda client: client.post(f"/api/campaigns/1/{name}", json={"reason": "tea"})


UNIT = "/api/units/OSU-FOG-2024/calibrations"
PERSON = {"by": "A", "reason": "B"}
NOTE = {"file": "x", "bytes": 1, "sha256": "0" * 64}
#: Every operation that changes something, in an order in which each succeeds, and the act that it leaves in the trail.
ACTS: dict[str, tuple[str, Callable[[TestClient], Any]]] = {
    "/api/benches/{bench}/check": ("bench check", lambda c: c.post("/api/benches/single-axis-sim/check", json={})),
    "/api/benches/{bench}/clear": (
        "bench clear", lambda c: c.post("/api/benches/single-axis-sim/clear", json={"by": "A. Person"}),
    ),
    **{act.command.path: (f"campaign {act.name}", asked(act.name)) for act in CAMPAIGN_ACTS if asks_running(act)},
    "/api/campaigns/{campaign}/confirm": (
        "campaign confirm", lambda c: c.post("/api/campaigns/1/confirm", json={"prompt": "1-mount", "by": "A"}),
    ),
    "/api/recordings": ("import", upload),
    "/api/recordings/logs": ("import", upload_log),
    "/api/recordings/simulated": (
        "simulate", lambda c: c.post("/api/recordings/simulated", json={"recipe": "short", "serial": "SIM"}),
    ),
    "/api/recordings/example": ("import", lambda c: c.post("/api/recordings/example", json={"name": "osu-fog"})),
    "/api/batches": (
        "unit batch", lambda c: c.post("/api/batches", json={"batch": "A", "serials": ["SIM"], "by": "A"}),
    ),
    "/api/units/{serial}/calibrations": ("fit", lambda c: c.post(UNIT, json={"effects": ["bias", "scale_factor"]})),
    "/api/units/{serial}/calibrations/{version}/improve": (
        "improve", lambda c: c.post(f"{UNIT}/1/improve", json={"remove": ["scale_factor"]}),
    ),
    "/api/units/{serial}/calibrations/{version}/certify": (
        "certify", lambda c: c.post(f"{UNIT}/1/certify", json=PERSON | OVERRIDE),
    ),
    "/api/units/{serial}/calibrations/{version}/revoke": ("revoke", lambda c: c.post(f"{UNIT}/1/revoke", json=PERSON)),
    "/api/campaigns/{campaign}/abort": (
        "campaign abort", lambda c: c.post("/api/campaigns/1/abort", json={"reason": "tea"}),
    ),
    "/api/stop": ("bench stop", lambda c: c.post("/api/stop", json={"reason": "tea"})),
    "/api/campaigns/{campaign}/resume": ("campaign resume", lambda c: c.post("/api/campaigns/1/resume", json={})),
    "/api/campaigns": ("campaign start", lambda c: c.post("/api/campaigns", json={"recipe": "short"})),
    "/api/schedule/{start}": ("schedule cancel", cancel),
    "/api/keys": ("key create", lambda c: c.post("/api/keys", json={"name": "robot", "role": "viewer"})),
    "/api/keys/{name}/revoke": ("key revoke", lambda c: c.post("/api/keys/robot/revoke", json={"reason": "lost"})),
    "/api/backups": ("backup", lambda c: c.post("/api/backups", json=NOTE)),
}  # fmt: skip

#: Operations that need more than one request before they succeed, and the test that holds each to its row.
ELSEWHERE = {
    "/api/campaigns/{campaign}/drafts": "tests/labctl/services/drafts/test_drafts.py",
    "/api/units/{serial}/calibrations/{version}/certificate": "tests/labctl/services/certificates/test_issue.py",
    "/api/certificates/withdraw": "tests/labctl/services/certificates/test_states.py",
    "/api/units/{serial}/calibrations/{version}/release": "tests/labctl/services/test_release.py",
    "/api/standards": "tests/labctl/services/standards/test_story.py",
    "/api/standards/{label}/certificates": "tests/labctl/services/standards/test_story.py",
    "/api/standards/{label}/checks": "tests/labctl/services/standards/test_story.py",
    "/api/standards/{label}/findings": "tests/labctl/services/standards/test_story.py",
    "/api/standards/{label}/findings/{finding}/withdraw": "tests/labctl/services/standards/test_story.py",
    "/api/check-gyros/{serial}": "tests/labctl/services/test_check_gyros.py",
    "/api/units/{serial}/sensors/accelerometer": "tests/labctl/api/test_sensors.py",
    "/api/units/{serial}/sensors/magnetometer": "tests/labctl/api/test_sensors.py",
    "/api/units/{serial}/diagnoses": "tests/labctl/services/diagnosis/test_in_service.py",
    "/api/diagnoses/{diagnosis}/confirm": "tests/labctl/services/diagnosis/test_diagnosis.py",
    "/api/diagnoses/{diagnosis}/stop": "tests/labctl/services/diagnosis/test_in_service.py",
    "/api/diagnoses/{diagnosis}/resume": "tests/labctl/services/diagnosis/test_in_service.py",
    "/api/diagnoses/{diagnosis}/end": "tests/labctl/services/diagnosis/test_in_service.py",
    "/api/live/start": "tests/labctl/services/live/test_live_sessions.py",
    "/api/live/end": "tests/labctl/services/live/test_live_sessions.py",
    "/api/environment": "tests/labctl/api/test_standards.py",
    "/api/fleet/jobs": "tests/labctl/api/test_fleet.py",
    "/api/fleet/jobs/{job}/cancel": "tests/labctl/api/test_fleet.py",
}


class AlwaysThere(BenchRunner):
    """A runner for which no campaign is too fast to be paused or to be answered."""

    def ask(self, campaign: int, change: Callable[[Control], None]) -> CampaignResponse:
        return campaign_status(self._store, campaign)

    def confirm(self, campaign: int, request: ConfirmRequest) -> CampaignResponse:
        return campaign_status(self._store, campaign)

    def start(self, request: CampaignRequest, *, attended: bool = True) -> CampaignResponse:
        while self._job is not None:  # the one that was resumed before
            self._job.thread.join()
        return super().start(request, attended=attended)


@pytest.mark.slow
def test_every_act_over_http_leaves_its_row(location: str) -> None:
    """A new operation fails this test until it says here which row it leaves."""
    store = Store(Database(location, write=True))
    bench = load_bench("single-axis-sim")
    lab_service = LabService(store, SystemClock(), AlwaysThere(store, bench, VirtualClock))
    application = create_app(lab_service)
    acting_paths = {path for path, item in application.openapi()["paths"].items() if set(item) - {"get", "head"}}
    assert acting_paths - set(ASKING) - set(ELSEWHERE) == set(ACTS)
    assert set(ASKING) | set(ELSEWHERE) <= acting_paths
    with TestClient(application, headers={"Labctl-User": "A. Person"}) as client:
        prepare(store, "short", bench, VirtualClock(), clip=False).bench.close()  # one that no process runs
        store.benches.mark(bench.name, "the chamber did not answer", SystemClock().utc())
        for path, (action, act) in ACTS.items():
            before = store.audit.rows()
            answer = act(client)
            assert answer.status_code < 300, (path, answer.text)
            new = store.audit.rows(after=before[-1].id)
            assert action in {row.action for row in new if row.who in {"A. Person", "A"}}, path
