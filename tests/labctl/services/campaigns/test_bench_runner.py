"""The queue and the bench together: not confirmed safe, lost and had again, left half done by another process."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from instruments.errors import NoReply
from labctl.acting_user import Actor, acting
from labctl.answers.admin import KeyRequest, Role
from labctl.answers.campaigns import CampaignRequest, ResumeRequest
from labctl.api import create_app
from labctl.api.access_policy import AccessPolicy
from labctl.errors import BenchBusy, Conflict
from labctl.services.admin.api_keys import create_key
from labctl.services.benches import lease
from labctl.services.benches.lease import STOP_S, BenchHold
from labctl.services.campaigns import preparation, recovery, resume
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.status import campaign_status
from labctl.services.commands.acts.start import START_CAMPAIGN
from labctl.services.commands.registry import CANCEL_START
from labctl.services.commands.requests import CampaignStart, ToStart
from labctl.services.lab_service import LabService
from labctl.services.local_bench import LocalBench
from labctl.services.planning.loading import load_bench
from labctl.services.schedule.queue import start_status
from labctl.store import Store
from labctl.store.connection.database import Database
from procedures.contracts.operator import HumanOperator

BENCH = load_bench("single-axis-sim")
START = datetime(2026, 1, 5, 8, tzinfo=UTC)


class Lab:
    """A service with a lease on its bench, whose schedule and lease the test looks after."""

    def __init__(self, location: str) -> None:
        self.store = Store(Database(location, write=True))
        self.clock = VirtualClock(START)
        self.hold = BenchHold(self.store, BENCH.name, self.clock)
        self.hold.take()
        self.runner = BenchRunner(self.store, BENCH, VirtualClock, self.hold)
        self.lab_service = LabService(self.store, self.clock, self.runner)
        assert isinstance(self.lab_service.bench_access, LocalBench)
        assert self.lab_service.bench_access.scheduler is not None
        self.scheduler = self.lab_service.bench_access.scheduler

    def enter(self, **when: Any) -> int:
        request = CampaignRequest.model_validate({"recipe": "short", **when})
        return self.lab_service.execute(START_CAMPAIGN, CampaignStart(request)).id

    def tick(self) -> None:
        self.scheduler.tick()
        self.rest()

    def rest(self) -> None:
        job = self.runner._job
        if job is not None and job.thread is not None:
            job.thread.join()

    def lose(self) -> None:
        """Let the lease run out of renewals."""
        self.clock.sleep(STOP_S)

    def begin_and_lose(self, at: int) -> None:
        """Begin a campaign, and lose the bench at its n-th sign of life."""
        seen = [0]

        def heard() -> None:
            seen[0] += 1
            if seen[0] == at:
                self.lose()

        stop = self.runner.listen(heard)
        self.runner.start(CampaignRequest(recipe="short"))
        self.rest()
        stop()

    def states(self) -> list[str]:
        return [row.state for row in self.store.campaigns.all()]

    def event(self, start: int) -> tuple[str, str]:
        event = start_status(self.store, start).history[-1]
        return event.outcome, event.message


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    made = Lab(str(tmp_path / "lab.sqlite"))
    yield made
    made.lab_service.close()


@pytest.fixture
def moves(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Whenever a bench is opened."""
    opened: list[str] = []
    for module in (preparation, recovery, resume):
        real = module.open_bench

        def opening(bench: Any, clock: Any, real: Any = real, **_wire: Any) -> Any:
            opened.append(bench.name)
            return real(bench, clock)

        monkeypatch.setattr(module, "open_bench", opening)
    return opened


@pytest.mark.slow
def test_a_bench_that_is_not_confirmed_safe_refuses_what_is_due_and_blocks_nothing(lab: Lab, moves: list[str]) -> None:
    lab.enter(at="now")
    lab.tick()
    lab.store.benches.mark(BENCH.name, "table to rest: no answer", START)
    moves.clear()
    once, daily = lab.enter(at="now"), lab.enter(cron="0 2 * * *", time_zone="UTC")
    lab.tick()
    lab.clock.sleep(86400)
    lab.hold.renew()
    lab.tick()
    for start in (once, daily):
        outcome, message = lab.event(start)
        assert (outcome, "was not confirmed safe: table to rest" in message) == ("refused", True)
    assert (start_status(lab.store, once).state, moves) == ("ended", [])
    lab.store.benches.clear(BENCH.name, "Ada", "looked", START)
    lab.clock.sleep(86400)
    lab.hold.renew()
    lab.tick()
    assert [event.outcome for event in start_status(lab.store, daily).history] == ["refused", "started"]
    assert lab.states() == ["done", "done"]


@pytest.mark.slow
def test_what_is_due_waits_for_a_bench_that_was_lost(lab: Lab, moves: list[str]) -> None:
    due = lab.enter(at="now")
    lab.lose()
    lab.tick()
    assert (start_status(lab.store, due).history, moves) == ([], [])
    lab.hold.renew()
    lab.tick()
    assert (lab.event(due)[0], lab.states()) == ("started", ["done"])


@pytest.mark.slow
def test_a_campaign_whose_bench_was_lost_is_resumed_before_the_queue_continues(lab: Lab) -> None:
    lab.begin_and_lose(at=200)
    lost = campaign_status(lab.store, 1)
    assert (lost.state, lost.ended_at) == ("interrupted", None)
    assert "could not be renewed" in lost.reason
    due = lab.enter(at="now")
    lab.tick()
    assert (lab.states(), start_status(lab.store, due).history) == (["interrupted"], [])
    lab.hold.renew()
    lab.tick()
    assert lab.states() == ["done"]
    lab.tick()
    assert (lab.states(), lab.event(due)[0]) == (["done", "done"], "started")
    kinds = [event.kind for event in lab.store.campaigns.events(1)]
    taken = kinds.index("taken_up")
    assert kinds[taken : taken + 3] == ["taken_up", "state", "safe_state"]
    assert {row.who for row in lab.store.audit.rows() if row.detail.get("state") == "interrupted"} == {"labctl"}


def test_a_campaign_that_waits_keeps_its_bench_and_lets_it_go_when_it_is_lost(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(preparation, "operator_of", lambda _: HumanOperator())
    seen: list[str] = []
    held: list[bool] = []
    refusals: list[str] = []

    def heard() -> None:
        answer = lab.runner.status(1)
        seen.append(answer.state if answer is not None else "")
        if seen.count("waiting") == 20:
            held.append(lab.hold.held)
            try:
                BenchHold(lab.store, BENCH.name, lab.clock).take()
            except Conflict as error:
                refusals.append(str(error))
            lab.lose()  # in either case: else the campaign would wait without end

    lab.runner.listen(heard)
    lab.runner.start(CampaignRequest(recipe="short"))
    lab.rest()
    assert seen.count("waiting") >= 20
    assert (held[0], "is in use by process" in refusals[0]) == (True, True)
    assert lab.states() == ["interrupted"]


@pytest.mark.slow
def test_without_the_lease_nothing_is_resumed_and_nothing_moves(tmp_path: Path, moves: list[str]) -> None:
    location = str(tmp_path / "lab.sqlite")
    first = Lab(location)
    left = prepare(first.store, "short", BENCH, VirtualClock(), clip=False)
    left.bench.close()
    moves.clear()
    first.lose()
    first.runner.resume_unfinished()
    with pytest.raises(BenchBusy, match="may not drive bench"):
        first.runner.resume(left.id, ResumeRequest(by="Ada"))
    assert (moves, first.states()) == ([], ["planned"])
    first.hold.renew()
    first.tick()
    assert first.states() == ["done"]
    first.lab_service.close()


@pytest.mark.slow
def test_a_command_that_takes_a_campaign_up_needs_the_lease_too(
    tmp_path: Path, moves: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    location = str(tmp_path / "lab.sqlite")
    lab = Lab(location)
    lab.begin_and_lose(at=200)
    lab.lab_service.close()
    moves.clear()

    def taken(*_: Any) -> None:
        raise Conflict("bench single-axis-sim is held by process 4321 on far-pc")

    with monkeypatch.context() as patched:
        patched.setattr(lease, "hold_bench", taken)
        with pytest.raises(Conflict, match="far-pc"):
            resume.resume_here(location, 1, None, None, ResumeRequest(by="Ada"))
        assert moves == []
    assert resume.resume_here(location, None, None, None, ResumeRequest(by="Ada")).state == "done"


@pytest.mark.slow
def test_a_service_resumes_a_left_campaign_before_its_queue(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    first = Lab(location)
    first.begin_and_lose(at=200)
    due = first.enter(at="now")
    first.lab_service.close()
    second = Lab(location)
    second.clock.sleep(3600)
    second.hold.renew()
    second.lab_service.start()
    second.rest()
    assert second.states()[-1] == "done"
    second.tick()
    assert second.event(due)[0] == "started"
    second.rest()
    second.lab_service.close()


@pytest.mark.slow
def test_what_cannot_be_resumed_waits_for_a_person_and_the_queue_continues(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab.begin_and_lose(at=200)
    due = lab.enter(at="now")
    lab.hold.renew()

    def silent(*_: Any, **__: Any) -> None:
        raise NoReply("table", "no answer")

    monkeypatch.setattr(recovery, "open_bench", silent)
    monkeypatch.setattr(resume, "open_bench", silent)
    lab.tick()
    left = campaign_status(lab.store, 1)
    assert (left.state, left.reason) == ("failed", "not resumed: table: no answer")
    lab.rest()
    lab.tick()
    assert lab.event(due)[0] == "started"


@pytest.mark.slow
def test_entries_and_what_became_of_them_are_in_the_audit_trail(lab: Lab) -> None:
    with acting(Actor("Ada", "key")):
        lab.enter(at="now")
        cancelled = lab.enter(cron="0 2 * * *", time_zone="UTC")
        lab.enter(at="2026-01-05T08:01Z", late_limit_s=0)
        lab.lab_service.execute(CANCEL_START, ToStart(cancelled))
    lab.tick()
    lab.clock.sleep(3600)
    lab.hold.renew()
    lab.tick()
    rows = lab.store.audit.rows()
    story = [(row.who, row.action, row.subject.split(" on ")[0]) for row in rows if row.action != "campaign state"]
    assert story == [
        ("Ada", "schedule enter", "start 1"),
        ("Ada", "schedule enter", "start 2"),
        ("Ada", "schedule enter", "start 3"),
        ("Ada", "schedule cancel", "start 2"),
        ("labctl", "campaign start", "campaign 1"),
        ("labctl", "schedule start", "start 1"),
        ("labctl", "schedule start", "start 3"),
    ]
    reported = [(row.detail["outcome"], row.detail["campaign"]) for row in rows if row.action == "schedule start"]
    assert reported == [("started", 1), ("missed", None)]
    assert lab.store.audit.first_broken() is None


def test_the_schedule_is_for_operators(tmp_path: Path) -> None:
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    keys = {role: create_key(store, KeyRequest(name=role.value, role=role), START).key for role in Role}
    lab_service = LabService(store, SystemClock(), BenchRunner(store, BENCH, VirtualClock))
    with TestClient(create_app(lab_service, AccessPolicy(keys=True))) as client:

        def ask(role: Role, method: str, path: str, body: Any = None) -> int:
            headers = {"Authorization": f"Bearer {keys[role]}"}
            return client.request(method, path, json=body, headers=headers).status_code

        later = {"recipe": "short", "at": "2199-01-01T00:00Z"}
        assert ask(Role.VIEWER, "POST", "/api/campaigns", later) == 403
        assert ask(Role.OPERATOR, "POST", "/api/campaigns", later) == 202
        assert ask(Role.VIEWER, "GET", "/api/schedule/1") == 200
        assert ask(Role.VIEWER, "DELETE", "/api/schedule/1") == 403
        assert ask(Role.OPERATOR, "DELETE", "/api/schedule/1") == 200
        rows = [(row.who, row.action) for row in store.audit.rows() if row.action.startswith("schedule")]
        assert rows == [("operator", "schedule enter"), ("operator", "schedule cancel")]
