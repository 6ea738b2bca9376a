"""Two processes of a service killed or stopped at random instants of a campaign, over pty and TCP: is it finished?

`LABCTL_STUDY_PAIRS` is how many pairs, `LABCTL_STUDY_AT_ONCE` how many run beside each other.

What systemd does to a supervisor that died or stands still is done here: it is
killed, and started again.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from labctl.answers.campaigns import BENCH_CHECKS
from labctl.store.connection.database import Database
from studies.crashable_process import all_readings, complete_data_sets
from studies.databases import close_server, new_database
from studies.process_kill import DATA_SETS, RECIPE, WHOLE_S, simulators

PAIRS = int(os.environ.get("LABCTL_STUDY_PAIRS", "100"))
AT_ONCE = int(os.environ.get("LABCTL_STUDY_AT_ONCE", "1"))  #: services beside each other
PROCESSES = ("supervisor", "bench", "web")
SIGNALS = (signal.SIGKILL, signal.SIGSTOP)
#: A service manager gives a supervisor that stands still so long, s.
WATCHDOG_S = 5.0
#: Everything must be over within this, s.
WITHIN_S = 180.0
POLL_INTERVAL_S = 0.2
#: What is far is not known to be simulated.
START = {"recipe": RECIPE, "confirmed_by": "the study", "checks": list(BENCH_CHECKS)}


@dataclass(frozen=True)
class Fault:
    """A signal to one process of the service, so long after the fault before, or after the start."""

    process: str
    number: signal.Signals
    after_s: float

    def __str__(self) -> str:
        return f"{self.number.name} {self.process} after {self.after_s:.1f} s"


@dataclass(frozen=True)
class Outcome:
    """What became of the campaign."""

    faults: tuple[Fault, ...]
    state: str
    reason: str
    readings_missing: int
    wrong_counts: int
    unconfirmed: str
    answers_after_s: float  #: from the last fault to the first answer that knows the bench

    @property
    def well(self) -> bool:
        """Whether the plan was finished, once, with everything kept, and the bench is known to be safe."""
        return self.state == "done" and not (self.readings_missing or self.wrong_counts or self.unconfirmed)


class NotStarted(Exception):
    """The service ended before it answered."""


class Service:
    """`labctl serve` as a service manager runs it."""

    def __init__(self, folder: Path, bench: Path) -> None:
        self.database = new_database(folder)
        words = ["serve", "--bench", str(bench), "--port", "0", "--json", "--database", self.database]
        self._command = [sys.executable, "-m", "labctl", *words]
        self._start()

    def _start(self) -> None:
        self._process = subprocess.Popen(self._command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        said = self._process.stdout.readline()
        if not said:
            raise NotStarted(f"`labctl serve` ended with status {self._process.wait()} at its start")
        reported = json.loads(said)
        self.pids = {"supervisor": self._process.pid, "bench": reported["bench_pid"], "web": reported["web_pid"]}
        self.http = httpx.Client(base_url=reported["url"], timeout=10.0)

    def suffer(self, fault: Fault) -> None:
        """Let a fault happen."""
        time.sleep(fault.after_s)
        with suppress(ProcessLookupError):
            os.kill(self.pids[fault.process], fault.number)

    def manage(self, supervisor: signal.Signals | None) -> None:
        """Do what a service manager does: end a supervisor that stands still, start one that has ended."""
        if supervisor is None:
            return
        if supervisor == signal.SIGSTOP:
            time.sleep(WATCHDOG_S)
            self._process.kill()
        self._process.wait()
        self.http.close()
        self._start()

    def asked(self, path: str, holds: Callable[[Any], bool], within_s: float) -> Any:
        """Ask until the answer is as expected; returns the last answer, None where there was none."""
        until_s, answer = time.monotonic() + within_s, None
        while time.monotonic() < until_s:
            with suppress(httpx.TransportError, ValueError):
                answer = self.http.get(path).json()
                if holds(answer):
                    break
            time.sleep(POLL_INTERVAL_S)
        return answer

    def close(self) -> None:
        """End the service."""
        self._process.terminate()
        self._process.communicate()
        self.http.close()


def suffer(folder: Path, bench: Path, faults: tuple[Fault, ...]) -> Outcome:
    """Run a campaign, let the faults happen, and check the final state."""
    (folder / "killed.toml").write_text(RECIPE)
    service = Service(folder, bench)
    try:
        campaign = service.http.post("/api/campaigns", json=START).json()["id"]
        for fault in faults:
            service.suffer(fault)
        before = _readings(service.database)
        begun_s = time.monotonic()
        service.manage(next((fault.number for fault in faults if fault.process == "supervisor"), None))
        service.asked("/health", lambda reported: reported["bench"]["heard_s"] < 3.0, WITHIN_S)
        answers_after_s = time.monotonic() - begun_s
        over = {"done", "failed", "aborted"}
        answer = service.asked(f"/api/campaigns/{campaign}", lambda reported: reported["state"] in over, WITHIN_S)
        unconfirmed = service.http.get("/health").json()["bench"]["unconfirmed"]
    finally:
        service.close()
    database = Database(service.database, write=False)
    counts = complete_data_sets(database)
    wrong = sum(counts[number] != 1 for number in range(1, DATA_SETS + 1))
    missing = len(before - all_readings(database))
    database.close()
    return Outcome(faults, answer["state"], answer["reason"], missing, wrong, unconfirmed, answers_after_s)


def _readings(location: str) -> set[Any]:
    database = Database(location, write=False)
    found = all_readings(database)
    database.close()
    return found


def drawn(pairs: int) -> list[tuple[Fault, ...]]:
    """Draw pairs of faults at instants spread over the length of a campaign."""
    rng = np.random.default_rng(11)
    found = []
    for number in range(pairs):
        which = [PROCESSES[k] for k in rng.choice(len(PROCESSES), 2, replace=False)]
        how = [SIGNALS[k] for k in rng.integers(len(SIGNALS), size=2)]
        when = (float(1.0 + WHOLE_S * (number + rng.uniform()) / pairs), float(rng.exponential(2.0)))
        found.append(tuple(Fault(*each) for each in zip(which, how, when, strict=True)))
    return found


def _suffer_alone(faults: tuple[Fault, ...]) -> Outcome:
    with tempfile.TemporaryDirectory() as name, simulators(Path(name)) as bench:
        try:
            outcome = suffer(Path(name), bench, faults)
        except NotStarted as error:
            outcome = Outcome(faults, "not started", str(error), 0, 0, "", 0.0)
    verdict = "as promised" if outcome.well else f"NOT as promised: {outcome}"
    print(f"   {', '.join(map(str, faults))}: {verdict}, heard after {outcome.answers_after_s:.1f} s", flush=True)
    return outcome


def run() -> dict[str, float]:
    """Let the pairs of faults happen, a line for each as it is over."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        outcomes = list(pool.map(_suffer_alone, drawn(PAIRS)))
    close_server()
    return {
        "pairs": float(len(outcomes)),
        "finished_as_promised": float(sum(outcome.well for outcome in outcomes)),
        "readings_missing": float(sum(outcome.readings_missing for outcome in outcomes)),
        "data_sets_twice_or_missing": float(sum(outcome.wrong_counts for outcome in outcomes)),
        "answers_again_after_s_largest": max(outcome.answers_after_s for outcome in outcomes),
    }
