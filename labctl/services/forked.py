"""A computation in a fork of this process, on another core, while this process goes on.

For a command that has its process to itself. A process of several threads is not forked, because another thread may
hold a lock that the fork would wait for; nor is a process that was started by another process of labctl. There the
work is done when its result is requested, with the same result.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import threading
from collections.abc import Callable
from multiprocessing import Pipe, get_context, parent_process
from multiprocessing.connection import Connection
from tempfile import TemporaryFile
from typing import IO, Generic, TypeVar

ResultT = TypeVar("ResultT")

#: A child that was killed is waited for so long, s.
END_S = 5.0


class Forked(Generic[ResultT]):
    """The result of `work`, which begins at once in a fork where that is safe. To be closed.

    The fork may not use what is open in this process: `work` opens its own database.
    """

    def __init__(self, work: Callable[[], ResultT]) -> None:
        self._work = work
        self._line: Connection | None = None
        if not can_fork():
            return
        # a pipe would carry the result in pieces of 64 KiB
        self._file = TemporaryFile()  # noqa: SIM115  closed with this
        self._line, theirs = Pipe(duplex=False)
        self._process = get_context("fork").Process(target=_save, args=(theirs, self._file, work), daemon=True)
        self._process.start()
        theirs.close()  # so that the end of the fork is the end of the line

    @property
    def is_forked(self) -> bool:
        """Whether the work is done beside this process."""
        return self._line is not None

    def result(self) -> ResultT:
        """Return what `work` returns; raises what it raises. A fork that fails is replaced by work in this process."""
        if self._line is not None:
            with contextlib.suppress(EOFError, OSError):
                self._line.recv_bytes()
                self._file.seek(0)
                result: ResultT = pickle.load(self._file)  # noqa: S301  from a fork of this process
                return result
        return self._work()

    def close(self) -> None:
        """End the fork, also where its result was not asked for."""
        if self._line is None:
            return
        self._line.close()
        self._file.close()
        self._process.kill()
        self._process.join(END_S)


def can_fork() -> bool:
    """Return whether a fork is safe here and gains anything."""
    alone = parent_process() is None and threading.active_count() == 1
    return alone and hasattr(os, "sched_getaffinity") and len(os.sched_getaffinity(0)) > 1


def _save(line: Connection, file: IO[bytes], work: Callable[[], object]) -> None:
    """Do the work and save its result; whatever goes wrong, the parent sees the end of the line and does it itself."""
    with contextlib.suppress(Exception):
        pickle.dump(work(), file, pickle.HIGHEST_PROTOCOL)
        file.flush()
        line.send_bytes(b"saved")
    line.close()
