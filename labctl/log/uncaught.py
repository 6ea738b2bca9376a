"""Uncaught errors of the process and of its threads become records."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import TracebackType

from labctl.log import get_logger

log = get_logger()


def _of_the_process(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    if issubclass(kind, KeyboardInterrupt):
        log.warning("process.interrupted")
        return
    log.critical("process.failed", error_type=kind.__name__, exc_info=(kind, error, trace))


def _of_a_thread(found: threading.ExceptHookArgs) -> None:
    if issubclass(found.exc_type, SystemExit):
        return
    error = found.exc_value or found.exc_type()
    name = found.thread.name if found.thread is not None else ""
    info = (found.exc_type, error, found.exc_traceback)
    log.error("thread.failed", thread=name, error_type=found.exc_type.__name__, exc_info=info)


def _of_a_finalizer(found: sys.UnraisableHookArgs) -> None:
    error = found.exc_value or found.exc_type()
    info = (found.exc_type, error, found.exc_traceback)
    where = found.err_msg or "ignored"
    with suppress(Exception):  # an object that is half gone may not have a text any more
        where = f"{where}: {found.object!r:.100}"
    log.error("error.ignored", where=where, error_type=found.exc_type.__name__, exc_info=info)


@contextmanager
def uncaught_errors_logged() -> Iterator[None]:
    """Log uncaught errors while the block runs; an error that leaves it is logged where it ends the process."""
    before = sys.excepthook, threading.excepthook, sys.unraisablehook
    sys.excepthook, threading.excepthook, sys.unraisablehook = _of_the_process, _of_a_thread, _of_a_finalizer
    try:
        yield
    finally:
        sys.excepthook, threading.excepthook, sys.unraisablehook = before
