"""Abort under attack: how soon it is answered and the bench safe, at real pace, whatever else the service is asked.

`LABCTL_STUDY_ABORTS` is how many campaigns are begun and aborted under each attack.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from labctl.services.recordings.examples import example

ABORTS = int(os.environ.get("LABCTL_STUDY_ABORTS", "20"))
#: Everything that is asked has to be answered within this, s.
WITHIN_S = 60.0
LOOK_S = 0.05
FILES = ("recording.toml", "points.csv")
RECIPE = """
format = "labctl-recipe/1"
name = "attacked"
temperatures_c = [25]
rates_dps = [-40, 20, 40]
positions = ["z"]
[soak]
hold_s = 1
max_drift_c = 20.0
drift_window_s = 1
timeout_s = 600
[acquire]
duration_s = 10
settle_s = 1
"""


class Target:
    """`labctl serve` on a simulated bench at real pace."""

    def __init__(self, folder: Path) -> None:
        self.database = folder / "lab.sqlite"
        words = ["serve", "--bench", "single-axis-sim", "--port", "0", "--json", "--database", str(self.database)]
        self._process = subprocess.Popen([sys.executable, "-m", "labctl", *words], stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        told = json.loads(self._process.stdout.readline())
        self.url, self.pids = told["url"], {"bench": told["bench_pid"], "web": told["web_pid"]}
        host, _, port = self.url.partition("://")[2].rpartition(":")
        self.address = (host, int(port))
        self.http = httpx.Client(base_url=self.url, timeout=WITHIN_S)

    def largest_mib(self, process: str) -> float:
        """Return the most memory that a process has had, MiB."""
        status = Path(f"/proc/{self.pids[process]}/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) / 1024

    def close(self) -> None:
        """End the service."""
        self.http.close()
        self._process.terminate()
        self._process.communicate()


@dataclass
class Seen:
    """What was measured under one attack."""

    answer_s: list[float] = field(default_factory=list)
    safe_s: list[float] = field(default_factory=list)
    health_s: float = 0.0  #: the longest answer of /health
    heard_s: float = 0.0  #: the longest that the bench process was not heard
    refused: int = 0


# -- attacks: each goes on while its context lasts


@contextmanager
def _repeated(work: Callable[[], None], count: int = 1) -> Iterator[None]:
    """Do the same again and again in threads; what fails is tried again."""
    over = threading.Event()

    def go_on() -> None:
        while not over.is_set():
            with suppress(httpx.HTTPError, OSError):
                work()

    threads = [threading.Thread(target=go_on, daemon=True) for _ in range(count)]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        over.set()


@contextmanager
def nothing(_: Target) -> Iterator[None]:
    """Nothing else is asked."""
    yield


def endless_headers(target: Target) -> AbstractContextManager[None]:
    """Four connections send headers without an end."""

    def send() -> None:
        with socket.create_connection(target.address, timeout=5) as connection:
            connection.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n")
            for _ in range(4096):
                connection.sendall(b"X-A: " + b"a" * 8192 + b"\r\n")

    return _repeated(send, 4)


@contextmanager
def half_sent(target: Target) -> Iterator[None]:
    """1,200 requests are begun and never ended."""
    with ExitStack() as opened, _repeated(lambda: _begin_one(target, opened)):
        for _ in range(1200):
            with suppress(OSError):
                _begin_one(target, opened)
        yield


def _begin_one(target: Target, opened: ExitStack) -> None:
    connection = opened.enter_context(socket.create_connection(target.address, timeout=5))
    connection.sendall(b"POST /api/recordings HTTP/1.1\r\nHost: x\r\nContent-Le")


def criticisms(target: Target) -> AbstractContextManager[None]:
    """50 clients ask for criticisms that are not cached."""
    number = iter(range(10**9))

    def ask() -> None:
        formula = f"f{next(number)}: table_rate_dps*temperature_c*{1 + next(number) / 7}"
        httpx.get(f"{target.url}{CRITICISM}", params={"formula": formula}, timeout=WITHIN_S)

    return _repeated(ask, 50)


CRITICISM = "/api/units/OSU-FOG-2024/calibrations/1/criticism"


def imports(target: Target) -> AbstractContextManager[None]:
    """One import of 50,000 data sets of one reading follows the other."""
    folder = target.database.parent / "many"
    if not folder.exists():
        folder.mkdir()
        (folder / "recording.toml").write_text(
            'format = "labctl-recording/1"\nserial = "MANY"\nkind = "points"\naxes = ["z"]\n'
        )
        rows = "\n".join(f"{n},z,{n % 80 - 40},25.0,{n % 80 - 40}.01" for n in range(1, 50_001))
        (folder / "points.csv").write_text(f"dataset,position,table_rate_dps,temperature_c,gyro_z\n{rows}\n")

    def send() -> None:
        files = [("files", (name, (folder / name).read_bytes())) for name in FILES]
        httpx.post(f"{target.url}/api/recordings", files=files, timeout=600)

    return _repeated(send)


@contextmanager
def all_cores_busy(_: Target) -> Iterator[None]:
    """Four other processes for each core take all the processor time that they get."""
    context = multiprocessing.get_context("spawn")
    burners = [context.Process(target=_burn, daemon=True) for _ in range(4 * (os.cpu_count() or 1))]
    for burner in burners:
        burner.start()
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()


def _burn() -> None:
    while True:
        pass


@contextmanager
def watchers(target: Target) -> Iterator[None]:
    """50 onlookers follow campaign 1, half of them without ever reading."""
    with ExitStack() as opened:
        for number in range(50):
            connection = opened.enter_context(socket.create_connection(target.address, timeout=5))
            connection.sendall(b"GET /api/campaigns/1/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            if number % 2:
                opened.enter_context(_repeated(partial(_read, connection)))
        yield


def _read(connection: socket.socket) -> None:
    if not connection.recv(65536):
        threading.Event().wait(1.0)


def held_writer(target: Target) -> AbstractContextManager[None]:
    """Another program holds a lock on the database file for three seconds out of four."""

    def hold() -> None:
        with sqlite3.connect(target.database, timeout=0.2, isolation_level=None) as other:
            with suppress(sqlite3.OperationalError):
                other.execute("BEGIN IMMEDIATE")
                time.sleep(3.0)
                other.execute("ROLLBACK")
            time.sleep(1.0)
        other.close()

    return _repeated(hold)


ATTACKS: Mapping[str, Callable[[Target], AbstractContextManager[None]]] = {
    each.__name__: each
    for each in (nothing, endless_headers, half_sent, criticisms, imports, all_cores_busy, watchers, held_writer)
}


# -- measuring


def measure(target: Target, attack: AbstractContextManager[None], seed: int) -> Seen:
    """Begin and abort campaigns while an attack goes on."""
    seen, rng, over = Seen(), np.random.default_rng(seed), threading.Event()
    monitor = threading.Thread(target=_monitor, args=(target, seen, over), daemon=True)
    with attack:
        monitor.start()
        for _ in range(ABORTS):
            with suppress(httpx.TransportError):
                _abort_once(target, seen, float(rng.uniform(1.0, 8.0)))
        over.set()
        monitor.join()
    return seen


def _abort_once(target: Target, seen: Seen, after_s: float) -> None:
    started = _ask(target, seen, "/api/campaigns", {"recipe": RECIPE})
    if started is None:
        return
    campaign = started["id"]
    time.sleep(after_s)
    begun_s = time.monotonic()
    answer = _ask(target, seen, f"/api/campaigns/{campaign}/abort", {"reason": "the study"})
    seen.answer_s.append(time.monotonic() - begun_s)
    while answer is None or answer["state"] not in {"aborted", "failed", "done"}:
        time.sleep(LOOK_S)
        with suppress(httpx.TransportError, ValueError, KeyError):
            answer = target.http.get(f"/api/campaigns/{campaign}").json()
    seen.safe_s.append(time.monotonic() - begun_s)


def _ask(target: Target, seen: Seen, path: str, body: Mapping[str, Any]) -> Any:
    answer = target.http.post(path, json=body)
    if answer.is_success:
        return answer.json()
    seen.refused += 1
    print(f"   {answer.status_code} {answer.text[:200]}", flush=True)
    time.sleep(LOOK_S)
    return None


def _monitor(target: Target, seen: Seen, over: threading.Event) -> None:
    with httpx.Client(base_url=target.url, timeout=WITHIN_S) as http:
        while not over.wait(0.2):
            begun_s = time.monotonic()
            with suppress(httpx.TransportError, ValueError):
                seen.heard_s = max(seen.heard_s, http.get("/health/heartbeat").json()["heard_s"])
            seen.health_s = max(seen.health_s, time.monotonic() - begun_s)


def _lost(database: Path) -> int:
    with sqlite3.connect(f"file:{database}?mode=ro", uri=True) as connection:
        found = connection.execute("select coalesce(sum(lost), 0) from data_sets").fetchone()
    return int(found[0])


def run(names: tuple[str, ...] = tuple(ATTACKS)) -> str:
    """Measure every attack on a service of its own, and return the table."""
    lines = ["attack            aborts  answer_s p50 / p99 / max   safe_s max  health_s  heard_s  lost  refused  MiB"]
    for number, name in enumerate(names):
        with tempfile.TemporaryDirectory() as folder:
            target = Target(Path(folder))
            try:
                folder_of_example = example("osu-fog")
                files = [("files", (name, (folder_of_example / name).read_bytes())) for name in FILES]
                target.http.post("/api/recordings", files=files).raise_for_status()
                fit = {"model": "ojeda2000"}
                target.http.post("/api/units/OSU-FOG-2024/calibrations", json=fit).raise_for_status()
                seen = measure(target, ATTACKS[name](target), number)
                p50, p99 = np.percentile(seen.answer_s, [50, 99])
                lines.append(
                    f"{name:18}{len(seen.answer_s):6}  {p50:8.3f} / {p99:.3f} / {max(seen.answer_s):.3f}"
                    f"{max(seen.safe_s):16.2f}{seen.health_s:10.2f}{seen.heard_s:9.1f}{_lost(target.database):6}"
                    f"{seen.refused:9}  {target.largest_mib('bench'):.0f} / {target.largest_mib('web'):.0f}"
                )
                print(lines[-1], flush=True)
            finally:
                target.close()
    return "\n".join(lines)
