"""Readers of a bench's stops beside a stop that is being written."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from labctl.services.benches import stops as module
from labctl.services.benches.stops import BenchStops
from labctl.stop.latch import StopRequest
from labctl.store import open_store
from tests.helpers.patience import WAIT_S

READERS = 3


@pytest.fixture
def stops(tmp_path: Path) -> Iterator[BenchStops]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        made = BenchStops(store, "single-axis-sim")
        made.prepare()
        yield made


def writer(
    monkeypatch: pytest.MonkeyPatch, before_start: Callable[[], object] = int, before_join: Callable[[], object] = int
) -> None:
    """Let something happen just before the thread that writes a stop is started, and before it is waited for."""

    class Writer(threading.Thread):
        def start(self) -> None:
            before_start()
            super().start()

        def join(self, timeout: float | None = None) -> None:
            before_join()
            super().join(timeout)

    class Threading:
        Thread = Writer

    monkeypatch.setattr(module, "threading", Threading)


def test_a_reader_while_the_writer_of_a_stop_begins(stops: BenchStops, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    writer(monkeypatch, before_start=lambda: read.append(len(stops.state.open)))
    stops.remember(StopRequest.new("Ada", "page", "tea"))
    assert read == [0]
    assert [stop.reason for stop in stops.state.open] == ["tea"]


def test_every_reader_waits_for_a_stop_that_is_being_written(
    stops: BenchStops, monkeypatch: pytest.MonkeyPatch
) -> None:
    all_wait = threading.Barrier(READERS)
    written = threading.Event()
    request = stops._latch.request

    def slow_disk(stop: StopRequest) -> None:
        assert written.wait(WAIT_S)
        request(stop)

    def wait() -> None:
        all_wait.wait(WAIT_S)
        written.set()

    monkeypatch.setattr(module, "WRITTEN_WITHIN_S", WAIT_S)
    monkeypatch.setattr(type(stops._latch), "request", lambda _, stop: slow_disk(stop))
    writer(monkeypatch, before_join=wait)
    stops.remember(StopRequest.new("Ada", "page", "tea"))
    with ThreadPoolExecutor(READERS) as pool:
        states = list(pool.map(lambda _: stops.state, range(READERS)))
    assert [[stop.reason for stop in state.open] for state in states] == [["tea"]] * READERS
