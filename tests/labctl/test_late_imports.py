"""What few uses need is loaded by them alone: the reproduction of papers by its command, and by no service."""

from __future__ import annotations

import subprocess
import sys

import pytest

LATE = ("labctl.papers", "labctl.services.reproduction", "labctl.plots.papers")
#: What a bench process drives without: it starts sooner, and is started again sooner.
RESULTS = ("labctl.fitting.criticism", "labctl.services.commands.registry", "labctl.services.certificates")
SERVICE = {
    "labctl.processes.supervisor": LATE,
    "labctl.processes.bench_process": (*LATE, *RESULTS),
    "labctl.processes.web_process": LATE,
}
#: What each process of a service loads, with what the workers of its computations have in common.
PROGRAM = """
import importlib, sys
for name in sys.argv[1:]:
    importlib.import_module(name)
if "labctl.processes.web_process" in sys.argv:
    from labctl.processes.web_process import WORKER_MODULES
    for name in WORKER_MODULES:
        importlib.import_module(name)
print(*sorted(sys.modules))
"""


def loaded(*modules: str, late: tuple[str, ...] = LATE) -> list[str]:
    """Return which of the late modules a new process has after these imports."""
    found = subprocess.run(
        [sys.executable, "-c", PROGRAM, *modules], capture_output=True, text=True, check=True, timeout=120
    )
    return [name for name in found.stdout.split() if name.startswith(late)]


@pytest.mark.parametrize("module", SERVICE)
def test_no_process_of_a_service_loads_what_it_works_without(module: str) -> None:
    assert loaded(module, late=SERVICE[module]) == []


def test_the_command_line_with_all_its_commands_does_not_load_it() -> None:
    assert loaded("labctl.cli.app", "labctl.services.commands.registry", "labctl.services.lab_service") == []


def test_its_own_module_does() -> None:
    assert {"labctl.papers.yang2018", "labctl.services.reproduction.reproduce"} <= set(
        loaded("labctl.services.reproduction.reproduce")
    )
