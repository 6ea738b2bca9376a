"""A supervisor that finds a bench process whose own supervisor ended while it started: it is asked until it answers."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import pytest

from instruments.clock import VirtualClock
from labctl.errors import BenchSilent, Conflict
from labctl.processes import supervisor as module
from labctl.processes.listening import Listening
from labctl.processes.liveness import Elapsed
from labctl.processes.settings import BenchSettings, ServeRequest
from labctl.processes.supervisor import POLL_INTERVAL_S, STARTS_WITHIN_S, Supervisor
from labctl.processes.waker import Waker
from labctl.store import Holder


@dataclass
class FakeWaker:
    """Waits in virtual time."""

    clock: VirtualClock
    ending: bool = False
    waits: int = 0
    meanwhile: Callable[[], None] = lambda: None

    def wait(self, seconds: float) -> None:
        self.waits += 1
        self.meanwhile()
        self.clock.sleep(seconds)


@dataclass
class Machine:
    """The bench processes of one machine: one that another supervisor started, and those that this one starts."""

    holder: Holder | None
    answers_after: int  #: how often it is asked in vain
    asked: int = 0
    started: int = 0
    folders: list[Path] = field(default_factory=list)

    def line(self, settings: BenchSettings, pid: int, _child: object = None, listener: object = None) -> str:
        assert listener is None
        self.asked += 1
        self.folders.append(settings.folder)
        if self.asked <= self.answers_after:
            raise BenchSilent("no socket yet")
        return f"line to {pid}"

    def start(self) -> str:
        self.started += 1
        if self.holder is not None:
            raise Conflict("another process writes to this database now")
        return "line to a new one"


@dataclass(frozen=True)
class FakeListening:
    """Where the service would answer."""

    url: str = "http://127.0.0.1:1"
    name: str = "127.0.0.1"
    socket: None = None


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[Machine, FakeWaker], object]:
    """Return what opens the bench of a machine as `labctl serve` does."""

    def open_bench(machine: Machine, waker: FakeWaker) -> object:
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
        monkeypatch.setattr(module, "Elapsed", lambda: Elapsed(waker.clock))
        monkeypatch.setattr(module, "bench_process_of", lambda _request: machine.holder)
        monkeypatch.setattr(module, "BenchLine", machine.line)
        request = ServeRequest(simulate=True, database="lab.sqlite")
        supervisor = Supervisor(request, cast(Listening, FakeListening()), cast(Waker, waker))
        monkeypatch.setattr(supervisor, "_start_bench", machine.start)
        return supervisor._open_bench()  # the rest of `run` starts real processes

    return open_bench


def holder(folder: Path | None) -> Holder:
    return Holder(os.getpid(), "http://127.0.0.1:2", calls=None if folder is None else str(folder))


def test_a_bench_process_that_still_starts_is_asked_until_it_answers(
    opened: Callable[[Machine, FakeWaker], object], tmp_path: Path
) -> None:
    machine = Machine(holder(tmp_path), answers_after=3)
    assert opened(machine, FakeWaker(VirtualClock())) == f"line to {os.getpid()}"
    assert (machine.asked, machine.started) == (4, 3)
    assert set(machine.folders) == {tmp_path}


def test_one_that_ends_before_it_answers_is_replaced(
    opened: Callable[[Machine, FakeWaker], object], tmp_path: Path
) -> None:
    machine = Machine(holder(tmp_path), answers_after=100)
    waker = FakeWaker(VirtualClock(), meanwhile=lambda: setattr(machine, "holder", None))
    assert opened(machine, waker) == "line to a new one"


def test_one_that_never_answers_is_named_after_the_time_in_which_it_must(
    opened: Callable[[Machine, FakeWaker], object], tmp_path: Path
) -> None:
    machine, waker = Machine(holder(tmp_path), answers_after=10_000), FakeWaker(VirtualClock())
    with pytest.raises(Conflict, match="another process writes"):
        opened(machine, waker)
    assert waker.waits == pytest.approx(STARTS_WITHIN_S / POLL_INTERVAL_S, abs=2)


def test_a_command_that_holds_the_database_is_refused_at_once(opened: Callable[[Machine, FakeWaker], object]) -> None:
    machine, waker = Machine(holder(None), answers_after=0), FakeWaker(VirtualClock())
    with pytest.raises(Conflict):
        opened(machine, waker)
    assert (machine.asked, machine.started, waker.waits) == (0, 1, 0)
