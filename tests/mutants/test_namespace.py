"""Mutated code reaches no process but its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from mutants import namespace


@pytest.mark.skipif(not namespace.is_possible(), reason="this system allows no namespaces of users and processes")
def test_what_runs_apart_sees_its_own_processes_only(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = "import os; print(os.getpid(), sorted(int(each) for each in os.listdir('/proc') if each.isdigit()))"
    command = [*namespace.UNSHARE, sys.executable, "-c", seen]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "1 [1]\n"
    monkeypatch.setenv(namespace.APART, "yes")
    assert namespace.run_apart([]) is None


def test_without_namespaces_nothing_is_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv(namespace.APART, raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SystemExit, match="could signal or change any process of this user; run it where"):
        namespace.run_apart(["guards"])
