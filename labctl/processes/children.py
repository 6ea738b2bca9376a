"""Child processes of the supervisor: started with settings, and a line on which each says that it is ready, or why not.

The end of the line tells either side that the other has ended.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from logging import INFO
from multiprocessing.connection import Connection
from typing import Literal, NoReturn, TypeVar

from labctl.errors import LabctlError
from labctl.log.settings import level_asked
from labctl.log.setup import begin_log
from labctl.processes.documents import BadDocument, Form, answer, receive, refusal, value_of

Line = Connection
#: What a child says: once that it is ready, then that it lives.
ChildWord = Literal["ready", "beat"]
SAID_BY_CHILD: Form[ChildWord] = Form(ChildWord, "what a process of the service says")
SettingsT = TypeVar("SettingsT")
#: Of linux/prctl.h.
PR_SET_PDEATHSIG = 1
POLL_INTERVAL_S = 0.5


class Failed(LabctlError):
    """A child process ended before it was ready, without saying why."""

    slug = "process-failed"


class Child:
    """A process that this one has started. It loads its modules, then waits for its settings."""

    def __init__(self, module: str, pass_fds: Sequence[int] = ()) -> None:
        """Start `python -m module` in a session of its own: signals of the terminal do not reach it."""
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603  this very program
                [sys.executable, "-m", module, str(theirs.fileno())],
                pass_fds=[theirs.fileno(), *pass_fds],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # the supervisor's carries one document
                start_new_session=True,
            )
        self.line: Line = Connection(ours.detach())
        self.name = module.rpartition(".")[2].replace("_", " ")

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._process.pid

    def open(self, settings: object, gives_up: Callable[[], bool] = lambda: False) -> None:
        """Let it begin with its settings, and wait until it is ready; raises what kept it from that.

        Raises Failed, too, once `gives_up` returns True.
        """
        try:
            self.line.send_bytes(Form[object](type(settings), "the settings of a process").encode(settings))
            while not self.line.poll(POLL_INTERVAL_S):
                if gives_up():
                    raise Failed(f"the {self.name} was not ready when it was asked to end; start the service again")
            reply = receive(self.line)
        except (EOFError, OSError):
            self._process.wait()
            raise Failed(
                f"the {self.name} ended with exit status {self._process.returncode} while it started; "
                "read the log for the cause"
            ) from None
        try:
            value_of(SAID_BY_CHILD, reply)
        except BadDocument:
            self.kill()  # it may go on, and what it does is not known
            raise
        except Exception:
            self._process.wait()  # it has said why it ends
            raise

    def has_ended(self) -> bool:
        """Return whether the process is over."""
        return self._process.poll() is not None

    @property
    def status(self) -> int | None:
        """How it ended: its exit status, negative for a signal; None while it runs."""
        return self._process.poll()

    def signal(self, number: signal.Signals) -> None:
        """Send a signal, unless it is over."""
        with contextlib.suppress(ProcessLookupError):
            self._process.send_signal(number)

    def wait(self, timeout_s: float) -> bool:
        """Wait for its end; returns whether it came."""
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    def kill(self) -> None:
        """End it at once."""
        self.signal(signal.SIGKILL)
        self._process.wait()
        self.line.close()


def begin_child_log(name: str, location: str) -> None:
    """Begin the log of a child process; its supervisor has checked the level that the environment sets."""
    level = level_asked()
    begin_log(name, INFO if level is None else level, locations=(location,))


def line_to_parent(kind: type[SettingsT]) -> tuple[Line, SettingsT]:
    """Return the line to the process that started this one, and the settings of this type that came over it.

    Raises SystemExit where that process ended before it sent settings: no process is left to report to, and nothing
    was begun.
    """
    line = Connection(int(sys.argv[1]))
    os.set_inheritable(line.fileno(), False)
    try:
        return line, Form[SettingsT](kind, "the settings of a process").decode(receive(line))
    except (EOFError, ConnectionError):
        sys.exit(1)


def end_with_parent() -> None:
    """Have the kernel kill this process when the thread that started it has ended; on systems without that, nothing.

    A process that stands still cannot hear the end of its line: it would keep its memory and the service's address.
    Linux, prctl(2), PR_SET_PDEATHSIG.
    """
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def leave(status: int) -> NoReturn:
    """End this process, all of whose work is closed.

    What was registered for its end is done; the memory is not taken apart object by object, which needs a processor
    for up to a second, and on a busy computer keeps the supervisor waiting several.
    """
    atexit._run_exitfuncs()  # noqa: SLF001  there is no public name; as multiprocessing does for a forked process
    os._exit(status)


def tell(line: Line, what: ChildWord) -> None:
    """Say something to the parent; nothing where it has gone."""
    with contextlib.suppress(OSError, ValueError):
        line.send_bytes(answer(SAID_BY_CHILD, what))


def tell_refusal(line: Line, error: Exception) -> None:
    """Tell the parent why this process does not begin; nothing where it has gone."""
    with contextlib.suppress(OSError, ValueError):
        line.send_bytes(refusal(error))
