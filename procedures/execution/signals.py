"""Signals that must not interrupt the steps that make a bench safe. Each scope restores the handlers that it found.

Only a process's main thread gets signals; in another thread none of these scopes does anything.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType

#: What `signal.signal` takes and returns; None for a handler that was not set by Python.
Handler = Callable[[int, FrameType | None], object] | int | None

#: The signals that end a process.
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


@contextmanager
def signal_handlers(handlers: Mapping[signal.Signals, Handler]) -> Iterator[None]:
    """Handle signals by these handlers while the block runs.

    A handler that something else has replaced by the end of the block is left alone.
    """
    if not is_main_thread():
        yield
        return
    before: dict[signal.Signals, Handler] = {}
    try:
        for number, handler in handlers.items():
            before[number] = signal.signal(number, handler)
        yield
    finally:
        for number, earlier in before.items():
            if earlier is not None and signal.getsignal(number) is handlers[number]:
                signal.signal(number, earlier)


def restore(handlers: Mapping[signal.Signals, Handler]) -> None:
    """Set handlers that were found earlier."""
    if not is_main_thread():
        return
    for number, handler in handlers.items():
        if handler is not None:
            signal.signal(number, handler)


def signals_were_obeyed() -> None:
    """Ignore the ending signals from here on, until a scope further out restores its handlers: one was obeyed."""
    if is_main_thread():
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)


def is_main_thread() -> bool:
    """Return whether this thread may set signal handlers."""
    return threading.current_thread() is threading.main_thread()


@contextmanager
def shutdown_hook(hook: Callable[[], None]) -> Iterator[None]:
    """Call `hook` once, in a thread of its own, at the first ending signal; the handler found has every signal.

    A handler runs in the middle of what the main thread does. Were the hook called there, it would never get a
    lock that this thread holds, be it that of its own first call, which a second signal interrupts. So the handler only
    writes a byte. The block ends when a hook that was begun has ended; a signal that is ignored, or ends the process
    without a Python handler, begins none.
    """
    if not is_main_thread():
        yield
        return
    reader, writer = os.pipe2(os.O_CLOEXEC)
    heard = False

    def await_signal() -> None:
        if os.read(reader, 1):
            hook()

    def before_the(handler: Callable[[int, FrameType | None], object]) -> Handler:
        def handle(number: int, frame: FrameType | None) -> None:
            nonlocal heard
            if not heard:
                heard = True
                os.write(writer, b"!")
            handler(number, frame)

        return handle

    waiting = threading.Thread(target=await_signal, name="shutdown-hook", daemon=True)
    waiting.start()
    handlers = {number: signal.getsignal(number) for number in ENDING}
    try:
        with signal_handlers({number: before_the(each) for number, each in handlers.items() if callable(each)}):
            yield
    finally:
        heard = True  # a handler that was kept elsewhere writes nothing into a closed pipe
        os.close(writer)
        waiting.join()
        os.close(reader)


@contextmanager
def ignore_signals(note: Callable[[int], None] = lambda _: None) -> Iterator[None]:
    """Keep the ending signals from interrupting the block, which has to end by itself; `note` gets each number."""

    def handle(number: int, _frame: FrameType | None) -> None:
        note(number)

    with signal_handlers(dict.fromkeys(ENDING, handle)):
        yield


@contextmanager
def defer_signals() -> Iterator[None]:
    """Defer an ending signal until after the block, which has to be short.

    A write that is torn in the middle leaves a connection that takes no further write, not even that of the end.
    """
    heard: list[int] = []
    try:
        with ignore_signals(heard.append):
            yield
    finally:
        for number in heard[:1]:
            signal.raise_signal(number)
