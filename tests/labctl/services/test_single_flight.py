"""Several threads with one question: all hear its stages, and it is cancelled when none of them waits any more."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from labctl.progress import Cancelled, report_stage, reporting_to
from labctl.services.single_flight import single_flight
from tests.helpers.patience import WAIT_S


class Client:
    """Hears stages until it leaves."""

    def __init__(self) -> None:
        self.stages: list[str] = []
        self.heard = threading.Event()
        self.left = False

    def __call__(self, stage: str) -> None:
        if self.left:
            raise Cancelled(stage)
        self.stages.append(stage)
        self.heard.set()

    def ask(self, work: Callable[[], str]) -> str:
        with reporting_to(self), single_flight("the same"):
            return work()


class Work:
    """Reports two stages; between them it waits until it is released."""

    def __init__(self) -> None:
        self.begun, self.go_on, self.times = threading.Event(), threading.Event(), 0

    def __call__(self) -> str:
        self.times += 1
        report_stage("first")
        self.begun.set()
        assert self.go_on.wait(WAIT_S)
        report_stage("second")
        return "done"


def both_ask(pool: ThreadPoolExecutor, work: Work) -> tuple[Client, Client, Future[str], Future[str]]:
    one, other = Client(), Client()
    working = pool.submit(one.ask, work)
    assert work.begun.wait(WAIT_S)
    waiting = pool.submit(other.ask, lambda: "after the other")
    assert other.heard.wait(WAIT_S)
    return one, other, working, waiting


def test_all_that_wait_hear_the_stages() -> None:
    work = Work()
    with ThreadPoolExecutor(2) as pool:
        one, other, working, waiting = both_ask(pool, work)
        work.go_on.set()
        assert (working.result(WAIT_S), waiting.result(WAIT_S)) == ("done", "after the other")
    assert one.stages == ["first", "second"]
    assert list(dict.fromkeys(other.stages)) == ["first", "second"]


def test_the_work_goes_on_while_another_waits_for_it() -> None:
    work = Work()
    with ThreadPoolExecutor(2) as pool:
        one, _, working, waiting = both_ask(pool, work)
        one.left = True
        work.go_on.set()
        assert (working.result(WAIT_S), waiting.result(WAIT_S)) == ("done", "after the other")


def test_one_that_only_waits_and_leaves_frees_its_thread_at_once() -> None:
    work = Work()
    with ThreadPoolExecutor(2) as pool:
        _, other, working, waiting = both_ask(pool, work)
        other.left = True
        with pytest.raises(Cancelled):
            waiting.result(WAIT_S)
        assert not working.done()
        work.go_on.set()
        assert working.result(WAIT_S) == "done"


def test_the_work_is_cancelled_at_its_next_stage_when_all_have_left() -> None:
    work = Work()
    with ThreadPoolExecutor(2) as pool:
        one, other, working, waiting = both_ask(pool, work)
        one.left = other.left = True
        with pytest.raises(Cancelled):
            waiting.result(WAIT_S)
        work.go_on.set()
        with pytest.raises(Cancelled):
            working.result(WAIT_S)
    assert Client().ask(lambda: "again") == "again"


def test_without_a_listener_nothing_is_cancelled() -> None:
    work = Work()
    work.go_on.set()
    with single_flight("plain"):
        assert work() == "done"
