"""From an error to one clear line on standard error and an exit status."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import typer
from pydantic import ValidationError

from labctl.cli.output import stderr
from procedures.execution.signals import ENDING


@contextmanager
def one_clear_line() -> Iterator[None]:
    """Turn what is wrong into one line on standard error and its exit status."""
    from instruments.errors import InstrumentError
    from labctl.errors import LabctlError, Stopped
    from procedures.contracts.errors import ProcedureError

    try:
        yield
    except Stopped as error:
        _hear_no_more()
        raise _said(str(error), error.exit_status) from error
    except LabctlError as error:
        raise _said(str(error), error.exit_status) from error
    except (InstrumentError, ProcedureError) as error:
        raise _said(str(error), 2) from error
    except ValidationError as error:
        first = error.errors()[0]
        option = "--" + "-".join(str(part) for part in first["loc"]).replace("_", "-")
        raise _said(f"{option} {first['input']!r}: {first['msg'][0].lower()}{first['msg'][1:]}", 2) from error
    except OverflowError as error:
        raise _said(f"a number is larger than anything here can be ({error})", 2) from error
    except OSError as error:
        raise _said(f"{error.filename or 'output'}: {error.strerror or error}; nothing was written there", 2) from error
    except KeyboardInterrupt as error:
        _hear_no_more()
        # an impatient second one, while what the first one stopped was being closed, takes nothing back
        stopped = error.__context__
        raise _said(str(stopped) if isinstance(stopped, Stopped) else "interrupted", 130) from None


def _said(text: str, status: int) -> typer.Exit:
    stderr.print(f"labctl: {' '.join(text.split())}", markup=False)
    return typer.Exit(status)


def _hear_no_more() -> None:
    """Ignore Ctrl-C and the signals to end from here to the exit: what they ask for is done.

    Python itself ends by the signal, not by the exit status, when one comes while it waits for its last threads.
    """
    if threading.current_thread() is threading.main_thread():
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)


@contextmanager
def ending_is_an_interrupt() -> Iterator[None]:
    """Let a request to end (SIGTERM) and a lost terminal (SIGHUP) do what Ctrl-C does: the bench is left safe.

    Once one of them was heeded, none is heard any more when the block is over.
    """
    heard = False

    def interrupt(*_: int | FrameType | None) -> None:
        nonlocal heard
        heard = True
        raise KeyboardInterrupt

    before = {number: signal.signal(number, interrupt) for number in ENDING}
    try:
        yield
    finally:
        if heard:
            _hear_no_more()
        else:
            for number, handler in before.items():
                signal.signal(number, handler)
