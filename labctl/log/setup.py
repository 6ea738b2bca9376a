"""Beginning and ending the log of a process: where it goes, in which form, and what is taken into it."""

from __future__ import annotations

import atexit
import logging
import os
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from types import TracebackType

import structlog
from structlog.stdlib import ExtraAdder, ProcessorFormatter, add_logger_name

from labctl.log import get_logger
from labctl.log.redaction import Redaction, secrets_of
from labctl.log.rendering import Rendering
from labctl.log.repetition import MAX_FOREIGN, ForeignRecordLimit, RepetitionLimit
from labctl.log.settings import is_read_by_a_person, level_asked
from labctl.log.silence import be_silent
from labctl.log.writer import LogWriter

log = get_logger()


def _of_the_process(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    if issubclass(kind, KeyboardInterrupt):
        log.warning("process.interrupted")
        return
    log.critical("process.failed", error_type=kind.__name__, exc_info=(kind, error, trace))


def _of_a_thread(hook_args: threading.ExceptHookArgs) -> None:
    if issubclass(hook_args.exc_type, SystemExit):
        return
    error = hook_args.exc_value or hook_args.exc_type()
    name = hook_args.thread.name if hook_args.thread is not None else ""
    info = (hook_args.exc_type, error, hook_args.exc_traceback)
    log.error("thread.failed", thread=name, error_type=hook_args.exc_type.__name__, exc_info=info)


def _of_a_finalizer(hook_args: sys.UnraisableHookArgs) -> None:
    error = hook_args.exc_value or hook_args.exc_type()
    info = (hook_args.exc_type, error, hook_args.exc_traceback)
    place_text = hook_args.err_msg or "ignored"
    with suppress(Exception):  # an object that is half gone may not have a text any more
        place_text = f"{place_text}: {hook_args.object!r:.100}"
    log.error("error.ignored", where=place_text, error_type=hook_args.exc_type.__name__, exc_info=info)


@contextmanager
def uncaught_errors_logged() -> Iterator[None]:
    """Log uncaught errors while the block runs; an error that leaves it is logged where it ends the process."""
    before = sys.excepthook, threading.excepthook, sys.unraisablehook
    sys.excepthook, threading.excepthook, sys.unraisablehook = _of_the_process, _of_a_thread, _of_a_finalizer
    try:
        yield
    finally:
        sys.excepthook, threading.excepthook, sys.unraisablehook = before


STDERR = 2


@dataclass(frozen=True)
class Log:
    """The log of this process."""

    writer: LogWriter
    level: int
    limit: RepetitionLimit  #: of what other libraries log


class _Output:
    """What structlog calls a logger: takes the line of a record."""

    def __init__(self, writer: LogWriter) -> None:
        self._writer = writer

    def msg(self, line: str) -> None:
        self._writer.put(line)

    debug = info = warning = error = critical = exception = log = msg


class _ForeignRecords(logging.Handler):
    """Takes in what other libraries log. It has no lock: the engine's thread must not wait for another's record."""

    def __init__(self, writer: LogWriter, rendering: Rendering, limit: RepetitionLimit) -> None:
        super().__init__()
        self._writer = writer
        self.addFilter(ForeignRecordLimit(limit))
        self.setFormatter(
            ProcessorFormatter(
                processors=[ProcessorFormatter.remove_processors_meta, rendering],
                foreign_pre_chain=[add_logger_name, ExtraAdder()],
            )
        )

    def createLock(self) -> None:  # noqa: N802  the name is the standard library's
        self.lock = None

    def emit(self, record: logging.LogRecord) -> None:
        try:
            self._writer.put(self.format(record))
        except structlog.DropEvent:
            pass
        except Exception:  # noqa: BLE001  a record that cannot be written must stop no caller
            self._writer.lost += 1


_stack: list[Log] = []
#: Contexts that are closed only at the end of the process: a log that lasts as long.
_to_the_end = ExitStack()


def present_level() -> int | None:
    """Return the level of the log that runs in this process; None where none does."""
    return _stack[-1].level if _stack else None


def held_back() -> tuple[int, int]:
    """Return how many records of this process were lost, and how many were held back as repetitions."""
    return sum(log.writer.lost for log in _stack), sum(log.limit.held_back for log in _stack)


@contextmanager
def running_log(process: str, level: int, *, locations: Iterable[str] = (), descriptor: int = STDERR) -> Iterator[Log]:
    """Log in the name of a process while the block runs; its end waits a moment for what is not written yet.

    The passwords of `locations`, addresses of databases, are removed from every record.
    """
    with _log_to(_own(descriptor), process, level, locations) as log:
        yield log


def begin_log(process: str, level: int, *, locations: Iterable[str] = (), descriptor: int = STDERR) -> Log:
    """Log in the name of this process from now on to its very end."""
    log = _to_the_end.enter_context(running_log(process, level, locations=locations, descriptor=descriptor))
    atexit.register(_to_the_end.close)
    return log


def _own(descriptor: int) -> int | None:
    """Return a duplicate of a descriptor, which stays the same output; None where there is no such output.

    In a process that was started without standard error, its number may belong to another file.
    """
    if descriptor == STDERR and sys.__stderr__ is None:
        return None
    try:
        return os.dup(descriptor)
    except OSError:
        return None


@contextmanager
def _log_to(output: int | None, process: str, level: int, locations: Iterable[str]) -> Iterator[Log]:
    by_person = output is not None and is_read_by_a_person(output)
    colors = by_person and not os.environ.get("NO_COLOR")
    redaction = Redaction(secrets_of(locations=locations))
    brief = level_asked() is None
    rendering = Rendering(process, redaction, for_a_person=by_person, brief=brief, colors=colors)
    limit = RepetitionLimit(MAX_FOREIGN)

    def notes(lost: int) -> Iterator[str]:
        if lost:
            yield rendering(None, "warning", {"event": "log.lost", "records": lost})
        for source, count in limit.take_counts().items():
            yield rendering(None, "warning", {"event": "log.held_back", "source": source, "records": count})

    log = Log(LogWriter(output, notes=notes), level, limit)
    before = structlog.get_config() if _stack else None
    structlog.configure(
        processors=[rendering],
        wrapper_class=structlog.make_filtering_bound_logger(level),
        logger_factory=lambda *_: _Output(log.writer),
        cache_logger_on_first_use=False,
    )
    _stack.append(log)
    try:
        with _foreign_records(_ForeignRecords(log.writer, rendering, limit), level), uncaught_errors_logged():
            yield log
    finally:
        _stack.remove(log)
        if before is None:
            be_silent()
        else:
            structlog.configure(**before)
        log.writer.close()


@contextmanager
def _foreign_records(handler: logging.Handler, level: int) -> Iterator[None]:
    """Take in what other libraries log while the block runs: their warnings and worse, more where more is asked for."""
    root, package_loggers = logging.getLogger(), [logging.getLogger(name) for name in ("instruments", "procedures")]
    before = {logger: logger.level for logger in (root, *package_loggers)}
    root.addHandler(handler)
    root.setLevel(logging.INFO if level <= logging.DEBUG else max(level, logging.WARNING))
    for logger in package_loggers:
        logger.setLevel(level)
    logging.captureWarnings(capture=True)
    try:
        yield
    finally:
        logging.captureWarnings(capture=False)
        root.removeHandler(handler)
        for logger, was in before.items():
            logger.setLevel(was)
