"""Remote procedure calls (RPC) from one labctl process to another over a Unix socket in a private folder.

A call and its answer are documents of declared types (`labctl.processes.documents`), so the process that answers runs
nothing that a caller sends. The folder (mode 0700) keeps other users out.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Client, Connection, Listener
from pathlib import Path
from typing import Any

from labctl.errors import BadInput, BenchSilent
from labctl.log import get_logger
from labctl.processes.documents import BadDocument, answer, receive, refusal, value_of
from labctl.processes.rpc_methods import Call, MethodOf, RpcMethod, read_call
from labctl.stop.acceptor import Acceptor

log = get_logger()

BACKLOG = 64


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


class RpcServer:
    """Answers calls at a Unix socket, each caller in a thread of its own.

    A caller that sends what is no call gets a refusal, and its connection is closed; the log has one line.
    """

    def __init__(self, path: Path, respond: Respond, method_of: MethodOf) -> None:
        """`method_of` has the types of a call by its name."""
        self._respond, self._method_of = respond, method_of
        self._listener = Listener(str(path), "AF_UNIX", backlog=BACKLOG)
        self._acceptor = Acceptor(path, f"calls-{path.name}", self._listener.accept, self._begin)

    def start(self) -> None:
        """Answer from now on."""
        self._acceptor.start()

    def close(self) -> None:
        """Answer no caller that comes from now on."""
        self._acceptor.close()
        self._listener.close()

    def _begin(self, connection: Connection) -> None:
        threading.Thread(target=self._serve, args=(connection,), name="call", daemon=True).start()

    def _serve(self, connection: Connection) -> None:
        try:
            while self._one(connection):
                pass
        except (EOFError, OSError):
            connection.close()

    def _one(self, connection: Connection) -> bool:
        """Answer one call; returns whether the connection waits for another. Raises EOFError, OSError at its end."""
        try:
            call, method = read_call(receive(connection), self._method_of)
        except (BadDocument, BadInput) as error:
            log.warning("call.refused", error=str(error))
            with contextlib.suppress(OSError), connection:
                connection.send_bytes(refusal(error))
            return False
        result = self._respond(call, connection)
        if result is None:
            return False
        connection.send_bytes(_document(method, result))
        return True


def answer_with(work: Callable[[], object]) -> Answer:
    """Return what `work` returns, or what it raises."""
    try:
        return Answer(work())
    except Exception as error:  # noqa: BLE001  the caller gets the error; this end continues
        return Answer(raised=error)


def _document(method: RpcMethod, result: Answer) -> bytes:
    if result.raised is not None:
        return refusal(result.raised)
    try:
        return answer(method.result, result.value)
    except BadDocument as error:
        return refusal(error)


class RpcClient:
    """Calls the process behind a Unix socket. Any thread may call; each call has a connection to itself.

    Connections are kept for further calls.
    """

    def __init__(self, path: Path, timeout_s: float, method_of: MethodOf) -> None:
        """`method_of` has the types of a call by its name."""
        self._path, self._timeout_s, self._method_of = path, timeout_s, method_of
        self._idle: list[Connection] = []
        self._guard = threading.Lock()

    def call(self, name: str, *args: Any, timeout_s: float | None = None, **kwargs: Any) -> Any:
        """Return what the other process answers, or raise what it raised.

        Raises BenchSilent without an answer, BadDocument for arguments or an answer of other types than declared.
        """
        wait_s = self._timeout_s if timeout_s is None else timeout_s
        method = self._method_of(name)
        document = method.call(*args, **kwargs)
        connection = self._taken()
        try:
            connection.send_bytes(document)
            if not connection.poll(wait_s):
                raise BenchSilent(
                    f"the bench process has not answered within {wait_s:g} s; inspect the bench if this continues"
                )
            reply = receive(connection)
        except (EOFError, OSError) as error:
            connection.close()
            raise BenchSilent(
                f"the bench process has ended ({error or type(error).__name__}); wait for its restart, then try again"
            ) from error
        except BaseException:
            connection.close()  # an answer that comes later must not be taken for that of the next call
            raise
        with self._guard:
            self._idle.append(connection)
        return value_of(method.result, reply)

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
