"""Stops of a real service whose processes were killed, frozen or signalled: when does the table hear of it?

Each round runs `labctl serve` on simulated instruments at pseudo-terminals and TCP ports of another process, starts a
campaign, lets one or two processes of the service suffer at random moments, and then asks for a stop: by the page's
request, by `labctl stop`, or by a signal to the supervisor. The log of the table says when it was stopped and whether
it turned again. `LABCTL_STUDY_STOPS` is how many rounds, `LABCTL_STUDY_BUSY` how many busy processes run beside.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import tomli_w

from instruments.bench_config import read_bench
from labctl.services.schemas.campaigns import BENCH_CHECKS

ROUNDS = int(os.environ.get("LABCTL_STUDY_STOPS", "200"))
BUSY = int(os.environ.get("LABCTL_STUDY_BUSY", "0"))
#: The table is stopped within this, or the one who asked reads NOT STOPPED within `SAID_S`, s.
TOLD_S, SAID_S = (2.0, 5.0) if BUSY == 0 else (5.0, 5.0)
#: How long the table is watched after the stop, while what died is started again, s.
WATCHED_S = 6.0
PROCESSES = ("supervisor", "web", "bench")
FAULTS = (signal.SIGKILL, signal.SIGSTOP, signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
WAYS = ("page", "command", "signal")
ABORT = "!1a"
RECIPE = """
format = "labctl-recipe/1"
name = "stops"
temperatures_c = [25]
rates_dps = [-40, 40]
positions = ["z"]
[soak]
hold_s = 1
max_drift_c = 5.0
drift_window_s = 2
timeout_s = 600
[acquire]
duration_s = 300
settle_s = 1
"""


@dataclass(frozen=True)
class Fault:
    """A signal to one process, so long after the one before."""

    process: str
    number: signal.Signals
    after_s: float


@dataclass(frozen=True)
class Round:
    """What came of one stop."""

    faults: tuple[Fault, ...]
    way: str
    told_s: float | None  #: from the request until the table heard the stop; None: it never did
    stood: bool  #: whether the table stood already when the stop was asked for
    said_s: float | None  #: until NOT STOPPED was read, where it was
    turned_again: bool
    left_behind: tuple[int, ...]  #: processes that still live at the end, after a last stop of everything

    @property
    def well(self) -> bool:
        """Whether the table was stopped in time, or that was said in time, and nothing turned again."""
        in_time = self.stood or (self.told_s is not None and self.told_s <= TOLD_S)
        said = self.said_s is not None and self.said_s <= SAID_S
        return (in_time or said) and not self.turned_again and not self.left_behind

    def __str__(self) -> str:
        faults = ", ".join(f"{each.number.name} {each.process} after {each.after_s:.1f} s" for each in self.faults)
        told = "stood already" if self.stood else "never" if self.told_s is None else f"{self.told_s:.2f} s"
        said = "" if self.said_s is None else f", NOT STOPPED said after {self.said_s:.2f} s"
        again = ", TURNED AGAIN" if self.turned_again else ""
        left = f", left behind {self.left_behind}" if self.left_behind else ""
        return f"{faults}; stop by {self.way}: table stopped {told}{said}{again}{left}"


class Table:
    """The simulated table's own log."""

    def __init__(self, log: Path) -> None:
        self.log = log

    def lines(self) -> list[dict[str, Any]]:
        """Return what the instruments have heard."""
        found = []
        for text in self.log.read_text().splitlines():
            with contextlib.suppress(ValueError):
                found.append(json.loads(text))
        return found

    def turns(self) -> bool:
        """Return whether the table turned when an instrument heard something last."""
        lines = self.lines()
        return bool(lines and lines[-1]["table_turns"])


@contextmanager
def simulators(folder: Path) -> Iterator[tuple[Path, Table]]:
    """Run the simulated instruments in a process of their own; gives the bench file and the table's log."""
    near, far, log = folder / "near.toml", folder / "far.toml", folder / "heard"
    near.write_text(tomli_w.dumps(read_bench("single-axis-sim").model_dump(exclude_none=True)))
    command = [sys.executable, "-m", "labctl", "simulator", str(near), "--out", str(far), "--log", str(log), "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            yield far, Table(log)
        finally:
            process.terminate()


class Service:
    """`labctl serve` on a bench."""

    def __init__(self, folder: Path, bench: Path) -> None:
        self.database = folder / "lab.sqlite"
        self.environment = {**os.environ, "XDG_STATE_HOME": str(folder / "state")}
        words = ["serve", "--bench", str(bench), "--port", "0", "--json", "--database", str(self.database)]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "labctl", *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env=self.environment,
        )  # fmt: skip
        assert self.process.stdout is not None
        ready = json.loads(self.process.stdout.readline())
        self.url = ready["url"]
        self.pids = {"supervisor": self.process.pid, "web": ready["web_pid"], "bench": ready["bench_pid"]}

    def command(self, *words: str) -> subprocess.Popen[str]:
        """Start a command on the database."""
        return subprocess.Popen(
            [sys.executable, "-m", "labctl", *words, "--database", str(self.database)],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=self.environment,
        )  # fmt: skip

    def family(self) -> tuple[int, ...]:
        """Return the processes that have this database on their command line, or were started by this service."""
        found = set()
        for entry in Path("/proc").iterdir():
            with contextlib.suppress(OSError, ValueError):
                pid, words = int(entry.name), (entry / "environ").read_bytes()
                state = (entry / "stat").read_text(encoding="latin-1").rpartition(")")[2].split()[0]
                if str(self.environment["XDG_STATE_HOME"]).encode() in words and state != "Z":
                    found.add(pid)
        return tuple(sorted(found))


def ask(service: Service, way: str, campaign: int) -> float | None:
    """Ask for a stop; returns after how many seconds NOT STOPPED was read, None where it was not."""
    begun_s = time.monotonic()
    if way == "signal":
        with contextlib.suppress(ProcessLookupError):
            os.kill(service.pids["supervisor"], signal.SIGTERM)
        return None
    if way == "page":
        try:
            answer = httpx.post(f"{service.url}/api/campaigns/{campaign}/abort", json={"reason": "study"}, timeout=5.0)
        except httpx.HTTPError:  # the page shows NOT STOPPED over everything, at once
            return time.monotonic() - begun_s
        return time.monotonic() - begun_s if "NOT STOPPED" in answer.text else None
    command = service.command("stop")
    assert command.stderr is not None
    for line in command.stderr:
        if "NOT STOPPED" in line:
            return time.monotonic() - begun_s
    command.wait()
    return None


def one(faults: tuple[Fault, ...], way: str) -> Round:
    """Run one round."""
    with tempfile.TemporaryDirectory() as name, simulators(Path(name)) as (bench, table):
        service = Service(Path(name), bench)
        start = {"recipe": RECIPE, "confirmed_by": "the study", "checks": list(BENCH_CHECKS)}
        campaign = httpx.post(f"{service.url}/api/campaigns", json=start, timeout=60.0).json()["id"]
        while not table.turns():
            time.sleep(0.05)
        for fault in faults:
            time.sleep(fault.after_s)
            with contextlib.suppress(ProcessLookupError):
                os.kill(service.pids[fault.process], fault.number)
        before, stood, begun_s = len(table.lines()), not table.turns(), time.monotonic()
        watch = subprocess.Popen([sys.executable, "-c", _WATCH, str(table.log), str(before)], stdout=subprocess.PIPE)
        said_s = ask(service, way, campaign)
        until_s = begun_s + WATCHED_S + 5.0
        while time.monotonic() < until_s:
            time.sleep(0.1)
        watch.terminate()
        heard = watch.communicate()[0].split()
        told_s = float(heard[0]) - begun_s if heard else None
        lines = table.lines()[before:]
        stop_at = next(
            (k for k, line in enumerate(lines) if ABORT in line["heard"] and line["device"] == "table"), None
        )
        standing = False
        turned_again = False
        for line in lines[(stop_at or 0) :] if stop_at is not None or stood else []:
            standing = standing or not line["table_turns"]
            turned_again = turned_again or (standing and line["table_turns"])
        service.command("stop").wait()
        for pid in {*service.pids.values(), *service.family()}:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        with contextlib.suppress(ProcessLookupError):
            os.kill(service.pids["supervisor"], signal.SIGTERM)
        left = _left(service)
        return Round(faults, way, told_s, stood, said_s, turned_again, left)


#: Reads the log as it grows, and prints the monotonic time at which the stop appears there.
_WATCH = """
import sys, time
log, before = open(sys.argv[1]), int(sys.argv[2])
for _ in range(before): log.readline()
while True:
    line = log.readline()
    if not line: time.sleep(0.005); continue
    if '"table"' in line and '!1a' in line: print(time.monotonic(), flush=True); break
"""


def _left(service: Service) -> tuple[int, ...]:
    """Return the processes of a service that still live a while after its end; they are ended."""
    until_s = time.monotonic() + 75.0  # a bench process that is left alone ends a minute after its campaign
    while (found := service.family()) and time.monotonic() < until_s:
        with contextlib.suppress(subprocess.TimeoutExpired):
            service.process.wait(0.2)
        time.sleep(0.2)
    for pid in found:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return found


def drawn(rounds: int) -> list[tuple[tuple[Fault, ...], str]]:
    """Draw faults of one or two processes, and the way in which the stop is asked for."""
    rng = np.random.default_rng(29)
    found = []
    for _ in range(rounds):
        which = rng.choice(len(PROCESSES), int(rng.integers(1, 3)), replace=False)
        faults = tuple(
            Fault(PROCESSES[k], FAULTS[int(rng.integers(len(FAULTS)))], float(rng.exponential(0.7))) for k in which
        )
        found.append((faults, WAYS[int(rng.integers(len(WAYS)))]))
    return found


def run() -> dict[str, float]:
    """Run all rounds, a line for each."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(BUSY)]
    try:
        rounds = []
        for faults, way in drawn(ROUNDS):
            rounds.append(one(faults, way))
            print(f"   {'as promised' if rounds[-1].well else 'NOT AS PROMISED'}: {rounds[-1]}", flush=True)
    finally:
        for each in busy:
            each.kill()
    told = [each.told_s for each in rounds if each.told_s is not None and not each.stood]
    return {
        "rounds": float(len(rounds)),
        "as_promised": float(sum(each.well for each in rounds)),
        "turned_again": float(sum(each.turned_again for each in rounds)),
        "left_behind": float(sum(bool(each.left_behind) for each in rounds)),
        "told_median_s": float(np.median(told)) if told else 0.0,
        "told_largest_s": float(max(told, default=0.0)),
    }
