"""A real process, ended by `kill -9` while it talks to another process's simulators over pty and TCP; then the next."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from instruments.bench_config import read_bench
from labctl.store.connection.database import Database
from studies.crashable_process import all_readings, complete_data_sets
from studies.databases import close_server, new_database

KILLS = int(os.environ.get("LABCTL_STUDY_REAL_KILLS", "30"))
SPEED = 5.0
#: Approximate duration of the campaign in real time, s. A busy machine may stall for seconds of bench time: the recipe
#: allows for that, because it is not what is measured here.
WHOLE_S = 16.0
RECIPE = """
format = "labctl-recipe/1"
name = "killed"
temperatures_c = [25]
rates_dps = [-40, 0, 20, 40]
positions = ["z"]
[soak]
hold_s = 10
max_drift_c = 2.0
drift_window_s = 10
timeout_s = 1800
[acquire]
duration_s = 8
settle_s = 2
[guards]
max_damaged_fraction = 0.9
stale_s = 600
[on_failure]
acquire_attempts = 20
"""
DATA_SETS = 4


@dataclass(frozen=True)
class Heir:
    """State of the campaign after the process that followed the killed one."""

    after_s: float
    state: str
    reason: str
    readings_missing: int
    wrong_counts: int
    safe: bool

    @property
    def well(self) -> bool:
        """Whether the plan was finished, once, with everything kept."""
        return self.state == "done" and self.safe and not (self.readings_missing or self.wrong_counts)


@contextmanager
def simulators(folder: Path) -> Iterator[Path]:
    """Run the simulated instruments in a process of their own; gives the bench file that leads there."""
    bench = read_bench("single-axis-sim").model_dump(exclude_none=True)
    bench["chamber"] = read_bench("triaxial-sim").model_dump(exclude_none=True)["chamber"]
    near, far = folder / "near.toml", folder / "far.toml"
    near.write_text(tomli_w.dumps(bench))
    command = [sys.executable, "-m", "labctl", "simulator", str(near), "--out", str(far), "--speed", str(SPEED)]
    with subprocess.Popen([*command, "--json"], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            json.loads(process.stdout.readline())
            yield far
        finally:
            process.terminate()


def labctl(database: str, *arguments: str) -> subprocess.Popen[str]:
    """Start a command on the study's database."""
    command = [sys.executable, "-m", "labctl", *arguments, "--json", "--database", database]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def kill_once(folder: Path, bench: Path, after_s: float) -> Heir:
    """Kill a campaign after so many seconds, let the next process resume it, and read what is there then."""
    recipe = folder / "killed.toml"
    recipe.write_text(RECIPE)
    location = new_database(folder)
    start = ("start", str(recipe), "--clear-confirmed-by", "the study")  # what is far is not known to be simulated
    with labctl(location, "campaign", *start, "--bench", str(bench)) as first:
        with suppress(subprocess.TimeoutExpired):
            first.wait(after_s)
        first.send_signal(signal.SIGKILL)
        first.communicate()
    database = Database(location, write=False)
    before = all_readings(database)
    database.close()
    answer = _status(location)
    if answer is None or answer["state"] != "done":
        verb = ("resume",) if answer is not None else start
        with labctl(location, "campaign", *verb, "--bench", str(bench)) as heir:
            said, complaint = heir.communicate(timeout=300)
        answer = json.loads(said) if said else {"state": "none", "reason": complaint}
    database = Database(location, write=False)
    counts = complete_data_sets(database)
    wrong = sum(counts[number] != 1 for number in range(1, DATA_SETS + 1))
    missing = len(before - all_readings(database))
    database.close()
    return Heir(after_s, answer["state"], answer["reason"], missing, wrong, "NOT confirmed" not in answer["reason"])


def _status(database: str) -> dict[str, Any] | None:
    with labctl(database, "campaign", "status") as asked:
        said, _ = asked.communicate(timeout=60)
    return dict(json.loads(said)) if asked.returncode == 0 else None


def run() -> dict[str, float]:
    """Kill campaigns at instants spread over their whole length."""
    rng = np.random.default_rng(9)
    heirs = []
    for number in range(KILLS):
        after_s = float(0.5 + WHOLE_S * (number + rng.uniform()) / KILLS)
        with tempfile.TemporaryDirectory() as name, simulators(Path(name)) as bench:
            heirs.append(kill_once(Path(name), bench, after_s))
        if not heirs[-1].well:
            print(f"   not as promised: {heirs[-1]}", flush=True)
    close_server()
    return {
        "kills": float(len(heirs)),
        "finished_as_promised": float(sum(heir.well for heir in heirs)),
        "readings_missing": float(sum(heir.readings_missing for heir in heirs)),
        "data_sets_twice_or_missing": float(sum(heir.wrong_counts for heir in heirs)),
    }
