"""`labctl stop` as a process: what it loads, which benches it finds, and what its exit status says."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from labctl.stop.places import BenchPlace, DriverNote, known_places, place_of
from tests.helpers.patience import WAIT_S

#: What Python's own start may load for an installation from a working tree.
STARTED = {"_virtualenv", "sitecustomize", "usercustomize"}


@pytest.fixture
def environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("LABCTL_DATABASE", raising=False)
    return dict(os.environ)


def stop(environment: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "labctl", "stop", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=WAIT_S)


def test_it_loads_the_standard_library_alone() -> None:
    code = (
        "import sys; before = set(sys.modules); import labctl.cli, labctl.stop.program\n"
        "print([name for name in set(sys.modules) - before if name.partition('.')[0] not in sys.stdlib_module_names])"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    allowed = {"labctl", "labctl.cli", "labctl.stop", "instruments", "instruments.clock"} | STARTED
    others = {name for name in eval(loaded) if name not in allowed and not name.startswith("labctl.stop.")}
    assert others == set()


def test_it_runs_first_before_it_loads_what_it_needs(environment: dict[str, str]) -> None:
    code = (
        "import os, sys; os.sched_setscheduler = lambda *_: print(sorted({'labctl.stop.program', 'ctypes', 'tomllib'} "
        "& set(sys.modules))); sys.argv = ['labctl', 'stop']; import labctl.cli; labctl.cli.main()"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, env=environment)
    assert found.stdout.split("\n")[0] == "[]"


def test_no_bench_that_is_known_is_not_called_stopped(environment: dict[str, str]) -> None:
    found = stop(environment)
    assert (found.returncode, "NOT STOPPED: labctl knows of no bench" in found.stderr) == (1, True)


def test_a_bench_is_found_without_its_database(environment: dict[str, str], tmp_path: Path) -> None:
    place = place_of(str(tmp_path / "lab.sqlite"), "bench 1/a")
    place.write_note(DriverNote("bench 1/a", left="bench 1/a is safe", left_safe=True))
    place.register()
    assert known_places() == [place]
    found = stop(environment, "--json")
    (bench,) = json.loads(found.stdout)["benches"]
    assert (found.returncode, bench["bench"], bench["stands"]) == (0, "bench 1/a", True)
    place.write_note(DriverNote("bench 1/a", left="table to rest: no answer", left_safe=False))
    found = stop(environment)
    assert (found.returncode, "NOT STOPPED: bench bench 1/a: table to rest" in found.stderr) == (1, True)


def test_a_bench_file_names_the_bench_also_where_it_has_another_name(
    environment: dict[str, str], tmp_path: Path
) -> None:
    place = place_of(str(tmp_path / "lab.sqlite"), "real")
    document = {"name": "real", "table": {"port": "/dev/ttyUSB7"}}
    place.write_note(DriverNote("real", document=document, left="bench real is safe", left_safe=True))
    place.register()
    file = tmp_path / "copy.toml"
    file.write_text('name = "copy"\n[table]\nport = "/dev/ttyUSB7"\n')
    assert "bench real stands" in stop(environment, "--bench", str(file)).stdout
    file.write_text('name = "copy"\n[table]\nport = "sim://arrick"\n')
    assert "instruments are simulated, and no process runs it" in stop(environment, "--bench", str(file)).stdout
    wrong = stop(environment, "--bench", str(tmp_path / "nowhere.toml"))
    assert (wrong.returncode, "cannot be read" in wrong.stderr) == (2, True)


def test_a_folder_without_a_note_is_named_by_its_bench(tmp_path: Path) -> None:
    assert BenchPlace(place_of(str(tmp_path / "lab.sqlite"), "ü 1/..").folder).name == "ü 1/.."
    assert place_of(str(tmp_path / "lab.sqlite"), "..").folder.parent.name == "lab.sqlite.benches"


def test_a_password_is_in_no_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    first = place_of("postgresql://ann:secret@host/lab", "b").folder
    assert first == place_of("postgresql://ann:other@host/lab", "b").folder
    assert "secret" not in str(first)
