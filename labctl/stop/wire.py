"""What is said over a stop socket: one JSON document per line, in a private folder.

The asker sends a stop request. The other end answers in phases: `asked` (it knows), `heard` (what drives the bench has
left its step and makes the bench safe), `waiting` (with what keeps it, about once a second), and at the end `stands` or
`failed`.
"""

from __future__ import annotations

import contextlib
import json
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal, Protocol

from instruments.clock import SystemClock
from labctl.stop.acceptor import Acceptor
from labctl.stop.latch import StopRequest

Phase = Literal["asked", "heard", "waiting", "stands", "failed"]
LAST: frozenset[Phase] = frozenset({"stands", "failed"})
#: A caller has this long to say what it wants, s.
SAID_WITHIN_S = 1.0
LINE_BYTES = 64 * 1024
BEAT_S = 0.5
BACKLOG = 64


@dataclass(frozen=True)
class Word:
    """One line of an answer."""

    phase: Phase
    text: str = ""
    campaign: int | None = None


class Stopping(Protocol):
    """A stop that is under way."""

    campaign: int | None

    def is_heard(self, within_s: float) -> bool:
        """Wait until what drives the bench has left its step; returns whether it has."""
        ...

    def is_over(self, within_s: float) -> bool:
        """Wait until it is known whether the table stands; returns whether it is."""
        ...

    @property
    def stands(self) -> bool:
        """Whether the table is confirmed to stand."""
        ...

    @property
    def text(self) -> str:
        """How far the stop is, or what keeps it."""
        ...


#: Begins a stop at once: waits for no lock, no database and no disk.
Respond = Callable[[StopRequest], Stopping]


class StopServer:
    """Answers stop requests at a Unix socket. A stop begins in the thread that accepts it; each waits in its own."""

    def __init__(self, path: Path, respond: Respond) -> None:
        self._path, self._respond = path, respond
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC)
        self._listener.bind(str(path))
        self._listener.listen(BACKLOG)
        self._acceptor = Acceptor(path, f"stop-{path.name}", self._accept, self._begin)

    def start(self) -> None:
        """Answer from now on."""
        self._acceptor.start()

    def close(self) -> None:
        """Answer no caller that comes from now on. Safe to call twice."""
        self._acceptor.close()
        self._listener.close()
        with contextlib.suppress(OSError):
            self._path.unlink()

    def _accept(self) -> socket.socket:
        return self._listener.accept()[0]

    def _begin(self, caller: socket.socket) -> None:
        try:
            caller.settimeout(SAID_WITHIN_S)
            stop = StopRequest(**json.loads(_line(caller)))
            stopping = self._respond(stop)
        except (OSError, ValueError, TypeError):
            caller.close()
            return
        threading.Thread(target=self._follow, args=(caller, stopping), name="stop-answer", daemon=True).start()

    @staticmethod
    def _follow(caller: socket.socket, stopping: Stopping) -> None:
        with caller, contextlib.suppress(OSError):
            for word in phases(stopping):
                caller.sendall(json.dumps(asdict(word)).encode() + b"\n")


def phases(stopping: Stopping) -> Iterator[Word]:
    """Yield how a stop goes on, until it is over."""
    yield Word("asked", stopping.text, stopping.campaign)
    heard = False
    while not stopping.is_over(0.0):
        if not heard and stopping.is_heard(BEAT_S):
            heard = True
            yield Word("heard", stopping.text, stopping.campaign)
        elif not stopping.is_over(BEAT_S if heard else 0.0):
            yield Word("waiting", stopping.text, stopping.campaign)
    yield Word("stands" if stopping.stands else "failed", stopping.text, stopping.campaign)


def ask(path: str, stop: StopRequest, silent_s: float, first_s: float) -> Iterator[Word]:
    """Ask for a stop at a socket; yields what is answered.

    Raises OSError where nothing comes within `first_s`, or later for `silent_s`.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC) as line:
        line.settimeout(first_s)
        line.connect(path)
        line.sendall(json.dumps(asdict(stop)).encode() + b"\n")
        clock, read = SystemClock(), b""
        until_s = clock.now_s() + first_s
        while True:
            while b"\n" in read:
                text, _, read = read.partition(b"\n")
                word = Word(**json.loads(text))
                yield word
                until_s = clock.now_s() + silent_s
                if word.phase in LAST:
                    return
            line.settimeout(max(until_s - clock.now_s(), 1e-3))
            more = line.recv(4096)
            if not more:
                raise ConnectionResetError("the process ended before it had answered")
            read += more


def _line(caller: socket.socket) -> bytes:
    read = b""
    while not read.endswith(b"\n") and len(read) < LINE_BYTES:
        more = caller.recv(4096)
        if not more:
            break
        read += more
    return read
