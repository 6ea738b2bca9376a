"""Attacks on a running service; each goes on while its context lasts."""

from __future__ import annotations

import json
import multiprocessing
import os
import resource
import socket
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TypeVar

import httpx

from labctl.services.recordings.examples import example

#: Everything that is asked has to be answered within this, s.
WITHIN_S = 60.0
ArgumentT = TypeVar("ArgumentT")
FILES = ("recording.toml", "points.csv")


class Target:
    """`labctl serve` on a simulated bench at real pace."""

    def __init__(self, folder: Path) -> None:
        self.database = folder / "lab.sqlite"
        words = ["serve", "--bench", "single-axis-sim", "--port", "0", "--json", "--database", str(self.database)]
        self._process = subprocess.Popen([sys.executable, "-m", "labctl", *words], stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        reported = json.loads(self._process.stdout.readline())
        self.url, self.pids = reported["url"], {"bench": reported["bench_pid"], "web": reported["web_pid"]}
        host, _, port = self.url.partition("://")[2].rpartition(":")
        self.address = (host, int(port))
        self.http = httpx.Client(base_url=self.url, timeout=WITHIN_S)

    def fit_example(self) -> None:
        """Import a recording and fit it: what the criticisms are of."""
        folder = example("osu-fog")
        files = [("files", (name, (folder / name).read_bytes())) for name in FILES]
        self.http.post("/api/recordings", files=files).raise_for_status()
        self.http.post("/api/units/OSU-FOG-2024/calibrations", json={"model": "ojeda2000"}).raise_for_status()

    def memory_mib(self, process: str) -> float:
        """Return the memory that a process has now, MiB."""
        return self._status_mib(process, "VmRSS")

    def largest_mib(self, process: str) -> float:
        """Return the most memory that a process has had, MiB."""
        return self._status_mib(process, "VmHWM")

    def _status_mib(self, process: str, name: str) -> float:
        status = Path(f"/proc/{self.pids[process]}/status").read_text()
        return int(status.partition(f"{name}:")[2].split()[0]) / 1024

    def close(self) -> None:
        """End the service."""
        self.http.close()
        self._process.terminate()
        self._process.communicate()


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
def _from_another_process(attack: Callable[[ArgumentT], None], on: ArgumentT) -> Iterator[None]:
    """Attack from a process of its own: its threads and files are not those of the process that measures."""
    attacking = multiprocessing.get_context("spawn").Process(target=attack, args=(on,), daemon=True)
    attacking.start()
    try:
        yield
    finally:
        attacking.kill()
        attacking.join()


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


def half_sent(target: Target) -> AbstractContextManager[None]:
    """1,200 requests and more are begun and never ended."""
    return _from_another_process(_begin_requests, target.address)


def _begin_requests(address: tuple[str, int]) -> None:
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(4096, most), most))
    with ExitStack() as opened, _repeated(lambda: _begin_one(address, opened)):
        for _ in range(1200):
            with suppress(OSError):
                _begin_one(address, opened)
        threading.Event().wait()


def _begin_one(address: tuple[str, int], opened: ExitStack) -> None:
    connection = opened.enter_context(socket.create_connection(address, timeout=5))
    connection.sendall(b"POST /api/recordings HTTP/1.1\r\nHost: x\r\nContent-Le")


def criticisms(target: Target) -> AbstractContextManager[None]:
    """50 clients ask for criticisms that are not cached."""
    return criticisms_of(target.url)


def criticisms_of(url: str) -> AbstractContextManager[None]:
    """50 clients, in a process of their own, ask a service for criticisms that are not cached."""
    return _from_another_process(_ask_for_criticisms, url)


def _ask_for_criticisms(url: str) -> None:
    number = iter(range(10**9))

    def ask() -> None:
        formula = f"f{next(number)}: table_rate_dps*temperature_c*{1 + next(number) / 7}"
        httpx.get(f"{url}{CRITICISM}", params={"formula": formula}, timeout=WITHIN_S)

    with _repeated(ask, 50):
        threading.Event().wait()


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
    with ExitStack() as burning:
        for number in range(4 * (os.cpu_count() or 1)):
            burning.enter_context(_from_another_process(_burn, number))
        yield


def _burn(_: int) -> None:
    while True:
        pass


@contextmanager
def watchers(target: Target) -> Iterator[None]:
    """50 clients follow campaign 1, half of them without ever reading."""
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
