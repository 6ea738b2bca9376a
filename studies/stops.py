"""Stops of a real service whose processes were killed, frozen or signalled: when does the table hear of it?

Each round runs `labctl serve` on simulated instruments at pseudo-terminals and TCP ports of another process, starts a
campaign, lets one or two processes of the service suffer at random moments, and then asks for a stop: by the page's
request, by `labctl stop`, or by a signal to the supervisor. The log of the table says when it was stopped and whether
it turned again. `LABCTL_STUDY_STOPS` is how many rounds, `LABCTL_STUDY_AT_ONCE` how many run beside each other,
`LABCTL_STUDY_BUSY` how many busy processes run beside each from the moment when its table turns; with
`LABCTL_STUDY_CRITICISMS=1` 50 clients ask its service for criticisms meanwhile.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import httpx
import numpy as np

from labctl.answers.campaigns import BENCH_CHECKS
from studies.attack_kinds import criticisms_of
from studies.stop_rig import RECIPE, Table, family, simulators

ROUNDS = int(os.environ.get("LABCTL_STUDY_STOPS", "200"))
AT_ONCE = int(os.environ.get("LABCTL_STUDY_AT_ONCE", "1"))
BUSY = int(os.environ.get("LABCTL_STUDY_BUSY", "0"))
CRITICISMS = os.environ.get("LABCTL_STUDY_CRITICISMS", "0") == "1"
SEED = int(os.environ.get("LABCTL_STUDY_SEED", "29"))
#: The table is stopped within this, or the one who asked reads NOT STOPPED within `SAID_S`, s.
TOLD_S, SAID_S = (2.0, 5.0) if BUSY == 0 else (5.0, 5.0)
#: A page that has no answer to its stop says NOT STOPPED after this, s (`core/stop/state.js`).
PAGE_SAYS_S = 3.0
#: How long the load runs before the first fault, s: the clients of `criticisms_of` have then asked.
LOADED_S = 3.0 if BUSY or CRITICISMS else 0.0
#: How long the table is watched after the stop, while what died is started again, s.
WATCHED_S = 8.0
#: A service that was asked to end has this long, and a bench process without a supervisor a minute more, s.
ENDS_WITHIN_S = 80.0
PROCESSES = ("supervisor", "web", "bench")
FAULTS = (signal.SIGKILL, signal.SIGSTOP, signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
WAYS = ("page", "command", "signal")
NOT_STOPPED = "NOT STOPPED"
DATABASE = "lab.sqlite"
EXAMPLE = Path(__file__).parents[1] / "labctl" / "examples" / "osu-fog"


#: So many processes that never rest.
LOAD = (
    "import os, signal, sys; [os.fork() or exec('while True: pass') for _ in range(int(sys.argv[1]))]; signal.pause()"
)


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
    said_s: float | None  #: until the one who asked read that the bench is not stopped, where that was said
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


class Service:
    """`labctl serve` on a bench."""

    def __init__(self, folder: Path, bench: Path) -> None:
        self.database = folder / DATABASE
        self.environment = {**os.environ, "XDG_STATE_HOME": str(folder / "state")}
        self.log = folder / "service.log"
        words = ["serve", "--bench", str(bench), "--port", "0", "--json", "--database", str(self.database)]
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "labctl", *words], stdout=subprocess.PIPE, stderr=log, text=True,
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
        """Return the processes that were started by this service, or on its database."""
        return family(self.environment["XDG_STATE_HOME"])

    def say_not_stopped(self) -> bool:
        """Return whether the service has written to its terminal that the bench is not stopped."""
        return NOT_STOPPED in self.log.read_text(encoding="utf-8", errors="replace")


def ask(service: Service, way: str, campaign: int) -> float | None:
    """Ask for a stop; returns after how many seconds it was read that the bench is not stopped, None where it was not.

    A page that gets no answer shows NOT STOPPED over everything at once; a person who signals a process that is gone
    reads that there is no such process.
    """
    begun_s = time.monotonic()
    said = {"page": _ask_page, "command": _ask_command, "signal": _ask_by_signal}[way](service, campaign)
    return time.monotonic() - begun_s if said else None


def _ask_by_signal(service: Service, _campaign: int) -> bool:
    if service.process.poll() is not None:  # a shell says that there is no such process
        return True
    os.kill(service.pids["supervisor"], signal.SIGTERM)
    until_s = time.monotonic() + SAID_S
    while time.monotonic() < until_s:
        if service.say_not_stopped() or service.process.poll() == -signal.SIGKILL:  # the shell says "Killed"
            return True
        time.sleep(0.1)
    return False


def _ask_page(service: Service, campaign: int) -> bool:
    """Ask as a page does, which says NOT STOPPED where a request fails, and while one is not answered in time."""
    answered = threading.Event()
    texts: list[str] = []

    def post() -> None:
        try:
            answer = httpx.post(f"{service.url}/api/campaigns/{campaign}/abort", json={"reason": "study"}, timeout=4.5)
            texts.append(answer.text)
        except httpx.HTTPError:
            texts.append(NOT_STOPPED)
        answered.set()

    threading.Thread(target=post, daemon=True).start()
    return not answered.wait(PAGE_SAYS_S) or NOT_STOPPED in texts[0]


def _ask_command(service: Service, _campaign: int) -> bool:
    command = service.command("stop")
    assert command.stderr is not None
    with command.stderr:
        for line in command.stderr:
            if NOT_STOPPED in line:
                return True
    command.wait()
    return False


def one(prepared: Path, faults: tuple[Fault, ...], way: str) -> Round:
    """Run one round on a copy of the database in a folder."""
    with tempfile.TemporaryDirectory() as name, simulators(Path(name)) as (bench, table):
        shutil.copytree(prepared, name, dirs_exist_ok=True)
        service = Service(Path(name), bench)
        try:
            return _suffered(service, table, faults, way)
        finally:
            for pid in service.family():
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)


def _suffered(service: Service, table: Table, faults: tuple[Fault, ...], way: str) -> Round:
    start = {"recipe": RECIPE, "confirmed_by": "the study", "checks": list(BENCH_CHECKS)}
    answer = httpx.post(f"{service.url}/api/campaigns", json=start, timeout=120.0)
    if answer.is_error:
        raise RuntimeError(f"the campaign was not started: {answer.status_code} {answer.text}")
    campaign = answer.json()["id"]
    while not table.turns():
        time.sleep(0.05)
    with _load(service):
        time.sleep(LOADED_S)
        for fault in faults:
            time.sleep(fault.after_s)
            with contextlib.suppress(ProcessLookupError):
                os.kill(service.pids[fault.process], fault.number)
        before, stood, begun_s = len(table.heard), not table.turns(), time.monotonic()
        said_s = ask(service, way, campaign)
        while time.monotonic() < begun_s + WATCHED_S:
            time.sleep(0.1)
    told_s = table.told_s(before)
    turned_again = _turned_again(table, before, stood)
    service.command("stop").wait()
    for pid in {*service.pids.values(), *service.family()}:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
    with contextlib.suppress(ProcessLookupError):
        os.kill(service.pids["supervisor"], signal.SIGTERM)
    left = _left(service)
    return Round(faults, way, None if told_s is None else told_s - begun_s, stood, said_s, turned_again, left)


@contextlib.contextmanager
def _load(service: Service) -> Iterator[None]:
    """Keep the computer busy beside a service, and the service with criticisms.

    The busy processes have a session of their own: the system shares its processors between sessions (sched(7),
    autogroup), and this one, which reads the log of the table and the clock, is not to be late.
    """
    busy = [subprocess.Popen([sys.executable, "-c", LOAD, str(BUSY)], start_new_session=True)] if BUSY else []
    try:
        with criticisms_of(service.url) if CRITICISMS else contextlib.nullcontext():
            yield
    finally:
        for each in busy:
            os.killpg(each.pid, signal.SIGKILL)
            each.wait()


def _prepare(folder: Path) -> None:
    """Make a database in a folder; with a calibration to criticise where criticisms are asked for."""
    if CRITICISMS:
        for words in (("import", str(EXAMPLE)), ("fit", "OSU-FOG-2024", "--model", "ojeda2000")):
            made = [sys.executable, "-m", "labctl", *words, "--database", str(folder / DATABASE)]
            subprocess.run(made, check=True, stdout=subprocess.DEVNULL)


def _turned_again(table: Table, before: int, stood: bool) -> bool:
    """Return whether the table turned after it had come to rest from the stop."""
    lines = table.heard[before:]
    told = next((k for k, line in enumerate(lines) if line.is_stop or not line.table_turns), None)
    standing = stood
    for line in lines[told or 0 :] if told is not None or stood else []:
        if standing and line.shows_motion:
            return True
        standing = standing or not line.table_turns
    return False


def _left(service: Service) -> tuple[int, ...]:
    """Return the processes of a service that still live a while after its end."""
    until_s = time.monotonic() + ENDS_WITHIN_S
    while (found := service.family()) and time.monotonic() < until_s:
        with contextlib.suppress(subprocess.TimeoutExpired):
            service.process.wait(0.2)
        time.sleep(0.2)
    return found


def drawn(rounds: int) -> list[tuple[tuple[Fault, ...], str]]:
    """Draw faults of one or two processes, and the way in which the stop is asked for."""
    rng = np.random.default_rng(SEED)
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

    def shown(asked: tuple[tuple[Fault, ...], str]) -> Round:
        found = one(Path(prepared), *asked)
        print(f"   {'as promised' if found.well else 'NOT AS PROMISED'}: {found}", flush=True)
        return found

    with tempfile.TemporaryDirectory() as prepared, ThreadPoolExecutor(AT_ONCE) as pool:
        _prepare(Path(prepared))
        rounds = list(pool.map(shown, drawn(ROUNDS)))
    told = [each.told_s for each in rounds if each.told_s is not None and not each.stood]
    return {
        "rounds": float(len(rounds)),
        "as_promised": float(sum(each.well for each in rounds)),
        "turned_again": float(sum(each.turned_again for each in rounds)),
        "left_behind": float(sum(bool(each.left_behind) for each in rounds)),
        "told": float(len(told)),
        "told_median_s": float(np.median(told)) if told else 0.0,
        "told_largest_s": float(max(told, default=0.0)),
        "said_not_stopped": float(sum(each.said_s is not None for each in rounds)),
    }
