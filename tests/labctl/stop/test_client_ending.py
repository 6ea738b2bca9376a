"""How a process that drives a bench is ended: by its handle, on a system that is made up."""

from __future__ import annotations

import errno
import os
import select
import signal
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from labctl.stop import client
from labctl.stop.client import end_process


@dataclass
class Process:
    """A process that ends after it was asked for a number of times whether it lives."""

    pid: int
    lives_for: int

    @property
    def lives(self) -> bool:
        self.lives_for -= 1
        return self.lives_for >= 0


@dataclass
class Kernel:
    """Handles of processes; fails where a test says so."""

    at_open: OSError | None = None
    at_signal: OSError | None = None
    killed: list[tuple[int, int]] = field(default_factory=list)
    waited: list[tuple[list[int], float]] = field(default_factory=list)
    closed: list[int] = field(default_factory=list)

    def pidfd_open(self, pid: int) -> int:
        if self.at_open:
            raise self.at_open
        return pid + 1000

    def pidfd_send_signal(self, handle: int, number: int) -> None:
        if self.at_signal:
            raise self.at_signal
        self.killed.append((handle, number))

    def select(self, readable: list[int], _writable: list[int], _other: list[int], within_s: float) -> None:
        self.waited.append((readable, within_s))


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> Kernel:
    made = Kernel()
    for module, name in ((os, "pidfd_open"), (signal, "pidfd_send_signal"), (select, "select")):
        monkeypatch.setattr(module, name, getattr(made, name))
    monkeypatch.setattr(client, "os", SimpleNamespace(pidfd_open=made.pidfd_open, close=made.closed.append))
    return made


def ended(pid: int, lives_for: int) -> str:
    process: Any = Process(pid, lives_for)
    return end_process(process)


@pytest.mark.parametrize(("lives_for", "text"), [(2, ""), (3, "process 5 does not end")])
def test_a_process_is_killed_by_its_handle_and_waited_for_during_2_s(kernel: Kernel, lives_for: int, text: str) -> None:
    assert ended(5, lives_for) == text
    assert (kernel.killed, kernel.waited, kernel.closed) == ([(1005, signal.SIGKILL)], [([1005], 2.0)], [1005])


def test_a_process_that_has_ended_meanwhile_is_not_killed_nor_is_another_one_with_its_number(kernel: Kernel) -> None:
    assert ended(5, 0) == ""
    assert kernel.closed == []
    assert ended(5, 1) == ""
    assert (kernel.killed, kernel.closed) == ([], [1005])


GONE, REFUSED = ProcessLookupError(errno.ESRCH, "No such process"), PermissionError(errno.EPERM, "Not permitted")


@pytest.mark.parametrize(("error", "text"), [(GONE, ""), (REFUSED, "process 5 cannot be ended (Not permitted)")])
def test_a_process_that_cannot_be_killed_is_named_unless_it_is_gone(kernel: Kernel, error: OSError, text: str) -> None:
    kernel.at_open = error
    assert ended(5, 10) == text
    assert kernel.closed == []
    kernel.at_open, kernel.at_signal = None, error
    assert ended(5, 10) == text
    assert kernel.closed == [1005]
