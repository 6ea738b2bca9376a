"""Signals that must not cut short what leaves a bench safe."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def add_shutdown_hook(noted: Callable[[], None]) -> None:
    """Let `noted` hear of each signal to end before whoever handles it now; it may neither block nor raise.

    Nothing happens outside a process's main thread, or where nobody handles them.
    """
    if threading.current_thread() is not threading.main_thread():
        return

    def telling(before: Callable[[int, Any], Any]) -> Callable[[int, Any], None]:
        def tell(number: int, frame: Any) -> None:
            noted()
            before(number, frame)

        return tell

    for number in ENDING:
        if callable(before := signal.getsignal(number)):
            signal.signal(number, telling(before))


@contextmanager
def ignore_signals(noted: Callable[[int], None] = lambda _: None) -> Iterator[None]:
    """Let nobody interrupt the block by Ctrl-C or a signal; `noted` hears of each.

    Every part of the safe state has an end of its own, so the block ends. Only a process's main thread gets signals;
    in another thread there is nothing to hold back.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def note(number: int, _frame: Any) -> None:
        noted(number)

    before = {number: signal.signal(number, note) for number in ENDING}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def defer_signals() -> Iterator[None]:
    """Let Ctrl-C or a signal come only after the block, which has to be short: a write that is torn in the middle
    leaves a connection behind that nobody can write with, and then not even the end can be written.
    """
    heard: list[int] = []
    try:
        with ignore_signals(heard.append):
            yield
    finally:
        for number in heard[:1]:
            signal.raise_signal(number)
