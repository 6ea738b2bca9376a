"""What few uses need is loaded by them alone: the reproduction of papers by its command, and by no service.

And a command that prints a list, or the list of commands, loads no numbers, log or models that it does without.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from labctl.store import open_store
from tests.helpers.patience import WAIT_S

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
        [sys.executable, "-c", PROGRAM, *modules], capture_output=True, text=True, check=True, timeout=WAIT_S
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


#: What the list of commands is printed without.
NOT_TO_LIST = ("importlib.metadata", "labctl.answers", "labctl.log", "labctl.store", "numpy", "pydantic", "sqlalchemy")
#: What a list from the database is printed without: each takes 5 to 60 ms to load.
NOT_TO_READ = (
    "attr", "labctl.answers.campaigns", "labctl.answers.plans", "labctl.answers.recordings", "labctl.answers.standards",
    "labctl.calibration", "labctl.exports", "labctl.fitting", "labctl.store.repositories.campaigns",
    "labctl.store.repositories.diagnoses", "labctl.store.repositories.fleet_jobs",
    "labctl.store.repositories.recordings", "numpy", "procedures.recipe", "rich.traceback",
    "sqlalchemy.dialects.postgresql", "structlog",
)  # fmt: skip
COMMAND = """
import atexit, sys
atexit.register(lambda: print("loaded:", *sorted(sys.modules)))
sys.argv = ["labctl", *sys.argv[1:]]
from labctl.cli import main
main()
"""


@pytest.mark.parametrize(("arguments", "late"), [(["--help"], NOT_TO_LIST), (["units"], NOT_TO_READ)])
def test_a_command_that_lists_loads_what_it_prints_alone(
    tmp_path: Path, arguments: list[str], late: tuple[str, ...]
) -> None:
    database = [] if "--help" in arguments else ["--database", str(tmp_path / "lab.sqlite")]
    if database:
        with open_store(database[1], write=True):  # which is made, and needs more
            pass
    command = [sys.executable, "-c", COMMAND, *arguments, *database]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=WAIT_S)
    modules = done.stdout.rpartition("loaded: ")[2].split()
    assert "labctl.cli.app" in modules
    assert [name for name in modules if any(name == each or name.startswith(f"{each}.") for each in late)] == []
