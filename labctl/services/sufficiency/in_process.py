"""Evaluation of a campaign in a process of its own, with a low priority: the process that drives a bench never waits.

The two share a pair of sockets. A request is one word, an answer a JSON document. The process reads the database, and
ends when the other end of the sockets is closed, however that happened.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from pydantic import TypeAdapter

from labctl.services.sufficiency.evaluation import Evaluation, UnitU
from labctl.store import open_store

#: How long the end of a campaign waits for U by all data sets, s; the bench is in its safe state meanwhile.
LAST_WITHIN_S = 120.0
#: Added to the niceness of the process.
NICE = 10
#: The process that the system ends first when its memory is short.
FIRST_TO_END = "1000"
NEWEST, LAST = b"newest", b"last"
_UNITS = TypeAdapter(list[UnitU])


ENDED = "the process that computes U could not be started, or has ended"


class ProcessEnded(Exception):
    """The process that evaluates a campaign has ended, or does not answer."""


class InOwnProcess:
    """Evaluates a campaign in another process. One request is under way at a time; only `last` waits for it."""

    def __init__(self, location: str, campaign: int) -> None:
        """Start the process; it gets the `location` of the database over the socket: a URL may have a password.

        Where it cannot be started, every request raises ProcessEnded: a campaign does not need it to run.
        """
        self._is_asked = False
        self._process: subprocess.Popen[bytes] | None = None
        ours, theirs = socket.socketpair()
        self._line = Connection(ours.detach())
        with theirs, suppress(OSError):
            self._process = subprocess.Popen(  # noqa: S603  this very program
                [sys.executable, "-m", "labctl.services.sufficiency.in_process", str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
                start_new_session=True,  # signals of the terminal do not reach it
            )
            self._line.send_bytes(f"{campaign} {location}".encode())

    def newest(self) -> Sequence[UnitU]:
        """Return the answer that has come, if one has; ask anew where none is awaited. Raises ProcessEnded."""
        try:
            units = self._received() if self._is_asked and self._line.poll(0) else []
            if not self._is_asked:
                self._ask(NEWEST)
        except (EOFError, OSError) as error:
            raise ProcessEnded(ENDED) from error
        return units

    def last(self) -> Sequence[UnitU]:
        """Wait for U by all data sets. Raises ProcessEnded."""
        try:
            if self._is_asked and self._line.poll(LAST_WITHIN_S):
                self._received()  # by fewer data sets
            if not self._is_asked:
                self._ask(LAST)
                if self._line.poll(LAST_WITHIN_S):
                    return self._received()
        except (EOFError, OSError) as error:
            raise ProcessEnded(ENDED) from error
        raise ProcessEnded(f"the process that computes U gave no answer in {LAST_WITHIN_S:.0f} s")

    def close(self) -> None:
        """End the process; it has nothing to save."""
        self._line.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def _ask(self, word: bytes) -> None:
        self._line.send_bytes(word)
        self._is_asked = True

    def _received(self) -> list[UnitU]:
        document = self._line.recv_bytes()
        self._is_asked = False
        return _UNITS.validate_json(document)


def main(fd: int) -> None:
    """Answer requests until the other end is closed."""
    os.nice(NICE)
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(FIRST_TO_END, encoding="ascii")
    line = Connection(fd)
    try:
        campaign, _, location = line.recv_bytes().decode().partition(" ")
        with open_store(location, write=False) as store:
            evaluation = Evaluation(store, int(campaign))
            while True:
                is_last = line.recv_bytes() == LAST
                line.send_bytes(_UNITS.dump_json(evaluation.evaluate(is_last=is_last)))
    except (EOFError, OSError):  # the campaign, or its process, is over
        return


if __name__ == "__main__":
    main(int(sys.argv[1]))
