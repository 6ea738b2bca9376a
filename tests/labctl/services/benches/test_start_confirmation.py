"""A campaign on a bench that is not simulated begins only after a person has confirmed that it is clear."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from labctl.answers.campaigns import BENCH_CHECKS, CampaignRequest, StartRequest
from labctl.cli import terminal_operator
from labctl.errors import StartNotConfirmed
from labctl.services.benches.start_confirmation import confirmation_text, start_questions
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.execution import run_here
from labctl.services.planning.loading import load_bench
from labctl.services.schedule.queue import add_start, start_status
from labctl.services.schedule.scheduler import Scheduler
from labctl.store import Store, open_store
from labctl.store.repositories.scheduled_starts import NewStart
from tests.helpers.service import open_client

BENCH = load_bench("single-axis-sim")
REAL_TABLE = BENCH.table.model_copy(update={"port": "/dev/ttyUSB0"})
AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
CONFIRMED: dict[str, Any] = {"confirmed_by": "Ann", "checks": list(BENCH_CHECKS)}
TEXT = "chamber clear, table free, limiter on: confirmed by Ann"


@pytest.fixture
def real(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the bench be one whose table moves."""
    monkeypatch.setattr(BenchFile, "is_simulated", property(lambda _: False))


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def recorded(store: Store) -> tuple[str, str]:
    """Return what the first event of campaign 1 and the audit trail say of its bench."""
    first = store.campaigns.events(1)[0]
    started = next(row for row in store.audit.rows() if row.action == "campaign start")
    return f"{first.kind}: {first.message}", started.detail["bench_clear"]


def finish(runner: BenchRunner) -> None:
    job = runner._job
    if job is not None and job.thread is not None:
        job.thread.join()


@pytest.mark.usefixtures("real")
@pytest.mark.parametrize(
    ("given", "missing"),
    [
        ({}, list(BENCH_CHECKS)),
        ({"confirmed_by": "Ann"}, list(BENCH_CHECKS)),
        ({"checks": list(BENCH_CHECKS)}, list(BENCH_CHECKS)),
        ({"confirmed_by": "  ", "checks": list(BENCH_CHECKS)}, list(BENCH_CHECKS)),
        ({"confirmed_by": "Ann", "checks": ["chamber_clear", "table_free"]}, ["limiter_on"]),
    ],
)
def test_a_start_over_http_that_nobody_confirmed_is_refused_and_nothing_is_written(
    tmp_path: Path, given: dict[str, Any], missing: list[str]
) -> None:
    with open_client(tmp_path / "lab.sqlite") as client:
        for later in ({}, {"at": "2199-07-01T08:00"}):
            refused = client.post("/api/campaigns", json={"recipe": "short", **given, **later})
            assert refused.status_code == 422
            said = refused.json()
            assert said["type"] == "urn:labctl:problem:start-not-confirmed"
            assert list(said["questions"]) == missing
            assert "--clear-confirmed-by" in said["detail"]
        assert client.get("/api/campaigns").json() == client.get("/api/schedule").json() == []
        assert list(client.get("/api/benches").json()[0]["start_questions"]) == list(BENCH_CHECKS)


@pytest.mark.slow
@pytest.mark.usefixtures("real")
def test_who_confirmed_is_the_first_event_and_in_the_audit_trail(store: Store) -> None:
    runner = BenchRunner(store, BENCH, VirtualClock)
    with pytest.raises(StartNotConfirmed):
        runner.start(CampaignRequest(recipe="short"))
    runner.start(CampaignRequest(recipe="short", **CONFIRMED))
    finish(runner)
    assert recorded(store) == (f"operator.bench_clear: {TEXT}", TEXT)


@pytest.mark.slow
def test_a_simulated_bench_asks_nothing(store: Store) -> None:
    runner = BenchRunner(store, BENCH, VirtualClock)
    runner.start(CampaignRequest(recipe="short"))
    finish(runner)
    assert start_questions(BENCH) == {}
    assert store.campaigns.events(1)[0].kind == "state"


@pytest.mark.slow
@pytest.mark.usefixtures("real")
def test_a_scheduled_start_keeps_who_confirmed_it(store: Store) -> None:
    clock, runner = VirtualClock(AT), BenchRunner(store, BENCH, VirtualClock)
    with pytest.raises(StartNotConfirmed):
        add_start(store, CampaignRequest(recipe="short", at="now"), BENCH, clock.utc())
    entered = add_start(store, CampaignRequest(recipe="short", at="now", **CONFIRMED), BENCH, clock.utc())
    assert entered.confirmed_by == "Ann"
    Scheduler(store, clock, runner, BENCH.name).tick()
    finish(runner)
    assert recorded(store) == (f"operator.bench_clear: {TEXT}", TEXT)
    assert next(row for row in store.audit.rows() if row.action == "schedule enter").detail[
        "bench_clear_confirmed_by"
    ] == ("Ann")


@pytest.mark.usefixtures("real")
def test_an_entry_from_before_confirmations_were_asked_is_refused_when_it_is_due(store: Store) -> None:
    clock, runner = VirtualClock(AT), BenchRunner(store, BENCH, VirtualClock)
    old = NewStart(
        bench_name=BENCH.name, recipe_name="short", recipe="short", clip=False, priority=0, cron=None, time_zone="UTC",
        late_limit_s=None, due_at=AT, confirmed_by=None, visits_s=None,
        hide=None, fit=True,
    )  # fmt: skip
    number = store.starts.add(old, AT)
    Scheduler(store, clock, runner, BENCH.name).tick()
    event = start_status(store, number).history[0]
    assert event.outcome == "refused"
    assert "only after a person has confirmed" in event.message
    assert store.campaigns.all() == []


@pytest.mark.usefixtures("real")
def test_in_the_foreground_the_person_at_the_terminal_is_asked(tmp_path: Path) -> None:
    location, asked = str(tmp_path / "lab.sqlite"), []

    def answer(by: str) -> Any:
        def ask(questions: Any) -> str:
            asked.append(list(questions))
            return by

        return ask

    request = StartRequest(recipe="short", bench="single-axis-sim")
    for ask_clear in (None, answer("")):
        with pytest.raises(StartNotConfirmed):
            run_here(location, request, ask_clear=ask_clear)
    with open_store(location, write=False) as store:
        assert store.campaigns.all() == []
    assert asked == [list(BENCH_CHECKS)]


class Terminal:
    """Standard input that answers with lines."""

    def __init__(self, *lines: str, tty: bool = True) -> None:
        self.lines, self.tty = list(lines), tty

    def isatty(self) -> bool:
        return self.tty

    def fileno(self) -> int:
        return 0

    def readline(self) -> str:
        return self.lines.pop(0) if self.lines else ""


@pytest.mark.parametrize(
    ("terminal", "by"),
    [
        (Terminal("yes\n", "yes\n", "yes\n", "Ann\n"), "Ann"),
        (Terminal("yes\n", "no\n", "yes\n", "Ann\n"), ""),
        (Terminal("\n"), ""),
        (Terminal(), ""),
        (Terminal("yes\n", "yes\n", "yes\n", "Ann\n", tty=False), ""),
    ],
)
def test_only_three_times_yes_and_a_name_is_a_confirmation(
    monkeypatch: pytest.MonkeyPatch, terminal: Terminal, by: str
) -> None:
    monkeypatch.setattr(terminal_operator.sys, "stdin", terminal)
    monkeypatch.setattr(terminal_operator.termios, "tcflush", lambda *_: None)
    assert terminal_operator.ask_bench_clear(dict.fromkeys(BENCH_CHECKS, "Is it?")) == by


def test_a_refusal_keeps_its_questions_on_the_way_between_processes() -> None:
    with pytest.raises(StartNotConfirmed) as refused:
        confirmation_text(BENCH.model_copy(update={"table": REAL_TABLE}), CampaignRequest(recipe="short"))
    copy = pickle.loads(pickle.dumps(refused.value))
    assert (str(copy), copy.questions) == (str(refused.value), refused.value.questions)


def test_an_unknown_check_is_refused_by_name(tmp_path: Path) -> None:
    with open_client(tmp_path / "lab.sqlite") as client:
        refused: Any = _start(client, checks=["all_well"])
        assert refused.status_code == 422
        assert "checks" in refused.json()["detail"]


def _start(client: TestClient, **given: Any) -> Any:
    return client.post("/api/campaigns", json={"recipe": "short", **given})
