"""Signals as in a foreground process, whatever started the tests: a shell's background job ignores Ctrl-C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

DEFAULTS = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
    signal.SIGHUP: signal.SIG_DFL,
    signal.SIGQUIT: signal.SIG_DFL,
}


@contextmanager
def default_signals() -> Iterator[None]:
    """Give the ending signals their default handlers for the block, and to the processes that are started in it.

    Nothing happens outside the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in DEFAULTS}
    for number, handler in DEFAULTS.items():
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number, found in before.items():
            if found is not None:  # set by something else than Python
                signal.signal(number, found)
