"""Callers at a Unix socket: one that is gone ends nothing, and none is answered after the end."""

from __future__ import annotations

import queue
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from labctl.stop.acceptor import Acceptor

WITHIN_S = 10.0


@pytest.fixture
def listener(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(str(tmp_path / "callers"))
        made.listen()
        yield made


def call(listener: socket.socket) -> socket.socket:
    line = socket.socket(socket.AF_UNIX)
    line.settimeout(WITHIN_S)
    line.connect(listener.getsockname())
    return line


def test_each_caller_is_begun_also_after_one_that_is_gone(listener: socket.socket) -> None:
    begun: queue.Queue[socket.socket] = queue.Queue()
    failures = iter([ConnectionAbortedError("gone before it was accepted")])

    def accept() -> socket.socket:
        caller = listener.accept()[0]
        if (failure := next(failures, None)) is not None:
            caller.close()
            raise failure
        return caller

    acceptor = Acceptor(Path(listener.getsockname()), "callers", accept, begun.put)
    acceptor.start()
    with call(listener), call(listener) as second:
        taken = begun.get(timeout=WITHIN_S)
        taken.sendall(b"begun")
        assert second.recv(5) == b"begun"
        taken.close()
    acceptor.close()
    assert begun.empty()


def test_the_thread_ends_and_no_caller_is_begun_after_it(listener: socket.socket) -> None:
    begun: list[socket.socket] = []
    acceptor = Acceptor(Path(listener.getsockname()), "callers", lambda: listener.accept()[0], begun.append)
    acceptor.start()
    acceptor.close()
    acceptor.close()
    with call(listener) as late:
        late.sendall(b"late")
        listener.settimeout(WITHIN_S)
        taken = [listener.accept()[0] for _ in range(2)]  # that of the second close, and the late one
        assert [each.recv(4) for each in taken] == [b"", b"late"]
    for each in taken:
        each.close()
    assert not begun
