"""What goes over a stop socket: the phases in their order, what a caller may send, and how long an asker waits."""

from __future__ import annotations

import errno
import json
import os
import socket
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import pytest

from labctl.stop import client, wire
from labctl.stop.latch import StopRequest
from labctl.stop.wire import StopServer, Word, ask, phases
from tests.helpers.fake_stopping import FakeStopping

pytestmark = pytest.mark.timeout(30)  # what never ends, or waits for longer than it was given, is a failure
REQUEST = StopRequest("1", "2026-11-26T12:00:00+00:00", "Ada", "key", "smoke")
LINE = json.dumps(REQUEST.__dict__).encode()


@dataclass
class Scripted:
    """A stop whose answers are given in advance; notes how long each was waited for."""

    heard: list[bool]
    over: list[bool]
    stands: bool = True
    text: str = "on its way"
    campaign: int | None = 7
    waits_s: list[tuple[str, float]] = field(default_factory=list)

    def is_heard(self, within_s: float) -> bool:
        self.waits_s.append(("heard", within_s))
        return self.heard.pop(0)

    def is_over(self, within_s: float) -> bool:
        self.waits_s.append(("over", within_s))
        return self.over.pop(0)


@pytest.fixture
def path() -> Iterator[Path]:
    with TemporaryDirectory(prefix="labctl-") as name:
        yield Path(name) / "stop"


@pytest.fixture
def asked() -> list[StopRequest]:
    return []


@pytest.fixture
def server(path: Path, asked: list[StopRequest]) -> Iterator[StopServer]:
    stopping = FakeStopping()
    stopping.heard.set()
    stopping.over.set()

    def respond(request: StopRequest) -> FakeStopping:
        asked.append(request)
        return stopping

    server = StopServer(path, respond)
    server.start()
    yield server
    server.close()


def sent(path: Path, content: bytes, *, ends: bool = False) -> bytes:
    """Send bytes to a server and return all that it answers."""
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(3.0)
        line.connect(str(path))
        line.sendall(content)
        if ends:
            line.shutdown(socket.SHUT_WR)
        try:
            return b"".join(iter(lambda: line.recv(4096), b""))
        except ConnectionResetError:
            return b""


@pytest.mark.parametrize(("stands", "last"), [(True, "stands"), (False, "failed")])
def test_a_stop_is_asked_for_then_heard_then_over(stands: bool, last: str) -> None:
    over = [False, False, False, False, False, False, True, True]
    stopping = Scripted([False, True], over, stands)
    found = list(phases(stopping))
    assert [word.phase for word in found] == ["asked", "waiting", "heard", "waiting", last]
    assert {(word.text, word.campaign) for word in found} == {("on its way", 7)}
    beat, now = wire.BEAT_S, 0.0
    assert stopping.waits_s == [
        ("over", now), ("heard", beat), ("over", now),  # the beat passes before the table is stopped
        ("over", now), ("heard", beat),
        ("over", now), ("over", beat),
        ("over", now), ("over", beat),
        ("over", now),
    ]  # fmt: skip


def test_a_stop_that_is_over_at_once_is_not_waited_for() -> None:
    stopping = Scripted([], [True])
    assert [word.phase for word in phases(stopping)] == ["asked", "stands"]


def test_a_beat_and_a_silent_caller_take_less_than_an_asker_waits() -> None:
    assert 0.0 < wire.BEAT_S <= client.SILENT_S / 3
    assert wire.SAID_WITHIN_S < client.HEARD_WITHIN_S  # a caller that says nothing does not keep another one waiting


@pytest.mark.parametrize("ends", [False, True])
def test_a_request_is_answered_with_or_without_the_end_of_its_line(
    path: Path, server: StopServer, asked: list[StopRequest], ends: bool
) -> None:
    answer = sent(path, LINE if ends else LINE + b"\n", ends=ends)
    assert [json.loads(line)["phase"] for line in answer.splitlines()] == ["asked", "stands"]
    assert answer.endswith(b"\n")
    assert asked == [REQUEST]


@pytest.mark.parametrize("content", [b"no JSON\n", b'{"id": "1"}\n', b"[]\n", b"x" * wire.LINE_BYTES])
def test_what_is_no_request_is_refused_and_the_next_one_is_answered(
    path: Path, server: StopServer, asked: list[StopRequest], content: bytes
) -> None:
    assert sent(path, content) == b""
    assert asked == []
    assert b"stands" in sent(path, LINE + b"\n")


def test_a_caller_that_says_nothing_is_closed_and_the_next_one_is_answered(
    path: Path, server: StopServer, asked: list[StopRequest], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wire, "SAID_WITHIN_S", 0.5)
    assert sent(path, b"") == b""
    assert b"stands" in sent(path, LINE + b"\n")
    assert asked == [REQUEST]


def test_a_closed_server_answers_none_and_leaves_no_socket(path: Path, server: StopServer) -> None:
    before = threading.active_count()
    server.close()
    assert threading.active_count() == before - 1
    assert not path.exists()
    server.close()


def test_a_server_that_was_not_started_can_be_closed(path: Path) -> None:
    StopServer(path, lambda _: FakeStopping()).close()
    assert not path.exists()


def answered(path: Path, *parts: bytes, ends: bool = True) -> socket.socket:
    """Answer the next caller with these bytes, one by one, and end the line unless it is to stay open."""
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(path))
    listener.listen()

    def answer() -> None:
        caller, _ = listener.accept()
        with caller:
            caller.recv(4096)
            for part in parts:
                caller.sendall(part)
            if not ends:
                caller.recv(4096)  # until the asker has gone

    threading.Thread(target=answer, daemon=True).start()
    return listener


def test_words_are_read_however_they_are_cut_until_the_last(path: Path) -> None:
    parts = (b'{"phase": "asked"}\n{"pha', b'se": "heard", "text": "soon"}\n', b'{"phase": "stands", "campaign": 3}\n')
    with answered(path, *parts, ends=False):
        found = list(ask(str(path), REQUEST, silent_s=3.0, first_s=3.0))
    assert found == [Word("asked"), Word("heard", "soon"), Word("stands", campaign=3)]


@pytest.mark.parametrize(("parts", "silent_s", "first_s"), [((), 90.0, 0.05), ((b'{"phase": "asked"}\n',), 0.05, 90.0)])
def test_silence_ends_the_wait_for_the_first_word_and_for_each_later_one(
    path: Path, parts: tuple[bytes, ...], silent_s: float, first_s: float
) -> None:
    with answered(path, *parts, ends=False), pytest.raises(TimeoutError):
        list(ask(str(path), REQUEST, silent_s, first_s))


def test_a_process_that_ends_before_it_has_answered_is_an_error(path: Path) -> None:
    with answered(path, b'{"phase": "asked"}\n'), pytest.raises(ConnectionResetError, match="ended before"):
        list(ask(str(path), REQUEST, silent_s=3.0, first_s=3.0))


def test_an_asker_does_not_wait_at_a_socket_that_takes_no_caller(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener, socket.socket(socket.AF_UNIX) as earlier:
        listener.bind(str(path))
        listener.listen(0)
        earlier.connect(str(path))
        with pytest.raises(OSError, match=r"unavailable|timed out"):
            list(ask(str(path), REQUEST, silent_s=3.0, first_s=0.05))


def test_a_line_of_64_kib_without_an_end_is_refused_at_once(
    path: Path, server: StopServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wire, "SAID_WITHIN_S", 30.0)
    assert sent(path, b"x" * 65536) == b""


def test_a_request_of_just_less_than_64_kib_is_read_to_its_end_however_it_is_cut() -> None:
    parts = [b"x" * (65536 - 4), b"\n", b"not read"]
    caller: Any = SimpleNamespace(recv=lambda _: parts.pop(0))
    assert wire._line(caller) == b"x" * (65536 - 4) + b"\n"


def test_a_caller_that_could_not_be_accepted_does_not_keep_the_next_one_from_its_answer(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where the process has no file handle left for a moment."""
    accept, failures = socket.socket.accept, [OSError(errno.EMFILE, os.strerror(errno.EMFILE))]

    def flaky(listener: socket.socket) -> Any:
        if failures:
            raise failures.pop()
        return accept(listener)

    monkeypatch.setattr(socket.socket, "accept", flaky)
    stopping = FakeStopping()
    stopping.heard.set()
    stopping.over.set()
    server = StopServer(path, lambda _: stopping)
    server.start()
    answer = sent(path, LINE + b"\n")
    server.close()
    assert failures == []
    assert b"stands" in answer


def test_no_stop_that_is_being_answered_keeps_its_process_from_ending(path: Path) -> None:
    before = set(threading.enumerate())
    stopping = FakeStopping()
    server = StopServer(path, lambda _: stopping)
    server.start()
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(str(path))
        line.sendall(LINE + b"\n")
        line.recv(4096)
        begun = set(threading.enumerate()) - before
        stopping.heard.set()
        stopping.over.set()
    server.close()
    assert len(begun) == 2  # that accepts, and that answers
    assert all(thread.daemon for thread in begun)


class ScriptedLine:
    """A connection whose answers come at given times, s; notes for how long each is waited for."""

    def __init__(self, *answers: tuple[float, bytes]) -> None:
        self.now, self.waits_s = 100.0, list[float]()
        self._answers = list(answers)

    def __enter__(self) -> ScriptedLine:
        return self

    def __exit__(self, *_: object) -> None: ...

    def settimeout(self, within_s: float) -> None:
        self.waits_s.append(within_s)

    def connect(self, _path: str) -> None: ...

    def sendall(self, _request: bytes) -> None: ...

    def now_s(self) -> float:
        return self.now

    def recv(self, _length: int) -> bytes:
        after_s, answer = self._answers.pop(0)
        self.now += after_s
        return answer


def test_an_asker_waits_for_the_first_word_from_its_question_on_and_for_each_later_one_from_the_word_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = ScriptedLine(
        (1.0, b'{"phase": '), (0.5, b'"asked"}\n'), (2.0, b'{"phase"'), (3.5, b": "), (0.0, b'"stands"}\n')
    )
    monkeypatch.setattr(wire, "SystemClock", lambda: line)
    monkeypatch.setattr(wire, "socket", SimpleNamespace(**vars(socket) | {"socket": lambda *_: line}))
    assert [word.phase for word in ask("stop", REQUEST, silent_s=5.0, first_s=1.5)] == ["asked", "stands"]
    assert line.waits_s == [1.5, 1.5, 0.5, 5.0, 3.0, 1e-3]  # the first is that of the connection; none is without end
