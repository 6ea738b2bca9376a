"""From a signal that asks the process to end to an interrupt: exit status, handlers, and what later signals do."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from types import FrameType

from procedures.execution.signals import ENDING, restore, signal_handlers, signals_were_obeyed

#: Exit status of an interrupted command: 128 + SIGINT.
INTERRUPTED = 130

#: Whether the process ends with the command that runs.
_PROCESS_ENDS: ContextVar[bool] = ContextVar("_PROCESS_ENDS", default=False)


@contextmanager
def process_of_one_command() -> Iterator[None]:
    """Run the block as the last thing that this process does.

    Signals that an interrupted command ignores then stay ignored until the exit: else one that comes while Python waits
    for its last threads would end the process by the signal, not with the exit status.
    """
    token = _PROCESS_ENDS.set(True)
    try:
        yield
    finally:
        _PROCESS_ENDS.reset(token)


def process_ends() -> bool:
    """Return whether the process ends with the command that runs."""
    return _PROCESS_ENDS.get()


@contextmanager
def signals_restored() -> Iterator[None]:
    """Restore the handlers of the ending signals at the end, unless the process ends with this command."""
    before = {number: signal.getsignal(number) for number in ENDING}
    try:
        yield
    finally:
        if not _PROCESS_ENDS.get():
            restore(before)


@contextmanager
def ending_is_an_interrupt() -> Iterator[None]:
    """Treat a request to end (SIGTERM) and a lost terminal (SIGHUP) as Ctrl-C: the bench is left safe.

    For use within `signals_restored`: once a signal came, all are ignored from the end of this block on.
    """
    interrupted = False

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True
        raise KeyboardInterrupt

    with signal_handlers(dict.fromkeys(ENDING, interrupt)):
        try:
            yield
        finally:
            if interrupted:
                signals_were_obeyed()  # a handler that was replaced is not restored at the end of the scope
