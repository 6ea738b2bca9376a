"""Mutated code reaches no process but its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from mutants import namespace


@pytest.mark.skipif(not namespace.is_possible(), reason="this system allows no namespaces of users and processes")
def test_what_runs_apart_sees_its_own_processes_only(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = (
        "import os; print(os.getpid(), sorted(int(each) for each in os.listdir('/proc') if each.isdigit()), "
        "os.path.isdir('/dev/shm') and os.listdir('/dev/shm'))"
    )
    command = [*namespace.UNSHARE, *namespace.OWN_MEMORY, sys.executable, "-c", seen]
    seen_there = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert seen_there in {"1 [1] []\n", "1 [1] False\n"}  # not what other processes have in memory
    monkeypatch.setenv(namespace.APART, "yes")
    assert namespace.run_apart([]) is None


def test_without_namespaces_nothing_is_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv(namespace.APART, raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SystemExit, match="could signal or change any process of this user; run it where"):
        namespace.run_apart(["guards"])
