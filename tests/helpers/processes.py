"""`labctl` in real processes: commands, and a service with commands beside it."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from labctl.store import holder_of, is_url, open_store
from tests.helpers.forked_commands import ForkedCommand, run_labctl
from tests.helpers.patience import WAIT_S
from tests.helpers.signal_defaults import default_signals
from tests.helpers.waiting import before_next_request


def labctl(database: Path | str, *arguments: str) -> list[str]:
    """Return the words of a command on a database."""
    return [sys.executable, "-m", "labctl", *arguments, "--database", str(database)]


def begin(command: list[str], log: Path | None = None) -> subprocess.Popen[str]:
    """Start a process that obeys signals; its standard error is a pipe, or goes to a file."""
    with default_signals(), contextlib.ExitStack() as opened:
        stderr = subprocess.PIPE if log is None else opened.enter_context(log.open("ab"))
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, text=True)


def begin_loaded(
    arguments: Sequence[str], log: Path | None = None, open_files: int | None = None
) -> subprocess.Popen[str]:
    """Start `labctl` as `begin` does, in a process that is forked from one that has loaded it."""
    with contextlib.ExitStack() as opened:
        stderr = subprocess.PIPE if log is None else opened.enter_context(log.open("ab"))
        return ForkedCommand(arguments, stderr=stderr, open_files=open_files)


def first_line(process: subprocess.Popen[str]) -> str:
    """Wait until a process says that it is ready; returns the line."""
    assert process.stdout is not None
    return process.stdout.readline()


def kill(process: subprocess.Popen[str]) -> None:
    """End a process, if it still runs, and close its pipes."""
    process.kill()
    process.communicate()


def end_of(database: Path | str, campaign: int = 1) -> tuple[str, str]:
    """Return state and reason of a campaign, as they were written."""
    with open_store(str(database), write=False) as store:
        row = store.campaigns.get(campaign)
        return row.state, row.reason


class ServiceProcess:
    """`labctl serve` in a process of its own, and other commands beside it on the same database."""

    def __init__(
        self,
        database: Path | str,
        *options: str,
        open_files: int | None = None,
        log: Path | None = None,
        shell: str = "",
        loads: bool = False,
        bench: Path | str = "single-axis-sim",
    ) -> None:
        """Serve a database; `bench` is a shipped bench, or a file that has the name of its bench."""
        self.database, self._bench = database, Path(bench).stem
        command = ["serve", "--bench", str(bench), "--speed", "30", "--port", "0", "--json", *options]
        if shell or loads:
            before = ["/bin/sh", "-c", f'{shell}; exec "$0" "$@"'] if shell else []
            self.process = begin([*before, *labctl(database, *command)], log)
        else:
            self.process = begin_loaded([*command, "--database", str(database)], log, open_files)
        reported = json.loads(first_line(self.process))
        self.url = reported["url"]
        self.bench_pid, self.web_pid = reported["bench_pid"], reported["web_pid"]
        self.http = httpx.Client(base_url=self.url, timeout=WAIT_S)

    def run(self, *arguments: str, status: int = 0, key: str = "") -> subprocess.CompletedProcess[str]:
        """Run a command to its end, which must be with this exit status."""
        given = [*arguments, "--database", str(self.database)]
        done = run_labctl(given, environment={**os.environ, "LABCTL_KEY": key})
        assert done.returncode == status, done.stderr
        return done

    @contextmanager
    def following(self, campaign: int) -> Iterator[Iterator[str]]:
        """Yield the lines of a campaign's event stream, which ends with the campaign."""
        with self.http.stream("GET", f"/api/campaigns/{campaign}/events", timeout=WAIT_S) as stream:
            yield stream.iter_lines()

    def wait_for_data_set(self, campaign: int) -> None:
        """Wait until the first data set of a campaign is being taken."""
        with self.following(campaign) as lines:
            assert any('"step_text":"data set' in line for line in lines)

    def until_ended(self, campaign: int) -> dict[str, Any]:
        """Follow a campaign to its end, also past the death of a process that runs it; returns its status."""
        while True:
            with contextlib.suppress(httpx.TransportError, json.JSONDecodeError):
                with self.following(campaign) as lines:
                    for _ in lines:
                        pass
                found: dict[str, Any] = self.http.get(f"/api/campaigns/{campaign}").json()
                if found.get("state") in {"done", "failed", "aborted"}:
                    return found
            before_next_request()

    def close(self) -> None:
        """End all processes of the service at once, as a power cut would."""
        self.http.close()
        self.process.kill()  # first: it would start the others again
        for pid in {self.bench_pid, self.web_pid, self._bench_pid_now()}:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        kill(self.process)

    @property
    def bench_was_replaced(self) -> bool:
        """Whether the supervisor has ended the bench process of the start, or started another."""
        return self._bench_pid_now() != self.bench_pid or not Path(f"/proc/{self.bench_pid}").exists()

    def _bench_pid_now(self) -> int:
        """Return the bench process, which may be another than at the start."""
        location = str(self.database)
        if not is_url(location):
            holder = holder_of(location)
            return holder.pid if holder else self.bench_pid
        with open_store(location, write=False) as store:
            lease = store.leases.holder(self._bench)
            return lease.pid if lease else self.bench_pid


@contextmanager
def running(
    database: Path | str,
    *options: str,
    open_files: int | None = None,
    log: Path | None = None,
    shell: str = "",
    loads: bool = False,
) -> Iterator[ServiceProcess]:
    """Serve a database while the block runs; `open_files` is all that the process may open.

    `log` is the file that standard error goes to; `shell` is done by the shell that becomes the service. With either a
    shell or `loads`, its processes load their modules; otherwise they are forked from one that has loaded them.
    """
    made = ServiceProcess(database, *options, open_files=open_files, log=log, shell=shell, loads=loads)
    try:
        yield made
    finally:
        made.close()
