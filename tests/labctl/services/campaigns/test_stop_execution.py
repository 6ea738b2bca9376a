"""A stop between a request to move and the move itself, and a bench process that begins while a campaign runs."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType

import pytest

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest, ResumeRequest
from labctl.errors import BenchBusy
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.planning.loading import load_bench
from labctl.stop.latch import StopRequest
from labctl.store import Store, open_store
from tests.helpers.patience import WAIT_S


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def runner(store: Store) -> Iterator[BenchRunner]:
    made = BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)
    yield made
    made.close()


class StoppedBefore:
    """A lock with a stop before it: a caller gets the lock when the stop was carried out."""

    def __init__(self, runner: BenchRunner, campaign: int | None) -> None:
        self._runner, self._lock, self._campaign = runner, runner._guard, campaign

    def __enter__(self) -> None:
        asked = StopRequest.new("Ada", "command line", "a hand in the bench (Ada)", self._campaign)
        stopping = self._runner.stops.request(asked)
        assert stopping.is_over(WAIT_S)
        self._lock.acquire()

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._lock.release()


def finish(runner: BenchRunner) -> None:
    job = runner._job
    if job is not None and job.thread is not None:
        job.thread.join(WAIT_S)


def start(runner: BenchRunner) -> object:
    return runner.start(CampaignRequest(recipe="short", confirmed_by="Bob"))


def resume(runner: BenchRunner) -> object:
    return runner.resume(1, ResumeRequest(by="Bob"))


@pytest.mark.slow
@pytest.mark.parametrize("campaign", [None, 1])  # 1 has ended: its page still shows the button
@pytest.mark.parametrize("move", [start, resume])
def test_what_was_asked_before_a_stop_does_not_take_it_back(
    runner: BenchRunner, store: Store, move: Callable[[BenchRunner], object], campaign: int | None
) -> None:
    start(runner)
    runner.stops.request(StopRequest.new("Eve", "key", "earlier", 1))
    finish(runner)
    lock = runner._guard
    runner._guard = StoppedBefore(runner, campaign)  # type: ignore[assignment]
    with pytest.raises(BenchBusy, match=r"was stopped \(a hand in the bench \(Ada\)\) after this was asked for"):
        move(runner)
    runner._guard = lock
    assert [stop.reason for stop in runner.stop_latch.state.held] == ["earlier", "a hand in the bench (Ada)"]
    assert [row.state for row in store.campaigns.all()] == ["aborted"]
    start(runner)  # asked after it, by a person
    assert runner.stop_latch.state.held == ()


@pytest.mark.slow
def test_a_campaign_that_a_person_has_started_is_not_taken_for_one_that_was_left(
    runner: BenchRunner, store: Store
) -> None:
    """A bench process resumes what was left unfinished; by then a person may have started a campaign."""
    looked: list[str] = []

    def look() -> None:
        if not looked and runner.running is not None:
            looked.append(str(store.campaigns.get(1).state))
            other = threading.Thread(target=runner.resume_unfinished)
            other.start()
            other.join(WAIT_S)
            looked.append(str(store.campaigns.get(1).state))

    runner.listen(look)
    start(runner)
    finish(runner)
    assert len(looked) == 2
    assert looked[0] == looked[1]
    assert (store.campaigns.get(1).state, store.campaigns.get(1).reason) == ("done", "all steps done")


@pytest.mark.slow
def test_a_stop_of_one_campaign_is_not_said_to_have_stopped_another(runner: BenchRunner) -> None:
    answers: list[tuple[bool, str]] = []

    def ask() -> None:
        if not answers and runner.running is not None:
            stopping = runner.stops.request(StopRequest.new("Ada", "key", "tea", 7))
            answers.append((stopping.is_over(0.0) and stopping.stands, stopping.text))

    runner.listen(ask)
    start(runner)
    finish(runner)
    assert answers == [(False, "campaign 1 runs on this bench, not campaign 7, and goes on")]
