"""What each process asks the system for, with and without the right to be raised, of a system that is made up.

The mutants of the module run against these tests alone: some of them would raise another process of the computer.
"""

from __future__ import annotations

import ctypes
import os
import resource
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from labctl.stop.priority import at_once, first_of_all, keep_memory, of_the_bench, of_the_pages

HERE, PID = 0, 4711


class System:
    """Priorities of one process, which may be raised or not."""

    def __init__(self, group: Path) -> None:
        self.may_raise = self.leads_session = self.has_real_time = True
        self.niceness, self.real_time, self.locks_memory = 0, "", True
        self.group_file, self.locked = group, list[int]()
        self.opened: list[int] = []

    @property
    def group(self) -> str:
        return self.group_file.read_text()

    def setpriority(self, which: int, process: int, niceness: int) -> None:
        assert which == os.PRIO_PROCESS
        if process != HERE or (niceness < self.niceness and not self.may_raise):
            raise PermissionError
        self.niceness = niceness

    def getsid(self, process: int) -> int:
        if process != HERE:
            raise ProcessLookupError
        return PID if self.leads_session else PID - 1

    def sched_setscheduler(self, process: int, policy: int, parameters: Any) -> None:
        if process != HERE or not self.has_real_time:
            raise PermissionError
        assert policy == os.SCHED_RR | os.SCHED_RESET_ON_FORK
        self.real_time = f"{parameters.sched_priority}"

    def mlockall(self, flags: int) -> int:
        self.locked.append(flags)
        return 0 if self.locks_memory else -1


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> System:
    file, opened = tmp_path / "autogroup", os.open
    file.write_text("")
    made = System(file)

    def open_file(path: str, flags: int, *rest: Any, **more: Any) -> int:
        is_group = path == "/proc/self/autogroup"  # each write to it counts alone
        handle = opened(file if is_group else path, flags | os.O_TRUNC if is_group else flags, *rest, **more)
        if is_group:
            made.opened.append(handle)
        return handle

    for name in ("setpriority", "getsid", "sched_setscheduler"):
        monkeypatch.setattr(os, name, getattr(made, name))
    monkeypatch.setattr(os, "getpid", lambda: PID)
    monkeypatch.setattr(os, "open", open_file)
    limited(monkeypatch, (resource.RLIM_INFINITY, resource.RLIM_INFINITY), 1000)
    monkeypatch.setattr(ctypes, "CDLL", lambda _: SimpleNamespace(mlockall=made.mlockall))
    return made


def limited(monkeypatch: pytest.MonkeyPatch, limits: tuple[int, int], user: int) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: user)
    monkeypatch.setattr(resource, "getrlimit", {resource.RLIMIT_MEMLOCK: limits}.__getitem__)


@pytest.mark.parametrize(
    ("of_a_kind", "raised", "beside"),
    [(first_of_all, -15, 0), (of_the_bench, -10, 0), (of_the_pages, 0, 5)],
)
@pytest.mark.parametrize("may_raise", [True, False])
def test_each_kind_of_process_has_its_niceness_and_so_has_the_group_of_its_session(
    system: System, of_a_kind: Callable[[], None], raised: int, beside: int, may_raise: bool
) -> None:
    """Where the others cannot be raised, what answers pages steps back from them."""
    system.may_raise = may_raise
    of_a_kind()
    expected = raised if may_raise else beside
    assert (system.niceness, system.group) == (expected, str(expected))
    for handle in system.opened:
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(handle)


def test_the_group_of_a_session_is_left_to_the_process_whose_session_it_is(system: System) -> None:
    system.leads_session = False
    first_of_all()
    assert (system.niceness, system.group) == (-15, "")


def test_a_process_that_was_started_behind_others_is_not_raised_without_the_right(system: System) -> None:
    system.may_raise, system.niceness = False, 3
    of_the_bench()
    assert (system.niceness, system.group) == (3, "")
    of_the_pages()
    assert (system.niceness, system.group) == (5, "5")
    system.niceness = 7
    of_the_pages()
    assert (system.niceness, system.group) == (7, "5")


def test_a_system_without_groups_of_sessions_is_as_good(system: System) -> None:
    system.group_file.unlink()
    first_of_all()
    assert system.niceness == -15


def test_a_stop_runs_in_real_time_at_its_lowest_priority(system: System) -> None:
    at_once()
    assert (system.real_time, system.niceness) == ("1", 0)


@pytest.mark.parametrize("is_known", [True, False])
def test_without_real_time_a_stop_is_raised_as_what_lives_long(
    system: System, monkeypatch: pytest.MonkeyPatch, is_known: bool
) -> None:
    system.has_real_time = False
    if not is_known:
        monkeypatch.delattr(os, "sched_setscheduler")
    at_once()
    assert (system.real_time, system.niceness) == ("", -15)


NO_LIMIT, LIMIT = resource.RLIM_INFINITY, 8 * 2**20


@pytest.mark.parametrize(
    ("limits", "user", "is_kept"),
    [
        ((NO_LIMIT, NO_LIMIT), 1000, True),
        ((LIMIT, NO_LIMIT), 1000, False),  # what counts is what is in force, not what it could be raised to
        ((LIMIT, LIMIT), 0, True),
        ((LIMIT, LIMIT), 1000, False),
        ((LIMIT, LIMIT), 1, False),
    ],
)
def test_memory_is_kept_where_no_limit_holds(
    system: System, monkeypatch: pytest.MonkeyPatch, limits: tuple[int, int], user: int, is_kept: bool
) -> None:
    limited(monkeypatch, limits, user)
    assert keep_memory() is is_kept
    assert system.locked == ([1 | 2 | 4] if is_kept else [])  # all pages, those to come, when they are first used


def test_the_bench_process_keeps_its_memory_and_what_answers_pages_does_not(system: System) -> None:
    of_the_pages()
    assert system.locked == []
    of_the_bench()
    assert len(system.locked) == 1


@pytest.mark.parametrize("is_known", [True, False])
def test_a_system_that_keeps_no_memory_says_so(system: System, monkeypatch: pytest.MonkeyPatch, is_known: bool) -> None:
    system.locks_memory = False
    if not is_known:
        monkeypatch.setattr(ctypes, "CDLL", lambda _: SimpleNamespace())
    assert keep_memory() is False
