"""From an error to one clear line on standard error and an exit status."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from types import FrameType

import typer
from pydantic import ValidationError

from labctl.cli.output import stderr
from procedures.execution.signals import ENDING, is_main_thread, restore, signal_handlers

#: Whether the process ends with the command that runs.
_PROCESS_ENDS: ContextVar[bool] = ContextVar("_PROCESS_ENDS", default=False)


@contextmanager
def process_of_one_command() -> Iterator[None]:
    """Run the block as the last thing that this process does.

    What an interrupted command ignores then stays ignored until the exit: Python ends by the signal, not by the exit
    status, when one comes while it waits for its last threads.
    """
    token = _PROCESS_ENDS.set(True)
    try:
        yield
    finally:
        _PROCESS_ENDS.reset(token)


@contextmanager
def one_clear_line() -> Iterator[None]:
    """Turn what is wrong into one line on standard error and its exit status.

    Raises typer.Exit. The handlers of signals are restored, unless the process ends with this command.
    """
    before = {number: signal.getsignal(number) for number in ENDING}
    try:
        with _errors_as_lines():
            yield
    finally:
        if not _PROCESS_ENDS.get():
            restore(before)


@contextmanager
def _errors_as_lines() -> Iterator[None]:
    from instruments.errors import InstrumentError
    from labctl.errors import LabctlError, Stopped
    from procedures.contracts.errors import ProcedureError

    try:
        yield
    except Stopped as error:
        _ignore_signals()
        raise _exit(str(error), error.exit_status) from error
    except LabctlError as error:
        raise _exit(str(error), error.exit_status) from error
    except (InstrumentError, ProcedureError) as error:
        raise _exit(str(error), 2) from error
    except ValidationError as error:
        first = error.errors()[0]
        option = "--" + "-".join(str(part) for part in first["loc"]).replace("_", "-")
        raise _exit(f"{option} {first['input']!r}: {first['msg'][0].lower()}{first['msg'][1:]}", 2) from error
    except OverflowError as error:
        raise _exit(f"a number is larger than anything here can be ({error})", 2) from error
    except OSError as error:
        raise _exit(f"{error.filename or 'output'}: {error.strerror or error}; nothing was written there", 2) from error
    except KeyboardInterrupt as error:
        _ignore_signals()
        # further ones, while what the first one stopped was being closed, change nothing
        stopped: BaseException | None = error
        while stopped is not None and not isinstance(stopped, Stopped):
            stopped = stopped.__context__
        raise _exit("interrupted" if stopped is None else str(stopped), 130) from None


def _exit(text: str, status: int) -> typer.Exit:
    stderr.print(f"labctl: {' '.join(text.split())}", markup=False)
    return typer.Exit(status)


def _ignore_signals() -> None:
    """Ignore the ending signals from here to the end of `one_clear_line`, or of the process: they were obeyed."""
    if is_main_thread():
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)


@contextmanager
def ending_is_an_interrupt() -> Iterator[None]:
    """Let a request to end (SIGTERM) and a lost terminal (SIGHUP) do what Ctrl-C does: the bench is left safe.

    For use within `one_clear_line`: once a signal came, all are ignored from the end of this block to the end of that.
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
                _ignore_signals()  # a handler that was replaced is not restored at the end of the scope
