"""Campaigns at 30 times real time, alone and beside busy processes: nothing is lost unsaid, no cable is blamed.

Each campaign is started as a user does it, by the command line: against `labctl simulator` in a process of its own, on
real ports, or by `labctl serve`. Readings of a data set that are missing inside it are counted by the unit's own clock
where it has one. Those missing at its ends, or of a unit without such a clock, are counted by what the unit's rate and
the duration promise, as exactly as a computer knows at 30 times real time when a reading arrived.
`LABCTL_STUDY_CAMPAIGNS` are run alone, `LABCTL_STUDY_BUSY_CAMPAIGNS` beside `LABCTL_STUDY_BUSY_PROCESSES` processes
that compute without end, at normal priority.
"""

from __future__ import annotations

import json
import math
import os
import re
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import read_bench
from labctl.recording.columns import DEVICE_S
from labctl.store import DataSetRow, open_store

QUIET = int(os.environ.get("LABCTL_STUDY_CAMPAIGNS", "100"))
BUSY = int(os.environ.get("LABCTL_STUDY_BUSY_CAMPAIGNS", "10"))
PROCESSES = int(os.environ.get("LABCTL_STUDY_BUSY_PROCESSES", "8"))
SPEED = 30
#: A campaign that has not ended after this is ended by the study, s of real time.
LONGEST_S = 900.0
#: A gate holds one reading more or fewer than its duration promises, depending on the phase of the stream.
PHASE = 1.0
#: When a reading arrived is known so well, s of real time: its time in the campaign is `SPEED` times less certain.
ARRIVAL_S = 1e-3
#: What blames an instrument or its wire.
BLAME = re.compile(r"cable|no answer|not answer|silent|check power|link .* (?:lost|broke)", re.IGNORECASE)
RECIPE = """
format = "labctl-recipe/1"
name = "busy"
temperatures_c = [25, 27]
rates_dps = [-40, -10, 20, 40]
positions = ["z"]
[soak]
hold_s = 30
max_drift_c = 2.0
drift_window_s = 30
timeout_s = 3600
[acquire]
duration_s = 10
settle_s = 1
"""


@dataclass(frozen=True)
class Way:
    """How a campaign is run: on which bench, and whether by a service or against a simulator on real ports."""

    bench: str
    by_service: bool = False

    @property
    def name(self) -> str:
        """What it is called in the table."""
        return f"{self.bench} {'by a service' if self.by_service else 'on ports'}"


#: A unit with a counter and a chamber on the network; a unit without one and a chamber on a serial line; a service.
WAYS = (Way("triaxial-sim"), Way("single-axis-sim"), Way("triaxial-sim", by_service=True))


@dataclass
class Counts:
    """What was found in the campaigns of one way."""

    campaigns: int = 0
    done: int = 0
    planned: int = 0  #: data sets
    complete: int = 0
    repeated: int = 0  #: events that say so
    short_said: int = 0  #: data sets that count their missing readings as lost
    short_unsaid: int = 0
    blames: list[str] = field(default_factory=list)  #: messages to the user
    retries: int = 0  #: requests that were asked again, by the log
    stalls: int = 0  #: events that say so
    wall_s: list[float] = field(default_factory=list)

    def add(self, answer: dict[str, Any], database: Path, rates_hz: dict[str, float], log: str) -> None:
        """Take in one campaign: the answer of the command line, what was recorded, and what was logged."""
        self.campaigns += 1
        self.done += answer.get("state") == "done"
        self.blames += [f"{answer.get('state')}: {answer.get('reason')}"] if answer.get("state") != "done" else []
        self.retries += log.count("link.retry")
        with sqlite3.connect(f"file:{database}?mode=ro", uri=True) as connection:
            events = connection.execute("select kind, message from events").fetchall()
            steps = connection.execute("select count(*) from steps where kind = 'acquire'").fetchone()[0]
        self.planned += steps
        self.repeated += sum(kind == "data_set_repeated" for kind, _ in events)
        self.stalls += sum(kind == "host_stalled" for kind, _ in events)
        self.blames += [f"{kind}: {message}" for kind, message in events if BLAME.search(message)]
        with open_store(str(database), write=False) as store:
            for recording in store.recordings.all():
                heads = {head.number: head for head in store.recordings.data_sets(recording.id)}
                for number, columns in store.recordings.iter_datasets(recording.id, times=True):
                    self.complete += 1
                    missing = missing_of(heads[number], columns, rates_hz[recording.serial])
                    said = heads[number].lost + heads[number].damaged
                    self.short_said += 0 < missing <= said
                    self.short_unsaid += missing > said

    @property
    def line(self) -> str:
        """The figures, as in `HEAD`."""
        wall_s = sorted(self.wall_s)
        return (
            f"{self.done:5}/{self.campaigns:<5}{self.complete:6}/{self.planned:<6}{self.repeated:8}{self.short_said:11}"
            f"{self.short_unsaid:13}{len(self.blames):8}{self.retries:9}{self.stalls:8}"
            f"{wall_s[len(wall_s) // 2]:9.0f}{wall_s[-1]:6.0f}"
        )


def missing_of(head: DataSetRow, columns: Mapping[str, NDArray[np.generic]], rate_hz: float) -> int:
    """Return how many readings of a data set are missing for certain."""
    gate_s = (head.t_until_s or 0.0) - (head.t_from_s or 0.0)
    t_s, u_readings = np.asarray(columns["t_s"], dtype=np.float64), ARRIVAL_S * SPEED * rate_hz
    if DEVICE_S not in columns:
        return max(math.floor(gate_s * rate_hz - len(t_s) - PHASE - 2 * u_readings), 0)
    device_s = np.asarray(columns[DEVICE_S], dtype=np.float64)
    inside = round((device_s[-1] - device_s[0]) * rate_hz) + 1 - len(device_s)
    before, after = t_s[0] - (head.t_from_s or 0.0), (head.t_until_s or 0.0) - t_s[-1]
    at_ends = sum(math.floor(max(each_s * rate_hz - PHASE - u_readings, 0.0)) for each_s in (before, after))
    return inside + at_ends


HEAD = "   done/of   complete/of  repeated  short_said  short_unsaid  blames  retries  stalls  wall_s p50 / max"


def labctl(*arguments: object) -> list[str]:
    """Return the words of a command."""
    return [sys.executable, "-m", "labctl", *map(str, arguments)]


@contextmanager
def started(command: Sequence[str], log: Path) -> Iterator[str]:
    """Run a process that says in a line that it is ready; gives the line."""
    with log.open("ab") as errors, subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True) as made:
        try:
            assert made.stdout is not None
            yield made.stdout.readline()
        finally:
            made.terminate()


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """Run processes that compute without end."""
    with ExitStack() as stack:
        for _ in range(processes):
            made = stack.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            stack.callback(made.kill)
        yield


def campaign(way: Way, folder: Path, seed: int) -> tuple[dict[str, Any], str]:
    """Run one campaign; returns the command's answer, empty where it gave none, and what all processes logged."""
    recipe, database, log = folder / "busy.toml", folder / "labctl.sqlite", folder / "log"
    recipe.write_text(RECIPE, encoding="utf-8")
    start = labctl("campaign", "start", recipe, "--json", "--database", database)
    with ExitStack() as stack:
        if way.by_service:
            serve = labctl("serve", "--bench", way.bench, "--speed", SPEED, "--port", 0, "--json")
            stack.enter_context(started([*serve, "--database", str(database)], log))
            _answer(start, log)
            start = labctl("campaign", "watch", "--json", "--database", database)
        else:
            far = folder / "far.toml"
            simulator = labctl("simulator", way.bench, "--out", far, "--speed", SPEED, "--json")
            stack.enter_context(started(simulator, log))
            start += ["--bench", str(far), "--clear-confirmed-by", "a study", "--seed", str(seed)]
        answer = _answer(start, log)
    return answer, log.read_text(encoding="utf-8", errors="replace")


def _answer(command: Sequence[str], log: Path) -> dict[str, Any]:
    """Return the last document that a command printed; what it said beside goes to the log."""
    with log.open("ab") as errors:
        try:
            said = subprocess.run(
                command, stdout=subprocess.PIPE, stderr=errors, text=True, timeout=LONGEST_S, check=False
            ).stdout
        except subprocess.TimeoutExpired:
            return {"state": "not ended", "reason": f"after {LONGEST_S:g} s"}
    found, decoder, rest = {}, json.JSONDecoder(), said.strip()
    while rest:
        found, end = decoder.raw_decode(rest)
        rest = rest[end:].strip()
    return dict(found)


def measure(campaigns: int, processes: int) -> list[str]:
    """Run campaigns of each way in turn beside busy processes; returns the lines of the table."""
    found = {way: Counts() for way in WAYS}
    with busy(processes):
        for number in range(campaigns):
            way = WAYS[number % len(WAYS)]
            rates_hz = {gyro.serial: gyro.sample_rate_hz for gyro in read_bench(way.bench).gyros}
            with tempfile.TemporaryDirectory() as folder:
                begun_s = time.monotonic()
                answer, log = campaign(way, Path(folder), number + 1)
                found[way].wall_s.append(time.monotonic() - begun_s)
                found[way].add(answer, Path(folder) / "labctl.sqlite", rates_hz, log)
            print(f"   {number + 1:4} {way.name:30}{found[way].line}", flush=True)
    lines = [f"beside {processes} busy processes"]
    for way, counts in found.items():
        if counts.campaigns:
            lines.append(f"{way.name:30}{counts.line}")
            lines += [f"      {text[:200]}" for text in counts.blames]
    return lines


def run() -> str:
    """Run the campaigns alone and beside busy processes, and return the table."""
    return "\n".join([f"{'':30}{HEAD}", *measure(QUIET, 0), *measure(BUSY, PROCESSES)])
