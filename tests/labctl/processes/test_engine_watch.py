"""An engine that hangs in a driver while its process lives: no beat is sent, so that the supervisor replaces it."""

from __future__ import annotations

from collections.abc import Iterator
from multiprocessing import Pipe
from pathlib import Path

import pytest

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest
from labctl.processes import supervision
from labctl.processes.documents import receive, value_of
from labctl.processes.held_address import HeldAddress
from labctl.processes.liveness import ENGINE_SILENT_S, EngineWatch
from labctl.processes.settings import BenchSettings
from labctl.processes.supervision import SAID_BY_BENCH, Supervision
from labctl.processes.waker import Waker
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.stop_requests import StopElsewhere
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store
from procedures.contracts.control import Control


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def test_an_engine_that_asks_for_nothing_any_more_is_stuck_and_one_that_asks_again_is_not() -> None:
    clock, control = VirtualClock(), Control()
    watch = EngineWatch(lambda: (1, control.polls), clock)
    control.poll()
    assert not watch.is_stuck()
    clock.sleep(ENGINE_SILENT_S - 1)
    assert not watch.is_stuck()
    clock.sleep(2)
    assert watch.is_stuck()
    control.poll()
    assert not watch.is_stuck()


def test_a_bench_without_a_campaign_is_never_stuck() -> None:
    clock = VirtualClock()
    watch = EngineWatch(lambda: None, clock)
    clock.sleep(10 * ENGINE_SILENT_S)
    assert not watch.is_stuck()


def test_the_next_campaign_begins_to_count_anew() -> None:
    clock = VirtualClock()
    running: list[tuple[int, int]] = [(1, 7)]
    watch = EngineWatch(lambda: running[0], clock)
    assert not watch.is_stuck()
    clock.sleep(2 * ENGINE_SILENT_S)
    running[0] = (2, 7)
    assert not watch.is_stuck()


def test_a_campaign_that_runs_is_seen_to_move(store: Store) -> None:
    runner = BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)
    seen: list[tuple[int, int] | None] = []
    runner.listen(lambda: seen.append(runner.polls))
    runner.start(CampaignRequest(recipe="short"))
    runner.close()
    counts = [polls[1] for polls in seen if polls is not None]
    assert counts
    assert counts == sorted(counts)
    assert runner.polls is None


def test_a_stuck_engine_sends_one_beat_to_its_supervisor_and_no_more(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervision, "BEAT_S", 0.01)
    stuck = [True]
    settings = BenchSettings(str(tmp_path / "lab.sqlite"), None, False, 1.0, tmp_path, "http://127.0.0.1:1")
    waker = Waker()
    here, there = Pipe()
    address = HeldAddress(lambda _: StopElsewhere("no bench", stands=True), lambda: "")
    guarded = Supervision(settings, store, waker, lambda: stuck[0], address, lambda: False)
    guarded.take_charge(settings, there)
    assert value_of(SAID_BY_BENCH, receive(here)) == "beat"  # the answer that it is in charge
    assert not here.poll(0.2)
    stuck[0] = False
    assert value_of(SAID_BY_BENCH, receive(here)) == "beat"
    here.close()
    waker.close()
