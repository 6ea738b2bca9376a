"""The supervisor refuses what cannot be served, and hears signals while it serves."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from instruments.clock import WallClock
from labctl.cli.app import app
from labctl.errors import BadInput, LabctlError
from labctl.processes import liveness, supervisor
from labctl.processes.bench_process import open_bench_service
from labctl.processes.listening import listening
from labctl.processes.settings import BenchSettings, ServeRequest
from labctl.processes.waker import Waker
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.lab_service import LabService
from labctl.store import holder_of, open_store
from procedures.execution.signals import ENDING
from tests.helpers.patience import WAIT_S


def handlers() -> dict[signal.Signals, object]:
    return {number: signal.getsignal(number) for number in ENDING}


@contextmanager
def waker() -> Iterator[Waker]:
    made = Waker()
    before = handlers()
    try:
        yield made
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        made.close()


@pytest.mark.parametrize("number", ENDING)
def test_a_signal_ends_a_wait_at_once_and_the_handlers_are_restored(number: signal.Signals) -> None:
    before = handlers()
    with supervisor.ending_signals() as woken:
        signal.raise_signal(number)
        woken.wait(3600.0)
        assert woken.ending
    assert handlers() == before


def test_a_wait_that_nothing_wakes_ends_by_itself() -> None:
    with waker() as quiet:
        quiet.wait(0.0)
        assert not quiet.ending


def test_simulate_never_takes_a_real_bench(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    asked = BenchSettings(location, "example-real", simulate=True, speed=1.0, folder=tmp_path, url="")
    with pytest.raises(BadInput, match="--simulate with --bench example-real: that bench has real instruments"):
        open_bench_service(asked)
    assert holder_of(location) is None


@pytest.mark.parametrize(("asked", "said"), [
    (ServeRequest(speed=-1.0), "--speed -1.0"),
    (ServeRequest(speed=float("inf")), "--speed inf"),
    (ServeRequest(port=70000), "--port 70000"),
    (ServeRequest(max_upload_mib=0), "--max-upload-mib 0"),
    (ServeRequest(read_only=True, simulate=True), "--read-only"),
    (ServeRequest(acts_at="http://lab:8420"), "--acts-at http://lab:8420: this service acts itself"),
    (ServeRequest(read_only=True, acts_at="lab:8420"), "--acts-at lab:8420: give an address"),
    (ServeRequest(processes=2), "--processes 2: a service that may write has one web process"),
    (ServeRequest(read_only=True, processes=65), "--processes 65: give a number from 1 to 64"),
])  # fmt: skip
def test_numbers_out_of_range_are_refused_before_anything_starts(asked: ServeRequest, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        supervisor.serve_forever(asked, lambda _: None)


@pytest.mark.parametrize(("unconfirmed", "status"), [(True, 1), (False, 0)])
def test_a_bench_left_unconfirmed_ends_the_command_with_a_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unconfirmed: bool, status: int
) -> None:
    left = BenchLeft("bench b was left", unconfirmed=unconfirmed)
    monkeypatch.setattr(supervisor.Supervisor, "run", lambda *_: left)
    ended = CliRunner().invoke(app, ["serve", "--port", "0", "--database", str(tmp_path / "lab.sqlite")])
    assert (ended.exit_code, "labctl: stopped; bench b was left" in ended.stderr) == (status, True)


def test_a_port_that_is_taken_is_refused() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(BadInput, match=f"--port {port} on 127.0.0.1"), listening("127.0.0.1", port):
            pass


def test_a_service_hears_of_signals_until_it_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ends: list[int] = []
    monkeypatch.setattr(LabService, "end_soon", lambda _: ends.append(1))
    for number in ENDING:
        signal.signal(number, lambda *_: None)
    before = handlers()
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        service = LabService(store, WallClock())
        service.start()
        signal.raise_signal(signal.SIGTERM)
        service.close()  # what the signal began has ended
        assert ends == [1]
    signal.raise_signal(signal.SIGTERM)
    assert ends == [1]
    assert handlers() == before


@pytest.mark.slow
def test_a_service_that_cannot_say_where_it_is_ends_its_processes(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    reported: list[supervisor.Ready] = []

    def fails(service: supervisor.Ready) -> None:
        reported.append(service)
        raise BrokenPipeError("no reader")

    with pytest.raises(BrokenPipeError):
        supervisor.serve_forever(ServeRequest(port=0, database=location), fails)
    (service,) = reported
    assert holder_of(location) is None
    for pid in (service.bench_pid, service.web_pid):
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


@pytest.mark.slow
def test_a_process_that_ends_again_and_again_ends_the_service(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(liveness, "MAX_RESTARTS", 0)
    location = str(tmp_path / "lab.sqlite")
    reported: list[supervisor.Ready] = []

    def kill(service: supervisor.Ready) -> None:
        reported.append(service)
        os.kill(service.web_pid, signal.SIGKILL)

    with pytest.raises(LabctlError, match="the web process"):
        supervisor.serve_forever(ServeRequest(port=0, database=location), kill)
    assert holder_of(location) is None
    with pytest.raises(ProcessLookupError):
        os.kill(reported[0].bench_pid, 0)


@pytest.mark.slow
@pytest.mark.parametrize("module", ["bench_process", "web_process"])
def test_a_process_whose_supervisor_ends_before_it_sends_settings_ends_without_a_word(module: str) -> None:
    ours, theirs = socket.socketpair()
    with theirs:
        command = [sys.executable, "-m", f"labctl.processes.{module}", str(theirs.fileno())]
        process = subprocess.Popen(command, pass_fds=[theirs.fileno()], stderr=subprocess.PIPE, text=True)
    ours.close()
    _, said = process.communicate(timeout=WAIT_S)
    assert (process.returncode, said) == (1, "")
