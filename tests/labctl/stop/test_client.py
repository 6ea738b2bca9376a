"""A stop goes to the bench process, else to the guardian, else to the instruments; each answer is that of the wire."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from labctl.stop import client, instruments_stop
from labctl.stop.client import stop_bench
from labctl.stop.instruments_stop import InstrumentsLeft
from labctl.stop.latch import StopRequest
from labctl.stop.places import BenchPlace, DriverNote, ProcessId
from labctl.stop.wire import StopServer
from tests.helpers.fake_stopping import FakeStopping


@pytest.fixture
def sockets() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="labctl-") as name:
        yield Path(name)


@pytest.fixture
def place(tmp_path: Path) -> BenchPlace:
    return BenchPlace(tmp_path / "b")


def me() -> ProcessId:
    return ProcessId.of(os.getpid())


def stop() -> StopRequest:
    return StopRequest.new("Ada", "command line", "smoke (Ada)")


@pytest.fixture
def at_instruments(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    told: list[dict[str, Any]] = []

    def stopped(document: dict[str, Any], *_: object) -> InstrumentsLeft:
        told.append(document)
        return InstrumentsLeft(stands=True, safe=True, text="table at rest")

    monkeypatch.setattr(instruments_stop, "stop_instruments", stopped)
    return told


def test_a_process_that_answers_stops_the_bench(place: BenchPlace, sockets: Path) -> None:
    stopping, asked = FakeStopping(), []
    stopping.heard.set()
    stopping.over.set()
    server = StopServer(sockets / "stop", lambda request: asked.append(request) or stopping)
    server.start()
    place.write_note(DriverNote("b", me(), str(sockets / "stop")))
    request = stop()
    found = stop_bench(place, request)
    server.close()
    assert (found.stands, found.text, found.campaign, found.latched) == (True, "the table is at rest", 7, True)
    assert asked == [request]
    state = place.latch.state()
    assert (state.open, state.unconfirmed) == ((request,), ())  # the table stands; the campaign is still to be ended


def test_what_the_bench_process_does_not_hear_goes_to_the_guardian(
    place: BenchPlace, sockets: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client, "HEARD_WITHIN_S", 0.05)
    deaf, guardian = FakeStopping(), FakeStopping(text="the guardian has stopped it", campaign=None)
    guardian.heard.set()
    guardian.over.set()
    servers = [StopServer(sockets / "a", lambda _: deaf), StopServer(sockets / "g", lambda _: guardian)]
    for server in servers:
        server.start()
    place.write_note(DriverNote("b", me(), str(sockets / "a"), me(), str(sockets / "g")))
    found = stop_bench(place, stop())
    deaf.heard.set()
    deaf.over.set()
    for server in servers:
        server.close()
    assert (found.stands, found.text) == (True, "the guardian has stopped it")


def test_a_socket_without_an_answer_goes_to_the_instruments_and_its_process_is_ended(
    place: BenchPlace, sockets: Path, at_instruments: list[dict[str, Any]]
) -> None:
    frozen = subprocess.Popen([sys.executable, "-c", "import signal; signal.pause()"])
    os.kill(frozen.pid, signal.SIGSTOP)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(sockets / "stop"))
        listener.listen()
        place.write_note(DriverNote("b", ProcessId.of(frozen.pid), str(sockets / "stop"), document={"name": "b"}))
        found = stop_bench(place, stop())
    assert (found.stands, found.text) == (True, "its instruments were stopped directly: table at rest")
    assert at_instruments == [{"name": "b"}]
    assert frozen.wait() == -signal.SIGKILL


@pytest.mark.parametrize(("late_s", "begun_s"), [(0.0, 0.0), (4.0, 60.0)])
def test_a_table_that_does_not_answer_is_not_called_stopped(
    place: BenchPlace, monkeypatch: pytest.MonkeyPatch, late_s: float, begun_s: float
) -> None:
    """Also where the computer was busy for so long before the command began that no more time is left."""
    monkeypatch.setattr(client, "LATE_S", late_s)
    monkeypatch.setattr(client, "MIN_S", 0.0)
    slow = threading.Event()

    def silent(*_: object) -> InstrumentsLeft:
        slow.wait(5.0)
        return InstrumentsLeft(stands=False, safe=False, text="table to rest: no answer")

    monkeypatch.setattr(instruments_stop, "stop_instruments", silent)
    place.write_note(DriverNote("b", document={"name": "b"}))
    said: list[str] = []

    def say(text: str) -> None:
        said.append(text)
        slow.set()

    found = stop_bench(place, stop(), say, begun_s)
    assert (found.stands, found.text) == (False, "its instruments were stopped directly: table to rest: no answer")
    assert said[0].startswith("NOT STOPPED yet: bench b: ")
    assert place.latch.state().unconfirmed


def test_a_bench_that_was_left_safe_is_not_touched(place: BenchPlace, at_instruments: list[dict[str, Any]]) -> None:
    place.write_note(DriverNote("b", document={"name": "b"}, left="bench b is safe", left_safe=True))
    found = stop_bench(place, stop())
    assert (found.stands, found.text, at_instruments) == (True, "bench b is safe", [])


def test_another_process_with_the_same_number_is_not_taken_for_the_driver() -> None:
    mine = me()
    assert mine.lives
    assert mine.age_s > 0.1
    assert not ProcessId(mine.pid, mine.started + 1, mine.boot).lives
    assert not ProcessId(mine.pid, mine.started, "another start of the computer").lives
    assert client.end_process(ProcessId(mine.pid, mine.started + 1, mine.boot)) == ""  # and this process goes on
