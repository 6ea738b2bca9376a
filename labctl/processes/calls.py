"""Calls from one labctl process to another: a name, data, and who acts, over a Unix socket in a private folder.

Both ends are processes of one user and one installation, so calls and answers are pickled. The folder (mode 0700) keeps
others out.
"""

from __future__ import annotations

import contextlib
import pickle
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Client, Connection, Listener
from pathlib import Path
from typing import Any

from labctl.acting_user import Actor, actor
from labctl.errors import BenchSilent, LabctlError
from labctl.log.context import request_id

BACKLOG = 64
#: A caller that was accepted has this long to say what it wants, where callers are answered one after the other, s.
SAID_WITHIN_S = 1.0


@dataclass(frozen=True)
class Call:
    """What is asked, and in whose name."""

    name: str
    args: tuple[Any, ...] = ()
    kwargs: dict[str, Any] = field(default_factory=dict)
    actor: Actor = field(default_factory=actor)
    request_id: str = field(default_factory=request_id)  #: the HTTP request that asks, for the log


@dataclass(frozen=True)
class Answer:
    """What came of a call: a value, or what was raised."""

    value: Any = None
    raised: BaseException | None = None


#: Answers a call; one that returns None has taken the connection over.
Respond = Callable[[Call, Connection], Answer | None]


class UnderWay:
    """Counts the calls that are being answered, until no more may begin. Any thread may use it."""

    def __init__(self) -> None:
        self._count, self._is_over = 0, False
        self._changed = threading.Condition()

    def begin(self) -> bool:
        """Begin a call; returns whether it may."""
        with self._changed:
            self._count += not self._is_over
            return not self._is_over

    def end(self) -> None:
        """End a call that was begun."""
        with self._changed:
            self._count -= 1
            self._changed.notify_all()

    def close(self, within_s: float) -> int:
        """Let none begin from now on; returns how many are still under way after `within_s` at most."""
        with self._changed:
            self._is_over = True
            self._changed.wait_for(lambda: self._count == 0, within_s)
            return self._count


class CallServer:
    """Answers calls at a Unix socket: each caller in a thread of its own, or all in turn in one thread."""

    def __init__(self, path: Path, respond: Respond, *, in_turn: bool = False) -> None:
        self._path, self._respond, self._in_turn = path, respond, in_turn
        self._listener = Listener(str(path), "AF_UNIX", backlog=BACKLOG)
        self._over = False
        self._thread = threading.Thread(target=self._accept, name=f"calls-{path.name}", daemon=True)

    def start(self) -> None:
        """Answer from now on."""
        self._thread.start()

    def close(self) -> None:
        """Answer no caller that comes from now on."""
        self._over = True
        with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as waker:
            waker.connect(str(self._path))  # a thread that waits for a caller gets this one
        if self._thread.is_alive():
            self._thread.join()
        self._listener.close()

    def _accept(self) -> None:
        while True:
            try:
                connection = self._listener.accept()
            except OSError:
                if self._over:
                    return
                continue
            if self._over:
                connection.close()
                return
            if not self._in_turn:
                threading.Thread(target=self._serve, args=(connection,), name="call", daemon=True).start()
            elif connection.poll(SAID_WITHIN_S):
                self._one(connection)
                connection.close()

    def _serve(self, connection: Connection) -> None:
        while self._one(connection):
            pass

    def _one(self, connection: Connection) -> bool:
        """Answer one call; returns whether the connection waits for another."""
        try:
            call = connection.recv()
            answer = self._respond(call, connection)
            if answer is None:
                return False
            connection.send_bytes(_packed(answer))
        except (EOFError, OSError):
            connection.close()
            return False
        return True


def answer_with(work: Callable[[], object]) -> Answer:
    """Return what `work` returns, or what it raises."""
    try:
        return Answer(work())
    except Exception as error:  # noqa: BLE001  the caller gets the error; this end continues
        return Answer(raised=error)


def _packed(answer: Answer) -> bytes:
    try:
        return pickle.dumps(answer)
    except Exception as error:  # noqa: BLE001  what cannot be pickled is sent as text
        text = str(answer.raised or error)
        return pickle.dumps(
            Answer(
                raised=LabctlError(
                    f"an answer cannot be sent between processes; report this text and the version of labctl to "
                    f"its maintainers: {text}"
                )
            )
        )


class Caller:
    """Calls the process behind a Unix socket. Any thread may call; each call has a connection to itself.

    Connections are kept for further calls, unless the other end answers one call on each.
    """

    def __init__(self, path: Path, timeout_s: float, *, keeps: bool = True) -> None:
        self._path, self._timeout_s, self._keeps = path, timeout_s, keeps
        self._idle: list[Connection] = []
        self._guard = threading.Lock()

    def call(self, name: str, *args: Any, timeout_s: float | None = None, **kwargs: Any) -> Any:
        """Return what the other process answers, or raise what it raised. Raises BenchSilent without an answer."""
        wait_s = self._timeout_s if timeout_s is None else timeout_s
        connection = self._taken()
        try:
            connection.send(Call(name, args, kwargs))
            if not connection.poll(wait_s):
                raise BenchSilent(
                    f"the bench process has not answered within {wait_s:g} s; inspect the bench if this continues"
                )
            answer: Answer = connection.recv()
        except (EOFError, OSError) as error:
            connection.close()
            raise BenchSilent(
                f"the bench process has ended ({error or type(error).__name__}); wait for its restart, then try again"
            ) from error
        except BaseException:
            connection.close()  # an answer that comes later must not be taken for that of the next call
            raise
        if self._keeps:
            with self._guard:
                self._idle.append(connection)
        else:
            connection.close()
        if answer.raised is not None:
            raise answer.raised
        return answer.value

    def _taken(self) -> Connection:
        with self._guard:
            while self._idle:
                connection = self._idle.pop()
                if not connection.poll(0):  # one that has something to say was closed at the other end
                    return connection
                connection.close()
        return self.connect()

    def connect(self) -> Connection:
        """Return a new connection. Raises BenchSilent."""
        try:
            return Client(str(self._path), "AF_UNIX")
        except OSError as error:
            raise BenchSilent(
                f"the bench process cannot be reached ({error.strerror or error}); wait for its restart, then try again"
            ) from error

    def close(self) -> None:
        """Close the connections that wait for a call."""
        with self._guard:
            for connection in self._idle:
                connection.close()
            self._idle.clear()
