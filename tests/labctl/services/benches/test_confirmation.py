"""A bench that is not confirmed safe is tried again until it is; a person looks before anything moves again."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from instruments.bench import open_bench
from instruments.bench_config import BenchFile
from instruments.clock import SystemClock, VirtualClock
from instruments.errors import NoReply
from instruments.simulation import open_simulation
from labctl.answers.campaigns import BENCH_CHECKS, CampaignRequest
from labctl.cli.app import app
from labctl.errors import Conflict, StoreError
from labctl.services.benches import confirmation
from labctl.services.benches.confirmation import RETRY_S, SafeStateRetry
from labctl.services.benches.lease import STOP_S, BenchHold
from labctl.services.campaigns import execution, preparation, resume
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.preparation import prepare
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import BenchRow, Store, open_store
from labctl.store.connection.database import Database
from labctl.store.repositories.benches import Benches
from tests.helpers.patience import WAIT_S

BENCH = load_bench("single-axis-sim")
TABLE, CHAMBER = BENCH.table.port, BENCH.chamber.host or BENCH.chamber.port or ""
AT = datetime(2026, 1, 5, 7, tzinfo=UTC)


class RealBench:
    """A bench that outlives what drives it: one simulated world, opened again and again, with faults on its wires."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.clock = VirtualClock()
        self.world = open_simulation(BENCH, self.clock)
        self.opened = 0
        monkeypatch.setattr(BenchFile, "is_simulated", property(lambda _: False))
        for module in (confirmation, preparation):
            monkeypatch.setattr(module, "open_bench", self._open)

    def _open(self, bench: BenchFile, clock: Any, **_wire: Any) -> Any:
        self.opened += 1
        return open_bench(bench, clock, self.world)

    def silence(self, url: str) -> None:
        self.world.faults(url).arm("silence")

    def heal(self, url: str) -> None:
        self.world.faults(url).clear()

    @property
    def turns(self) -> bool:
        return self.world.world.table.moving(self.clock.now_s())

    def turn(self) -> None:
        """Let the table turn for an hour, as a process leaves it that was killed."""
        opened = open_bench(BENCH, self.clock, self.world)
        opened.table.home()
        opened.table.spin(20.0, 3600.0)


@pytest.fixture
def real(monkeypatch: pytest.MonkeyPatch) -> RealBench:
    return RealBench(monkeypatch)


@pytest.fixture
def location(tmp_path: Path) -> str:
    """A database that knows the bench, which is not confirmed safe."""
    path = str(tmp_path / "lab.sqlite")
    with open_store(path, write=True) as store:
        prepared = prepare(store, "short", BENCH, VirtualClock(), clip=False)
        prepared.bench.close()
        store.campaigns.close_unfinished(prepared.id, "enough", AT)
        store.benches.mark(BENCH.name, "table to rest: no answer", AT)
    return path


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    with open_store(location, write=True) as opened:
        yield opened


def bench(store: Store) -> BenchRow:
    found = store.benches.get(BENCH.name)
    assert found is not None
    return found


def trail(store: Store) -> list[tuple[str, Any, bool]]:
    rows = [row for row in store.audit.rows() if row.action == "bench safe state"]
    return [(row.who, row.detail["attempt"], row.detail["confirmed"]) for row in rows]


def retry_of(store: Store, real: RealBench) -> SafeStateRetry:
    return SafeStateRetry(store, BENCH, lambda: real.clock)


def test_the_safe_state_is_tried_until_it_is_confirmed_and_every_attempt_counts(store: Store, real: RealBench) -> None:
    real.turn()
    real.silence(TABLE)
    retry = retry_of(store, real)
    for attempts in (1, 2, 3):
        retry.attempt()
        row = bench(store)
        assert (row.attempts, row.attempted_at, row.is_unconfirmed) == (attempts, real.clock.utc(), True)
        assert "table to rest: table: " in row.unconfirmed
    assert trail(store) == [("labctl", 1, False)]
    real.silence(CHAMBER)
    retry.attempt()
    retry.attempt()
    assert "chamber to its safe set point" in bench(store).unconfirmed
    assert trail(store) == [("labctl", 1, False), ("labctl", 4, False)]
    assert not real.turns  # the abort arrived; that the table stands was not confirmed
    real.heal(TABLE)
    real.heal(CHAMBER)
    retry.attempt()
    row = bench(store)
    assert (row.attempts, row.confirmed_at, row.is_unconfirmed, real.turns) == (6, real.clock.utc(), False, False)
    assert trail(store)[2:] == [("labctl", 6, True)]
    opened = real.opened
    retry.attempt()
    assert (real.opened, bench(store).attempts) == (opened, 6)
    assert store.audit.first_broken() is None


def test_one_attempt_is_short(store: Store, real: RealBench) -> None:
    """It holds what else wants the bench, so it makes no pauses."""
    for url in (TABLE, CHAMBER):
        real.silence(url)
    began_s = real.clock.now_s()
    retry_of(store, real).attempt()
    assert real.clock.now_s() - began_s < RETRY_S


def test_nothing_moves_before_a_person_has_looked(store: Store, real: RealBench) -> None:
    retry_of(store, real).attempt()
    with pytest.raises(Conflict, match=r"was confirmed safe by labctl at 2026-01-05 08:00.*attempt 1, after: table"):
        prepare(store, "short", BENCH, real.clock, clip=False)
    cleared = store.benches.clear(BENCH.name, "Ada", "plugged it in", AT)
    assert (cleared.unconfirmed, cleared.attempts, cleared.confirmed_at) == ("", 0, None)
    prepare(store, "short", BENCH, real.clock, clip=False).bench.close()


def test_a_new_doubt_is_tried_anew(store: Store, real: RealBench) -> None:
    retry = retry_of(store, real)
    retry.attempt()
    store.benches.mark(BENCH.name, "campaign 7 ended while the database could not be written", AT)
    assert bench(store).is_unconfirmed
    retry.attempt()
    row = bench(store)
    assert (row.attempts, row.is_unconfirmed, row.unconfirmed[:10]) == (1, False, "campaign 7")


def test_a_simulated_bench_ended_with_its_process(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(confirmation, "open_bench", lambda *_: pytest.fail("opened"))
    retry = SafeStateRetry(store, BENCH, VirtualClock)
    retry.start()
    retry.close()
    assert (bench(store).attempts, bench(store).is_unconfirmed) == (0, True)


def test_what_cannot_be_written_or_read_keeps_no_bench_from_being_tried(
    store: Store, real: RealBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    retry = retry_of(store, real)
    real.silence(TABLE)
    retry.attempt()

    def broken(*_: Any) -> Any:
        raise StoreError("the disk is full")

    opened = real.opened
    with monkeypatch.context() as patched:
        patched.setattr(Benches, "attempted", broken)
        patched.setattr(Benches, "get", broken)
        retry.attempt()
    assert (real.opened, bench(store).attempts) == (opened + 1, 1)
    real.heal(TABLE)
    retry.attempt()
    assert not bench(store).is_unconfirmed


@pytest.mark.slow
def test_nothing_is_tried_while_a_campaign_runs_or_without_the_lease(store: Store, real: RealBench) -> None:
    store.benches.clear(BENCH.name, "Ada", "looked", AT)
    wall = VirtualClock(AT)
    hold = BenchHold(store, BENCH.name, wall)
    hold.take()
    runner = BenchRunner(store, BENCH, lambda: real.clock, hold)
    opened: list[int] = []

    def heard() -> None:
        if runner.busy and len(opened) < 3:
            store.benches.mark(BENCH.name, "table to rest: no answer", AT)
            runner.safe_state.attempt()
            opened.append(real.opened)

    stop = runner.listen(heard)
    runner.start(CampaignRequest(recipe="short", confirmed_by="Ada", checks=list(BENCH_CHECKS)))
    job = runner._job
    if job is not None and job.thread is not None:
        job.thread.join()
    stop()
    assert opened == [1, 1, 1]
    wall.sleep(STOP_S)
    runner.safe_state.attempt()
    assert (real.opened, bench(store).attempts) == (1, 0)
    hold.renew()
    runner.safe_state.attempt()
    assert (real.opened, bench(store).is_unconfirmed) == (2, False)
    runner.close()


class Beats(VirtualClock):
    """A virtual clock whose thirty seconds are over at once."""

    def wall_s(self, duration_s: float) -> float:
        return 0.0 if duration_s == RETRY_S else super().wall_s(duration_s)


def test_a_service_tries_when_it_starts_in_the_background_and_before_it_ends(location: str, real: RealBench) -> None:
    real.silence(TABLE)
    real.clock = Beats()
    store = Store(Database(location, write=True))
    runner = BenchRunner(store, BENCH, lambda: real.clock)
    service = LabService(store, SystemClock(), runner)
    tried = threading.Semaphore(0)

    def opening(bench: BenchFile, clock: Any, **_wire: Any) -> Any:
        tried.release()
        return open_bench(bench, clock, real.world)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(confirmation, "open_bench", opening)
        service.start()
        for _ in range(5):
            assert tried.acquire(timeout=WAIT_S)
    runner.safe_state.end_soon()
    real.heal(TABLE)
    service.close()
    assert "was confirmed safe by labctl" in service.left.text
    assert not service.left.unconfirmed


def labctl(location: str, *arguments: str) -> Result:
    return CliRunner().invoke(app, [*arguments, "--database", location])


@pytest.mark.parametrize("healed", [False, True])
def test_a_service_says_whether_it_leaves_its_bench_unconfirmed(
    location: str, real: RealBench, monkeypatch: pytest.MonkeyPatch, healed: bool
) -> None:
    def silent(*_: Any) -> Any:
        raise NoReply("table", "no answer")

    if not healed:
        monkeypatch.setattr(confirmation, "open_bench", silent)
    with open_store(location, write=True) as store:
        service = LabService(store, SystemClock(), BenchRunner(store, BENCH, lambda: real.clock))
        service.start()
        service.close()
    said = "was confirmed safe by labctl at" if healed else "is NOT confirmed safe: table: no answer"
    assert (service.left.unconfirmed, f"bench {BENCH.name} {said}" in service.left.text) == (not healed, True)
    looked = labctl(location, "bench", "status")
    assert (looked.exit_code, "more times to set the safe state" in looked.stdout) == (1, True)
    assert ("labctl confirmed the safe state at" in looked.stdout) == healed


@pytest.mark.slow
def test_a_campaign_in_the_foreground_that_leaves_its_bench_unconfirmed_ends_with_a_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    location = str(tmp_path / "lab.sqlite")
    for module in ("step_handlers", "shutdown"):
        monkeypatch.setattr(f"procedures.execution.{module}.make_safe", lambda *_, **__: ("table to rest: no answer",))
    ended = labctl(location, "campaign", "start", "short", "--bench", BENCH.name)
    assert (ended.exit_code, "NOT confirmed safe: table to rest: no answer" in ended.stdout) == (1, True)
    for again in (("start", "short", "--bench", BENCH.name), ("resume", "1")):
        refused = labctl(location, "campaign", *again)
        assert (refused.exit_code, "was not confirmed safe" in refused.stderr) == (2, True)


@pytest.mark.parametrize("act", [("start", "short", "--bench", BENCH.name), ("resume", "1")])
def test_a_campaign_in_the_foreground_tries_a_bench_unconfirmed_before_it_is_refused(
    location: str, real: RealBench, monkeypatch: pytest.MonkeyPatch, act: tuple[str, ...]
) -> None:
    monkeypatch.setattr(execution, "clock_for", lambda *_: real.clock)
    monkeypatch.setattr(resume, "clock_for", lambda *_: real.clock)
    real.turn()
    refused = labctl(location, "campaign", *act)
    assert (refused.exit_code, real.turns) == (2, False)
    assert "was confirmed safe by labctl" in refused.stderr
    with open_store(location, write=False) as store:
        assert len(store.campaigns.all()) == 1
