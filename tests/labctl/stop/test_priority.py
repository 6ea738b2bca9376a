"""What drives or guards a bench keeps its memory, where the system allows that without a limit."""

from __future__ import annotations

import ctypes
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from labctl.stop.priority import keep_memory

RAISED = """
import os, pathlib
from labctl.stop.priority import first_of_all
{before}
first_of_all()
group = pathlib.Path("/proc/self/autogroup")
print(os.getpriority(os.PRIO_PROCESS, 0), group.read_text().split()[-1] if group.exists() else "none")
"""

LOOK = """
from labctl.stop.priority import keep_memory
kept = keep_memory()
more = bytearray(64 * 2**20)
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
print(int(kept), status["VmLck"].split()[0])
"""


def test_all_that_is_used_is_kept_where_there_is_no_limit() -> None:
    words = [sys.executable, "-c", LOOK]
    found = subprocess.run(words, capture_output=True, text=True, check=True, cwd=Path(__file__).parents[3])
    kept, locked_kib = found.stdout.split()
    if kept == "0":
        pytest.skip("this system keeps no memory for its processes")
    assert int(locked_kib) > 64 * 1024


def test_where_there_is_a_limit_nothing_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """With memory to come kept, a process beyond its limit would get no more of it."""
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (8 * 2**20, 8 * 2**20))
    monkeypatch.setattr(ctypes, "CDLL", lambda _: pytest.fail("the memory was locked"))
    assert not keep_memory()


def test_the_group_of_a_session_is_raised_only_by_the_process_whose_session_it_is() -> None:
    """Whatever else runs at the same terminal would be raised with it, beyond the bench process."""
    shared = _raised("os.fork() and (os.wait(), os._exit(0))")
    own = _raised("")
    if own == (0, "none") or own[1] in {"0", "none"}:
        pytest.skip("this system raises no process, or has no groups of sessions")
    assert own == (-15, "-15")
    assert shared == (-15, "0")


def _raised(before: str) -> tuple[int, str]:
    """Return niceness and that of the group, of a process in a new session; `before` is run first."""
    words = [sys.executable, "-c", RAISED.format(before=before)]
    found = subprocess.run(
        words, capture_output=True, text=True, check=True, cwd=Path(__file__).parents[3], start_new_session=True
    )
    niceness, group = found.stdout.split()
    return int(niceness), group


def test_a_stop_runs_in_real_time_and_what_it_starts_does_not() -> None:
    look = (
        "import os; from labctl.stop.priority import at_once; at_once();"
        "print(os.sched_getscheduler(0) & 0xF, flush=True);"
        "os.fork() or (print(os.sched_getscheduler(0) & 0xF, flush=True), os._exit(0)); os.wait()"
    )
    found = subprocess.run(
        [sys.executable, "-c", look], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[3]
    )
    own, started = found.stdout.split()
    if int(own) == os.SCHED_OTHER:
        pytest.skip("this system gives no process real time")
    assert (int(own), int(started)) == (os.SCHED_RR, os.SCHED_OTHER)
