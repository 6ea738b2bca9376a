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
